//! The mean reward and its variance.

use ivx_math::moments::{weighted_mean, weighted_variance};
use ivx_op::declare;

use super::CertaintyEquivalent;

declare! {
    /// Mean-variance utility (Eqn. 2.2): mean + β variance.
    pub struct Mvu = "mvu" @ 1 {
        /// Weight β of the variance: below 0 averse to risk, above 0 seeking it.
        beta: f64;
    }
}

impl CertaintyEquivalent for Mvu {
    fn value(&self, outcomes: &[f64], probabilities: &[f64]) -> f64 {
        weighted_mean(outcomes, probabilities)
            + self.beta * weighted_variance(outcomes, probabilities)
    }
}
