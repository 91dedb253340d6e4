//! The best model.

use ivx_math::order::max;
use ivx_math::tail::support;
use ivx_op::declare;

use super::KnowledgeEquivalent;

declare! {
    /// Best-case model (Eqn. 2.7b): the highest score of a model that is possible.
    pub struct Bcm = "bcm" @ 1 {}
}

impl KnowledgeEquivalent for Bcm {
    fn reduce(&self, scores: &[f64], weights: &[f64]) -> f64 {
        let possible: Vec<f64> = support(weights).map(|i| scores[i]).collect();
        max(&possible)
    }

    fn gradient(&self, scores: &[f64], weights: &[f64]) -> Vec<f64> {
        let mut gradient = vec![0.0; scores.len()];
        let best = support(weights).reduce(|a, b| if scores[b] > scores[a] { b } else { a });
        if let Some(i) = best {
            gradient[i] = 1.0;
        }
        gradient
    }
}
