//! The states of an environment as a model sees them.

use ivx_nn::WorldModel;
use ivx_nn::{Live, Shape};
use ivx_op::{Array, Ctx, Dim, Labels, One, Op, OpError, declare};

use super::hot;

declare! {
    /// The latent state that a world model makes of each state (Figure 2.9a).
    pub struct LatentStates = "latent_states" @ 1 -> Array [state, latent] {
        /// The model.
        of: One<WorldModel>;
    }
}

impl Op for LatentStates {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let layout = &self.of.layout;
        if layout.actions.is_empty() {
            let why = "the model is of a process whose states can't be listed";
            return Err(OpError::Failed(why.to_owned()));
        }
        let live = Live::of(&self.of.nets);
        let graph = &live.graph;
        let mut states = Vec::new();
        for state in 0..layout.n_states {
            hot(state, layout.n_states, &mut states);
        }
        let states = graph.input(Shape::vectors(layout.n_states, layout.n_states), &states);
        let latent = graph.still(|| live.body("representation").of(graph, states));
        let dim = |name, n| Dim::new(name, Labels::count(n));
        Ok(Array {
            dims: vec![dim("state", layout.n_states), dim("latent", layout.latent)],
            values: graph.value(latent).into_iter().map(f64::from).collect(),
        })
    }
}
