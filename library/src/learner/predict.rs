//! What a model predicts at places.

use ivx_data::form::{failed, model_of_pairs, wrong};
use ivx_nn::Model;
use ivx_op::{Array, Ctx, Facts, One, Op, OpError, Wrong, declare};
use ivx_world::{Points, curve};

use super::spread::{says_std, stds};

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

declare! {
    /// The standard deviation that a model says at each place: of a network trained under `gaussian_nll()`, or of a
    /// `mixture`.
    pub struct PredictStd = "predict_std" @ 1 -> Array [x] {
        /// The model.
        model: One<Model>;
        /// The places.
        at: Box<dyn Points>;
    }
    rule model_says_std;
}

fn model_says_std(facts: &Facts<'_>) -> Result<(), Wrong> {
    model_of_pairs(facts)?;
    facts.shapes("model").map_or(Ok(()), |model| says_std(model).map_err(wrong("model")))
}

impl Op for Predict {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let points = self.at.points()?;
        let values = self.model.rewards(&points)?;
        Ok(curve(points, values))
    }
}

impl Op for PredictStd {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let points = self.at.points()?;
        ivx_data::form::of_numbers(&self.model.form()).map_err(failed)?;
        let values = stds(&self.model, &points).map_err(failed)?;
        Ok(curve(points, values))
    }
}
