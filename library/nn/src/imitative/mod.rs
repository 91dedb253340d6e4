//! Imitative models: how probable a plan is for who was imitated (§3.1, Fig. 3.3).

mod member;
mod model;
mod online;
mod product;
mod scorer;
mod train;

pub use member::PlanWeights;
pub use model::{Imitative, Imitators, PlanNets};
pub(crate) use model::{KIND, read};
pub use online::PlanLearner;
pub use scorer::Scorer;
pub use train::{PlanTraining, fit_plans, plan_log_density};

/// What the networks of a model are called: what sees an input, what makes a state of it and of the numbers beside it,
/// what steps from place to place, and what says where the next one is.
const SEE: &str = "see";
const MERGE: &str = "merge";
const CELL: &str = "cell";
const HEAD: &str = "head";

/// The least standard deviation of a place.
const FLOOR: f64 = 1e-3;

#[cfg(test)]
mod tests;
