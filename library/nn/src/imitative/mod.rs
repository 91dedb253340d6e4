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

/// What the networks of a model are called beside those that see: what steps from place to place, and what says where
/// the next one is.
const CELL: &str = "cell";
const HEAD: &str = "head";

#[cfg(test)]
mod tests;
