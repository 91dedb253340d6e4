use std::sync::Mutex;

use dfdx::prelude::{
    Axis, Backward as _, BroadcastTo as _, Cpu, Gradients, HasShape as _, MeanTo as _, OwnedTape,
    SumTo as _, Tensor, TensorFromVec as _, Trace as _,
};
use ivx_data::Form;
use ivx_op::{Lit, Part, Progress};
use rand::RngExt as _;

use super::*;
use crate::Head;
use crate::loss::losses;
use crate::net::nets;
use crate::network::{init, predict};
use crate::optimiser::optimisers;
use crate::registry;
use crate::{Curve, Module};

fn loss(name: &str) -> Box<dyn Loss> {
    let part = match name {
        "softplus" => Part::new("gaussian_nll").with("softplus", true),
        name => Part::new(name),
    };
    losses().build(&registry().complete(&part)).unwrap()
}

fn adam(lr: f64) -> Box<dyn Optimiser> {
    let rate = Part::new("linear").with("from", lr).with("to", 0.0);
    let part = registry().complete(&Part::new("adamw").with("lr", rate));
    optimisers().build(&part).unwrap()
}

fn untrained(part: &Part, loss: &dyn Loss, form: &Form) -> NetModel {
    let net = nets().build(&registry().complete(part)).unwrap();
    init(&*net, loss, form, &mut Ctx::new("train", 5, None).rng("init", &[])).unwrap()
}

fn mlp(activation: &str, hidden: &[i64]) -> NetModel {
    let part =
        Part::new("mlp").with("hidden", hidden.to_vec()).with("activation", Part::new(activation));
    untrained(&part, &*loss("squared"), &Form::default())
}

fn sequence(layers: Vec<Part>) -> Part {
    let layers = layers.into_iter().map(Lit::from).collect();
    Part::new("sequence").with("layers", Lit::List(layers))
}

fn waves() -> Dataset {
    let x: Vec<f64> = (0..7).map(|i| f64::from(i) / 3.0 - 1.0).collect();
    Dataset::pairs(x.clone(), x.iter().map(|x| (3.0 * x).sin()).collect())
}

/// Noise of a form, with classes in turn.
fn noise(form: Form, n: usize) -> Dataset {
    let mut rng = Ctx::new("noise", 0, None).rng("noise", &[]);
    let x = (0..n * form.input_len()).map(|_| rng.random::<f64>() - 0.5).collect();
    let n_classes = u32::try_from(form.classes.unwrap()).unwrap();
    let y = (0..n * form.target_len()).zip((0..n_classes).cycle()).map(|(_, y)| f64::from(y));
    Dataset { y: y.collect(), x, form }
}

fn values_mut<'a>(net: &'a mut NetModel, name: &str) -> &'a mut Vec<f32> {
    net.nets.arrays.iter_mut().find(|(n, ..)| n == name).map(|(.., values)| values).unwrap()
}

/// The loss on all data, and its gradients by array name.
fn gradients(net: &NetModel, loss: &dyn Loss, data: &Dataset) -> (f32, Vec<(String, Vec<f32>)>) {
    let live = Live::some(&net.nets, str::is_empty);
    let graph = &live.graph;
    let batches = Batches::new(net, data, 0);
    let mut dropout = Ctx::new("train", 0, None).rng("dropout", &[]);
    graph.begin();
    let x = graph.input(batch(data.len(), &net.form.input), &batches.x.shown);
    let value = objective(&live, (&net.form, loss), (x, &batches), &mut dropout);
    graph.backward(value);
    let value = graph.scalar(value);
    let held = graph.params();
    let named =
        held.arrays().iter().zip(held.ids()).filter_map(|(param, id)| {
            held.grad(id).map(|grad| (param.name.clone(), grad.to_vec()))
        });
    (value, named.collect())
}

