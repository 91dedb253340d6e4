//! Training and evaluating networks.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use dfdx::prelude::{
    AsArray, Backward, Cpu, Gradients, MeanTo as _, Tape, TensorFromVec as _, Trace as _,
};
use ivx_op::{Ctx, Data, Part, Tensors};

use super::activation::{Activation, activations};
use super::dense::{Batch, Dense, dense};
use super::net::layer_shapes;
use super::optim::{Moments, Pull};
use super::optimiser::{Optimiser, Step};
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
    let mut layers = load(&net, "");
    let moments = |n: &[f32]| Moments::zeros(n.len());
    let mut moments: Vec<_> =
        layers.iter().map(|layer| (moments(&layer.weight), moments(&layer.bias))).collect();
    let (x, y) = (column(&data.x), column(&data.y));
    let state = ctx.resume().and_then(|bytes| restore(&bytes, &mut layers, &mut moments));
    for t in state.unwrap_or(0)..steps {
        ctx.checkpoint(|| keep(t, &layers, &moments));
        let step = Step { t, total: steps, pull };
        backward(&layers, &x, &y);
        for (layer, (of_weight, of_bias)) in layers.iter_mut().zip(&mut moments) {
            let layer = Rc::get_mut(layer).expect("the tape is spent");
            let (weight_grad, bias_grad) = layer.grads.get_mut();
            optimiser.update(&step, &mut layer.weight, weight_grad, of_weight);
            optimiser.update(&step, &mut layer.bias, bias_grad, of_bias);
        }
    }
    for (i, layer) in layers.iter().enumerate() {
        array_mut(&mut net, &format!("{i}.weight")).clone_from(&layer.weight);
        array_mut(&mut net, &format!("{i}.bias")).clone_from(&layer.bias);
    }
    net
}

/// The running averages of a layer's weights and of its biases.
type Averages = (Moments<f32>, Moments<f32>);

/// The kind of a training that is not done.
const UNFINISHED: &str = "Unfinished";

/// A training before step `t`, as bytes.
fn keep(t: u64, layers: &[Rc<Dense>], moments: &[Averages]) -> Vec<u8> {
    let mut arrays = BTreeMap::new();
    let mut put = |name: String, values: &[f32]| {
        arrays.insert(name, Data::F32(vec![values.len()], values.to_vec()));
    };
    for (i, (layer, (of_weight, of_bias))) in layers.iter().zip(moments).enumerate() {
        for (part, values, moments) in
            [("weight", &layer.weight, of_weight), ("bias", &layer.bias, of_bias)]
        {
            put(format!("{i}.{part}"), values);
            put(format!("{i}.{part}.first"), &moments.first);
            put(format!("{i}.{part}.second"), &moments.second);
        }
    }
    Tensors { arrays }.encode(UNFINISHED, &t)
}

/// The step that a training goes on with; `None`, and nothing changed, if the bytes are not of one
/// of these layers.
fn restore(bytes: &[u8], layers: &mut [Rc<Dense>], moments: &mut [Averages]) -> Option<u64> {
    let (mut tensors, t): (_, u64) = Tensors::decode(UNFINISHED, bytes)?;
    let mut take = |name: String, n: usize| {
        tensors.f32(&name).map(|(_, values)| values).filter(|values| values.len() == n)
    };
    let mut read = Vec::new();
    for (i, layer) in layers.iter().enumerate() {
        for (part, n) in [("weight", layer.weight.len()), ("bias", layer.bias.len())] {
            let first = take(format!("{i}.{part}.first"), n)?;
            let second = take(format!("{i}.{part}.second"), n)?;
            read.push((take(format!("{i}.{part}"), n)?, Moments { first, second }));
        }
    }
    let mut read = read.into_iter();
    for (layer, (of_weight, of_bias)) in layers.iter_mut().zip(moments) {
        let layer = Rc::get_mut(layer).expect("there is no tape yet");
        (layer.weight, *of_weight) = read.next()?;
        (layer.bias, *of_bias) = read.next()?;
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
    let x = column(xs);
    let outputs =
        |prefix| forward(x.clone(), &load(net, prefix)).as_vec().into_iter().map(f64::from);
    if net.prior_scale == 0.0 {
        return outputs("").collect();
    }
    outputs("").zip(outputs("prior.")).map(|(f, prior)| f + net.prior_scale * prior).collect()
}

/// Half the mean squared error; its gradients are left in the layers.
fn backward(layers: &[Rc<Dense>], x: &Batch, y: &Batch) -> f32 {
    let outputs = forward(x.clone().traced(Gradients::leaky()), layers);
    let loss = (outputs - y.clone()).square().mean() * 0.5;
    let value = loss.array();
    loss.backward();
    value
}

fn forward<T: Tape<f32, Cpu>>(x: Batch<T>, layers: &[Rc<Dense>]) -> Batch<T> {
    layers.iter().fold(x, dense)
}

/// The layers whose arrays bear `prefix`.
fn load(net: &NetModel, prefix: &str) -> Vec<Rc<Dense>> {
    let activation = activations().build(&Part::new(&net.activation));
    let activation: Rc<dyn Activation> =
        activation.expect("networks name known activations").into();
    let last = net.hidden.len();
    let layer = |(i, (n_in, n_out)): (usize, (usize, usize))| {
        let array = |name| array(net, &format!("{prefix}{i}.{name}")).to_vec();
        Rc::new(Dense {
            weight: array("weight"),
            bias: array("bias"),
            activation: (i < last).then(|| Rc::clone(&activation)),
            passes_gradient: i > 0,
            grads: RefCell::new((vec![0.0; n_in * n_out], vec![0.0; n_out])),
        })
    };
    layer_shapes(&net.hidden).into_iter().enumerate().map(layer).collect()
}

fn array<'a>(net: &'a NetModel, name: &str) -> &'a [f32] {
    let found = net.params.iter().find(|(n, ..)| n == name);
    found.map(|(.., values)| values.as_slice()).expect("networks have an array for every layer")
}

