//! The average of the models and their variance.

use ivx_math::moments::{weighted_mean, weighted_variance};
use ivx_op::declare;

use super::KnowledgeEquivalent;

declare! {
    /// Mean-variance model (Eqn. 2.6): mean + ξ population variance over models.
    pub struct Mvm = "mvm" @ 1 {
        /// Weight ξ of the variance: below 0 averse to ignorance, above 0 seeking it.
        xi: f64;
    }
}

impl KnowledgeEquivalent for Mvm {
    fn reduce(&self, scores: &[f64], weights: &[f64]) -> f64 {
        weighted_mean(scores, weights) + self.xi * weighted_variance(scores, weights)
    }

    fn slope(&self, scores: &[f64], weights: &[f64], slope: &mut [f64]) {
        let centre = weighted_mean(scores, weights);
        for (slope, (s, w)) in slope.iter_mut().zip(scores.iter().zip(weights)) {
            *slope = w * (1.0 + 2.0 * self.xi * (s - centre));
        }
    }
}
