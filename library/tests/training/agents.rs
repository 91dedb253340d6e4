//! Agents on problems with a known answer, and in the face of interruptions.

use std::sync::Mutex;

use ivx_library::agent::{Act, Demonstrate, Learn, Learned, Method, Span, Tabular};
use ivx_math::moments::mean;
use ivx_op::{
    Array, Artifact as _, Ctx, Gathered, Held, Labelled, Lit, Literal as _, One, Op as _, OpError,
    Part, Progress,
};
use ivx_world::{Chain, Env};

pub(crate) fn learn(how: &Part, env: &Part, steps: i64, (every, lanes): (u64, usize)) -> Learn {
    let registry = ivx_library::registry();
    let lit = |part: &Part| Lit::Part(registry.complete(part));
    Learn {
        how: Box::<dyn Method>::from_lit(&lit(how)).expect("a method"),
        r#in: Box::<dyn Env>::from_lit(&lit(env)).expect("a world"),
        r#for: Box::<dyn Span>::from_lit(&lit(&Part::new("steps").with("n", steps)))
            .expect("a span"),
        every,
        trials: 5,
        lanes,
    }
}

pub(crate) fn rate(lr: f64) -> Part {
    Part::new("adam").with("lr", Part::new("constant").with("value", lr))
}

pub(crate) fn dqn() -> Part {
    let follows = Part::new("averaged").with("share", 0.05);
    Part::new("dqn")
        .with("net", Part::new("mlp").with("hidden", vec![32_i64]))
        .with("warm_up", 200_i64)
        .with("every", 2_i64)
        .with("explore", 2000_i64)
        .with("target", follows)
        .with("optimiser", rate(3e-3))
}

