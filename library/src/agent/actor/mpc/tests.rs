use std::sync::Arc;

use ivx_data::{Act as Action, Actions, End, Field, Kind, Rollouts, Values};
use ivx_math::affine::Affine;
use ivx_math::moments::mean;
use ivx_nn::{Curve, Fitted, Layout, Model, Module, Networks, WorldModel};
use ivx_op::{
    Array, Artifact as _, Ctx, Dim, Gathered, Held, Labels, Lit, Literal as _, Members, One,
    Op as _, Shapes,
};
use ivx_world::{Chain, Env, Foresight, GoalWorld, Pendulum, Row, World};

use super::super::Random;
use super::*;
use crate::agent::tabular::ValueIteration;
use crate::agent::{Act, Evaluate, Returns, strolls};
use crate::ke::{Ma, Wcm};
use crate::learner::Learner;
use crate::planner::{
    LabelledTransitions, LatentModel, LearnedModel, TrajectoryLibrary, TrueModel,
};

const CTX: Ctx = Ctx::new("mpc", 1, None);

fn planner(part: &Part) -> Box<dyn Planner> {
    let part = crate::registry().complete(part);
    Box::<dyn Planner>::from_lit(&Lit::Part(part)).expect("a planner")
}

fn cem(samples: i64, rounds: i64) -> Box<dyn Planner> {
    planner(&Part::new("cem").with("samples", samples).with("rounds", rounds))
}

fn exhaustive() -> Box<dyn Planner> {
    planner(&Part::new("exhaustive"))
}

fn mpc(planner: Box<dyn Planner>, model: Box<dyn Simulator>, horizon: usize) -> Mpc {
    Mpc { planner, model, horizon, every: 1, discount: 0.95, ke: Box::new(Ma {}) }
}

fn truly(of: Box<dyn Env>) -> Box<dyn Simulator> {
    Box::new(TrueModel { of })
}

