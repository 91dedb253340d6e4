//! How agents decide, and plan.

mod argmax;
mod decide;
mod greedy;
mod imitated;
mod model;
mod modes;
mod plan_library;
mod plans;
mod search;
mod utility;

use ivx_data::Decision;
use ivx_op::{OpError, Registry};

pub use argmax::{Argmax, equivalents};
pub use decide::{Decide, policy};
pub use greedy::Greedy;
pub(crate) use imitated::imitating;
pub use imitated::{Goals, Imitated};
pub use model::{LabelledTransitions, LatentModel, LearnedModel, Simulating, Simulator, TrueModel};
pub(crate) use modes::MODES;
pub use modes::{Foretold, Modes};
pub use plan_library::PlanLibrary;
pub use plans::{LogDensity, Planned, Plans};
pub use search::{
    Cem, Exhaustive, GradientPlan, Objective, Planner, Planning, RandomShooting, Space,
    TrajectoryLibrary,
};
pub use utility::Utility;

/// The decision for the first candidate of the highest score, and the belief in that score.
///
/// # Errors
/// If a score is not a number, or there are no candidates.
///
/// # Panics
/// If there is not one score a candidate.
pub fn choose(candidates: Vec<f64>, scores: &[f64]) -> Result<Decision, OpError> {
    assert_eq!(candidates.len(), scores.len(), "one score a candidate");
    if let Some(i) = scores.iter().position(|score| score.is_nan()) {
        return Err(OpError::Failed(format!("the score of {} is not a number", candidates[i])));
    }
    let best = ivx_math::order::argmax(scores);
    let best = best.ok_or_else(|| OpError::Failed("there is nothing to choose from".to_owned()))?;
    Ok(Decision { action: candidates[best], believed: scores[best], candidates })
}

/// Adds what this folder declares.
pub(crate) fn register(registry: Registry) -> Registry {
    registry
        .parts(search::planners())
        .parts(model::simulators())
        .op::<Utility>()
        .op::<Decide>()
        .op::<Greedy>()
        .op::<Argmax>()
        .op::<PlanLibrary>()
        .op::<Plans>()
        .op::<LogDensity>()
        .op::<Modes>()
        .op::<LabelledTransitions>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_the_best_is_chosen() {
        let decision = choose(vec![-1.0, 0.0, 1.0], &[0.5, 2.0, 2.0]).unwrap();
        assert_eq!((decision.action, decision.believed), (0.0, 2.0));
        let message = choose(vec![-1.0, 0.0], &[0.5, f64::NAN]).unwrap_err().to_string();
        assert_eq!(message, "the score of 0 is not a number");
        assert!(choose(vec![], &[]).is_err());
    }
}
