//! What a model predicts.

use ivx_data::form::model_of_pairs;
use ivx_nn::Model;
use ivx_op::{Array, Ctx, One, Op, OpError, declare};
use ivx_world::{Points, curve};

declare! {
    /// The reward a model predicts for each action.
    pub struct Predict = "predict" @ 2 -> Array [x] {
        /// The model.
        model: One<Model>;
        /// The actions.
        at: Box<dyn Points>;
    }
    rule model_of_pairs;
}

impl Op for Predict {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let points = self.at.points()?;
        let values = self.model.rewards(&points)?;
        Ok(curve(points, values))
    }
}