fn array_mut<'a>(net: &'a mut NetModel, name: &str) -> &'a mut Vec<f32> {
    let found = net.params.iter_mut().find(|(n, ..)| n == name);
    found.map(|(.., values)| values).expect("networks have an array for every layer")
}

#[expect(clippy::cast_possible_truncation, reason = "networks compute in single precision")]
fn column(values: &[f64]) -> Batch {
    let singles = values.iter().map(|&x| x as f32).collect();
    Cpu::default().tensor_from_vec(singles, (values.len(), 1))
}

#[cfg(test)]
mod tests {
    use dfdx::prelude::{Axis, BroadcastTo as _, OwnedTape, Tensor, TryMatMul as _};

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
        let layers = load(net, "");
        backward(&layers, &column(&data.x), &column(&data.y));
        let both = layers.iter().enumerate().flat_map(|(i, layer)| {
            let (weight, bias) = layer.grads.borrow().clone();
            [(format!("{i}.weight"), weight), (format!("{i}.bias"), bias)]
        });
        both.collect()
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
        let layers = load(&net, "");
        let tensors: Vec<_> = layers
            .iter()
            .zip(layer_shapes(&net.hidden))
            .map(|(layer, shape)| {
                let bias: Tensor<(usize,), f32, Cpu> =
                    device.tensor_from_vec(layer.bias.clone(), (shape.1,));
                (device.tensor_from_vec(layer.weight.clone(), shape), bias)
            })
            .collect();
        let mut x: Batch<OwnedTape<f32, Cpu>> = column(&data.x).traced(Gradients::leaky());
        for (i, (weight, bias)) in tensors.iter().enumerate() {
            let product = x.matmul(weight.clone());
            let shape = (data.x.len(), layer_shapes(&net.hidden)[i].1);
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
        let fit = |ctx: &Ctx| fit(net.clone(), &data, &*optimiser, Pull::default(), 20, ctx);
        let whole = fit(&ctx);
        let progress = BreakOff::default();
        let broken = catch_unwind(AssertUnwindSafe(|| fit(&ctx.keeping(&progress))));
        assert!(broken.is_err());
        progress.0.clear_poison();
        assert_eq!(fit(&ctx.keeping(&progress)), whole);
        // The first run kept states 0 to 7, the second went on from 7.
        assert_eq!(progress.0.lock().unwrap().1, 8 + 13);

        let other = self::net("tanh", &[5]);
        let fresh = super::fit(other.clone(), &data, &*optimiser, Pull::default(), 20, &ctx);
        let foreign =
            super::fit(other, &data, &*optimiser, Pull::default(), 20, &ctx.keeping(&progress));
        assert_eq!(foreign, fresh, "the state of another network is left alone");
    }

    #[test]
    fn dfdx_multiplies_matrices() {
        // (1 2; 3 4)(5 6; 7 8)
        let matrix =
            |values: [f32; 4]| -> Batch { Cpu::default().tensor_from_vec(values.to_vec(), (2, 2)) };
        let product = matrix([1.0, 2.0, 3.0, 4.0]).matmul(matrix([5.0, 6.0, 7.0, 8.0]));
        assert_eq!(product.as_vec(), [19.0, 22.0, 43.0, 50.0]);
    }
}
