//! Training and evaluating networks.

use std::collections::BTreeMap;

use ivx_op::{Ctx, Data, Part, Tensors};

use super::activation::activations;
use super::curve::Curve;
use super::graph::{Graph, Shape, Var};
use super::net::layer_shapes;
use super::optim::{Moments, Pull};
use super::optimiser::{Optimiser, Step};
use super::params::{ParamId, Params};
use super::real::Real as _;
use crate::artifact::{Dataset, NetModel};

/// The network after `steps` full-batch updates that lower
///
/// ```text
/// 1/(2N) Σ_i (y_i - f(x_i; θ))² + strength/2 ‖θ - centre‖²
/// ```
///
/// where `pull` is the second term. A prior network inside `net` is not evaluated and stays. Progress
/// is kept with `ctx`, and goes on from there.
///
/// # Panics
/// If an array is missing or the data have unequal columns.
#[must_use]
pub fn fit(
    mut net: NetModel,
    data: &Dataset,
    optimiser: &dyn Optimiser,
    pull: Pull,
    steps: u64,
    ctx: &Ctx,
) -> NetModel {
    let (graph, layers) = load(&net, "");
    let mut moments = graph.params().moments();
    let (x, y) = (singles(&data.x), singles(&data.y));
    let state = ctx.resume().and_then(|bytes| restore(&bytes, &mut graph.params(), &mut moments));
    for t in state.unwrap_or(0)..steps {
        ctx.checkpoint(|| keep(t, &graph.params(), &moments));
        backward(&graph, &layers, &x, &y);
        let step = Step { t, total: steps, pull };
        optimiser.step(&step, &mut graph.params(), &mut moments);
    }
    for param in graph.params().arrays() {
        array_mut(&mut net, &param.name).clone_from(&param.value);
    }
    net
}

/// The kind of a training that is not done.
const UNFINISHED: &str = "Unfinished";

/// A training before step `t`, as bytes.
fn keep(t: u64, params: &Params<f32>, moments: &[Moments<f32>]) -> Vec<u8> {
    let mut arrays = BTreeMap::new();
    let mut put = |name: String, values: &[f32]| {
        arrays.insert(name, Data::F32(vec![values.len()], values.to_vec()));
    };
    for (param, moments) in params.arrays().iter().zip(moments) {
        put(param.name.clone(), &param.value);
        put(format!("{}.first", param.name), &moments.first);
        put(format!("{}.second", param.name), &moments.second);
    }
    Tensors { arrays }.encode(UNFINISHED, &t)
}

/// The step that a training goes on with; `None`, and nothing changed, if the bytes are not of one
/// of these parameters.
fn restore(bytes: &[u8], params: &mut Params<f32>, moments: &mut [Moments<f32>]) -> Option<u64> {
    let (mut tensors, t): (_, u64) = Tensors::decode(UNFINISHED, bytes)?;
    let mut take = |name: String, n: usize| {
        tensors.f32(&name).map(|(_, values)| values).filter(|values| values.len() == n)
    };
    let mut read = Vec::new();
    for param in params.arrays() {
        let n = param.value.len();
        let first = take(format!("{}.first", param.name), n)?;
        let second = take(format!("{}.second", param.name), n)?;
        read.push((take(param.name.clone(), n)?, Moments { first, second }));
    }
    for ((value, kept), (param, moments)) in read.into_iter().zip(params.values_mut().zip(moments))
    {
        param.copy_from_slice(&value);
        *moments = kept;
    }
    Some(t)
}

/// The network's outputs at scalar inputs, its prior network included.
///
/// # Panics
/// If an array is missing.
#[must_use]
pub fn predict(net: &NetModel, xs: &[f64]) -> Vec<f64> {
    if xs.is_empty() {
        return Vec::new();
    }
    let x = singles(xs);
    let outputs = |prefix| {
        let (graph, layers) = load(net, prefix);
        let y = graph.still(|| forward(&graph, &layers, &x));
        graph.value(y).into_iter().map(f64::from)
    };
    if net.prior_scale == 0.0 {
        return outputs("").collect();
    }
    outputs("").zip(outputs("prior.")).map(|(f, prior)| f + net.prior_scale * prior).collect()
}

/// One layer: weight, bias, and what follows.
type Layer = (ParamId, ParamId, Curve);

/// Half the mean squared error; its gradients are left in the parameters.
fn backward(graph: &Graph<f32>, layers: &[Layer], x: &[f32], y: &[f32]) -> f32 {
    graph.begin();
    let outputs = forward(graph, layers, x);
    let y = graph.input(Shape::vectors(y.len(), 1), y);
    let loss = graph.affine(graph.mean(graph.squared(outputs, y)), 0.5, 0.0);
    graph.backward(loss);
    graph.scalar(loss)
}

fn forward(graph: &Graph<f32>, layers: &[Layer], x: &[f32]) -> Var {
    let x = graph.input(Shape::vectors(x.len(), 1), x);
    layers.iter().fold(x, |x, &(weight, bias, curve)| graph.linear(x, weight, bias, curve))
}

