use std::sync::Arc;

use ivx_data::{Dataset, Form};
use ivx_math::moments::real;
use ivx_op::{Artifact as _, Ctx, Data, Part, Tensors};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::loss::{
    chosen_losses, commanded_losses, displacement, made_losses, moved_losses, nearest,
    squared_distance,
};
use super::model::outputs;
use super::train::Shown;
use super::*;
use crate::descend::Rule;
use crate::graph::{Graph, Shape, Var};
use crate::live::Live;
use crate::model::Model;
use crate::module::Mode;
use crate::network::singles;
use crate::optim::Pull;
use crate::optimiser::optimisers;
use crate::params::Params;
use crate::{Fitted, Function as _, Mlp, Tanh};

/// The loss of one observation by what is said of it, and its slope.
fn asked(said: &[f64], loss: &dyn Fn(&Graph<f64>, Var) -> Var) -> (f64, Vec<f64>) {
    let graph = Graph::new(Params::default());
    let of = graph.variable(Shape::vectors(1, said.len()), said);
    let loss = loss(&graph, of);
    let told = graph.scalar(loss);
    graph.backward(loss);
    (told, graph.grad(of))
}

fn slopes_are_finite_differences(said: &[f64], loss: &dyn Fn(&Graph<f64>, Var) -> Var) {
    let (_, slope) = asked(said, loss);
    for i in 0..said.len() {
        let moved = |by: f64| {
            let mut said = said.to_vec();
            said[i] += by;
            asked(&said, loss).0
        };
        let found = (moved(1e-5) - moved(-1e-5)) / 2e-5;
        assert!((found - slope[i]).abs() < 1e-7 * (1.0 + found.abs()), "{i}: {found} {slope:?}");
    }
}

/// The second of two plans, of two steps, is 0 and 2 apart from what came, 1 on average, and the first 5 and 2. Its
/// probability is 3/4.
#[test]
fn plans_that_are_made_by_hand() {
    let plan = [3.0, 4.0, 0.0, 2.0];
    let loss = |graph: &Graph<f64>, said| made_losses(graph, said, (&plan, 2), 2.0);
    let said = [0.0, 3.0_f64.ln(), 0.0, 0.0, 0.0, 0.0, 3.0, 4.0, 0.0, 0.0];
    let (told, slope) = asked(&said, &loss);
    assert!((told - (4.0_f64 / 3.0).ln() - 2.0).abs() < 1e-12, "{told}");
    // What is not nearest has no slope, and a distance of 0 has none.
    let expected = [0.25, -0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0];
    assert!(slope.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{slope:?}");
    slopes_are_finite_differences(&[0.3, -0.2, 0.1, 0.2, 0.0, 0.4, 2.5, 4.4, 0.3, 0.9], &loss);
}

/// With `z = 0` the deviation is `ln 2 + 0.001`; of two numbers the first is met and the second 1 off.
#[test]
fn anchors_that_are_moved_by_hand() {
    // What came is (-0.5, 1) from the second anchor, which is moved by (-0.5, 0).
    let apart = [-0.5, 1.0];
    let loss = |graph: &Graph<f64>, said| moved_losses(graph, said, &apart, &[1]);
    let said = [0.0, 0.0, 9.0, 9.0, 9.0, 9.0, -0.5, 0.0, 0.0, 0.0];
    let spread: f64 = std::f64::consts::LN_2 + 1e-3;
    let log_n = |d: f64| -0.5 * (d / spread).powi(2) - spread.ln() - 0.918_938_533_204_672_7;
    let (told, slope) = asked(&said, &loss);
    assert!((told - std::f64::consts::LN_2 + log_n(0.0) + log_n(1.0)).abs() < 1e-12, "{told}");
    assert_eq!(slope[2..6], [0.0; 4]);
    slopes_are_finite_differences(&[0.1, 0.4, 1.0, 2.0, 3.0, 4.0, -0.7, 0.3, 0.2, -0.4], &loss);
}

#[test]
fn anchors_that_are_chosen_by_hand() {
    let loss = |graph: &Graph<f64>, said| chosen_losses(graph, said, &[2]);
    let (told, slope) = asked(&[0.0, 0.0, 2.0_f64.ln()], &loss);
    assert!((told - std::f64::consts::LN_2).abs() < 1e-12, "{told}");
    assert!(slope.iter().zip([0.25, 0.25, -0.5]).all(|(a, b)| (a - b).abs() < 1e-12), "{slope:?}");
    slopes_are_finite_differences(&[0.4, -0.3, 1.1], &loss);
}

/// 3 and 3 apart are nearer than 0 and 5 as vectors, and farther on average.
#[test]
fn which_is_nearest_depends_on_the_distance() {
    let (plan, modes) = ([0.0; 4], [3.0, 0.0, 0.0, 3.0, 0.0, 0.0, 3.0, 4.0]);
    assert_eq!(nearest(&modes, &plan, squared_distance), 0);
    assert_eq!(nearest(&modes, &plan, |a, b| displacement(a, b, 2)), 1);
    assert_eq!(nearest(&[1.0, -1.0], &[0.0], squared_distance), 0);
    let form = Form { target: vec![2, 2], ..Form::default() };
    let data = Dataset { form, x: vec![0.0], y: plan.to_vec() };
    let of = |how| Modes::Anchored(how, modes.to_vec()).nearest(&data);
    assert_eq!((of(Anchored::Moved), of(Anchored::Chosen)), (vec![0], vec![1]));
}

const NOISE: f64 = 0.1;

/// Where 0 is seen, half go left and half right; where 1 is seen, all go straight on.
fn fork(n: usize, noise: f64) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let form = Form { input: vec![1], beside: 1, target: vec![3, 2], ..Form::default() };
    let (mut x, mut y) = (Vec::new(), Vec::new());
    for i in 0..n {
        let (seen, side) = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (1.0, 0.0)][i % 4];
        x.extend([seen, rng.random::<f64>()]);
        for place in way(side) {
            let off: f64 = StandardNormal.sample(&mut rng);
            y.push(place + noise * off);
        }
    }
    Dataset { form, x, y }
}

