//! Training.

use ivx_op::{Ctx, One, Op, OpError, declare};

use super::Learner;
use crate::artifact::{Dataset, Model};

declare! {
    /// A model learned from data. An ensemble of learners gives an ensemble of models.
    pub struct Train = "train" @ 1 -> Model {
        /// How to learn.
        learner: Box<dyn Learner>;
        /// The data.
        on: One<Dataset>;
        /// How many updates; closed-form learners make none.
        steps: u64 = 0, in 0.0.., unit "updates";
    }
}

impl Op for Train {
    fn run(&self, ctx: &Ctx) -> Result<Model, OpError> {
        self.learner.train(&self.on, self.steps, ctx)
    }
}