fn returns(actor: Box<dyn Actor>, r#in: Box<dyn Env>, trials: usize) -> Vec<f64> {
    Evaluate { actor, r#in, trials }.run(&CTX).expect("it acts").returns.values
}

fn episodes(actor: Box<dyn Actor>, r#in: Box<dyn Env>, episodes: usize) -> Rollouts {
    let stream = "main".to_owned();
    Act { actor, r#in, episodes, limit: 30, stream, keeps: Vec::new() }.run(&CTX).expect("it acts")
}

/// A weight on a spring that is pushed. All is linear: it pays its speed.
#[derive(Clone, Copy, Debug)]
struct Spring;

fn spring([x, v]: [f64; 2], push: f64) -> [f64; 2] {
    [x + 0.5 * v, v - 0.5 * x + 0.5 * push]
}

impl Env for Spring {
    fn spec(&self) -> Result<Spec, Misfit> {
        Ok(Spec {
            sees: vec![Field::new("weight", &[2], Kind::F32)],
            does: Actions::Continuous { low: vec![-1.0], high: vec![1.0] },
            tells: Vec::new(),
            limit: Some(20),
        })
    }

    fn open(&self) -> Result<Box<dyn World>, OpError> {
        Ok(Box::new(Weight([0.0; 2])))
    }

    fn foresight(&self) -> Result<Box<dyn Foresight>, Misfit> {
        Ok(Box::new(Self))
    }
}

struct Weight([f64; 2]);

#[expect(clippy::cast_possible_truncation, reason = "what is seen has single precision")]
fn show(at: [f64; 2], row: &mut Row<'_>) {
    row.numbers(0).copy_from_slice(&at.map(|x| x as f32));
}

impl World for Weight {
    fn reset(&mut self, luck: &mut Luck, row: &mut Row<'_>) {
        self.0 = [luck.between(-1.0, 1.0), luck.between(-1.0, 1.0)];
        show(self.0, row);
    }

    fn step(&mut self, act: Action<'_>, _: &mut Luck, row: &mut Row<'_>) -> (f64, End) {
        let pays = self.0[1];
        self.0 = spring(self.0, f64::from(act.vector()[0]));
        show(self.0, row);
        (pays, End::No)
    }
}

impl Foresight for Spring {
    fn width(&self) -> usize {
        2
    }

    fn place(&self, seen: &Columns, row: usize, state: &mut [f64]) {
        let Values::F32(numbers) = seen.values(0) else { panic!("numbers") };
        state.iter_mut().zip(&numbers[2 * row..]).for_each(|(x, seen)| *x = f64::from(*seen));
    }

    fn step(&mut self, state: &mut [f64], act: Action<'_>) -> (f64, bool) {
        let pays = state[1];
        state.copy_from_slice(&spring([state[0], state[1]], f64::from(act.vector()[0])));
        (pays, false)
    }
}

fn affine(inputs: usize, targets: usize, weights: &[f64]) -> Model {
    let form =
        ivx_data::Form { input: vec![inputs], target: vec![targets], ..ivx_data::Form::default() };
    let function = Affine { weights: weights.to_vec(), intercepts: vec![0.0; targets] };
    Model::Fitted(Fitted { form, function: Arc::new(function) })
}

/// How place and speed change and what is paid, by place, speed and push.
fn of_spring() -> Model {
    affine(3, 3, &[0.0, -0.5, 0.0, 0.5, 0.0, 1.0, 0.0, 0.5, 0.0])
}

fn learned(models: Vec<Model>) -> Box<dyn Simulator> {
    Box::new(LearnedModel { models: Members(models) })
}

/// The best plan in the spring: as far as can be, towards where the weight of what follows of a push is.
fn best_pushes(horizon: usize, discount: f64) -> Vec<f64> {
    let of_push = |t: usize| {
        let (mut at, mut sum, mut weight) = ([0.0; 2], 0.0, 1.0);
        for k in 0..horizon {
            sum += weight * at[1];
            weight *= discount;
            at = spring(at, f64::from(u8::from(k == t)));
        }
        sum
    };
    // The last push moves nothing that still pays.
    (0..horizon - 1).map(|t| of_push(t).signum()).collect()
}

#[test]
fn a_pendulum_is_swung_up() {
    let env = || Box::new(Pendulum {}) as Box<dyn Env>;
    let run =
        |planner, horizon| mean(&returns(Box::new(mpc(planner, truly(env()), horizon)), env(), 10));
    let (swung, at_random) = (run(cem(100, 3), 20), mean(&returns(Box::new(Random {}), env(), 10)));
    assert!(swung > -300.0 && at_random < -900.0, "{swung} and {at_random} at random");
    // Who looks one step ahead never swings back to come up.
    let greedy = run(cem(100, 3), 1);
    assert!(greedy < swung - 300.0, "{greedy}");
}

/// A network that learned how a pendulum moves from aimless swings, by so many updates.
fn of_pendulum(steps: u64) -> Box<dyn Simulator> {
    let all = episodes(Box::new(Random {}), Box::new(Pendulum {}), 60);
    let data = LabelledTransitions { of: One(all) }.run(&CTX).expect("they are");
    let rate = Part::new("constant").with("value", 3e-3);
    let net = Part::new("map_estimate")
        .with("net", Part::new("mlp").with("hidden", vec![32_i64, 32_i64]))
        .with("batch", 64_i64)
        .with("optimiser", Part::new("adam").with("lr", rate));
    let how = crate::registry().complete(&Part::new("scaled").with("learner", net));
    let how = Box::<dyn Learner>::from_lit(&Lit::Part(how)).expect("a learner");
    learned(vec![how.train(&data, steps, &CTX).expect("it learns")])
}

#[test]
fn a_pendulum_is_swung_up_by_what_was_learned_of_aimless_swings() {
    let run = |steps| {
        let actor = Box::new(mpc(cem(100, 2), of_pendulum(steps), 20));
        mean(&returns(actor, Box::new(Pendulum {}), 3))
    };
    let (untrained, trained) = (run(0), run(1000));
    assert!(trained > -500.0 && untrained < -900.0, "{trained} and {untrained} before");
}

#[test]
fn a_grid_is_walked_as_well_as_can_be() {
    let env =
        || Box::new(GoalWorld { size: 3, goal: vec![0, 0], trap: vec![0, 1] }) as Box<dyn Env>;
    let walked = |every, horizon| {
        let actor = Mpc { every, ..mpc(exhaustive(), truly(env()), horizon) };
        let all = episodes(Box::new(actor), env(), 70);
        let starts: Vec<usize> =
            all.walks().unwrap().episodes.iter().map(|episode| episode.states[0]).collect();
        (Returns { of: One(all), discount: 0.95 }.run(&CTX).unwrap().values, starts)
    };
    let q = ValueIteration { r#in: env(), discount: 0.95 }.run(&CTX).unwrap().values;
    let best = |s: usize| q[4 * s..][..4].iter().copied().fold(f64::MIN, f64::max);
    for every in [1, 2, 4] {
        let (found, starts) = walked(every, 4);
        // From the right upper corner the way about the trap takes four steps.
        assert!(starts.contains(&2));
        for (gained, start) in found.into_iter().zip(starts) {
            assert!((gained - best(start)).abs() < 1e-9, "{gained} from {start} every {every}");
        }
    }
    // One step less, and the goal is not seen from there: that nothing better follows is all that is known.
    let (found, starts) = walked(1, 3);
    let pairs = || found.iter().zip(&starts);
    assert!(pairs().all(|(gained, start)| *gained <= best(*start) + 1e-9));
    assert!(pairs().any(|(gained, start)| *gained < best(*start) - 1e-3));
}

#[test]
fn what_a_plan_returns_by_chance_is_its_mean() {
    // From the second of three cells LEFT slips with ¼: then RIGHT is at the goal, and otherwise a step later.
    let env = Chain { cells: 3, slip: 0.25, goal: true };
    let model = TrueModel { of: Box::new(Chain { ..env }) };
    let spec = Env::spec(&env).unwrap();
    let mut seen = Columns::zeros(spec.sees.clone(), 2);
    let (Values::Index(states), _) = seen.values_mut(0) else { panic!("a state") };
    states[1] = 1;
    let mut model = model.open(&spec).unwrap();
    model.begin(&seen, 1);
    let mut found = [0.0; 4];
    // The second and the third begin as the first, the last does not.
    let plans = [[0.0, 1.0, 1.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [1.0, 0.0, 0.0]];
    model.returns(&plans.concat(), 4, 0.5, &mut found);
    let slips = 0.5 * 0.25;
    assert_eq!(found, [slips + 0.25 * 0.75, slips, slips + 0.25 * 0.75, 1.0]);
}

#[test]
fn a_learned_model_that_is_right_does_as_the_true_one() {
    let spec = Spring.spec().unwrap();
    let does = |model: Box<dyn Simulator>, planner: Box<dyn Planner>| {
        let actor = Mpc { every: 12, ..mpc(planner, model, 12) };
        let all = episodes(Box::new(actor), Box::new(Spring), 3);
        let Values::F32(pushes) = all.paths.acts.values(0) else { panic!("numbers") };
        (all.rewards.clone(), pushes.iter().map(|x| f64::from(*x)).collect::<Vec<_>>())
    };
    let best = best_pushes(12, 0.95);
    assert!(best.contains(&1.0) && best.contains(&-1.0), "{best:?}");
    let climb = || planner(&Part::new("gradient_plan").with("steps", 40_i64));
    for (name, way) in [("cem", &(|| cem(300, 30)) as &dyn Fn() -> _), ("gradient", &climb)] {
        let (pays, pushes) = does(truly(Box::new(Spring)), way());
        let (foretold, learned) = does(learned(vec![of_spring()]), way());
        let apart =
            pays.iter().zip(&foretold).take(12).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 0.02, "{name}: {apart}");
        for pushes in [pushes, learned] {
            let off = pushes.iter().zip(&best).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 0.02, "{name}: {pushes:?}, not {best:?}");
        }
    }

    // Plan by plan they say the same; a model in which a push does the opposite does not.
    let mut seen = Columns::zeros(spec.sees.clone(), 1);
    let (Values::F32(at), _) = seen.values_mut(0) else { panic!("numbers") };
    at.copy_from_slice(&[0.25, -0.5]);
    let says = |model: &dyn Simulator| {
        let mut model = model.open(&spec).unwrap();
        model.begin(&seen, 0);
        let mut found = [0.0; 2];
        model.returns(&[1.0, 0.5, -1.0, 0.25, -0.5, 0.0, 1.0, 1.0], 2, 0.9, &mut found);
        found
    };
    let truth = says(&*truly(Box::new(Spring)));
    let apart = |model| {
        let said = says(&*learned(vec![model]));
        said.iter().zip(truth).map(|(a, b): (&f64, f64)| (a - b).abs()).fold(0.0, f64::max)
    };
    assert!(apart(of_spring()) < 1e-12);
    assert!(apart(affine(3, 3, &[0.0, -0.5, 0.0, 0.5, 0.0, 1.0, 0.0, -0.5, 0.0])) > 0.1);
}

#[test]
fn members_are_reduced_by_the_knowledge_equivalent() {
    // One says that a push pays itself, the other that it costs three times as much.
    let says = |pays: f64| affine(3, 3, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, pays]);
    let does = |ke: Box<dyn KnowledgeEquivalent>| {
        let plans = Array {
            dims: vec![Dim::new("plan", Labels::count(3)), Dim::new("step", Labels::count(1))],
            values: vec![0.5, 0.0, -0.5],
        };
        let library = Box::new(TrajectoryLibrary { plans: One(plans) });
        let model = learned(vec![says(1.0), says(-3.0)]);
        let actor = Mpc { ke, ..mpc(library, model, 1) };
        let all = episodes(Box::new(actor), Box::new(Spring), 1);
        let Values::F32(pushes) = all.paths.acts.values(0) else { panic!("numbers") };
        pushes[0]
    };
    assert_eq!((does(Box::new(Ma {})), does(Box::new(Wcm {}))), (-0.5, 0.0));
}

#[test]
fn transitions_are_what_models_are_learned_of() {
    let walked = Rollouts::from(strolls(1));
    let data = LabelledTransitions { of: One(walked) }.run(&CTX).unwrap();
    assert_eq!((data.form.input, data.form.target), (vec![5], vec![4]));
    // 1 0 1 2 by LEFT RIGHT RIGHT, for 1, 0 and 2.
    assert_eq!(data.x[..5], [0.0, 1.0, 0.0, 1.0, 0.0]);
    assert_eq!(data.y[..4], [1.0, -1.0, 0.0, 1.0]);
    assert_eq!(data.x[10..], [0.0, 1.0, 0.0, 0.0, 1.0]);
    assert_eq!(data.y[8..], [0.0, -1.0, 1.0, 2.0]);

    let pushed = episodes(Box::new(Random {}), Box::new(Spring), 3);
    let data = LabelledTransitions { of: One(pushed) }.run(&CTX).unwrap();
    assert_eq!(data.len(), 60);
    let found = of_spring().predict(&data.x);
    assert!(found.iter().zip(&data.y).all(|(a, b)| (a - b).abs() < 1e-6));
}

fn dense(inputs: usize) -> Module {
    Module::Dense { inputs, outputs: 1, curve: Curve::Identity }
}

/// `z = s`, `z' = z ∓ 1` by the action, `r = ½ z + ¼` for the second one, and `v = 3 z`.
fn world_model(with_value: bool) -> WorldModel {
    let layout = Layout { n_states: 3, actions: vec!["LEFT".into(), "RIGHT".into()], latent: 1 };
    let mut nets = Networks::default();
    let mut add = |name: &str, weights: &[f32]| {
        nets.modules.insert(name.to_owned(), dense(weights.len()));
        nets.put((format!("{name}.bias"), vec![1], vec![0.0]));
        nets.put((format!("{name}.weight"), vec![weights.len(), 1], weights.to_vec()));
    };
    add("representation", &[0.0, 1.0, 2.0]);
    add("dynamics", &[1.0, -1.0, 1.0]);
    add("reward", &[0.5, 0.0, 0.25]);
    if with_value {
        add("value", &[3.0]);
    }
    WorldModel { layout, nets }
}

#[test]
fn a_latent_model_is_unrolled_and_bootstrapped_by_hand() {
    let spec = Env::spec(&Chain { cells: 3, slip: 0.0, goal: true }).unwrap();
    let says = |with_value, discount| {
        let of = LatentModel { model: One(world_model(with_value)) };
        let mut model = of.open(&spec).unwrap();
        let mut seen = Columns::zeros(spec.sees.clone(), 2);
        let (Values::Index(states), _) = seen.values_mut(0) else { panic!("a state") };
        states[1] = 1;
        model.begin(&seen, 1);
        let mut found = [0.0; 2];
        model.returns(&[1.0, 0.0, 1.0, 1.0], 2, discount, &mut found);
        found
    };
    // ¾, 1 and then 3 · 1; ¾, 1¼ and then 3 · 3.
    assert_eq!(says(true, 0.5), [0.75 + 0.5 + 0.75, 0.75 + 0.625 + 2.25]);
    assert_eq!(says(false, 0.5), [1.25, 1.375]);
    assert_eq!(says(true, 0.0), [0.75, 0.75]);
    // What is right is always worth more: it walks to the goal.
    let model = Box::new(LatentModel { model: One(world_model(true)) });
    let env = || Box::new(Chain { cells: 3, slip: 0.0, goal: true });
    let found = returns(Box::new(mpc(exhaustive(), model, 2)), env(), 5);
    assert_eq!(found, [1.0; 5]);
}

#[test]
fn episodes_know_nothing_of_each_other() {
    let does = |n| {
        let actor = Mpc { every: 3, ..mpc(cem(5, 1), truly(Box::new(Spring)), 4) };
        episodes(Box::new(actor), Box::new(Spring), n)
    };
    let (few, many) = (does(65), does(67));
    assert_eq!(few.rewards, many.rewards[..few.rewards.len()]);
    assert_ne!(many.rewards[..20], many.rewards[20..40]);
}

#[test]
fn a_plan_goes_on_without_what_was_done() {
    let check = |mut plan: Vec<f64>, (done, width), expected: &[f64]| {
        go_on(&mut plan, done, width);
        assert_eq!(plan, expected);
    };
    check(vec![1.0, 2.0, 3.0], (1, 1), &[2.0, 3.0, 3.0]);
    check(vec![1.0, 2.0, 3.0], (3, 1), &[3.0, 3.0, 3.0]);
    check(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0], (2, 2), &[3.0, 4.0, 5.0, 6.0, 5.0, 6.0]);
    check(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0], (4, 2), &[5.0, 6.0, 5.0, 6.0, 5.0, 6.0]);
}

