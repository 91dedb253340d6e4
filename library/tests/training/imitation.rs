//! Agents who imitate, where others know the way and nobody is paid.

use ivx_data::{Actions, Columns, End, Field, Kind, Misfit, Values};
use ivx_library::agent::{
    Act, Acting, Actor, Agent, Demonstrate, Evaluate, Learned, Random, Trained,
};
use ivx_math::moments::mean;
use ivx_op::{Artifact as _, Ctx, Gathered, Held, Labelled, Lit, One, Op as _, OpError, Part};
use ivx_world::{Acts, Env, Luck, Row, Spec, World};
use rand_chacha::ChaCha8Rng;

use crate::agents::{dqn, interrupted, learn, rate};

const SIDE: usize = 5;

/// A square of cells in which each step that ends in the corner at the top left pays, for 20 steps from anywhere. Seen
/// are the cell and so many numbers that mean nothing.
#[derive(Clone, Copy, Debug)]
struct Corner {
    pays: f64,
    noise: usize,
}

impl Env for Corner {
    fn spec(&self) -> Result<Spec, Misfit> {
        let cell = Field::new("cell", &[], Kind::Index(SIDE * SIDE));
        Ok(Spec {
            sees: vec![cell, Field::new("noise", &[self.noise], Kind::F32)],
            does: Actions::named(&["UP", "DOWN", "LEFT", "RIGHT"]),
            tells: Vec::new(),
            limit: Some(20),
        })
    }

    fn open(&self) -> Result<Box<dyn World>, OpError> {
        Ok(Box::new(Walk { pays: self.pays, at: [0; 2] }))
    }
}

struct Walk {
    pays: f64,
    at: [usize; 2],
}

impl Walk {
    fn show(&self, luck: &mut Luck, row: &mut Row<'_>) {
        row.index(0, self.at[0] * SIDE + self.at[1]);
        #[expect(clippy::cast_possible_truncation, reason = "it is noise")]
        row.numbers(1).fill_with(|| luck.between(-1.0, 1.0) as f32);
    }
}

impl World for Walk {
    fn reset(&mut self, luck: &mut Luck, row: &mut Row<'_>) {
        self.at = [0; 2].map(|_| luck.below(5) as usize);
        self.show(luck, row);
    }

    fn step(&mut self, act: ivx_data::Act<'_>, luck: &mut Luck, row: &mut Row<'_>) -> (f64, End) {
        let place = &mut self.at[act.index() / 2];
        *place = match act.index() % 2 {
            0 => place.saturating_sub(1),
            _ => (*place + 1).min(SIDE - 1),
        };
        self.show(luck, row);
        (if self.at == [0; 2] { self.pays } else { 0.0 }, End::No)
    }
}

const QUIET: Corner = Corner { pays: 1.0, noise: 0 };
const NOISY: Corner = Corner { pays: 1.0, noise: 50 };

/// Somebody who goes up as far as that goes, and left then.
#[derive(Debug)]
struct Expert;

impl Actor for Expert {
    fn fits(&self, _: &Spec) -> Result<(), Misfit> {
        Ok(())
    }

    fn open(&self, _: &Spec) -> Result<Box<dyn Acting>, Misfit> {
        Ok(Box::new(Self))
    }
}

impl Acting for Expert {
    fn act(&mut self, seen: &Columns, _: &mut ChaCha8Rng, acts: &mut Acts) -> Result<(), OpError> {
        let Values::Index(cells) = seen.values(0) else { panic!("cells") };
        let rows = acts.places.iter_mut().zip(cells);
        rows.for_each(|(act, cell)| *act = if (*cell as usize) < SIDE { 2 } else { 0 });
        Ok(())
    }
}

fn gathered<T>(value: T) -> Gathered<T> {
    Gathered { dims: Vec::new(), values: vec![value], name: String::new() }
}

