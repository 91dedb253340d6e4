//! The networks of world models: before training, and on a graph.

use std::collections::BTreeMap;

use rand_chacha::ChaCha8Rng;

use super::graph::Graph;
use super::params::{ParamId, Params};
use super::world::{Body, Latent};
use crate::{Layout, WorldModel};

/// The networks of a layout with arrays drawn from `rng`.
#[must_use]
pub fn drawn(layout: Layout, rng: &mut ChaCha8Rng) -> WorldModel {
    let mut params = Vec::new();
    for (name, module) in &layout.nets {
        let arrays = module.arrays().into_iter().map(|array| {
            let n = array.shape.iter().product();
            (format!("{name}.{}", array.name), array.shape, array.start.draw(n, rng))
        });
        params.extend(arrays);
    }
    // By name, as they come back from a file.
    params.sort_by(|(a, ..), (b, ..)| a.cmp(b));
    WorldModel { layout, params }
}

/// The networks of a world model on a graph.
#[derive(Debug)]
pub struct Bodies<'a> {
    layout: &'a Layout,
    ids: BTreeMap<&'a str, Vec<ParamId>>,
}

impl<'a> Bodies<'a> {
    /// Those of a model, with the graph on which they are.
    ///
    /// # Panics
    /// If an array is missing.
    #[must_use]
    pub fn of(model: &'a WorldModel) -> (Graph<f32>, Self) {
        let mut params = Params::default();
        let mut ids = BTreeMap::new();
        for (name, module) in &model.layout.nets {
            let own = module.arrays().into_iter().map(|array| {
                let name = format!("{name}.{}", array.name);
                let found = model.params.iter().find(|(own, ..)| *own == name);
                let (.., values) = found.expect("there is an array for every layer");
                params.add(name, array.shape, values.clone())
            });
            ids.insert(name.as_str(), own.collect());
        }
        (Graph::new(params), Self { layout: &model.layout, ids })
    }

    /// The network of a name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<Body<'_>> {
        Some(Body { module: self.layout.nets.get(name)?, params: self.ids.get(name)? })
    }

    /// The network of a name that the model must have.
    ///
    /// # Panics
    /// If it has not.
    #[must_use]
    pub fn body(&self, name: &str) -> Body<'_> {
        self.get(name).unwrap_or_else(|| panic!("a model with the network `{name}`"))
    }

    /// Those that all have.
    ///
    /// # Panics
    /// If one is missing.
    #[must_use]
    pub fn latent(&self) -> Latent<'_> {
        Latent {
            representation: self.body("representation"),
            dynamics: self.body("dynamics"),
            reward: self.body("reward"),
        }
    }
}

/// Puts the arrays of a graph back into the model that they are of.
///
/// # Panics
/// If they are of another.
pub fn learned(graph: &Graph<f32>, model: &mut WorldModel) {
    for param in graph.params().arrays() {
        let found = model.params.iter_mut().find(|(name, ..)| *name == param.name);
        let (.., values) = found.expect("the graph was made of this model");
        values.clone_from(&param.value);
    }
}