/// Cloning somebody who goes right in four of five steps through a chain of ten cells.
fn bc() -> Part {
    let env = || Box::new(Chain { cells: 10, slip: 0.1, goal: true });
    let dims = ivx_world::mdp(&*(env() as Box<dyn Env>)).expect("a table").pairs();
    let policy = One(Array { dims, values: [0.2, 0.8].repeat(10) });
    let (actor, stream) = (Box::new(Tabular { policy }), "main".to_owned());
    let act = Act { actor, r#in: env(), episodes: 300, limit: 0, stream, keeps: Vec::new() };
    let values = vec![act.run(&Ctx::new("act", 1, None)).expect("it acts")];
    let of = Labelled(Gathered { dims: Vec::new(), values, name: String::new() });
    let shown = Demonstrate { of, whose: String::new() }
        .run(&Ctx::new("demonstrations", 1, None))
        .expect("they are");
    let values = vec![shown.encode().into()];
    let held = Gathered { dims: Vec::new(), values, name: String::new() };
    Part::new("bc")
        .with("shown", Lit::Held(Held::Value(held)))
        .with("net", Part::new("mlp").with("hidden", vec![32_i64]))
}

/// The mean length of the episodes that an agent walks in a chain of ten cells after so many steps of learning, where an
/// even walk takes about ninety and the best takes five; and how often it goes right.
fn walks_to_goal(how: &Part, lanes: usize) -> (f64, f64) {
    let env = Part::new("chain").with("cells", 10_i64);
    let run =
        learn(how, &env, 4000, (0, lanes)).run(&Ctx::new("learn", 1, None)).expect("it learns");
    let agent = run.agent;
    let (env, ctx) = (learn(how, &env, 1, (0, 1)).r#in, Ctx::new("act", 2, None));
    let mut lanes = ivx_world::Lanes::open(&*env, 20, &ctx, ("evaluate", 0)).expect("worlds");
    let mut acting = agent.open();
    let mut rng = ctx.rng("act", &[]);
    let (mut lengths, mut rights) = (Vec::new(), Vec::new());
    for t in 0..400 {
        let (seen, acts) = lanes.choose();
        rng.set_stream(t);
        acting.act(seen, &mut rng, acts).expect("it acts");
        #[expect(clippy::cast_precision_loss, reason = "it is 0 or 1")]
        rights.extend(acts.places.iter().map(|act| *act as f64));
        lanes.step().expect("they go on");
        #[expect(clippy::cast_precision_loss, reason = "episodes are short")]
        lengths.extend(lanes.finished().map(|episode| episode.length as f64));
    }
    (mean(&lengths), mean(&rights))
}

#[test]
fn every_method_learns_to_walk() {
    let on_policy = |name: &str| {
        Part::new(name)
            .with("net", Part::new("mlp").with("hidden", vec![32_i64]))
            .with("optimiser", rate(1e-2))
            .with("n_steps", 20_i64)
    };
    for (name, how, lanes) in [
        ("dqn", dqn(), 1),
        ("double dqn over three steps", dqn().with("double", true).with("n_step", 3_i64), 2),
        ("ppo", on_policy("ppo"), 8),
        ("ppo, shared", on_policy("ppo").with("shared", true), 8),
        ("a2c", on_policy("a2c"), 8),
        ("bc", bc(), 1),
    ] {
        let (took, _) = walks_to_goal(&how, lanes);
        assert!(took < 8.0, "{name} takes {took} steps");
    }
}

#[test]
fn a_clone_acts_as_often_as_who_was_cloned() {
    let (took, right) = walks_to_goal(&bc().with("greedy", false), 1);
    assert!((right - 0.8).abs() < 0.03 && took > 6.0, "{right} right, {took} steps");
}

/// Stops a computation after so many checks, and keeps what it says.
#[derive(Debug)]
struct Stops {
    left: Mutex<u64>,
    kept: Mutex<Option<Vec<u8>>>,
}

impl Progress for Stops {
    fn load(&self) -> Option<Vec<u8>> {
        self.kept.lock().expect("nobody failed").clone()
    }
    fn due(&self) -> bool {
        false
    }
    fn save(&self, state: Vec<u8>) {
        *self.kept.lock().expect("nobody failed") = Some(state);
    }
    fn stopping(&self) -> bool {
        let mut left = self.left.lock().expect("nobody failed");
        *left = left.saturating_sub(1);
        *left == 0
    }
    fn listens(&self) -> bool {
        false
    }
    fn tell(&self, _: u64, _: u64, _: &str) {}
}

/// A learning that is stopped again and again, after `gaps` checks each, until it is done.
pub(crate) fn interrupted(op: &Learn, gaps: impl Iterator<Item = u64>) -> (Learned, usize) {
    let mut kept = None;
    for (stops, gap) in gaps.enumerate() {
        let progress = Stops { left: Mutex::new(gap), kept: Mutex::new(kept) };
        match op.run(&Ctx::new("learn", 3, None).keeping(&progress)) {
            Ok(learned) => return (learned, stops),
            Err(error) => assert_eq!(error, OpError::Stopped),
        }
        kept = progress.kept.into_inner().expect("nobody failed");
    }
    panic!("it never ends");
}

#[test]
fn who_is_stopped_at_any_moment_ends_in_the_same_bytes() {
    let game = Part::new("minatar").with("game", "breakout");
    let cart = Part::new("cart_pole");
    let small =
        |name: &str| Part::new(name).with("net", Part::new("mlp").with("hidden", vec![8_i64]));
    let torso = Part::new("cnn")
        .with("channels", vec![2_i64])
        .with("kernels", vec![3_i64])
        .with("hidden", vec![8_i64]);
    let ppo = small("ppo").with("n_steps", 16_i64);
    let dqn = small("dqn").with("warm_up", 64_i64).with("replay", 300_i64);
    let chain = Part::new("chain").with("cells", 10_i64);
    for (how, env, lanes) in [
        (bc().with("batch", 7_i64), &chain, 1),
        (dqn.clone().with("net", torso.clone()), &game, 1),
        (dqn.with("n_step", 3_i64).with("double", true), &cart, 4),
        (ppo, &cart, 8),
        (small("a2c").with("net", torso), &game, 2),
    ] {
        let op = learn(&how, env, 960, (320, lanes));
        let whole = op.run(&Ctx::new("learn", 3, None)).expect("it learns");
        let gaps = (0_u64..).map(|i| 1 + (i * 7919) % 97);
        let (other, stops) = interrupted(&op, gaps);
        assert!(stops > 2, "{stops} stops");
        assert!(whole.encode() == other.encode(), "{} after {stops} stops", how.name);
    }
}
