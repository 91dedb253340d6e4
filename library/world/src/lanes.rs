//! Worlds side by side, each in one episode after the other.

use ivx_data::Columns;
use ivx_data::form::failed;
use ivx_op::{Ctx, OpError, State};

use crate::env::{Env, Spec};
use crate::luck::Luck;
use crate::worlds::Worlds;
use ivx_data::{Act, Actions, End};

/// An action for each lane.
#[derive(Clone, Debug, PartialEq)]
pub struct Acts {
    /// How many numbers one has; 0 where they are places.
    width: usize,
    /// The places.
    pub places: Vec<usize>,
    /// Or the vectors, one after the other.
    pub vectors: Vec<f32>,
}

impl Acts {
    /// Those of `n` lanes, the first or zeros before they are chosen.
    #[must_use]
    pub fn of(actions: &Actions, n: usize) -> Self {
        match actions {
            Actions::Discrete(_) => Self { width: 0, places: vec![0; n], vectors: Vec::new() },
            Actions::Continuous { low, .. } => {
                let width = low.len();
                Self { width, places: Vec::new(), vectors: vec![0.0; n * width] }
            }
        }
    }

    /// That of a lane.
    #[inline]
    #[must_use]
    pub fn get(&self, lane: usize) -> Act<'_> {
        match self.width {
            0 => Act::Index(self.places[lane]),
            width => Act::Vector(&self.vectors[lane * width..][..width]),
        }
    }

    /// How many numbers it takes to keep one.
    fn kept(&self) -> usize {
        self.width.max(1)
    }

    /// Appends that of a lane to those of its episode.
    fn keep(&self, lane: usize, to: &mut Vec<u8>) {
        match self.get(lane) {
            Act::Index(place) => to.extend(u32::try_from(place).expect("far fewer").to_le_bytes()),
            Act::Vector(vector) => to.extend(vector.iter().flat_map(|x| x.to_le_bytes())),
        }
    }

    /// Takes back that of a lane.
    fn restore(&mut self, lane: usize, from: &[u8]) {
        let (words, _) = from.as_chunks::<4>();
        if self.width == 0 {
            self.places[lane] = u32::from_le_bytes(words[0]) as usize;
        } else {
            let vector = &mut self.vectors[lane * self.width..][..self.width];
            vector.iter_mut().zip(words).for_each(|(x, word)| *x = f32::from_le_bytes(*word));
        }
    }
}

/// What came of one step in each lane.
#[derive(Clone, Debug)]
pub struct Step {
    /// What was seen before it.
    pub before: Columns,
    /// What was done.
    pub acts: Acts,
    /// What was paid.
    pub rewards: Vec<f64>,
    /// What was seen after it, of episodes that are over too.
    pub after: Columns,
    /// Which episodes are over.
    pub ends: Vec<End>,
    /// What the worlds told besides, as many numbers a lane as [`Spec::tells`] has names.
    pub told: Vec<f32>,
}

/// An episode that is over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finished {
    /// The lane in which it was.
    pub lane: usize,
    /// The sum of its rewards.
    pub payoff: f64,
    /// How many steps it had.
    pub length: u64,
}

struct Lane {
    episode: u64,
    length: u64,
    payoff: f64,
    /// The actions of the episode so far.
    acts: Vec<u8>,
}

/// Worlds side by side. What chance decides in each depends on the seed, the stream, the lane and the episode alone.
pub struct Lanes<'a> {
    ctx: Ctx<'a>,
    stream: &'a str,
    spec: Spec,
    worlds: Box<dyn Worlds>,
    luck: Vec<Luck>,
    each: Vec<Lane>,
    /// The lanes that go on, in order.
    awake: Vec<usize>,
    /// Those whose episode was over just now.
    over: Vec<usize>,
    seen: Columns,
    step: Step,
    finished: Vec<Finished>,
}

