//! The average of the models and their standard deviation.

use ivx_math::moments::{weighted_mean, weighted_variance};
use ivx_op::declare;

use super::KnowledgeEquivalent;

declare! {
    /// Mean + β population standard deviation over models.
    pub struct MeanStd = "mean_std" @ 1 {
        /// Weight β of the deviation: below 0 averse to ignorance, above 0 seeking it.
        beta: f64;
    }
}

impl KnowledgeEquivalent for MeanStd {
    fn reduce(&self, scores: &[f64], weights: &[f64]) -> f64 {
        weighted_mean(scores, weights) + self.beta * weighted_variance(scores, weights).sqrt()
    }

    fn slope(&self, scores: &[f64], weights: &[f64], slope: &mut [f64]) {
        let centre = weighted_mean(scores, weights);
        let std = weighted_variance(scores, weights).sqrt();
        // Where the models agree the deviation has a kink, and 0 is among its subgradients.
        let rise = if std > 0.0 { self.beta / std } else { 0.0 };
        for (slope, (s, w)) in slope.iter_mut().zip(scores.iter().zip(weights)) {
            *slope = w * (1.0 + rise * (s - centre));
        }
    }
}