/// The layers whose arrays bear `prefix`, and a pass through them.
fn load(net: &NetModel, prefix: &str) -> (Graph<f32>, Vec<Layer>) {
    let activation = activations().build(&Part::new(&net.activation));
    let curve = activation.expect("networks name known activations").curve();
    let last = net.hidden.len();
    let mut params = Params::default();
    let mut layer = |(i, (n_in, n_out)): (usize, (usize, usize))| {
        let mut add = |name: &str, shape: Vec<usize>| {
            let name = format!("{prefix}{i}.{name}");
            let values = array(net, &name).to_vec();
            params.add(name, shape, values)
        };
        let (weight, bias) = (add("weight", vec![n_in, n_out]), add("bias", vec![n_out]));
        (weight, bias, if i < last { curve } else { Curve::Identity })
    };
    let layers = layer_shapes(&net.hidden).into_iter().enumerate().map(&mut layer).collect();
    (Graph::new(params), layers)
}

fn array<'a>(net: &'a NetModel, name: &str) -> &'a [f32] {
    let found = net.params.iter().find(|(n, ..)| n == name);
    found.map(|(.., values)| values.as_slice()).expect("networks have an array for every layer")
}

fn array_mut<'a>(net: &'a mut NetModel, name: &str) -> &'a mut Vec<f32> {
    let found = net.params.iter_mut().find(|(n, ..)| n == name);
    found.map(|(.., values)| values).expect("networks have an array for every layer")
}

fn singles(values: &[f64]) -> Vec<f32> {
    values.iter().map(|&x| f32::of(x)).collect()
}

#[cfg(test)]
mod tests {
    use dfdx::prelude::{
        Axis, Backward as _, BroadcastTo as _, Cpu, Gradients, MeanTo as _, OwnedTape, Tensor,
        TensorFromVec as _, Trace as _, TryMatMul as _,
    };

    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::sync::{Mutex, PoisonError};

    use ivx_op::Progress;

    use super::*;
    use crate::nn::net::nets;
    use crate::nn::optimiser::optimisers;
    use crate::registry;

    fn net(activation: &str, hidden: &[i64]) -> NetModel {
        let part = Part::new("mlp")
            .with("hidden", hidden.to_vec())
            .with("activation", Part::new(activation));
        let net = nets().build(&registry().complete(&part)).unwrap();
        net.init(&mut Ctx::new("train", 5, None).rng("init", &[]))
    }

    fn waves() -> Dataset {
        let x: Vec<f64> = (0..7).map(|i| f64::from(i) / 3.0 - 1.0).collect();
        Dataset { y: x.iter().map(|x| (3.0 * x).sin()).collect(), x }
    }

    /// The gradient of half the mean squared error, by array name.
    fn gradients(net: &NetModel, data: &Dataset) -> Vec<(String, Vec<f32>)> {
        let (graph, layers) = load(net, "");
        backward(&graph, &layers, &singles(&data.x), &singles(&data.y));
        let params = graph.params();
        let ids = layers.iter().flat_map(|(weight, bias, _)| [*weight, *bias]);
        let grad = |id| params.grad(id).expect("every layer learns").to_vec();
        params.arrays().iter().map(|param| param.name.clone()).zip(ids.map(grad)).collect()
    }

    #[test]
    fn a_network_by_hand() {
        // hidden relu: (2·x + 1, −x); out: 3 h_0 − h_1 + 0.5. At x = 1: 9 + 0 + 0.5; at −1: 0 − 1 + 0.5.
        let array = |name: &str, shape: &[usize], values: &[f32]| {
            (name.to_owned(), shape.to_vec(), values.to_vec())
        };
        let mut net = NetModel {
            hidden: vec![2],
            activation: "relu".into(),
            prior_scale: 0.0,
            params: vec![
                array("0.weight", &[1, 2], &[2.0, -1.0]),
                array("0.bias", &[2], &[1.0, 0.0]),
                array("1.weight", &[2, 1], &[3.0, -1.0]),
                array("1.bias", &[1], &[0.5]),
            ],
        };
        assert_eq!(predict(&net, &[1.0, -1.0]), [9.5, -0.5]);
        assert!(predict(&net, &[]).is_empty());

        // The same function again as its prior, at half the scale.
        let prior =
            net.params.iter().map(|(name, s, v)| (format!("prior.{name}"), s.clone(), v.clone()));
        net.params = net.params.iter().cloned().chain(prior).collect();
        net.prior_scale = 0.5;
        assert_eq!(predict(&net, &[1.0]), [14.25]);
    }