#[test]
fn what_does_not_fit_is_told() {
    let why = |mpc: &Mpc, env: &dyn Env| mpc.fits(&env.spec().unwrap()).unwrap_err().message;
    let (rod, row) =
        (|| Box::new(Pendulum {}), || Box::new(Chain { cells: 3, slip: 0.0, goal: true }));
    let climb = || planner(&Part::new("gradient_plan"));
    assert!(why(&mpc(exhaustive(), truly(rod()), 3), &Pendulum {}).contains("no end of plans"));
    assert!(why(&mpc(climb(), truly(row()), 3), &*row()).contains("discrete actions have none"));
    assert!(why(&mpc(exhaustive(), truly(row()), 20), &*row()).contains("2^20, 1048576, plans"));
    assert!(why(&mpc(cem(9, 1), truly(rod()), 3), &*row()).contains("and this world has"));
    let blind = || {
        Box::new(ivx_world::CoinGrid {
            pays: vec![1.0; 2],
            coins: 1,
            walls: 0,
            limit: 9,
            front_apart: false,
        })
    };
    assert!(
        why(&mpc(cem(9, 1), truly(blind()), 3), &*blind())
            .contains("is not known from what is seen")
    );
    let told = "the model is of vectors of 3 with vectors of 3, and one of this world is of vectors of 4 with vectors of 4";
    assert_eq!(why(&mpc(cem(9, 1), learned(vec![of_spring()]), 3), &Pendulum {}), told);
    let latent = || Box::new(LatentModel { model: One(world_model(true)) });
    assert!(
        why(&mpc(cem(9, 1), latent(), 3), &Pendulum {})
            .contains("this world is not a table of states")
    );
    let longer = Chain { cells: 4, slip: 0.0, goal: true };
    let told = "the model is of 3 states and 2 actions, and this world has 4 and 2";
    assert_eq!(why(&mpc(cem(9, 1), latent(), 3), &longer), told);
}