fn way(side: f64) -> Vec<f64> {
    (1..4).flat_map(|t| [f64::from(t) / 2.0, side * f64::from(t)]).collect()
}

/// Left, straight on, right, and where nobody goes.
fn ways() -> Vec<f64> {
    [way(1.0), way(0.0), way(-1.0), vec![-3.0; 6]].concat()
}

fn trained(modes: Modes, data: &Dataset, steps: u64) -> Multimodal {
    let net = Mlp { hidden: vec![8], activation: Box::new(Tanh {}) };
    let nets = ModeNets { net: &net, features: 8, merge: &[16] };
    let ctx = Ctx::new("train", 0, None);
    let model = Multimodal::drawn(&nets, modes, &data.form, &mut ctx.rng("init", &[])).unwrap();
    let rate = Part::new("linear").with("from", 1e-2).with("to", 0.0);
    let adam = crate::registry().complete(&Part::new("adam").with("lr", rate));
    let optimiser = optimisers().build(&adam).unwrap();
    let rule = Rule { optimiser: &*optimiser, pull: Pull::NONE, steps };
    fit_modes(model, data, &ModeTraining { rule, batch: 64, weight: 1.0 }, &ctx).unwrap()
}

/// The least mean distance of the `n` most probable plans from what came, averaged over data.
fn min_ade(model: &Multimodal, data: &Dataset, n: usize) -> f64 {
    let (plans, _) = model.best(&data.form, &data.x, n);
    let rows = plans.chunks_exact(n * 6).zip(data.y.chunks_exact(6));
    let of = rows.map(|(plans, y)| {
        let each = plans.chunks_exact(6).map(|plan| displacement(plan, y, 2) / 3.0);
        each.fold(f64::INFINITY, f64::min)
    });
    of.sum::<f64>() / real(data.len())
}