    /// In single precision a central difference with h = 1/64 is good to about 1e-3.
    #[test]
    fn gradients_agree_with_central_differences() {
        let data = waves();
        let loss = |net: &NetModel| {
            let errors =
                predict(net, &data.x).into_iter().zip(&data.y).map(|(f, y)| (f - y).powi(2));
            errors.sum::<f64>() / (2.0 * 7.0)
        };
        let h = 1.0 / 64.0;
        for (activation, hidden) in [("tanh", &[7, 6][..]), ("elu", &[9]), ("tanh", &[])] {
            let net = net(activation, hidden);
            for (name, gradient) in gradients(&net, &data) {
                for (i, g) in gradient.into_iter().enumerate() {
                    let shifted = |h: f32| {
                        let mut net = net.clone();
                        array_mut(&mut net, &name)[i] += h;
                        loss(&net)
                    };
                    let difference = (shifted(h) - shifted(-h)) / (2.0 * f64::from(h));
                    assert!(
                        (f64::from(g) - difference).abs() < 1e-3,
                        "{activation} {name}[{i}]: {g} and {difference}"
                    );
                }
            }
        }
    }

    /// Also a check of dfdx's own product, which is wrong without its `cpu` feature.
    #[test]
    fn the_fused_layer_agrees_with_dfdx_operations() {
        let (net, data) = (net("relu", &[8, 9]), waves());
        let device = Cpu::default();
        let column = |values: &[f64]| device.tensor_from_vec(singles(values), (values.len(), 1));
        let shapes = layer_shapes(&net.hidden);
        let tensors: Vec<_> = shapes
            .iter()
            .enumerate()
            .map(|(i, shape)| {
                let array = |name: &str| array(&net, &format!("{i}.{name}")).to_vec();
                let bias: Tensor<(usize,), f32, Cpu> =
                    device.tensor_from_vec(array("bias"), (shape.1,));
                (device.tensor_from_vec(array("weight"), *shape), bias)
            })
            .collect();
        let mut x: Tensor<(usize, usize), f32, Cpu, OwnedTape<f32, Cpu>> =
            column(&data.x).traced(Gradients::leaky());
        for (i, (weight, bias)) in tensors.iter().enumerate() {
            let product = x.matmul(weight.clone());
            let shape = (data.x.len(), shapes[i].1);
            let sum = product
                + bias.retaped::<OwnedTape<f32, Cpu>>().broadcast_like::<_, Axis<0>>(&shape);
            x = if i < 2 { sum.relu() } else { sum };
        }
        let theirs = ((x - column(&data.y)).square().mean() * 0.5).backward();
        let ours = gradients(&net, &data);
        for (i, (weight, bias)) in tensors.iter().enumerate() {
            for (ours, theirs) in [
                (&ours[2 * i].1, theirs.get(weight).as_vec()),
                (&ours[2 * i + 1].1, theirs.get(bias).as_vec()),
            ] {
                let distance =
                    ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(distance < 1e-6 && theirs.iter().any(|g| g.abs() > 1e-3), "layer {i}");
            }
        }
    }

    /// Keeps every state, and breaks off before one step.
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
            let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            kept.0 = Some(state);
            kept.1 += 1;
            assert!(kept.1 != 8, "broken off");
        }
    }

    #[test]
    fn a_training_that_was_broken_off_ends_in_the_same_bytes() {
        let (net, data) = (net("tanh", &[5, 4]), waves());
        let part =
            Part::new("adamw").with("lr", Part::new("linear").with("from", 0.1).with("to", 0.0));
        let optimiser = optimisers().build(&registry().complete(&part)).unwrap();
        let ctx = Ctx::new("train", 0, None);
        let fit = |ctx: &Ctx| fit(net.clone(), &data, &*optimiser, Pull::NONE, 20, ctx);
        let whole = fit(&ctx);
        let progress = BreakOff::default();
        let broken = catch_unwind(AssertUnwindSafe(|| fit(&ctx.keeping(&progress))));
        assert!(broken.is_err());
        progress.0.clear_poison();
        assert_eq!(fit(&ctx.keeping(&progress)), whole);
        // The first run kept states 0 to 7, the second went on from 7.
        assert_eq!(progress.0.lock().unwrap().1, 8 + 13);

        let other = self::net("tanh", &[5]);
        let fresh = super::fit(other.clone(), &data, &*optimiser, Pull::NONE, 20, &ctx);
        let foreign =
            super::fit(other, &data, &*optimiser, Pull::NONE, 20, &ctx.keeping(&progress));
        assert_eq!(foreign, fresh, "the state of another network is left alone");
    }

    #[test]
    fn dfdx_multiplies_matrices() {
        // (1 2; 3 4)(5 6; 7 8)
        let matrix = |values: [f32; 4]| -> Tensor<(usize, usize), f32, Cpu> {
            Cpu::default().tensor_from_vec(values.to_vec(), (2, 2))
        };
        let product = matrix([1.0, 2.0, 3.0, 4.0]).matmul(matrix([5.0, 6.0, 7.0, 8.0]));
        assert_eq!(product.as_vec(), [19.0, 22.0, 43.0, 50.0]);
    }
}
