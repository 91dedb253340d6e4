//! The best action under one model.

use ivx_data::Decision;
use ivx_data::form::model_of_pairs;
use ivx_nn::Model;
use ivx_op::{Ctx, One, Op, OpError, declare};
use ivx_world::Points;

use super::choose;

declare! {
    /// The action of the highest predicted reward under one model; the first where several have it.
    pub struct Greedy = "greedy" @ 2 -> Decision {
        /// The model.
        model: One<Model>;
        /// The actions to choose from.
        among: Box<dyn Points>;
    }
    rule model_of_pairs;
}

impl Op for Greedy {
    fn run(&self, _: &Ctx) -> Result<Decision, OpError> {
        let candidates = self.among.places()?;
        let scores = self.model.rewards(&candidates)?;
        choose(candidates, &scores)
    }
}
