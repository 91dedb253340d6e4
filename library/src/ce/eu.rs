//! The mean reward.

use ivx_math::moments::weighted_mean;
use ivx_op::declare;

use super::CertaintyEquivalent;

declare! {
    /// Expected utility (Eqn. 2.1): the mean. Neutral to risk.
    pub struct Eu = "eu" @ 1 {}
}

impl CertaintyEquivalent for Eu {
    fn value(&self, outcomes: &[f64], probabilities: &[f64]) -> f64 {
        weighted_mean(outcomes, probabilities)
    }
}