impl<'a> Lanes<'a> {
    /// `n` lanes of an environment at the beginning of episode `first`.
    ///
    /// # Errors
    /// If there are no such worlds.
    pub fn open(
        env: &dyn Env,
        n: usize,
        ctx: &Ctx<'a>,
        (stream, first): (&'a str, u64),
    ) -> Result<Self, OpError> {
        let spec = env.spec().map_err(failed)?;
        let worlds = env.open_all(n)?;
        let lane = |_| Lane { episode: first, length: 0, payoff: 0.0, acts: Vec::new() };
        let rows = || Columns::zeros(spec.sees.clone(), n);
        let step = Step {
            before: rows(),
            acts: Acts::of(&spec.does, n),
            rewards: vec![0.0; n],
            after: rows(),
            ends: vec![End::No; n],
            told: vec![0.0; n * spec.tells.len()],
        };
        let mut all = Self {
            ctx: *ctx,
            stream,
            worlds,
            luck: (0..n).map(|lane| Luck::of(ctx, stream, lane as u64, first)).collect(),
            each: (0..n).map(lane).collect(),
            awake: (0..n).collect(),
            over: Vec::new(),
            seen: rows(),
            step,
            finished: Vec::new(),
            spec,
        };
        all.worlds.reset(&all.awake, &mut all.luck, &mut all.seen)?;
        Ok(all)
    }

    /// Cuts episodes off after so many steps, if they are not before.
    pub fn limit(&mut self, steps: u64) {
        self.spec.limit = Some(self.spec.limit.map_or(steps, |limit| limit.min(steps)));
    }

    /// What the worlds show and take.
    #[must_use]
    pub fn spec(&self) -> &Spec {
        &self.spec
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.each.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.each.is_empty()
    }

    /// What is seen now.
    #[must_use]
    pub fn seen(&self) -> &Columns {
        &self.seen
    }

    /// What is seen now, and the actions to be chosen.
    pub fn choose(&mut self) -> (&Columns, &mut Acts) {
        (&self.seen, &mut self.step.acts)
    }

    /// Takes the actions that were chosen: what came of it. Episodes that are over are followed by others at once.
    ///
    /// # Errors
    /// If a world failed: then nothing can be done with them any more.
    pub fn step(&mut self) -> Result<&Step, OpError> {
        std::mem::swap(&mut self.seen, &mut self.step.before);
        self.advance()?;
        Ok(&self.step)
    }

    /// What came of the last step.
    #[must_use]
    pub fn stepped(&self) -> &Step {
        &self.step
    }

    /// What the world of a lane tells now, and would tell of the next steps if its expert acted ([`World::shown`]); chance is
    /// that of the episode and of `stream`, and not the world's own.
    ///
    /// [`World::shown`]: crate::World::shown
    #[must_use]
    pub fn shown(&self, lane: usize, steps: usize, stream: &str) -> Option<Vec<f32>> {
        let mut luck = Luck::of(&self.ctx, stream, lane as u64, self.each[lane].episode);
        self.worlds.shown(lane, steps, &mut luck)
    }

    /// The lanes that go on, in order.
    #[must_use]
    pub fn awake(&self) -> &[usize] {
        &self.awake
    }

    /// Leaves some lanes, in order, as they are from here on.
    pub fn rest(&mut self, lanes: &[usize]) {
        self.awake.retain(|awake| lanes.binary_search(awake).is_err());
    }

    fn advance(&mut self) -> Result<(), OpError> {
        let Self { worlds, luck, each, awake, over, step, seen, spec, .. } = self;
        worlds.step(awake, luck, step)?;
        over.clear();
        for &lane in &*awake {
            let one = &mut each[lane];
            step.acts.keep(lane, &mut one.acts);
            one.length += 1;
            one.payoff += step.rewards[lane];
            let end = &mut step.ends[lane];
            if *end == End::No && spec.limit.is_some_and(|limit| one.length >= limit) {
                *end = End::Limit;
            }
            match *end {
                End::No => seen.set(lane, &step.after, lane),
                End::Terminal | End::Limit => over.push(lane),
            }
        }
        if self.over.is_empty() { Ok(()) } else { self.follow() }
    }

    /// Begins the episodes that follow those that are over.
    fn follow(&mut self) -> Result<(), OpError> {
        for &lane in &self.over {
            let Lane { episode, length, payoff, acts } = &mut self.each[lane];
            self.finished.push(Finished { lane, payoff: *payoff, length: *length });
            *episode += 1;
            self.luck[lane] = Luck::of(&self.ctx, self.stream, lane as u64, *episode);
            (*length, *payoff) = (0, 0.0);
            acts.clear();
        }
        self.worlds.reset(&self.over, &mut self.luck, &mut self.seen)
    }

    /// The episodes that were finished since this was asked last, in their order.
    pub fn finished(&mut self) -> std::vec::Drain<'_, Finished> {
        self.finished.drain(..)
    }