#[test]
fn what_is_still_to_be_learned_is_seen_through() {
    let shapes = |n: usize, m: usize| {
        let x = [("x".to_owned(), vec![n]), ("y".to_owned(), vec![m])];
        Lit::Held(Held::Later(Arc::new(Shapes::from(x))))
    };
    let fits = |models: Lit| {
        let part = crate::registry().complete(&Part::new("learned").with("models", models));
        let model = Box::<dyn Simulator>::from_lit(&Lit::Part(part)).expect("a model");
        mpc(cem(9, 1), model, 3).fits(&Spring.spec().unwrap()).map_err(|misfit| misfit.message)
    };
    assert_eq!(fits(shapes(3, 3)), Ok(()));
    assert!(
        fits(shapes(3, 2))
            .unwrap_err()
            .starts_with("the model is of vectors of 3 with vectors of 2")
    );
    let dims = Vec::new();
    let values = vec![of_spring().encode().into()];
    let held = Gathered { dims, values, name: String::new() };
    assert_eq!(fits(Lit::Held(Held::Value(held))), Ok(()));
}

#[test]
fn a_model_that_says_nothing_is_an_error_where_it_is_asked() {
    let none = affine(3, 3, &[f64::NAN; 9]);
    let actor = Box::new(mpc(cem(9, 1), learned(vec![none]), 3));
    let stream = "main".to_owned();
    let act =
        Act { actor, r#in: Box::new(Spring), episodes: 1, limit: 5, stream, keeps: Vec::new() };
    let why = act.run(&CTX).unwrap_err().to_string();
    let told = "at step 0 of the episode in lane 0: no plan that was tried for problem 0 is worth a number";
    assert_eq!(why, told);
}
