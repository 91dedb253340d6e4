//! The best model.

use ivx_math::order::higher;
use ivx_math::tail::support;
use ivx_op::declare;

use super::KnowledgeEquivalent;

declare! {
    /// Best-case model (Eqn. 2.7b): the highest score of a model that is possible.
    pub struct Bcm = "bcm" @ 1 {}
}

impl KnowledgeEquivalent for Bcm {
    fn reduce(&self, scores: &[f64], weights: &[f64]) -> f64 {
        support(weights).map(|i| scores[i]).fold(f64::NEG_INFINITY, higher)
    }

    fn slope(&self, scores: &[f64], weights: &[f64], slope: &mut [f64]) {
        slope.fill(0.0);
        let best = support(weights).reduce(|a, b| if scores[b] > scores[a] { b } else { a });
        if let Some(i) = best {
            slope[i] = 1.0;
        }
    }
}
