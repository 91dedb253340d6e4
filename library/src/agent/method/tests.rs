//! First updates by hand, and what does not go together, of methods that imitate.

use ivx_data::{Columns, Demonstrations, End, Episode, Values, Walks};
use ivx_nn::{Curve, Live, Module, Networks, Shape};
use ivx_op::{Artifact as _, Ctx, Facts, Gathered, Held, Lit, Literal as _, Part};
use ivx_world::{Acts, Spec, Step};

use super::super::agent::{Agent, Choice};
use super::{Method, Setting};

const CTX: Ctx = Ctx::new("learn", 0, None);

/// A world of three states and two actions.
fn world() -> Spec {
    let paths = shown(true).paths;
    let sees = paths.seen.fields().to_vec();
    Spec { sees, does: paths.does, tells: Vec::new(), limit: None }
}

/// Demonstrations of a step by action 1 from state 1 to state 2, which ended or was cut off.
fn shown(ended: bool) -> Demonstrations {
    let step = Episode { states: vec![1, 2], actions: vec![1], rewards: vec![9.0], ended };
    let actions = vec!["A".to_owned(), "B".to_owned()];
    let paths = Walks { n_states: 3, actions, episodes: vec![step] }.trajectories();
    Demonstrations { paths, names: vec![String::new()], whose: vec![0] }
}

/// A step by action 0 from state 0 to state 2, which pays 7.
fn own(end: End) -> Step {
    Step {
        before: state(0, 1),
        acts: Acts::of(&world().does, 1),
        rewards: vec![7.0],
        after: state(2, 1),
        ends: vec![end],
        told: Vec::new(),
    }
}

/// The same state so many times.
fn state(state: u32, times: usize) -> Columns {
    let mut seen = Columns::zeros(world().sees, times);
    let (Values::Index(states), _) = seen.values_mut(0) else { panic!("states") };
    states.fill(state);
    seen
}

fn setting(spec: &Spec) -> Setting<'_> {
    Setting { spec, lanes: 1, steps: None, updates: Some(1) }
}

fn held(artifact: Vec<u8>) -> Lit {
    let (dims, values) = (Vec::new(), vec![artifact.into()]);
    Lit::Held(Held::Value(Gathered { dims, values, name: String::new() }))
}

fn built(part: &Part) -> Box<dyn Method> {
    Box::<dyn Method>::from_lit(&Lit::Part(crate::registry().complete(part))).unwrap()
}

/// Deep Q-learning that learns after each step and tries nothing.
fn dqn() -> Part {
    Part::new("dqn")
        .with("net", Part::new("mlp").with("hidden", vec![4_i64]))
        .with("discount", 0.5)
        .with("batch", 3_i64)
        .with("warm_up", 1_i64)
        .with("every", 1_i64)
        .with("epsilon", Part::new("constant").with("value", 0.0))
}

fn sqil(ended: bool) -> Part {
    let shown = held(shown(ended).encode());
    Part::new("sqil").with("shown", shown).with("by", dqn()).with("temperature", 0.25)
}

/// Cloning of that step.
fn bc() -> Part {
    Part::new("bc").with("shown", held(shown(true).encode())).with("batch", 5_i64)
}

fn beside(method: Part, weight: f64) -> Part {
    Part::new("beside").with("method", method).with("cloning", bc()).with("weight", weight)
}

fn gail(by: Part) -> Part {
    Part::new("gail")
        .with("shown", held(shown(true).encode()))
        .with("by", by)
        .with("net", Part::new("mlp").with("hidden", Vec::<i64>::new()))
        .with("batch", 2_i64)
        .with("penalty", 3.0)
}

/// What a network makes of a state.
fn output(agent: &Agent, net: &str, state: usize) -> Vec<f64> {
    let live = Live::of(&agent.nets);
    let mut x = [0.0; 3];
    x[state] = 1.0;
    let out = live.pass(net, live.graph.input(Shape::vectors(1, 3), &x));
    live.graph.value(out).into_iter().map(f64::from).collect()
}

fn near(found: &[f64], expected: &[f64]) {
    let apart = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
    let far = found.len() != expected.len() || apart.fold(0.0, f64::max) > 1e-6;
    assert!(!far, "{found:?} and not {expected:?}");
}

#[test]
fn the_first_loss_of_soft_q_imitation_by_hand() {
    for ended in [false, true] {
        let (how, spec) = (built(&sqil(ended).with("weight", 0.3)), world());
        let mut learning = how.begin(&setting(&spec), &CTX).unwrap();
        let q = [0, 1, 2].map(|s| output(&learning.agent(), "q", s));
        learning.see(&own(End::Limit));
        learning.learn(1);
        // What the world pays counts for nothing.
        let soft = 0.25 * q[2].iter().map(|q| (q / 0.25).exp()).sum::<f64>().ln();
        let shown = (q[1][1] - 1.0 - if ended { 0.0 } else { 0.5 * soft }).powi(2);
        let own = (q[0][0] - 0.5 * soft).powi(2);
        near(&learning.losses().take(), &[shown + 0.3 * own, shown, own]);
        assert_eq!(learning.updates(), 1);
    }
}

