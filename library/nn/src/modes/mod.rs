//! Forecasts of a few modes: plans with a probability each, which a network makes, moves or chooses.

mod loss;
mod model;
mod train;

pub use model::{Anchored, ModeNets, Modes, Multimodal};
pub(crate) use model::{KIND, read};
pub use train::{ModeTraining, fit_modes};

/// What the last layer of a model is called.
const HEAD: &str = "head";

#[cfg(test)]
mod tests;