#[test]
fn a_network_by_hand() {
    // hidden relu: (2·x + 1, −x); out: 3 h_0 − h_1 + 0.5. At x = 1: 9 + 0 + 0.5; at −1: 0 − 1 + 0.5.
    let array = |name: &str, shape: &[usize], values: &[f32]| {
        (name.to_owned(), shape.to_vec(), values.to_vec())
    };
    let dense = |inputs, outputs, curve| Module::Dense { inputs, outputs, curve };
    let module = Module::Sequence(vec![dense(1, 2, Curve::Relu), dense(2, 1, Curve::Identity)]);
    let arrays = vec![
        array("0.weight", &[1, 2], &[2.0, -1.0]),
        array("0.bias", &[2], &[1.0, 0.0]),
        array("1.weight", &[2, 1], &[3.0, -1.0]),
        array("1.bias", &[1], &[0.5]),
    ];
    let mut net = NetModel::new(module, Form::default(), Head::Mean, 0.0, arrays);
    assert_eq!(predict(&net, &[1.0, -1.0]), [9.5, -0.5]);
    assert!(predict(&net, &[]).is_empty());
    let many: Vec<f64> = (0..3000).map(|i| f64::from(i % 2) * 2.0 - 1.0).collect();
    assert!(predict(&net, &many).chunks(2).all(|pair| pair == [-0.5, 9.5]));

    // The same function again as its prior, at half the scale.
    let prior = net.nets.clone();
    net.nets.add(PRIOR, prior);
    net.prior_scale = 0.5;
    assert_eq!(predict(&net, &[1.0]), [14.25]);
    // Half of (14.25 − 4.25)² is what training sees.
    let (value, _) = gradients(&net, &*loss("squared"), &Dataset::pairs(vec![1.0], vec![4.25]));
    assert_eq!(value, 50.0);
}

/// In single precision a central difference with h = 1/64 is good to about 1e-3.
#[test]
fn gradients_agree_with_central_differences() {
    let classes = Form { input: vec![2], target: vec![], classes: Some(3), ..Form::default() };
    let pairs = Form { input: vec![2], target: vec![2], classes: None, ..Form::default() };
    let two = Form { input: vec![2], target: vec![], classes: Some(2), ..Form::default() };
    let net = Part::new("mlp").with("hidden", vec![4_i64]);
    for (name, form) in [
        ("squared", &pairs),
        ("absolute", &pairs),
        ("huber", &pairs),
        ("gaussian_nll", &pairs),
        ("softplus", &pairs),
        ("cross_entropy", &classes),
        ("binary_cross_entropy", &two),
    ] {
        let loss = loss(name);
        let net = untrained(&net, &*loss, form);
        let y: Vec<f64> = match form.classes {
            Some(n) => (0..4).map(|i| f64::from(i % u8::try_from(n).unwrap())).collect(),
            None => (0..8).map(|i| f64::from(i) / 2.0 - 1.7).collect(),
        };
        let x = (0..8).map(|i| f64::from(i * i % 5) / 3.0 - 0.6).collect();
        let data = Dataset { form: form.clone(), x, y };
        let h = 1.0 / 64.0;
        for (array, gradient) in gradients(&net, &*loss, &data).1 {
            for (i, g) in gradient.into_iter().enumerate() {
                let shifted = |h: f32| {
                    let mut net = net.clone();
                    values_mut(&mut net, &array)[i] += h;
                    f64::from(gradients(&net, &*loss, &data).0)
                };
                let difference = (shifted(h) - shifted(-h)) / (2.0 * f64::from(h));
                assert!(
                    (f64::from(g) - difference).abs() < 2e-3,
                    "{name} {array}[{i}]: {g} and {difference}"
                );
            }
        }
    }
}

#[test]
fn the_fused_layer_agrees_with_dfdx_operations() {
    let (net, data) = (mlp("relu", &[8, 9]), waves());
    let device = Cpu::default();
    let column = |values: &[f64]| device.tensor_from_vec(singles(values), (values.len(), 1));
    let tensors: Vec<_> = [(1, 8), (8, 9), (9, 1)]
        .into_iter()
        .enumerate()
        .map(|(i, shape)| {
            let array = |what: &str| {
                let name = format!("{i}.{what}");
                net.nets.arrays.iter().find(|(n, ..)| *n == name).unwrap().2.clone()
            };
            let bias: Tensor<(usize,), f32, Cpu> =
                device.tensor_from_vec(array("bias"), (shape.1,));
            (device.tensor_from_vec(array("weight"), shape), bias)
        })
        .collect();
    let mut x: Tensor<(usize, usize), f32, Cpu, OwnedTape<f32, Cpu>> =
        column(&data.x).traced(Gradients::leaky());
    for (i, (weight, bias)) in tensors.iter().enumerate() {
        let shape = (data.x.len(), bias.as_vec().len());
        let terms = (shape.0, weight.shape().0, shape.1);
        let weights = weight.retaped::<OwnedTape<f32, Cpu>>().broadcast_like::<_, Axis<0>>(&terms);
        let product = (x.broadcast_like::<_, Axis<2>>(&terms) * weights).sum::<_, Axis<1>>();
        let sum =
            product + bias.retaped::<OwnedTape<f32, Cpu>>().broadcast_like::<_, Axis<0>>(&shape);
        x = if i < 2 { sum.relu() } else { sum };
    }
    let theirs = ((x - column(&data.y)).square().mean() * 0.5).backward();
    let (_, ours) = gradients(&net, &*loss("squared"), &data);
    for (i, (weight, bias)) in tensors.iter().enumerate() {
        for (ours, theirs) in [
            (&ours[2 * i].1, theirs.get(weight).as_vec()),
            (&ours[2 * i + 1].1, theirs.get(bias).as_vec()),
        ] {
            let distance = ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(distance < 1e-6 && theirs.iter().any(|g| g.abs() > 1e-3), "layer {i}");
        }
    }
}