    /// Walks over what it takes to be where it is: an unfinished episode is its number and its actions. What was
    /// restored is to be followed by [`Lanes::catch_up`].
    pub fn state(&mut self, state: &mut State) {
        for (i, lane) in self.each.iter_mut().enumerate() {
            state.count(&format!("{i}.episode"), &mut lane.episode);
            state.bytes(&format!("{i}.acts"), &mut lane.acts);
        }
    }

    /// Takes the actions of all unfinished episodes again.
    ///
    /// # Errors
    /// If a world failed, or is not what it was by the same actions.
    pub fn catch_up(&mut self) -> Result<(), OpError> {
        let all: Vec<usize> = (0..self.each.len()).collect();
        let mut acts = Vec::new();
        for (i, lane) in self.each.iter_mut().enumerate() {
            self.luck[i] = Luck::of(&self.ctx, self.stream, i as u64, lane.episode);
            (lane.length, lane.payoff) = (0, 0.0);
            acts.push(std::mem::take(&mut lane.acts));
        }
        self.worlds.reset(&all, &mut self.luck, &mut self.seen)?;
        let width = 4 * self.step.acts.kept();
        let longest = acts.iter().map(|acts| acts.len() / width).max().unwrap_or_default();
        for t in 0..longest {
            let act = |lane: usize| acts[lane].chunks_exact(width).nth(t);
            self.awake.clear();
            for (lane, act) in all.iter().filter_map(|lane| Some((*lane, act(*lane)?))) {
                self.step.acts.restore(lane, act);
                self.awake.push(lane);
            }
            self.advance()?;
        }
        self.awake = all;
        if self.finished.is_empty() {
            return Ok(());
        }
        let why = "an episode that was taken again by the same actions was over before: its world \
                   depends on more than its seed and the actions";
        Err(OpError::Failed(why.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Chain;

    fn lanes<'a>(ctx: &Ctx<'a>) -> Lanes<'a> {
        let env = Chain { cells: 6, slip: 0.3, goal: true };
        Lanes::open(&env, 3, ctx, ("learn", 0)).unwrap()
    }

    /// Two steps to the right, and one to the left.
    fn go(lanes: &mut Lanes<'_>, t: usize) -> (Step, Vec<Finished>) {
        lanes.choose().1.places.fill(usize::from(t % 3 != 2));
        let step = lanes.step().unwrap().clone();
        (step, lanes.finished().collect())
    }

    #[test]
    fn an_unfinished_episode_is_taken_again_to_the_same_bits() {
        let ctx = Ctx::new("learn", 5, None);
        for stop in [1, 4, 17, 30] {
            let mut one = lanes(&ctx);
            (0..stop).for_each(|t| drop(go(&mut one, t)));
            let bytes = State::keep(|state| one.state(state));
            let mut other = lanes(&ctx);
            assert!(State::restore(&bytes, |state| other.state(state)));
            other.catch_up().unwrap();
            assert_eq!(other.seen(), one.seen());
            for t in stop..stop + 40 {
                let ((a, done), (b, also)) = (go(&mut one, t), go(&mut other, t));
                assert_eq!((a.before, a.after, a.rewards), (b.before, b.after, b.rewards));
                assert_eq!((a.ends, done), (b.ends, also));
            }
        }
    }

    #[test]
    fn episodes_are_counted_and_lanes_differ() {
        let ctx = Ctx::new("learn", 5, None);
        let mut lanes = lanes(&ctx);
        let mut finished = Vec::new();
        for t in 0..200 {
            finished.extend(go(&mut lanes, t).1);
        }
        assert!(finished.len() > 20 && finished.iter().all(|e| e.payoff == 1.0 && e.length > 0));
        let of = |lane| finished.iter().filter(move |e| e.lane == lane).map(|e| e.length);
        assert_ne!(of(0).take(5).collect::<Vec<_>>(), of(1).take(5).collect::<Vec<_>>());
    }
}
