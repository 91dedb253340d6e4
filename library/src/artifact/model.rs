//! Learned functions of a scalar.

use ivx_op::{Artifact, Data, Tensors};
use serde::{Deserialize, Serialize};

/// A learned function of a scalar.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// `θ_0 + θ_1 a + … + θ_d a^d` (Eqn. 2.18b).
    Polynomial(Vec<f64>),
    /// A neural network.
    Net(NetModel),
}

/// A neural network as plain named arrays, with what is needed to run it.
#[derive(Clone, Debug, PartialEq)]
pub struct NetModel {
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// The name of the activation between layers.
    pub activation: String,
    /// How much the fixed prior network adds; 0 without one.
    pub prior_scale: f64,
    /// Arrays such as `0.weight` (`[in, out]`), `0.bias`, `prior.0.weight`: name, shape, values.
    pub params: Vec<(String, Vec<usize>, Vec<f32>)>,
}

#[derive(Serialize, Deserialize)]
enum Facts {
    Polynomial,
    Net { hidden: Vec<usize>, activation: String, prior_scale: f64 },
}

impl Model {
    /// The function's values at `xs`.
    #[must_use]
    pub fn predict(&self, xs: &[f64]) -> Vec<f64> {
        match self {
            Self::Polynomial(theta) => {
                xs.iter().map(|x| theta.iter().rev().fold(0.0, |sum, c| sum * x + c)).collect()
            }
            Self::Net(net) => crate::nn::predict(net, xs),
        }
    }
}

impl Artifact for Model {
    const KIND: &'static str = "Model";

    fn encode(&self) -> Vec<u8> {
        match self {
            Self::Polynomial(theta) => {
                let theta = Data::F64(vec![theta.len()], theta.clone());
                Tensors { arrays: [("theta".to_owned(), theta)].into() }
                    .encode(Self::KIND, &Facts::Polynomial)
            }
            Self::Net(net) => {
                let facts = Facts::Net {
                    hidden: net.hidden.clone(),
                    activation: net.activation.clone(),
                    prior_scale: net.prior_scale,
                };
                let arrays = net.params.iter().cloned();
                let arrays = arrays.map(|(name, shape, values)| (name, Data::F32(shape, values)));
                Tensors { arrays: arrays.collect() }.encode(Self::KIND, &facts)
            }
        }
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, facts) = Tensors::decode::<Facts>(Self::KIND, bytes)?;
        match facts {
            Facts::Polynomial => tensors.f64("theta").map(|(_, theta)| Self::Polynomial(theta)),
            Facts::Net { hidden, activation, prior_scale } => {
                let params = tensors.arrays.into_iter().map(|(name, data)| match data {
                    Data::F32(shape, values) => Some((name, shape, values)),
                    _ => None,
                });
                let params = params.collect::<Option<_>>()?;
                Some(Self::Net(NetModel { hidden, activation, prior_scale, params }))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_survive_the_round_trip() {
        let net = NetModel {
            hidden: vec![2],
            activation: "tanh".into(),
            prior_scale: 0.5,
            params: vec![("0.weight".into(), vec![1, 2], vec![0.25, -1.0])],
        };
        for model in [Model::Polynomial(vec![1.0, -2.0]), Model::Net(net)] {
            assert_eq!(Model::decode(&model.encode()), Some(model));
        }
    }

    #[test]
    fn a_polynomial_is_evaluated_from_its_highest_power() {
        // 1 − 2·3 + 0.5·9 = −0.5
        assert_eq!(Model::Polynomial(vec![1.0, -2.0, 0.5]).predict(&[3.0]), [-0.5]);
    }
}
