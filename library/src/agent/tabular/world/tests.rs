use ivx_data::{Episode, Rollouts};
use ivx_nn::{Adam, Constant, Mlp, Optimiser, Params, Tanh};
use ivx_op::{Artifact as _, Dim, One, Op as _};
use ivx_world::{Chain, Env, Grid, Observe, Sinusoids};

use super::*;
use crate::agent::tabular::{GreedyPolicy, UniformPolicy, ValueIteration, walked};

const CTX: Ctx = Ctx::new("world", 1, None);

fn chain() -> Box<dyn Env> {
    Box::new(Chain { cells: 4, slip: 0.1, goal: true })
}

fn walks(stream: &str) -> Rollouts {
    let policy = One(UniformPolicy { r#in: chain() }.run(&CTX).unwrap());
    walked(policy, chain(), (60, stream))
}

fn net() -> Box<dyn Net> {
    Box::new(Mlp { hidden: vec![16], activation: Box::new(Tanh {}) })
}

fn adam() -> Box<dyn Optimiser> {
    Box::new(Adam { lr: Box::new(Constant { value: 0.01 }), beta1: 0.9, beta2: 0.999, eps: 1e-8 })
}

fn reconstruction(steps: u64, ctx: &Ctx) -> WorldModel {
    let op = ReconstructionModel {
        from: One(walks("main")),
        latent: 4,
        net: net(),
        noise: 0.1,
        stop_gradient: true,
        optimiser: adam(),
        batch: 32,
        steps,
    };
    op.run(ctx).unwrap()
}

/// What the states are worth, and what is best in each.
fn targets() -> (One<Array>, One<Array>) {
    let q = ValueIteration { r#in: chain(), discount: 0.9 }.run(&CTX).unwrap();
    let best = q.values.chunks(2).map(|row| row[0].max(row[1])).collect();
    let value = Array::series(q.dims[0].clone(), best);
    (One(value), One(GreedyPolicy { q: One(q), epsilon: 0.0 }.run(&CTX).unwrap()))
}

fn partial(steps: u64, scaled: bool) -> WorldModel {
    let (value, policy) = targets();
    let (from, net) = (One(walks("main")), net());
    let (unroll, latent, optimiser, batch) = (3, 4, adam(), 32);
    let op =
        PartialModel { from, value, policy, unroll, latent, net, scaled, optimiser, batch, steps };
    op.run(&CTX).unwrap()
}

fn errors(model: WorldModel) -> Vec<f64> {
    ModelErrors { of: One(model), on: One(walks("test")) }.run(&CTX).unwrap().values
}

fn unrolled(model: WorldModel) -> Vec<f64> {
    let (value, policy) = targets();
    let (of, on) = (One(model), One(walks("test")));
    UnrolledErrors { of, on, value, policy, unroll: 2 }.run(&CTX).unwrap().values
}

#[test]
fn states_of_a_chain_are_rebuilt_and_their_rewards_predicted() {
    let (before, after) = (errors(reconstruction(0, &CTX)), errors(reconstruction(600, &CTX)));
    assert!(before[0] > 0.5 && after[0] < 0.01, "{before:?} {after:?}");
    assert!(before[2] > 0.05 && after[2] < 0.01, "{before:?} {after:?}");
}

#[test]
fn values_policies_and_rewards_are_predicted_along_its_own_steps() {
    for scaled in [false, true] {
        let (before, after) = (unrolled(partial(0, scaled)), unrolled(partial(800, scaled)));
        assert_eq!(before.len(), 9);
        // A slip can't be foreseen: of the reward of the third step, what it costs on average stays.
        let at_first = [0.5, 0.5, 0.0];
        for (i, (before, after)) in before.iter().zip(&after).enumerate() {
            let most = [0.005, 0.01, 0.02][i % 3];
            assert!(*before > at_first[i % 3] && *after < most, "{i}, {scaled}: {before} {after}");
        }
    }
}

#[test]
fn training_again_makes_the_same_bytes() {
    assert_eq!(reconstruction(30, &CTX).encode(), reconstruction(30, &CTX).encode());
    assert_eq!(partial(30, true).encode(), partial(30, true).encode());
    let other = Ctx::new("world", 2, None);
    assert_ne!(reconstruction(0, &CTX).encode(), reconstruction(0, &other).encode());
}

#[test]
fn a_latent_state_for_each_state() {
    let latent = LatentStates { of: One(reconstruction(300, &CTX)) }.run(&CTX).unwrap();
    assert_eq!(latent.dims.iter().map(Dim::len).collect::<Vec<_>>(), [4, 4]);
    assert!(latent.values.iter().all(|z| z.abs() <= 1.0));
}

#[test]
fn paths_by_hand() {
    let actions = vec!["LEFT".to_owned(), "RIGHT".to_owned()];
    let episode = |states: &[usize], actions: &[usize], rewards: &[f64]| Episode {
        states: states.to_vec(),
        actions: actions.to_vec(),
        rewards: rewards.to_vec(),
        ended: true,
    };
    let short = episode(&[1, 2], &[1], &[1.0]);
    let long = episode(&[0, 1, 0, 2], &[1, 0, 1], &[0.0, 0.5, 1.0]);
    let of = Walks { n_states: 3, actions, episodes: vec![short, long] };
    let windows = Windows::new(&of, 2).unwrap();
    assert_eq!(windows.starts, [(1, 0), (1, 1)]);
    let graph = Graph::new(Params::default());
    let policy = [0.25, 0.75, 0.5, 0.5, 1.0, 0.0];
    let paths = windows.paths(&graph, &[1, 0], (&[3.0, 4.0, 5.0], &policy));
    let read = |vars: &[Var]| vars.iter().map(|var| graph.value(*var)).collect::<Vec<_>>();
    assert_eq!(graph.value(paths.states), [0.0, 1.0, 0.0, 1.0, 0.0, 0.0]);
    assert_eq!(read(&paths.actions), [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0]]);
    assert_eq!(read(&paths.rewards), [[0.5, 0.0], [1.0, 0.5]]);
    assert_eq!(read(&paths.values), [[4.0, 3.0], [3.0, 4.0], [5.0, 3.0]]);
    assert_eq!(read(&paths.policies)[2], [1.0, 0.0, 0.25, 0.75]);
    assert!(Windows::new(&of, 4).is_err());
}

#[test]
fn what_does_not_fit_says_so() {
    let why = |result: Result<Array, OpError>| result.unwrap_err().to_string();
    let on = || One(walks("test"));
    let model = || One(partial(0, false));
    assert!(why(ModelErrors { of: model(), on: on() }.run(&CTX)).contains("`unrolled_errors`"));
    let (value, policy) = targets();
    let of = One(reconstruction(0, &CTX));
    let refused = UnrolledErrors { of, on: on(), value, policy, unroll: 1 };
    assert!(why(refused.run(&CTX)).contains("`model_errors`"));
    let (value, policy) = targets();
    let swapped = UnrolledErrors { of: model(), on: on(), value: policy, policy: value, unroll: 1 };
    assert!(why(swapped.run(&CTX)).contains("over `state` of"));
    let fewer = Walks { n_states: 5, ..walks("test").walks().unwrap() };
    let refused = ModelErrors { of: One(reconstruction(0, &CTX)), on: One(fewer.into()) };
    assert!(why(refused.run(&CTX)).starts_with("the model is of 4 states and 2 actions"));
}

#[test]
fn values_of_a_reward_process_agree_where_they_were_learned() {
    let at = || Box::new(Grid { low: -1.0, high: 1.0, points: 5 });
    let on = Observe { reward: Box::new(Sinusoids {}), at: at() }.run(&CTX).unwrap();
    let model = |steps| {
        let (unroll, discount, latent, optimiser) = (3, 0.9, 8, adam());
        let (on, net) = (One(on.clone()), net());
        let op = ProcessModel { on, unroll, discount, latent, net, optimiser, batch: 0, steps };
        op.run(&CTX).unwrap()
    };
    let apart = |steps| {
        let of = One(model(steps));
        let values = ProcessValues { of, at: at(), unroll: 3, discount: 0.9 }.run(&CTX).unwrap();
        let errors = values.values.chunks(5).flat_map(|v| v.iter().zip(&on.y)).map(|(a, b)| a - b);
        errors.map(f64::abs).fold(0.0, f64::max)
    };
    let (before, after) = (apart(0), apart(600));
    assert!(before > 0.5 && after < 0.02, "{before} {after}");
    assert_eq!(model(20).encode(), model(20).encode());
    assert_eq!(WorldModel::decode(&model(1).encode()), Some(model(1)));

    let refused = LatentStates { of: One(model(0)) }.run(&CTX).unwrap_err().to_string();
    assert!(refused.contains("can't be listed"), "{refused}");
    let of = One(partial(0, false));
    let refused = ProcessValues { of, at: at(), unroll: 1, discount: 0.9 }.run(&CTX).unwrap_err();
    assert!(refused.to_string().contains("not of a reward process"));
}