/// Keeps every state, and ends before one step.
#[derive(Debug, Default)]
struct BreakOff(Mutex<(Option<Vec<u8>>, usize)>);

impl Progress for BreakOff {
    fn load(&self) -> Option<Vec<u8>> {
        self.0.lock().unwrap().0.clone()
    }
    fn due(&self) -> bool {
        true
    }
    fn save(&self, state: Vec<u8>) {
        let mut kept = self.0.lock().unwrap();
        kept.0 = Some(state);
        kept.1 += 1;
    }
    fn stopping(&self) -> bool {
        self.0.lock().unwrap().1 == 7
    }
    fn listens(&self) -> bool {
        true
    }
    fn tell(&self, done: u64, of: u64, words: &str) {
        assert!(done < of && words.starts_with("loss "), "{done} of {of}: {words}");
    }
}

/// Networks with everything that training remembers: moments, running statistics, dropout, batches.
fn trainings() -> Vec<(NetModel, Dataset, Box<dyn Loss>, usize)> {
    let conv = Part::new("conv").with("channels", 2_i64).with("stride", 2_i64);
    let forgetful = sequence(vec![
        conv,
        Part::new("batch_norm"),
        Part::new("flatten"),
        Part::new("dropout"),
        Part::new("dense").with("units", 6_i64),
    ]);
    let images =
        Form { input: vec![1, 10, 10], target: vec![], classes: Some(10), ..Form::default() };
    let images = noise(images, 11);
    let gru = Part::new("gru").with("units", 5_i64);
    let sequences =
        noise(Form { input: vec![4, 3], target: vec![4], classes: Some(3), ..Form::default() }, 9);
    let of = |part: &Part, data: Dataset, name: &str, batch| {
        let loss = loss(name);
        (untrained(part, &*loss, &data.form), data, loss, batch)
    };
    let wave = Part::new("mlp").with("hidden", vec![5_i64, 4]);
    vec![
        of(&wave, waves(), "squared", 0),
        of(&wave, waves(), "gaussian_nll", 2),
        of(&forgetful, images, "cross_entropy", 4),
        of(&gru, sequences, "cross_entropy", 3),
    ]
}

#[test]
fn a_training_that_was_broken_off_ends_in_the_same_bytes() {
    let optimiser = adam(0.1);
    let ctx = Ctx::new("train", 0, None);
    for (net, data, loss, batch) in trainings() {
        let how = Training {
            loss: &*loss,
            optimiser: &*optimiser,
            pull: Pull::NONE,
            batch,
            adversarial: 0.0,
            steps: 20,
        };
        let fit = |ctx: &Ctx| fit(net.clone(), &data, &how, ctx);
        let whole = fit(&ctx);
        assert_eq!(fit(&ctx), whole, "twice");
        assert_ne!(whole.as_ref(), Ok(&net));
        let progress = BreakOff::default();
        assert_eq!(fit(&ctx.keeping(&progress)), Err(OpError::Stopped));
        assert_eq!(fit(&ctx.keeping(&progress)), whole);
        // The first run kept states 0 to 7, the second went on from 7.
        assert_eq!(progress.0.lock().unwrap().1, 8 + 13);

        let (other, loss) = (mlp("tanh", &[5]), self::loss("squared"));
        let how = Training { loss: &*loss, batch: 0, ..how };
        let fresh = super::fit(other.clone(), &waves(), &how, &ctx);
        let foreign = super::fit(other, &waves(), &how, &ctx.keeping(&progress));
        assert_eq!(foreign, fresh, "the state of another network is left alone");
    }
}

