//! Networks before training.

use std::collections::BTreeSet;
use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Part, Parts, declare, family};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::activation::{Activation, activations};
use crate::artifact::NetModel;

/// The architecture of a network.
pub trait Net: Debug + Send + Sync {
    /// A network whose parameters are drawn from `rng`.
    fn init(&self, rng: &mut ChaCha8Rng) -> NetModel;

    /// How many parameters it has.
    fn n_params(&self) -> u64;

    /// How many numbers its layers put out for one input.
    fn n_outputs(&self) -> u64;
}

declare! {
    /// A multi-layer perceptron from a scalar to a scalar (Eqn. 2.19).
    ///
    /// Weights and biases start uniform within `±1/√n`, where `n` is the number of the layer's
    /// inputs.
    pub struct Mlp = "mlp" @ 1, stochastic {
        /// Widths of the hidden layers; none for a straight line.
        hidden: Vec<usize> = vec![64_i64, 64], in 1.0..;
        /// What follows each hidden layer.
        activation: Box<dyn Activation> = Part::new("tanh");
    }
}

impl Net for Mlp {
    fn init(&self, rng: &mut ChaCha8Rng) -> NetModel {
        let mut params = Vec::new();
        for (i, (n_in, n_out)) in layer_shapes(&self.hidden).into_iter().enumerate() {
            #[expect(clippy::cast_precision_loss, reason = "widths are far below 2^24")]
            let bound = 1.0 / (n_in as f32).sqrt();
            let mut draw = |n| (0..n).map(|_| bound * (2.0 * rng.random::<f32>() - 1.0)).collect();
            params.push((format!("{i}.weight"), vec![n_in, n_out], draw(n_in * n_out)));
            params.push((format!("{i}.bias"), vec![n_out], draw(n_out)));
        }
        // By name, as they come back from a file.
        params.sort_by(|(a, ..), (b, ..)| a.cmp(b));
        let activation = self.activation.name().to_owned();
        NetModel { hidden: self.hidden.clone(), activation, prior_scale: 0.0, params }
    }

    fn n_params(&self) -> u64 {
        layer_shapes(&self.hidden).iter().map(|(n_in, n_out)| ((n_in + 1) * n_out) as u64).sum()
    }

    fn n_outputs(&self) -> u64 {
        layer_shapes(&self.hidden).iter().map(|(_, n_out)| *n_out as u64).sum()
    }
}

/// Inputs and outputs of every layer, from the scalar that goes in to the one that comes out.
pub(super) fn layer_shapes(hidden: &[usize]) -> Vec<(usize, usize)> {
    let widths = [&[1], hidden, &[1]].concat();
    widths.windows(2).map(|pair| (pair[0], pair[1])).collect()
}

/// Whether a network that others wrote can be evaluated.
///
/// # Errors
/// What is wrong with it.
pub fn check(net: &NetModel) -> Result<(), String> {
    let activations: Vec<&str> = activations().names().collect();
    if !activations.contains(&net.activation.as_str()) {
        let known = activations.join(", ");
        return Err(format!("its activation is one of {known}, and not {:?}", net.activation));
    }
    let prefixes = if net.prior_scale == 0.0 { &[""][..] } else { &["", "prior."] };
    let mut known = BTreeSet::new();
    for prefix in prefixes {
        for (i, (n_in, n_out)) in layer_shapes(&net.hidden).into_iter().enumerate() {
            for (what, shape) in [("weight", &[n_in, n_out][..]), ("bias", &[n_out])] {
                let name = format!("{prefix}{i}.{what}");
                if !net.params.iter().any(|(own, found, _)| *own == name && found == shape) {
                    return Err(format!("the array `{name}` of shape {shape:?} is not there"));
                }
                known.insert(name);
            }
        }
    }
    match net.params.iter().find(|(name, ..)| !known.contains(name)) {
        Some((name, ..)) => Err(format!("the array `{name}` belongs to no layer")),
        None => Ok(()),
    }
}

/// The networks, by name.
pub(crate) fn nets() -> &'static Parts<dyn Net> {
    static TABLE: LazyLock<Parts<dyn Net>> =
        LazyLock::new(|| Parts::<dyn Net>::new().with(|x: Mlp| Box::new(x)));
    &TABLE
}

family!(dyn Net, "Net", nets);

#[cfg(test)]
mod tests {
    use ivx_op::{Artifact as _, Ctx};

    use super::*;
    use crate::artifact::Model;
    use crate::nn::activation::Relu;

    fn init(hidden: &[usize], seed: i64) -> NetModel {
        let ctx = Ctx::new("train", seed, None);
        let mlp = Mlp { hidden: hidden.to_vec(), activation: Box::new(Relu {}) };
        mlp.init(&mut ctx.rng("init", &[]))
    }

    #[test]
    fn arrays_have_the_shapes_of_the_layers() {
        let shapes = |net: NetModel| -> Vec<_> {
            net.params.into_iter().map(|(name, shape, _)| (name, shape)).collect()
        };
        let named = |name: &str, shape: &[usize]| (name.to_owned(), shape.to_vec());
        assert_eq!(shapes(init(&[], 0)), [named("0.bias", &[1]), named("0.weight", &[1, 1])]);
        assert_eq!(
            shapes(init(&[3], 0)),
            [
                named("0.bias", &[3]),
                named("0.weight", &[1, 3]),
                named("1.bias", &[1]),
                named("1.weight", &[3, 1]),
            ]
        );
    }

    #[test]
    fn draws_fill_the_interval_and_follow_the_stream() {
        let net = init(&[400], 0);
        for (name, bound) in [("0.weight", 1.0), ("1.weight", 0.05)] {
            let (.., values) = net.params.iter().find(|(n, ..)| n == name).unwrap();
            let largest = values.iter().fold(0.0_f32, |max, x| max.max(x.abs()));
            assert!(0.95 * bound < largest && largest <= bound, "{name}");
            assert!(values.iter().any(|x| *x < -0.9 * bound));
        }
        assert_eq!(net, init(&[400], 0));
        assert_ne!(net, init(&[400], 1));
    }

    #[test]
    fn a_network_survives_the_round_trip() {
        let net = Model::Net(init(&[2, 3], 0));
        assert_eq!(Model::decode(&net.encode()), Some(net));
    }
}
