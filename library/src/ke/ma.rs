//! The average of the models.

use ivx_math::moments::weighted_mean;
use ivx_op::declare;

use super::KnowledgeEquivalent;

declare! {
    /// Model average (Eqn. 2.5): the mean over models. Neutral to ignorance.
    pub struct Ma = "ma" @ 1 {}
}

impl KnowledgeEquivalent for Ma {
    fn reduce(&self, scores: &[f64], weights: &[f64]) -> f64 {
        weighted_mean(scores, weights)
    }

    fn slope(&self, _: &[f64], weights: &[f64], slope: &mut [f64]) {
        slope.copy_from_slice(weights);
    }
}
