//! Learned models of environments.

use std::collections::BTreeMap;

use ivx_op::{Artifact, Tensors};
use serde::{Deserialize, Serialize};

use crate::{Module, Networks};

/// A learned model of a finite environment that moves in a latent space (Figure 2.9).
#[derive(Clone, Debug, PartialEq)]
pub struct WorldModel {
    /// What it is a model of.
    pub layout: Layout,
    /// The networks by name: `representation`, `dynamics`, `reward`, and `reconstruction` or `value` and `policy`.
    pub nets: Networks,
}

/// What a world model is a model of.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// How many states the environment has; a state goes in as a vector with a 1 in its place. 1 where a state is a
    /// number, which goes in itself.
    pub n_states: usize,
    /// What its actions are called; an action goes in likewise, behind a latent state. None in a reward process.
    pub actions: Vec<String>,
    /// How many numbers a latent state has.
    pub latent: usize,
}

/// What is stored of it besides arrays.
#[derive(Serialize, Deserialize)]
struct Facts {
    n_states: usize,
    actions: Vec<String>,
    latent: usize,
    nets: BTreeMap<String, Module>,
}

impl Layout {
    /// How many numbers go into a network, and how many come out; `None` if there is none of this name.
    #[must_use]
    pub fn widths(&self, net: &str) -> Option<(usize, usize)> {
        let moved = self.latent + self.actions.len();
        Some(match net {
            "representation" => (self.n_states, self.latent),
            "reconstruction" => (self.latent, self.n_states),
            "dynamics" => (moved, self.latent),
            "reward" => (moved, 1),
            "value" => (self.latent, 1),
            "policy" => (self.latent, self.actions.len()),
            _ => return None,
        })
    }

    /// Whether every network takes what goes in and gives what should come out.
    fn fits(&self, nets: &Networks) -> bool {
        nets.modules.iter().all(|(name, module)| {
            let Some((inputs, outputs)) = self.widths(name) else { return false };
            let shape = [1, inputs];
            let shape = if module.takes_steps() { &shape[..] } else { &shape[1..] };
            module.output(shape).ok() == Some(vec![outputs])
        })
    }
}

impl Artifact for WorldModel {
    const KIND: &'static str = "WorldModel";

    fn encode(&self) -> Vec<u8> {
        let Layout { n_states, actions, latent } = self.layout.clone();
        let nets = self.nets.modules.clone();
        self.nets.tensors().encode(Self::KIND, &Facts { n_states, actions, latent, nets })
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (tensors, facts) = Tensors::decode::<Facts>(Self::KIND, bytes)?;
        let Facts { n_states, actions, latent, nets } = facts;
        let (layout, nets) = (Layout { n_states, actions, latent }, Networks::of(nets, tensors)?);
        (nets.are_whole() && layout.fits(&nets)).then_some(Self { layout, nets })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Curve;

    #[test]
    fn a_model_survives_the_round_trip_and_one_of_other_sizes_is_none() {
        let value = Module::Dense { inputs: 2, outputs: 1, curve: Curve::Identity };
        let layout = Layout { n_states: 3, actions: vec!["GO".into()], latent: 2 };
        let array = |name: &str, shape: Vec<usize>| {
            let values = vec![0.5; shape.iter().product()];
            (name.to_owned(), shape, values)
        };
        let arrays = vec![array("value.bias", vec![1]), array("value.weight", vec![2, 1])];
        let modules = [("value".to_owned(), value.clone())].into();
        let model = WorldModel { layout, nets: Networks { modules, arrays } };
        assert_eq!(WorldModel::decode(&model.encode()), Some(model.clone()));

        let mut other = model.clone();
        other.nets.arrays.pop();
        assert_eq!(WorldModel::decode(&other.encode()), None);
        let mut other = model.clone();
        other.layout.latent = 3;
        assert_eq!(WorldModel::decode(&other.encode()), None);
        let mut other = model;
        other.nets.modules.insert("guess".into(), value);
        assert_eq!(WorldModel::decode(&other.encode()), None);
    }
}
