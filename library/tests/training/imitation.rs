//! Agents who imitate, where others know the way and nobody is paid.

use ivx_data::{Actions, End, Field, Kind, Misfit, pairs};
use ivx_library::agent::{Act, Actor, Agent, Demonstrate, Evaluate, Random, Tabular, Trained};
use ivx_math::moments::mean;
use ivx_op::{
    Array, Artifact as _, Ctx, Gathered, Held, Labelled, Lit, One, Op as _, OpError, Part,
};
use ivx_world::{Env, Luck, Row, Spec, World};

use crate::agents::{dqn, interrupted, learn};

const SIDE: usize = 5;
const STEPS: u64 = 20;

/// A square of cells in which each step that ends in the corner at the top left pays, for 20 steps from anywhere.
#[derive(Clone, Copy, Debug)]
struct Corner {
    pays: f64,
}

impl Env for Corner {
    fn spec(&self) -> Result<Spec, Misfit> {
        Ok(Spec {
            sees: vec![Field::new("cell", &[], Kind::Index(SIDE * SIDE))],
            does: Actions::named(&["UP", "DOWN", "LEFT", "RIGHT"]),
            tells: Vec::new(),
            limit: Some(STEPS),
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

impl World for Walk {
    fn reset(&mut self, luck: &mut Luck, row: &mut Row<'_>) {
        self.at = [0; 2].map(|_| luck.below(5) as usize);
        row.index(0, self.at[0] * SIDE + self.at[1]);
    }

    fn step(&mut self, act: ivx_data::Act<'_>, _: &mut Luck, row: &mut Row<'_>) -> (f64, End) {
        let place = &mut self.at[act.index() / 2];
        *place =
            if act.index() % 2 == 0 { place.saturating_sub(1) } else { (*place + 1).min(SIDE - 1) };
        row.index(0, self.at[0] * SIDE + self.at[1]);
        (if self.at == [0; 2] { self.pays } else { 0.0 }, End::No)
    }
}

const WORLD: Corner = Corner { pays: 1.0 };

fn gathered<T>(value: T) -> Gathered<T> {
    Gathered { dims: Vec::new(), values: vec![value], name: String::new() }
}

/// Somebody who goes up as far as that goes, and left then.
fn expert() -> Box<dyn Actor> {
    let Actions::Discrete(names) = WORLD.spec().expect("it is").does else { panic!("places") };
    let act = |cell: usize| if cell < SIDE { 2 } else { 0 };
    let values = (0..4 * SIDE * SIDE).map(|i| f64::from(u8::from(i % 4 == act(i / 4))));
    let policy = One(Array { dims: pairs(SIDE * SIDE, &names), values: values.collect() });
    Box::new(Tabular { policy })
}

fn shown(episodes: usize) -> Lit {
    let stream = "main".to_owned();
    let act = Act { actor: expert(), r#in: Box::new(WORLD), episodes, limit: 0, stream };
    let of = Labelled(gathered(act.run(&Ctx::new("act", 1, None)).expect("it acts")));
    let show = Demonstrate { of, whose: String::new() };
    let shown = show.run(&Ctx::new("demonstrations", 1, None)).expect("they are");
    Lit::Held(Held::Value(gathered(shown.encode().into())))
}

fn returns(actor: Box<dyn Actor>) -> f64 {
    let evaluate = Evaluate { actor, r#in: Box::new(WORLD), trials: 200 };
    mean(&evaluate.run(&Ctx::new("evaluate", 7, None)).expect("it acts").returns.values)
}

fn agent_of(how: &Part, r#in: Corner, (steps, lanes): (i64, usize)) -> Agent {
    let mut op = learn(how, &Part::new("cart_pole"), steps, (0, lanes));
    op.r#in = Box::new(r#in);
    op.trials = 1;
    op.run(&Ctx::new("learn", 1, None)).expect("it learns").agent
}

fn net(width: i64) -> Part {
    Part::new("mlp").with("hidden", vec![width])
}

fn q_learning() -> Part {
    dqn().with("discount", 0.9).with("explore", 500_i64)
}

fn sqil() -> Part {
    Part::new("sqil").with("shown", shown(20)).with("by", q_learning())
}

/// The best gets 20 but for the way, which takes four steps on average.
#[test]
fn who_imitates_gets_nearly_what_others_got_and_never_learns_what_it_pays() {
    let (best, chance) = (returns(expert()), returns(Box::new(Random {})));
    assert!(best > 16.0 && chance < 0.15 * best, "{best} {chance}");
    for (name, how, length) in [
        ("sqil", sqil(), (3000, 1)),
        ("sqil over three steps", sqil().with("by", q_learning().with("n_step", 3_i64)), (3000, 2)),
    ] {
        let agent = agent_of(&how, WORLD, length);
        let got = returns(Box::new(Trained { agent: One(agent.clone()) }));
        assert!(got >= 0.9 * best, "{name} gets {got}");
        let other = agent_of(&how, Corner { pays: -3.0 }, length);
        assert!(agent == other, "{name} knows what is paid");
    }
}

#[test]
fn who_is_stopped_at_any_moment_imitates_to_the_same_bytes() {
    let by = q_learning().with("warm_up", 64_i64).with("replay", 300_i64);
    let sqil = sqil().with("by", by.with("net", net(8)));
    for (how, lanes) in [(sqil, 4)] {
        let mut op = learn(&how, &Part::new("cart_pole"), 960, (320, lanes));
        op.r#in = Box::new(WORLD);
        let whole = op.run(&Ctx::new("learn", 3, None)).expect("it learns");
        let (other, stops) = interrupted(&op, (0_u64..).map(|i| 1 + (i * 7919) % 97));
        assert!(stops > 2, "{stops} stops");
        assert!(whole.encode() == other.encode(), "{} after {stops} stops", how.name);
    }
}
