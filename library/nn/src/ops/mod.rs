//! The operations that a pass is made of, each with its gradient.

mod conv;
mod elementwise;
mod embedding;
mod linear;
mod losses;
mod norm;
mod policy;
mod pool;
mod recurrent;
mod rows;
mod select;

pub use conv::Window;
pub use norm::BatchNorm;
pub use policy::{Proximal, Proximity, Steps};
pub use recurrent::Cell;

#[cfg(test)]
mod tests;