#[test]
fn it_acts_as_softly_as_its_temperature_says() {
    let (n, spec) = (20_000, world());
    let share = |how: &Part| {
        let how = built(how);
        let mut learning = how.begin(&setting(&spec), &CTX).unwrap();
        let agent = learning.agent();
        assert_eq!(Agent::decode(&agent.encode()), Some(agent.clone()));
        let (mut learns, mut acts) = (Acts::of(&spec.does, n), Acts::of(&spec.does, n));
        learning.act(1, &state(0, n), &mut learns);
        agent.open().act(&state(0, n), &mut CTX.rng("act", &[]), &mut acts).unwrap();
        let share = |acts: &Acts| {
            ivx_math::moments::real(acts.places.iter().sum()) / ivx_math::moments::real(n)
        };
        (share(&learns), share(&acts), output(&agent, "q", 0))
    };
    let (learns, acts, q) = share(&sqil(true).with("temperature", 0.02));
    let expected = 1.0 / (1.0 + ((q[0] - q[1]) / 0.02).exp());
    assert!((expected - 0.5).abs() > 0.1, "{expected}");
    assert!((learns - expected).abs() < 0.01 && (acts - expected).abs() < 0.01, "{learns} {acts}");
    let (learns, acts, _) = share(&sqil(true).with("temperature", 0.02).with("greedy", true));
    assert!((learns - expected).abs() < 0.01 && [0.0, 1.0].contains(&acts), "{learns} {acts}");
}

#[test]
fn learning_goes_on_from_an_agent() {
    let spec = world();
    let begun = |how: &Part, seed| {
        let ctx = Ctx::new("learn", seed, None);
        built(how).begin(&setting(&spec), &ctx).unwrap().agent()
    };
    let known = begun(&dqn(), 5);
    assert_ne!(begun(&dqn(), 0).nets, known.nets);
    let from = held(known.encode());
    assert_eq!(begun(&dqn().with("from", from.clone()), 0), known);
    let soft = begun(&sqil(true).with("from", from.clone()), 0);
    assert_eq!(soft.acts, Choice::Softened);
    assert_eq!(output(&soft, "q", 1), output(&known, "q", 1));
    // And from one that was softened.
    let from = held(soft.encode());
    assert_eq!(begun(&sqil(true).with("by", dqn().with("from", from)), 0), soft);
}

#[test]
fn cloning_beside_deep_q_learning_by_hand_shapes_the_layers_of_both() {
    let (how, spec) = (built(&beside(dqn(), 0.7)), world());
    let mut learning = how.begin(&setting(&spec), &CTX).unwrap();
    let agent = learning.agent();
    let (q, next) = (output(&agent, "q", 0), output(&agent, "q", 2));
    let live = Live::of(&agent.nets);
    let x = live.graph.input(Shape::vectors(1, 3), &[0.0, 1.0, 0.0]);
    let logits = live.graph.value(live.pass("clone", live.pass_to_last("q", x)));
    let cloning = f64::from(logits[0] - logits[1]).exp().ln_1p();
    let error = q[0] - 7.0 - 0.5 * next[0].max(next[1]);
    let loss = error.abs() - 0.5 + 0.7 * cloning;
    learning.see(&own(End::Limit));
    learning.learn(1);
    near(&learning.losses().take(), &[loss, f64::midpoint(q[0], q[1]), cloning]);
    // Only others were in state 1.
    let of_one = |agent: &Agent| agent.nets.array("q.0.weight").unwrap().2[4..8].to_vec();
    assert_ne!(of_one(&learning.agent()), of_one(&agent));
    let how = built(&beside(dqn(), 0.0));
    let mut learning = how.begin(&setting(&spec), &CTX).unwrap();
    learning.see(&own(End::Limit));
    learning.learn(1);
    assert_eq!(of_one(&learning.agent()), of_one(&agent));
}