#[test]
fn batches_go_through_all_data_in_a_new_order_each_time() {
    let net = mlp("tanh", &[2]);
    let data = Dataset::pairs((0..6).map(f64::from).collect(), vec![0.0; 6]);
    let ctx = Ctx::new("train", 0, None);
    let mut batches = Batches::new(&net, &data, 2);
    let mut shown = |t| {
        batches.turn(t, &ctx);
        batches.x.shown.clone()
    };
    let passes: Vec<Vec<f32>> =
        (0..4).map(|pass| (0..3).flat_map(|i| shown(3 * pass + i)).collect()).collect();
    for pass in &passes {
        let mut sorted = pass.clone();
        sorted.sort_by(f32::total_cmp);
        assert_eq!(sorted, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    }
    assert!(passes.windows(2).any(|pair| pair[0] != pair[1]));
    // Where a training goes on, the order is that of its step and not of what came before.
    assert_eq!(shown(7), passes[2][2..4]);
}

/// A line of two inputs, after a step of gradient descent at the rate 0.1 on two observations, with inputs moved by so
/// large a share of their range.
fn line_after_a_step(adversarial: f64) -> Vec<f32> {
    let module = Module::Dense { inputs: 2, outputs: 1, curve: Curve::Identity };
    let arrays =
        vec![("bias".into(), vec![1], vec![0.5]), ("weight".into(), vec![2, 1], vec![2.0, -1.0])];
    let form = Form { input: vec![2], ..Form::default() };
    let net = NetModel::new(module, form.clone(), Head::Mean, 0.0, arrays);
    let data = Dataset { form, x: vec![1.0, 0.0, 3.0, 5.0], y: vec![1.5, 5.5] };
    let rate = Part::new("constant").with("value", 0.1);
    let optimiser = registry().complete(&Part::new("sgd").with("lr", rate));
    let (optimiser, loss) = (optimisers().build(&optimiser).unwrap(), loss("squared"));
    let (loss, optimiser) = (&*loss, &*optimiser);
    let how = Training { loss, optimiser, pull: Pull::NONE, batch: 0, adversarial, steps: 1 };
    let mut net = fit(net, &data, &how, &Ctx::new("train", 0, None)).unwrap();
    let weight = values_mut(&mut net, "weight").clone();
    [values_mut(&mut net, "bias").clone(), weight].concat()
}

/// Errors are 2.5 − 1.5 = 1 and 1.5 − 5.5 = −4, ranges 2 and 5. At a quarter of them inputs move by 0.5 and 1.25 along
/// the sign of error times weight: (1.5, −1.25) with the error 4.75 − 1.5 = 3.25, and (2.5, 6.25) with −0.75 − 5.5 =
/// −6.25. The gradient by the bias is their mean, those by weights are the means of their products with inputs.
#[test]
fn adversarial_training_by_hand() {
    let close = |found: &[f32], gradients: [f32; 3]| {
        let from = [0.5, 2.0, -1.0];
        for ((found, gradient), from) in found.iter().zip(gradients).zip(from) {
            assert!((found - (from - 0.1 * gradient)).abs() < 1e-5, "{found} {gradient}");
        }
    };
    let plain = [-1.5, -5.5, -10.0];
    close(&line_after_a_step(0.0), plain);
    let moved = [-1.5, (3.25 * 1.5 - 6.25 * 2.5) / 2.0, (3.25 * -1.25 - 6.25 * 6.25) / 2.0];
    let both = [0, 1, 2].map(|i| plain[i] + moved[i]);
    close(&line_after_a_step(0.25), both);
    // Inputs that move with the network and not against it have errors that are smaller.
    let with = [-1.5, (-1.25 * 0.5 - 1.75 * 3.5) / 2.0, (-1.25 * 1.25 - 1.75 * 3.75) / 2.0];
    let wrong = [0, 1, 2].map(|i| plain[i] + with[i]);
    assert!(std::panic::catch_unwind(|| close(&line_after_a_step(0.25), wrong)).is_err());
}

/// `σ² = ln(1 + e^z) + 1e-6`: at z = 0 it is ln 2, and far below it stays above 1e-6.
#[test]
fn variances_by_softplus() {
    let module = Module::Dense { inputs: 1, outputs: 2, curve: Curve::Identity };
    let arrays = vec![
        ("bias".into(), vec![2], vec![3.0, 0.0]),
        ("weight".into(), vec![1, 2], vec![0.0, 100.0]),
    ];
    let head = loss("softplus").head();
    let net = NetModel::new(module, Form::default(), head, 0.0, arrays);
    let stds = crate::stds(&net, &[0.0, -1.0, 1.0]).unwrap();
    let expected = [2.0_f64.ln().sqrt(), 1e-3, 10.0];
    for (found, expected) in stds.iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
    }
    assert_eq!(predict(&net, &[0.0]), [3.0]);
}
