//! What operations hand to each other.

mod dataset;
mod decision;
mod model;
mod outputs;
mod posterior;
mod rollouts;
mod world_model;

pub use dataset::{Dataset, Form};
pub use decision::Decision;
pub use model::{Head, Model, NetModel};
pub use outputs::{Blob, Outputs};
pub use posterior::Posterior;
pub use rollouts::{Episode, Rollouts};
pub use world_model::{Layout, WorldModel};
