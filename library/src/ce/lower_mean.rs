//! The mean of the worst rewards.

use ivx_math::moments::weighted_mean;
use ivx_math::tail::lower_tail;
use ivx_op::declare;

use super::CertaintyEquivalent;

declare! {
    /// The mean of the lowest outcomes, by probability mass. Averse to risk, softer than `wcu`.
    pub struct LowerMean = "lower_mean" @ 1 {
        /// Share of the probability mass kept; an outcome at the edge counts in part.
        alpha: f64 = 0.25, in f64::MIN_POSITIVE..=1.0;
    }
}

impl CertaintyEquivalent for LowerMean {
    fn value(&self, outcomes: &[f64], probabilities: &[f64]) -> f64 {
        weighted_mean(outcomes, &lower_tail(outcomes, probabilities, self.alpha))
    }
}
