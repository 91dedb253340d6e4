//! How models are learned from data.

use std::fmt::Debug;

use ivx_op::{Ctx, OpError, Registry};

use crate::artifact::{Dataset, Model};

/// Learns a model from data.
pub trait Learner: Debug + Send + Sync {
    /// The model after `steps` updates; closed-form learners have no use for `steps`.
    ///
    /// # Errors
    /// If the data admit no model; the message says why.
    fn train(&self, data: &Dataset, steps: u64, ctx: &Ctx) -> Result<Model, OpError>;
}

/// Adds what this folder declares.
pub(crate) fn register(registry: Registry) -> Registry {
    registry
}
