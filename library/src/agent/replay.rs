//! What an agent has seen, to be learned from again.

use ivx_data::{Columns, Field, Kind, Values, packed};
use ivx_nn::{Graph, Real as _, Var};
use ivx_op::State;
use ivx_world::{Act, End, Step};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::agent::seen_shape;

/// What became of the step that a row is of.
const GOES_ON: u8 = 0;
const TERMINAL: u8 = 1;
/// It was cut off, and what was seen last is the row behind it.
const CUT: u8 = 2;
/// The row is no step, but what was seen last.
const LAST: u8 = 3;

/// How many numbers a byte of bits makes.
const BITS: [[f32; 8]; 256] = bits();

const fn bits() -> [[f32; 8]; 256] {
    let mut all = [[0.0; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut bit = 0;
        while bit < 8 {
            if byte >> bit & 1 == 1 {
                all[byte][bit] = 1.0;
            }
            bit += 1;
        }
        byte += 1;
    }
    all
}

/// The last steps in each lane.
///
/// What is seen before a step and after it is kept once: what follows a row is the row behind it. Bits are kept as
/// bits, and indices and numbers as four bytes.
#[derive(Debug)]
pub(crate) struct Replay {
    sees: Vec<Field>,
    /// How many bytes of a row are what was seen.
    sight: usize,
    /// How many rows a lane keeps.
    rows: usize,
    lanes: Vec<Lane>,
    /// How many steps a target looks ahead.
    n_step: usize,
    discount: f64,
}

/// A ring of rows.
#[derive(Debug)]
struct Lane {
    seen: Vec<u8>,
    acts: Vec<u8>,
    rewards: Vec<u8>,
    ends: Vec<u8>,
    /// How many rows were ever written.
    written: u64,
}

/// Some steps, drawn evenly with replacement.
#[derive(Clone, Debug, Default)]
pub(crate) struct Batch {
    /// The lane and the place of each, and those of what was seen after the last step that its target looks at.
    pub(crate) rows: Vec<(usize, usize)>,
    pub(crate) next: Vec<(usize, usize)>,
    /// What was done.
    pub(crate) acts: Vec<f32>,
    /// What was paid from there on, discounted.
    pub(crate) rewards: Vec<f32>,
    /// What the worth of what follows weighs: 0 where nothing follows.
    pub(crate) discounts: Vec<f32>,
}

impl Replay {
    /// That of the last `capacity` steps of `lanes` lanes, whose targets look `n_step` steps ahead.
    pub(crate) fn new(
        sees: &[Field],
        (capacity, lanes): (usize, usize),
        (n_step, discount): (usize, f64),
    ) -> Self {
        let sight = sees.iter().map(kept).sum();
        let rows = (capacity / lanes).max(n_step + 2);
        let lane = || Lane {
            seen: Vec::new(),
            acts: Vec::new(),
            rewards: Vec::new(),
            ends: Vec::new(),
            written: 0,
        };
        let lanes = (0..lanes).map(|_| lane()).collect();
        Self { sees: sees.to_vec(), sight, rows, lanes, n_step, discount }
    }

    /// How many bytes one takes.
    pub(crate) fn bytes(sees: &[Field], capacity: usize) -> u64 {
        (capacity * (sees.iter().map(kept).sum::<usize>() + 1 + 4 + 1)) as u64
    }

    /// How many steps are kept, about.
    pub(crate) fn len(&self) -> u64 {
        self.lanes.iter().map(|lane| lane.written.min(self.rows as u64)).sum()
    }

    /// Adds a step of every lane.
    pub(crate) fn push(&mut self, step: &Step) {
        for lane in 0..self.lanes.len() {
            let Act::Index(act) = step.acts.get(lane) else { panic!("discrete actions") };
            let act = u8::try_from(act).expect("fewer than 256 actions");
            let end = match step.ends[lane] {
                End::No => GOES_ON,
                End::Terminal => TERMINAL,
                End::Limit => CUT,
            };
            self.write(lane, &step.before, (act, f32::of(step.rewards[lane]), end));
            if end == CUT {
                self.write(lane, &step.after, (0, 0.0, LAST));
            }
        }
    }

    fn write(&mut self, lane: usize, seen: &Columns, (act, reward, end): (u8, f32, u8)) {
        let (row, sight, rows) = (lane, self.sight, self.rows);
        let lane = &mut self.lanes[lane];
        let place = usize::try_from(lane.written % rows as u64).expect("a place in memory");
        if lane.ends.len() == place && place < rows {
            grow(&mut lane.seen, sight, rows);
            grow(&mut lane.rewards, 4, rows);
            grow(&mut lane.acts, 1, rows);
            grow(&mut lane.ends, 1, rows);
            lane.seen.resize((place + 1) * sight, 0);
            lane.acts.push(0);
            lane.rewards.resize(4 * (place + 1), 0);
            lane.ends.push(0);
        }
        pack(seen, row, &mut lane.seen[place * sight..][..sight]);
        lane.acts[place] = act;
        lane.rewards[4 * place..][..4].copy_from_slice(&reward.to_le_bytes());
        lane.ends[place] = end;
        lane.written += 1;
    }

    /// Draws steps whose targets are known, evenly and with replacement.
    ///
    /// # Panics
    /// If there are none.
    pub(crate) fn draw(&self, n: usize, rng: &mut ChaCha8Rng, batch: &mut Batch) {
        let Batch { rows, next, acts, rewards, discounts } = batch;
        rows.clear();
        next.clear();
        acts.clear();
        rewards.clear();
        discounts.clear();
        let total = self.len();
        let mut tries = 0_u64;
        while rows.len() < n {
            tries += 1;
            assert!(tries < 1000 * (n as u64 + 1000), "there are steps to learn from");
            let mut drawn = rng.random_range(0..total);
            let kept = |lane: &Lane| lane.written.min(self.rows as u64);
            let lane = self.lanes.iter().position(|lane| {
                let here = drawn < kept(lane);
                drawn -= if here { 0 } else { kept(lane) };
                here
            });
            let lane = lane.expect("fewer than all");
            let of = &self.lanes[lane];
            let Some(target) = self.target(of, of.written - kept(of) + drawn) else { continue };
            let (row, after, reward, discount) = target;
            rows.push((lane, row));
            next.push((lane, after));
            acts.push(f32::from(of.acts[row]));
            rewards.push(reward);
            discounts.push(discount);
        }
    }

    /// Of row `at` of all that a lane ever wrote: its place, that of what its target looks at, what is paid up to
    /// there, and what is left of what follows. None if it is no step, or not known yet.
    fn target(&self, lane: &Lane, at: u64) -> Option<(usize, usize, f32, f32)> {
        let place = |at: u64| usize::try_from(at % self.rows as u64).expect("a place in memory");
        let (mut sum, mut weight) = (0.0, 1.0);
        for i in 0..self.n_step as u64 {
            let now = place(at + i);
            if at + i >= lane.written {
                return None;
            }
            let reward = &lane.rewards[4 * now..][..4];
            let reward = f32::from_le_bytes(reward.try_into().expect("four bytes"));
            match lane.ends[now] {
                // The end of a path that was cut off counts as far as it went.
                LAST if i == 0 => return None,
                LAST => break,
                end => {
                    sum += weight * f64::from(reward);
                    weight *= self.discount;
                    if end == TERMINAL {
                        return Some((place(at), now, f32::of(sum), 0.0));
                    }
                    if end == CUT {
                        let after = place(at + i + 1);
                        return Some((place(at), after, f32::of(sum), f32::of(weight)));
                    }
                }
            }
        }
        let after = at + self.n_step as u64;
        (after < lane.written).then(|| (place(at), place(after), f32::of(sum), f32::of(weight)))
    }

    /// What was seen in some rows, as a network sees it.
    pub(crate) fn look(&self, graph: &Graph<f32>, rows: &[(usize, usize)]) -> Var {
        graph.filled(seen_shape(&self.sees, rows.len()), |out| {
            let width = out.len() / rows.len();
            for (out, (lane, place)) in out.chunks_exact_mut(width).zip(rows) {
                unpack(&self.sees, &self.lanes[*lane].seen[place * self.sight..], out);
            }
        })
    }

    /// Walks over all rows.
    pub(crate) fn state(&mut self, state: &mut State) {
        for (i, lane) in self.lanes.iter_mut().enumerate() {
            state.within(&i.to_string(), |state| {
                state.count("written", &mut lane.written);
                state.bytes("seen", &mut lane.seen);
                state.bytes("acts", &mut lane.acts);
                state.bytes("rewards", &mut lane.rewards);
                state.bytes("ends", &mut lane.ends);
            });
        }
    }
}

/// Makes room for one more row of `width` bytes of at most `rows`: an eighth more at a time, since a replay fills memory.
fn grow(bytes: &mut Vec<u8>, width: usize, rows: usize) {
    if bytes.capacity() < bytes.len() + width {
        let more = (bytes.len() / width / 8).max(1024).min(rows - bytes.len() / width);
        bytes.reserve_exact(more * width);
    }
}

/// How many bytes are kept of a field.
fn kept(field: &Field) -> usize {
    match field.kind {
        Kind::F32 | Kind::Index(_) => 4 * field.width(),
        Kind::U8 => field.width(),
        Kind::Bit => field.width().div_ceil(8),
    }
}

fn pack(seen: &Columns, row: usize, mut out: &mut [u8]) {
    for (column, field) in seen.fields().iter().enumerate() {
        let (own, rest) = out.split_at_mut(kept(field));
        let at = row * field.width()..(row + 1) * field.width();
        match seen.values(column) {
            Values::F32(xs) => words(own, xs[at].iter().map(|x| x.to_le_bytes())),
            Values::Index(xs) => words(own, xs[at].iter().map(|x| x.to_le_bytes())),
            Values::U8(xs) if field.kind == Kind::Bit => {
                for (byte, bits) in own.iter_mut().zip(xs[at].chunks(8)) {
                    *byte = packed(bits);
                }
            }
            Values::U8(xs) => own.copy_from_slice(&xs[at]),
        }
        out = rest;
    }
}

fn words(out: &mut [u8], words: impl Iterator<Item = [u8; 4]>) {
    let (slots, _) = out.as_chunks_mut::<4>();
    slots.iter_mut().zip(words).for_each(|(slot, word)| *slot = word);
}

fn unpack(sees: &[Field], mut bytes: &[u8], mut out: &mut [f32]) {
    for field in sees {
        let ((own, more), (numbers, rest)) =
            (bytes.split_at(kept(field)), out.split_at_mut(field.spread()));
        match field.kind {
            Kind::F32 => {
                let (words, _) = own.as_chunks::<4>();
                numbers.iter_mut().zip(words).for_each(|(x, word)| *x = f32::from_le_bytes(*word));
            }
            Kind::U8 => numbers.iter_mut().zip(own).for_each(|(x, byte)| *x = f32::from(*byte)),
            Kind::Bit => {
                for (numbers, byte) in numbers.chunks_mut(8).zip(own) {
                    numbers.copy_from_slice(&BITS[usize::from(*byte)][..numbers.len()]);
                }
            }
            Kind::Index(n) => {
                let (words, _) = own.as_chunks::<4>();
                for (numbers, word) in numbers.chunks_exact_mut(n).zip(words) {
                    numbers.fill(0.0);
                    numbers[u32::from_le_bytes(*word) as usize] = 1.0;
                }
            }
        }
        (bytes, out) = (more, rest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_nn::Params;
    use ivx_world::{Actions, Acts};
    use rand::SeedableRng as _;

    fn sees() -> Vec<Field> {
        vec![
            Field::new("bits", &[11], Kind::Bit),
            Field::new("speed", &[], Kind::F32),
            Field::new("cell", &[], Kind::Index(3)),
        ]
    }

    /// What is seen at time `t` of an episode.
    fn seen(t: u8) -> Columns {
        let mut seen = Columns::zeros(sees(), 1);
        if let (Values::U8(bits), _) = seen.values_mut(0) {
            bits.iter_mut()
                .enumerate()
                .for_each(|(i, bit)| *bit = u8::from((t >> (i % 8)) & 1 == 1));
        }
        if let (Values::F32(speed), _) = seen.values_mut(1) {
            speed[0] = f32::from(t);
        }
        if let (Values::Index(cell), _) = seen.values_mut(2) {
            cell[0] = u32::from(t % 3);
        }
        seen
    }

    /// The step at time `t`, which pays `2^t`.
    fn step(t: u8, end: End) -> Step {
        let mut acts = Acts::of(&Actions::named(&["a", "b", "c", "d"]), 1);
        acts.places[0] = usize::from(t % 4);
        Step {
            before: seen(t),
            acts,
            rewards: vec![f64::from(t).exp2()],
            after: seen(t + 1),
            ends: vec![end],
            told: Vec::new(),
        }
    }

    fn looked(replay: &Replay, rows: &[(usize, usize)]) -> Vec<f32> {
        let graph = Graph::new(Params::default());
        graph.value(replay.look(&graph, rows))
    }

    /// Of each step that can be drawn: when it was, what is paid, what the rest weighs, and when that is.
    fn drawn(replay: &Replay) -> Vec<(u8, f32, f32, Option<u8>)> {
        let (mut rng, mut batch) = (ChaCha8Rng::seed_from_u64(1), Batch::default());
        replay.draw(2000, &mut rng, &mut batch);
        let when = |row: (usize, usize)| {
            let time = looked(replay, &[row])[11];
            (0..=u8::MAX).find(|t| f32::from(*t) == time).expect("a time")
        };
        let mut found = Vec::new();
        for i in 0..batch.rows.len() {
            let t = when(batch.rows[i]);
            assert_eq!(batch.acts[i], f32::from(t % 4));
            let next = (batch.discounts[i] > 0.0).then(|| when(batch.next[i]));
            found.push((t, batch.rewards[i], batch.discounts[i], next));
        }
        found.sort_by_key(|(t, ..)| *t);
        found.dedup();
        found
    }

    #[test]
    fn what_was_seen_comes_back_to_the_bit() {
        let mut replay = Replay::new(&sees(), (10, 1), (1, 0.5));
        (0..3).for_each(|t| replay.push(&step(t + 180, End::No)));
        for place in 0..3 {
            let mut expected = vec![0.0; 15];
            seen(180 + u8::try_from(place).unwrap()).spread_all(&mut expected);
            assert_eq!(looked(&replay, &[(0, place)]), expected);
        }
        // Two bytes of bits and two numbers; action, reward and end.
        assert_eq!((replay.sight, Replay::bytes(&sees(), 100)), (10, 1600));
    }

    #[test]
    fn targets_stop_at_ends_and_reach_beyond_cuts() {
        let mut replay = Replay::new(&sees(), (100, 1), (2, 0.5));
        for (t, end) in [(0, End::No), (1, End::No), (2, End::Terminal)] {
            replay.push(&step(t, end));
        }
        for (t, end) in [(10, End::No), (11, End::Limit), (20, End::No), (21, End::No)] {
            replay.push(&step(t, end));
        }
        let power = |t: u8| f32::from(t).exp2();
        assert_eq!(
            drawn(&replay),
            [
                (0, 1.0 + 0.5 * 2.0, 0.25, Some(2)),
                (1, 2.0 + 0.5 * 4.0, 0.0, None),
                (2, 4.0, 0.0, None),
                (10, power(10) + 0.5 * power(11), 0.25, Some(12)),
                (11, power(11), 0.5, Some(12)),
            ]
        );
        // What follows 20 over two steps is known once there is a third.
        replay.push(&step(22, End::No));
        let last = *drawn(&replay).last().unwrap();
        assert_eq!(last, (20, power(20) + 0.5 * power(21), 0.25, Some(22)));
    }

    /// As those of Breakout: 400 bits, an action, a reward and an end.
    #[test]
    fn a_replay_takes_little_more_than_its_bits() {
        let sees = vec![Field::new("grid", &[4, 10, 10], Kind::Bit)];
        let mut replay = Replay::new(&sees, (50_000, 1), (1, 0.9));
        let mut step = step(1, End::No);
        step.before = Columns::zeros(sees.clone(), 1);
        for n in 1..=60_000 {
            replay.push(&step);
            let Lane { seen, acts, rewards, ends, .. } = &replay.lanes[0];
            let held = seen.capacity() + acts.capacity() + rewards.capacity() + ends.capacity();
            let rows = n.clamp(10_000, 50_000);
            assert!(held <= rows * 50 * 13 / 10, "{held} bytes after {n} steps");
        }
        let Lane { seen, acts, rewards, ends, .. } = &replay.lanes[0];
        let held = seen.capacity() + acts.capacity() + rewards.capacity() + ends.capacity();
        assert_eq!((held, Replay::bytes(&sees, 50_000)), (50_000 * 56, 50_000 * 56));
    }

    #[test]
    fn the_oldest_steps_are_forgotten() {
        let mut replay = Replay::new(&sees(), (4, 1), (1, 1.0));
        (0..11).for_each(|t| replay.push(&step(t, End::No)));
        let times: Vec<u8> = drawn(&replay).into_iter().map(|(t, ..)| t).collect();
        assert_eq!((times, replay.len()), (vec![7, 8, 9], 4));
        let bytes = State::keep(|state| replay.state(state));
        let mut other = Replay::new(&sees(), (4, 1), (1, 1.0));
        assert!(State::restore(&bytes, |state| other.state(state)));
        assert_eq!(drawn(&other), drawn(&replay));
    }
}
