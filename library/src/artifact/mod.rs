//! What operations hand to each other.

mod dataset;
mod decision;
mod model;

pub use dataset::Dataset;
pub use decision::Decision;
pub use model::{Model, NetModel};