#[test]
fn a_discriminator_by_hand_and_what_it_pays() {
    // A discriminator without hidden layers: the weights of three states and two actions, and a bias.
    let module =
        Module::Sequence(vec![Module::Dense { inputs: 5, outputs: 1, curve: Curve::Identity }]);
    let modules = [("discriminator".to_owned(), module)].into();
    let nets = Networks::drawn(modules, &mut CTX.rng("init", &["discriminator"]));
    let numbers = |name: &str| -> Vec<f64> {
        let array = nets.array(&format!("discriminator.0.{name}")).unwrap();
        array.2.iter().map(|x| f64::from(*x)).collect()
    };
    let (w, b) = (numbers("weight"), numbers("bias")[0]);
    let (theirs, mine) = (w[1] + w[4] + b, w[0] + w[3] + b);
    let told = (-theirs).exp().ln_1p() + mine.exp().ln_1p();
    let penalty = (w.iter().map(|w| w * w).sum::<f64>().sqrt() - 1.0).powi(2);
    let d = 1.0 / (1.0 + (-mine).exp());
    for (pays, paid) in
        [("positive", -(1.0 - d).ln()), ("negative", d.ln()), ("logit", d.ln() - (1.0 - d).ln())]
    {
        let (how, spec) = (built(&gail(dqn().with("every", 9_i64)).with("pays", pays)), world());
        let mut learning = how.begin(&setting(&spec), &CTX).unwrap();
        let agent = learning.agent();
        let (q, next) = (output(&agent, "q", 0), output(&agent, "q", 2));
        (0..2).for_each(|_| learning.see(&own(End::Limit)));
        learning.learn(2);
        let error = q[0] - paid - 0.5 * next[0].max(next[1]);
        let loss = if error.abs() < 1.0 { 0.5 * error * error } else { error.abs() - 0.5 };
        let found = learning.losses().take();
        near(&found, &[told, penalty, loss, f64::midpoint(q[0], q[1])]);
    }
}

#[test]
fn what_is_said_of_cloning_beside_a_method_is_what_is_said_of_that() {
    let registry = crate::registry();
    let said = |method: Part, cloning: Part| {
        let beside = Part::new("beside").with("method", method).with("cloning", cloning);
        let args = registry.complete(&beside).args;
        let none = (std::collections::BTreeMap::new(), std::collections::BTreeMap::new());
        let facts =
            Facts { args: &args, given: &[], over: &none.0, seen: &none.0, shapes: &none.1 };
        registry.decl("beside").unwrap().rule.unwrap()(&facts).err().map(|wrong| wrong.message)
    };
    assert_eq!(said(dqn(), bc()), None);
    let net = |n: i64| Part::new("mlp").with("hidden", vec![n]);
    assert_eq!(said(dqn(), bc().with("net", net(4))), None);
    let other = said(dqn(), bc().with("net", net(5))).unwrap();
    assert_eq!(other, "cloning beside `dqn` has no `net` of its own");
    let drawn = said(Part::new("ppo"), bc().with("greedy", false)).unwrap();
    assert_eq!(drawn, "cloning beside `ppo` has no `greedy` of its own");
}

#[test]
fn what_does_not_go_together_is_told() {
    let spec = world();
    let told = |how: &Part| built(how).fits(&setting(&spec)).err().map(|misfit| misfit.message);
    let whole = [sqil(true), beside(dqn(), 1.0), gail(dqn()), gail(beside(dqn(), 1.0))];
    let other = Spec { does: ivx_data::Actions::named(&["A", "B", "C"]), ..world() };
    for how in whole {
        assert_eq!(told(&how), None);
        let misfit = built(&how).fits(&setting(&other)).unwrap_err();
        assert!(misfit.message.contains("the demonstrations show"), "{}", misfit.message);
    }
    let has = |how: &Part, words: &str| {
        let message = told(how).unwrap_or_default();
        assert!(message.contains(words), "{message}");
    };
    has(&beside(sqil(true), 1.0), "no layers to share");
    has(&beside(dqn(), 1.0).with("cloning", dqn()), "is cloning");
    let flat = dqn().with("net", Part::new("mlp").with("hidden", Vec::<i64>::new()));
    has(&beside(flat, 1.0), "no layers before the last");
    has(&gail(bc()), "learns from nothing that is paid");
    has(&gail(sqil(true)), "learns from nothing that is paid");
    has(&gail(dqn()).with("pays", "well"), "`\"well\"`");
    let smooth = Part::new("mlp").with("activation", Part::new("silu"));
    has(&gail(dqn()).with("net", smooth), "no perceptron");
    let by = |by: Part| told(&sqil(true).with("by", by)).unwrap_or_default();
    assert!(by(Part::new("a2c")).contains("deep Q-learning"));
    assert!(by(dqn().with("double", true)).contains("no best action"));
    assert!(by(dqn().with("huber", 2.0)).contains("squared"));
    let learned = built(&dqn()).begin(&setting(&spec), &CTX).unwrap().agent();
    let from = held(learned.encode());
    let twice = sqil(true).with("by", dqn().with("from", from.clone())).with("from", from.clone());
    assert!(told(&twice).unwrap_or_default().contains("two agents"));
    let wider = dqn().with("net", Part::new("mlp").with("hidden", vec![5_i64]));
    assert!(by(wider.with("from", from)).contains("no such network"));
}