fn shown(world: Corner) -> Lit {
    let (actor, stream) = (Box::new(Expert), "main".to_owned());
    let act =
        Act { actor, r#in: Box::new(world), episodes: 50, limit: 0, stream, keeps: Vec::new() };
    let of = Labelled(gathered(act.run(&Ctx::new("act", 1, None)).expect("it acts")));
    let show = Demonstrate { of, whose: String::new() };
    let shown = show.run(&Ctx::new("demonstrations", 1, None)).expect("they are");
    Lit::Held(Held::Value(gathered(shown.encode().into())))
}

fn returns(actor: Box<dyn Actor>) -> f64 {
    let evaluate = Evaluate { actor, r#in: Box::new(QUIET), trials: 200 };
    mean(&evaluate.run(&Ctx::new("evaluate", 7, None)).expect("it acts").returns.values)
}

fn learned(how: &Part, world: Corner, (steps, lanes, seed): (i64, usize, i64)) -> Learned {
    let mut op = learn(how, &Part::new("cart_pole"), steps, (0, lanes));
    (op.r#in, op.trials) = (Box::new(world), 100);
    op.run(&Ctx::new("learn", seed, None)).expect("it learns")
}

fn net(width: i64) -> Part {
    Part::new("mlp").with("hidden", vec![width])
}

fn q_learning() -> Part {
    dqn().with("discount", 0.9).with("explore", 500_i64)
}

fn ppo() -> Part {
    Part::new("ppo")
        .with("net", net(32))
        .with("discount", 0.9)
        .with("n_steps", 20_i64)
        .with("optimiser", rate(1e-2))
}

fn sqil(by: Part) -> Part {
    Part::new("sqil").with("shown", shown(QUIET)).with("by", by)
}

/// The same at a rate that falls, since what a discriminator pays changes as the agent does.
fn settling() -> Part {
    let falls = Part::new("linear").with("from", 1e-2).with("to", 0.0);
    ppo().with("optimiser", Part::new("adam").with("lr", falls))
}

fn gail(by: Part) -> Part {
    Part::new("gail").with("shown", shown(QUIET)).with("by", by).with("net", net(32))
}

fn beside(method: Part, world: Corner, weight: f64) -> Part {
    let cloning = Part::new("bc").with("shown", shown(world)).with("batch", 32_i64);
    Part::new("beside").with("method", method).with("cloning", cloning).with("weight", weight)
}

/// The best gets 20 but for the way, which takes four steps on average.
#[test]
fn who_imitates_gets_nearly_what_others_got_and_never_learns_what_it_pays() {
    let (best, chance) = (returns(Box::new(Expert)), returns(Box::new(Random {})));
    assert!(best > 16.0 && chance < 0.15 * best, "{best} {chance}");
    let ahead = q_learning().with("n_step", 3_i64);
    for (name, how, (steps, lanes)) in [
        ("sqil", sqil(q_learning()), (3000, 1)),
        ("sqil over three steps", sqil(ahead), (3000, 2)),
        ("gail", gail(settling()), (16_000, 8)),
        ("gail, paid to end", gail(settling()).with("pays", "negative"), (16_000, 8)),
        ("gail, paid by the logit", gail(settling()).with("pays", "logit"), (16_000, 8)),
        ("gail by q-learning", gail(q_learning()).with("pays", "logit"), (4000, 8)),
    ] {
        let learned = |world| learned(&how, world, (steps, lanes, 1)).agent;
        let agent: Agent = learned(QUIET);
        let got = returns(Box::new(Trained { agent: One(agent.clone()) }));
        assert!(got >= 0.9 * best, "{name} gets {got} of {best}");
        assert!(learned(Corner { pays: -3.0, ..QUIET }) == agent, "{name} knows what is paid");
    }
}

/// Where most of what is seen means nothing, others tell what does: at 960 steps all layers that are shared get 14.4 of
/// 16.9 on average, and 10.7 alone.
#[test]
fn who_clones_beside_learns_faster() {
    let got = |weight: f64| {
        let how = beside(ppo().with("shared", true), NOISY, weight);
        let runs = (0..5).map(|seed| learned(&how, NOISY, (960, 8, seed)));
        let (returns, cloning): (Vec<f64>, Vec<f64>) =
            runs.map(|run| (mean(&run.returns.values), run.losses.values[3])).unzip();
        (mean(&returns), mean(&cloning))
    };
    let ((alone, even), (beside, known)) = (got(0.0), got(1.0));
    assert!(beside > alone + 2.0, "{beside} and {alone} alone");
    // Among four actions a head that learns nothing is wrong by about ln 4.
    assert!(even > 1.2 && known < 0.7, "{known} and {even} alone");
}

#[test]
fn cloning_of_no_weight_is_the_method_alone_to_the_bit() {
    let a2c = Part::new("a2c").with("net", net(8));
    for (how, lanes) in [
        (q_learning().with("n_step", 2_i64), 1),
        (ppo(), 8),
        (ppo().with("shared", true), 8),
        (a2c, 4),
    ] {
        let alone = learned(&how, QUIET, (960, lanes, 1));
        let beside = |weight| learned(&beside(how.clone(), QUIET, weight), QUIET, (960, lanes, 1));
        let arrays = |run: &Learned| {
            let mut arrays = run.agent.nets.arrays.clone();
            arrays.retain(|(name, ..)| !name.starts_with("clone."));
            arrays
        };
        let of_none = beside(0.0);
        assert!(of_none.played == alone.played && of_none.returns == alone.returns);
        assert!(arrays(&of_none) == arrays(&alone), "{}", how.name);
        assert!(arrays(&beside(1.0)) != arrays(&alone), "{}", how.name);
    }
}

#[test]
fn who_is_stopped_at_any_moment_imitates_to_the_same_bytes() {
    let small = |how: Part| how.with("net", net(8));
    let q = || small(q_learning().with("warm_up", 64_i64).with("replay", 300_i64));
    let ppo = || small(ppo().with("n_steps", 16_i64));
    for (how, lanes) in [
        (sqil(q()), 4),
        (gail(ppo()).with("recent", 100_i64), 8),
        (gail(beside(q(), QUIET, 0.5)), 2),
        (beside(q(), QUIET, 1.0), 1),
        (beside(ppo(), QUIET, 1.0), 8),
    ] {
        let mut op = learn(&how, &Part::new("cart_pole"), 960, (320, lanes));
        op.r#in = Box::new(QUIET);
        let whole = op.run(&Ctx::new("learn", 3, None)).expect("it learns");
        let (other, stops) = interrupted(&op, (0_u64..).map(|i| 1 + (i * 7919) % 97));
        assert!(stops > 2, "{stops} stops");
        assert!(whole.encode() == other.encode(), "{} after {stops} stops", how.name);
    }
}
