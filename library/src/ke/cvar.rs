//! The average of the worst models.

use ivx_math::moments::weighted_mean;
use ivx_math::tail::lower_tail;
use ivx_op::declare;

use super::KnowledgeEquivalent;

declare! {
    /// Conditional value at risk: the mean of the lowest scores, by posterior mass. A softer `wcm`.
    pub struct Cvar = "cvar" @ 1 {
        /// Share of the posterior mass kept; a model at the edge counts in part.
        alpha: f64 = 0.25, in f64::MIN_POSITIVE..=1.0;
    }
}

impl KnowledgeEquivalent for Cvar {
    fn reduce(&self, scores: &[f64], weights: &[f64]) -> f64 {
        weighted_mean(scores, &lower_tail(scores, weights, self.alpha))
    }

    fn slope(&self, scores: &[f64], weights: &[f64], slope: &mut [f64]) {
        slope.copy_from_slice(&lower_tail(scores, weights, self.alpha));
    }
}
