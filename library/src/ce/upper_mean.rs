//! The mean of the best rewards.

use ivx_math::moments::weighted_mean;
use ivx_math::tail::upper_tail;
use ivx_op::declare;

use super::CertaintyEquivalent;

declare! {
    /// The mean of the highest outcomes, by probability mass. Seeks risk, softer than `bcu`.
    pub struct UpperMean = "upper_mean" @ 1 {
        /// Share of the probability mass kept; an outcome at the edge counts in part.
        alpha: f64 = 0.25, in f64::MIN_POSITIVE..=1.0;
    }
}

impl CertaintyEquivalent for UpperMean {
    fn value(&self, outcomes: &[f64], probabilities: &[f64]) -> f64 {
        weighted_mean(outcomes, &upper_tail(outcomes, probabilities, self.alpha))
    }
}
