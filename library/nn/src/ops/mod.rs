//! The operations that a pass is made of, each with its gradient.

mod conv;
mod elementwise;
mod embedding;
pub(crate) mod gate;
mod imitation;
mod input_gradient;
mod linear;
mod losses;
mod norm;
mod policy;
mod pool;
mod recurrent;
mod rows;
mod select;
mod successor;

pub use conv::Window;
pub use imitation::{Payment, SoftSteps};
pub use input_gradient::Layer;
pub use norm::BatchNorm;
pub use policy::{Proximal, Proximity, Steps};
pub use recurrent::Cell;
pub use successor::{Norm, PsiPhiLosses, SuccessorSteps, Weighting};

#[cfg(test)]
mod tests;
