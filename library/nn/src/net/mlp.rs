//! Multi-layer perceptrons.

use ivx_data::Misfit;
use ivx_op::{Part, declare};

use super::Net;
use crate::activation::Activation;
use crate::module::{Module, vectors};

declare! {
    /// A multi-layer perceptron (Eqn. 2.19), for numbers, vectors and every step of sequences.
    ///
    /// Weights and biases of linear maps and convolutions start uniform within `±1/√n`, where `n` is
    /// how many numbers go into one that comes out.
    pub struct Mlp = "mlp" @ 1 {
        /// Widths of the hidden layers; none for a straight line.
        hidden: Vec<usize> = vec![64_i64, 64], in 1.0..=1e6;
        /// What follows each hidden layer.
        activation: Box<dyn Activation> = Part::new("tanh");
    }
}

impl Net for Mlp {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        let (_, mut inputs) = vectors("`mlp`", input)?;
        let curve = self.activation.curve();
        let layers = self.hidden.iter().map(|&outputs| {
            let inputs = std::mem::replace(&mut inputs, outputs);
            Module::Dense { inputs, outputs, curve }
        });
        Ok(Module::Sequence(layers.collect()))
    }
}
