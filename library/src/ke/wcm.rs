//! The worst model.

use ivx_math::order::min;
use ivx_math::tail::support;
use ivx_op::declare;

use super::KnowledgeEquivalent;

declare! {
    /// Worst-case model (Eqn. 2.7a): the lowest score of a model that is possible.
    pub struct Wcm = "wcm" @ 1 {}
}

impl KnowledgeEquivalent for Wcm {
    fn reduce(&self, scores: &[f64], weights: &[f64]) -> f64 {
        let possible: Vec<f64> = support(weights).map(|i| scores[i]).collect();
        min(&possible)
    }

    fn gradient(&self, scores: &[f64], weights: &[f64]) -> Vec<f64> {
        let mut gradient = vec![0.0; scores.len()];
        let worst = support(weights).reduce(|a, b| if scores[b] < scores[a] { b } else { a });
        if let Some(i) = worst {
            gradient[i] = 1.0;
        }
        gradient
    }
}
