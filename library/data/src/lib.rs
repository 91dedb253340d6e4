//! What operations hand to each other: data, episodes, decisions and beliefs.

mod columns;
mod dataset;
mod decision;
pub mod form;
mod misfit;
mod outputs;
mod posterior;
mod rollouts;

pub use columns::{Columns, Field, Kind, Values};
pub use dataset::{Dataset, Form};
pub use decision::Decision;
pub use misfit::{Misfit, sizes_told};
pub use outputs::{Blob, Outputs};
pub use posterior::Posterior;
pub use rollouts::{Episode, Rollouts};

/// The dimension of a number that brings its interval along.
pub const END: &str = "end";

/// Its labels: the number and the ends of its interval.
pub const ENDS: [&str; 3] = ["estimate", "low", "high"];
