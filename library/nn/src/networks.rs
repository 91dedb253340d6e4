//! Networks by name, as plain data: what is stored, trained and acted with.

use std::collections::BTreeMap;

use ivx_op::{Data, Tensors};
use rand_chacha::ChaCha8Rng;

use crate::Module;
use crate::module::Start;

/// A named array: its name, its shape and its numbers, last dimension fastest.
pub type Named = (String, Vec<usize>, Vec<f32>);

/// Networks by name, and their arrays.
///
/// The arrays of the network `torso` are called `torso.0.weight` and so on; those of a network without a name are
/// called as its layers are. Arrays of no network, such as the weights of features, have names of their own.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Networks {
    /// The layers of each.
    pub modules: BTreeMap<String, Module>,
    /// All arrays, by name.
    pub arrays: Vec<Named>,
}

impl Networks {
    /// Networks with arrays drawn from `rng`, one network after the other by name.
    #[must_use]
    pub fn drawn(modules: BTreeMap<String, Module>, rng: &mut ChaCha8Rng) -> Self {
        let mut arrays = Vec::new();
        for (net, module) in &modules {
            arrays.extend(module.arrays().into_iter().map(|array| {
                let n = array.shape.iter().product();
                (joined(net, &array.name), array.shape, array.start.draw(n, rng))
            }));
        }
        // By name, as they come back from a file.
        arrays.sort_by(|(a, ..), (b, ..)| a.cmp(b));
        Self { modules, arrays }
    }

    /// Adds an array.
    pub fn put(&mut self, array: Named) {
        let place = self.arrays.partition_point(|(other, ..)| *other < array.0);
        self.arrays.insert(place, array);
    }

    /// Adds those of others, whose network without a name is called `name`.
    pub fn add(&mut self, name: &str, others: Self) {
        let modules = others.modules.into_iter();
        self.modules.extend(modules.map(|(net, module)| (joined(name, &net), module)));
        for (array, shape, values) in others.arrays {
            self.put((joined(name, &array), shape, values));
        }
    }

    /// The same with an array of no network.
    #[must_use]
    pub fn with(
        mut self,
        name: &str,
        shape: Vec<usize>,
        start: Start,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let values = start.draw(shape.iter().product(), rng);
        self.put((name.to_owned(), shape, values));
        self
    }

    /// The array of a name.
    #[must_use]
    pub fn array(&self, name: &str) -> Option<&Named> {
        let place = self.arrays.binary_search_by(|(other, ..)| other.as_str().cmp(name)).ok()?;
        Some(&self.arrays[place])
    }

    /// Whether every layer has its array.
    #[must_use]
    pub fn are_whole(&self) -> bool {
        self.modules.iter().all(|(net, module)| {
            module.arrays().into_iter().all(|array| {
                let found = self.array(&joined(net, &array.name));
                found.is_some_and(|(_, shape, _)| *shape == array.shape)
            })
        })
    }

    /// Whether every layer has its array, and every array its layer.
    #[must_use]
    pub fn are_exact(&self) -> bool {
        let known = self.modules.values().flat_map(Module::arrays).count();
        self.are_whole() && known == self.arrays.len()
    }

    /// Whether all numbers are some.
    #[must_use]
    pub fn are_finite(&self) -> bool {
        self.arrays.iter().all(|(.., values)| values.iter().all(|x| x.is_finite()))
    }

    /// The arrays as those of an artifact.
    #[must_use]
    pub fn tensors(&self) -> Tensors {
        let arrays = self.arrays.iter().cloned();
        let arrays = arrays.map(|(name, shape, values)| (name, Data::F32(shape, values)));
        Tensors { arrays: arrays.collect() }
    }

    /// Networks with the arrays of an artifact; `None` if these are no numbers in single precision.
    #[must_use]
    pub fn of(modules: BTreeMap<String, Module>, tensors: Tensors) -> Option<Self> {
        let arrays = tensors.arrays.into_iter().map(|(name, data)| match data {
            Data::F32(shape, values) => Some((name, shape, values)),
            _ => None,
        });
        Some(Self { modules, arrays: arrays.collect::<Option<_>>()? })
    }
}

/// What an array of a network is called.
#[must_use]
pub fn joined(net: &str, array: &str) -> String {
    match (net, array) {
        ("", name) | (name, "") => name.to_owned(),
        _ => format!("{net}.{array}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Curve;
    use rand::SeedableRng as _;

    #[test]
    fn networks_are_found_by_name_and_come_back_from_their_tensors() {
        let dense = |inputs| Module::Dense { inputs, outputs: 2, curve: Curve::Identity };
        let modules = BTreeMap::from([("q".to_owned(), dense(3)), (String::new(), dense(1))]);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let nets = Networks::drawn(modules.clone(), &mut rng);
        let nets = nets.with("bias2", vec![2], Start::Constant(0.5), &mut rng);
        let names: Vec<&str> = nets.arrays.iter().map(|(name, ..)| name.as_str()).collect();
        assert_eq!(names, ["bias", "bias2", "q.bias", "q.weight", "weight"]);
        assert_eq!(nets.array("bias2").unwrap().2, [0.5, 0.5]);
        assert!(nets.are_whole() && nets.are_finite() && nets.array("q").is_none());
        assert_eq!(Networks::of(modules, nets.tensors()), Some(nets.clone()));
        let mut fewer = nets;
        fewer.arrays.remove(3);
        assert!(!fewer.are_whole());
    }
}
