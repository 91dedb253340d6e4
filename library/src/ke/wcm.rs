//! The worst model.

use ivx_math::order::lower;
use ivx_math::tail::support;
use ivx_op::declare;

use super::KnowledgeEquivalent;

declare! {
    /// Worst-case model (Eqn. 2.7a): the lowest score of a model that is possible.
    pub struct Wcm = "wcm" @ 1 {}
}

impl KnowledgeEquivalent for Wcm {
    fn reduce(&self, scores: &[f64], weights: &[f64]) -> f64 {
        support(weights).map(|i| scores[i]).fold(f64::INFINITY, lower)
    }

    fn slope(&self, scores: &[f64], weights: &[f64], slope: &mut [f64]) {
        slope.fill(0.0);
        let worst = support(weights).reduce(|a, b| if scores[b] < scores[a] { b } else { a });
        if let Some(i) = worst {
            slope[i] = 1.0;
        }
    }
}