/// One plan cannot be left and right: at step `t` they are `2t` apart, so that it is `t` from them on average at best, 2
/// over the three steps, and 1 over all data, of which half fork; the number beside, which says nothing, is learned by heart
/// a little.
#[test]
fn two_plans_are_made_for_a_fork() {
    let data = fork(256, 0.0);
    let two = min_ade(&trained(Modes::Made(2), &data, 1500), &data, 2);
    let one = min_ade(&trained(Modes::Made(1), &data, 1500), &data, 1);
    assert!(two < 0.1 && one > 0.9, "{two} {one}");
}

#[test]
fn anchors_are_chosen_as_often_as_they_are_taken() {
    let data = fork(256, 0.0);
    let model = trained(Modes::Anchored(Anchored::Chosen, ways()), &data, 600);
    let (plans, log_shares) = model.best(&data.form, &data.x[..4], 4);
    let (forks, straight) = log_shares.split_at(4);
    let near = |log: f64, share: f64| (log.exp() - share).abs() < 0.03;
    assert!(near(forks[0], 0.5) && near(forks[1], 0.5), "{forks:?}");
    assert!(near(straight[0], 1.0) && straight.is_sorted_by(|a, b| a >= b), "{straight:?}");
    assert_eq!(plans[24..30], way(0.0));
    assert_eq!(model.predict(&data.form, &data.x[2..4]), way(0.0));
    assert!(min_ade(&model, &data, 2) < 1e-12);
}

/// Nobody foretells better than by the entropy of what comes: `3 ln(2πe σ²)` of the noise of six numbers, and `ln 2` where
/// it forks, which half of the data do. Anchors are off by 0.2, which they are moved by.
#[test]
fn anchors_are_moved_to_where_others_go() {
    let (data, fresh) = (fork(512, NOISE), fork(1024, NOISE));
    let off: Vec<f64> = ways().iter().map(|x| x + 0.2).collect();
    let modes = Modes::Anchored(Anchored::Moved, off);
    let loss = |model: &Multimodal| {
        let live = Live::of(&model.nets);
        let said = outputs(&live, &fresh.form, &singles(&fresh.x), &mut Mode::Predict);
        let shown = Shown::of(&model.modes, &fresh);
        let losses = shown.losses(&live.graph, said, &model.modes, (3, 1.0));
        f64::from(live.graph.scalar(live.graph.mean(losses)))
    };
    let model = trained(modes, &data, 1500);
    let scale = 2.0 * std::f64::consts::PI * std::f64::consts::E * NOISE * NOISE;
    let bound = 3.0 * scale.ln() + 0.5 * std::f64::consts::LN_2;
    let found = loss(&model);
    assert!((bound - 0.15..bound + 0.25).contains(&found), "{found} {bound}");
    let plan = model.predict(&fresh.form, &[1.0, 0.5]);
    assert!(plan.iter().zip(way(0.0)).all(|(a, b)| (a - b).abs() < 0.06), "{plan:?}");
}

/// The second of two commands is given, and its plan is 1, 0, 2 and 0 off: on average ¾.
#[test]
fn plans_of_commands_by_hand() {
    let plan = [3.0, 4.0, 0.0, 2.0];
    let loss = |graph: &Graph<f64>, said| commanded_losses(graph, said, &plan, &[1]);
    let said = [9.0, 9.0, 9.0, 9.0, 2.0, 4.0, 2.0, 2.0];
    let (told, slope) = asked(&said, &loss);
    assert_eq!((told, &slope[..]), (0.75, &[0.0, 0.0, 0.0, 0.0, -0.25, 0.0, 0.25, 0.0][..]));
    slopes_are_finite_differences(&[9.0, 9.0, 9.0, 9.0, 2.0, 4.5, 2.0, 2.5], &loss);
}

