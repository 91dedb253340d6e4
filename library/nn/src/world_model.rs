//! Learned models of environments.

use std::collections::BTreeMap;

use ivx_op::{Artifact, Data, Tensors};
use serde::{Deserialize, Serialize};

use crate::Module;

/// A learned model of a finite environment that moves in a latent space (Figure 2.9).
#[derive(Clone, Debug, PartialEq)]
pub struct WorldModel {
    /// What it is a model of, and its networks.
    pub layout: Layout,
    /// Their arrays, such as `dynamics.0.weight`, by name: name, shape, values.
    pub params: Vec<(String, Vec<usize>, Vec<f32>)>,
}

/// What a world model is a model of, and its networks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layout {
    /// How many states the environment has; a state goes in as a vector with a 1 in its place. 1 where a state is a
    /// number, which goes in itself.
    pub n_states: usize,
    /// What its actions are called; an action goes in likewise, behind a latent state. None in a reward process.
    pub actions: Vec<String>,
    /// How many numbers a latent state has.
    pub latent: usize,
    /// The networks by name: `representation`, `dynamics`, `reward`, and `reconstruction` or `value` and `policy`.
    pub nets: BTreeMap<String, Module>,
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

    /// Whether every network takes what goes in and gives what should come out, of arrays of these shapes.
    fn is_sound(&self, params: &[(String, Vec<usize>, Vec<f32>)]) -> bool {
        let mut wanted: Vec<(String, Vec<usize>)> = Vec::new();
        for (name, module) in &self.nets {
            let Some((inputs, outputs)) = self.widths(name) else { return false };
            let shape = [1, inputs];
            let shape = if module.takes_steps() { &shape[..] } else { &shape[1..] };
            if module.output(shape).ok() != Some(vec![outputs]) {
                return false;
            }
            let arrays = module.arrays().into_iter();
            wanted.extend(arrays.map(|array| (format!("{name}.{}", array.name), array.shape)));
        }
        wanted.sort();
        let found = params.iter().map(|(name, shape, _)| (name, shape));
        wanted.iter().map(|(name, shape)| (name, shape)).eq(found)
    }
}

impl Artifact for WorldModel {
    const KIND: &'static str = "WorldModel";

    fn encode(&self) -> Vec<u8> {
        let arrays = self.params.iter().cloned();
        let arrays = arrays.map(|(name, shape, values)| (name, Data::F32(shape, values)));
        Tensors { arrays: arrays.collect() }.encode(Self::KIND, &self.layout)
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (tensors, layout) = Tensors::decode::<Layout>(Self::KIND, bytes)?;
        let params = tensors.arrays.into_iter().map(|(name, data)| match data {
            Data::F32(shape, values) => Some((name, shape, values)),
            _ => None,
        });
        let params: Vec<_> = params.collect::<Option<_>>()?;
        layout.is_sound(&params).then_some(Self { layout, params })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Curve;

    #[test]
    fn a_model_survives_the_round_trip_and_one_of_other_sizes_is_none() {
        let value = Module::Dense { inputs: 2, outputs: 1, curve: Curve::Identity };
        let layout = Layout {
            n_states: 3,
            actions: vec!["GO".into()],
            latent: 2,
            nets: [("value".to_owned(), value.clone())].into(),
        };
        let array = |name: &str, shape: Vec<usize>| {
            let values = vec![0.5; shape.iter().product()];
            (name.to_owned(), shape, values)
        };
        let params = vec![array("value.bias", vec![1]), array("value.weight", vec![2, 1])];
        let model = WorldModel { layout, params };
        assert_eq!(WorldModel::decode(&model.encode()), Some(model.clone()));

        let mut other = model.clone();
        other.params.pop();
        assert_eq!(WorldModel::decode(&other.encode()), None);
        let mut other = model.clone();
        other.layout.latent = 3;
        assert_eq!(WorldModel::decode(&other.encode()), None);
        let mut other = model;
        other.layout.nets.insert("guess".into(), value);
        assert_eq!(WorldModel::decode(&other.encode()), None);
    }
}
