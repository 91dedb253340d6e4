//! What operations hand to each other: data, episodes, decisions, beliefs and pictures.

mod actions;
mod columns;
mod dataset;
mod decision;
mod demonstrations;
pub mod form;
mod misfit;
mod outputs;
mod picture;
mod posterior;
mod road_map;
mod rollouts;
mod trajectories;
mod walks;

pub use actions::{Act, Actions, End};
pub use columns::{Columns, Field, Kind, Values, packed};
pub use dataset::{Dataset, Form, Names};
pub use decision::Decision;
pub use demonstrations::Demonstrations;
pub use misfit::{Misfit, sizes_told};
pub use outputs::{Blob, Outputs};
pub use picture::{Outline, Picture, Place, Shape};
pub use posterior::Posterior;
pub use road_map::RoadMap;
pub use rollouts::Rollouts;
pub use trajectories::{Trajectories, same_world, shown_by, tell, told_by, world_shapes};
pub use walks::{Episode, NOT_FINITE, Walks, finite, pairs};

/// The dimension of a number that brings its interval along.
pub const END: &str = "end";

/// Its labels: the number and the ends of its interval.
pub const ENDS: [&str; 3] = ["estimate", "low", "high"];