/// Who is told where to go at the fork goes there, and elsewhere straight on; the mean of left and right is neither.
#[test]
fn a_command_tells_where_to_go() {
    let mut data = fork(256, 0.0);
    data.form.beside = 3;
    let sides = [1.0, 0.0, -1.0, 0.0].into_iter().cycle();
    let rows = data.x.chunks_exact(2).zip(sides);
    let is = |it: bool| f64::from(u8::from(it));
    data.x = rows
        .flat_map(|(x, side)| [x[0], is(side > 0.0), is(side < 0.0), is(side == 0.0)])
        .collect();
    let model = trained(Modes::Commanded(3), &data, 1500);
    let missed = min_ade(&model, &data, 1);
    assert!(missed < 0.1, "{missed}");
    let plan = model.predict(&data.form, &[0.0, 0.0, 1.0, 0.0]);
    assert!(plan.iter().zip(way(-1.0)).all(|(a, b)| (a - b).abs() < 0.2), "{plan:?}");
    // More commands than numbers are none.
    let net = Mlp { hidden: vec![8], activation: Box::new(Tanh {}) };
    let nets = ModeNets { net: &net, features: 8, merge: &[] };
    let why = nets.modules(&data.form, &Modes::Commanded(4)).unwrap_err().message;
    assert_eq!(why, "of 4 numbers that are seen the last 4 cannot be commands");
}

fn every() -> Vec<Multimodal> {
    let anchored = |how| Modes::Anchored(how, ways());
    let all = [
        Modes::Made(3),
        anchored(Anchored::Moved),
        anchored(Anchored::Chosen),
        Modes::Commanded(1),
    ];
    all.map(|modes| trained(modes, &fork(8, NOISE), 2)).into()
}

#[test]
fn a_model_is_stored_whole() {
    let form = fork(8, NOISE).form;
    for model in every() {
        let fitted = Fitted { form: form.clone(), function: Arc::new(model.clone()) };
        let stored = Model::Fitted(fitted);
        let bytes = stored.encode();
        let back = Model::decode(&bytes).unwrap();
        assert_eq!(Multimodal::within(&back), Some((&model, &form)));
        assert_eq!(back.encode(), bytes);
        // A plan alone is what it is among others.
        let data = fork(300, NOISE);
        let (all, one) = (back.predict(&data.x), back.predict(&data.x[2..4]));
        assert!(one.iter().zip(&all[6..12]).all(|(one, all)| (one - all).abs() < 1e-5));
        for n in (0..bytes.len()).step_by(97) {
            assert_eq!(Model::decode(&bytes[..n]), None, "of {n} bytes");
        }
    }
}

#[test]
fn what_cannot_be_evaluated_is_not_read() {
    let form = fork(8, NOISE).form;
    let reads = |form: &Form, mut tensors: Tensors| read(form, &mut tensors).is_some();
    for model in every() {
        let whole = model.tensors();
        assert!(reads(&form, whole.clone()));
        for name in whole.arrays.keys() {
            let mut less = whole.clone();
            less.arrays.remove(name);
            assert!(!reads(&form, less), "without {name}");
        }
        let mut more = whole.clone();
        more.arrays.insert("head.1.bias".to_owned(), Data::F32(vec![1], vec![0.0]));
        assert!(!reads(&form, more));
        let others = [
            Form { target: vec![3, 3], ..form.clone() },
            Form { target: vec![0, 2], ..form.clone() },
            Form { target: vec![usize::MAX, 2], ..form.clone() },
            Form { target: vec![], ..form.clone() },
            Form { classes: Some(2), ..form.clone() },
            Form { input: vec![2], ..form.clone() },
            Form { input: vec![0], ..form.clone() },
            Form { beside: usize::MAX, ..form.clone() },
        ];
        for other in others {
            assert!(!reads(&other, whole.clone()), "{other:?}");
        }
    }
    // Anchors that are none, no numbers, or fewer or more than there are logits.
    let model = &every()[1];
    for values in [vec![], vec![f64::NAN; 24], vec![0.0; 18], vec![0.0; 30], vec![0.0; 23]] {
        let mut tensors = model.tensors();
        tensors.arrays.insert("anchors".to_owned(), Data::F64(vec![values.len()], values));
        assert!(!reads(&form, tensors));
    }
    // So many modes that their numbers cannot be counted, none, and others than the last layer has.
    for n in [usize::MAX, 0, 2] {
        let model = Multimodal { modes: Modes::Made(n), ..every().swap_remove(0) };
        assert!(!reads(&form, model.tensors()), "{n}");
    }
}
