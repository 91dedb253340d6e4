//! How models are learned from data.

mod ensemble;
mod map_estimate;
mod prior;

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Ctx, OpError, Parts, Registry, family};

pub use ensemble::Ensemble;
pub use map_estimate::MapEstimate;
pub use prior::{Normal, Prior};

use crate::artifact::{Dataset, Model, NetModel};

/// Learns a model from data.
pub trait Learner: Debug + Send + Sync {
    /// The model after `steps` updates; closed-form learners have no use for `steps`.
    ///
    /// # Errors
    /// If the data admit no model; the message says why.
    fn train(&self, data: &Dataset, steps: u64, ctx: &Ctx) -> Result<Model, OpError>;

    /// A fixed network of the learner's own architecture, drawn from the stream `prior`;
    /// none where models are not networks.
    fn prior_network(&self, _ctx: &Ctx) -> Option<NetModel> {
        None
    }
}

/// The learners, by name.
pub(crate) fn learners() -> &'static Parts<dyn Learner> {
    static TABLE: LazyLock<Parts<dyn Learner>> = LazyLock::new(|| {
        Parts::<dyn Learner>::new()
            .with(|x: MapEstimate| Box::new(x))
            .with(|x: Ensemble| Box::new(x))
    });
    &TABLE
}

family!(dyn Learner, "Learner", learners);

/// Adds what this folder declares.
pub(crate) fn register(registry: Registry) -> Registry {
    registry.parts(prior::priors()).parts(learners())
}
