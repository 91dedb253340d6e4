//! How much distributions disagree (Eqn. C.5).

use super::moments::{real, weighted_mean};
use super::mpv::across;
use super::policy::shares;

/// The last of `n` weights over the first (§C.4.3).
const LAST: f64 = 1.0 / 3.0;

/// The generalised Jensen-Shannon divergence of categorical distributions, in nats (Eqn. C.5): 0 where they
/// are one, and at most the entropy of their weights.
///
/// ```text
/// JSD_w = H(Σ_k w_k p_k) - Σ_k w_k H(p_k)
/// ```
///
/// - `distributions`: `[n][M]`, each over the same `M` places.
/// - `weights`: `[n]`, which sum to one.
///
/// # Panics
/// If there are no distributions, they differ in length, or there is not one weight a distribution.
#[must_use]
pub fn jensen_shannon(distributions: &[impl AsRef<[f64]>], weights: &[f64]) -> f64 {
    let entropies: Vec<f64> = distributions.iter().map(|p| entropy(p.as_ref())).collect();
    entropy(&mixture(distributions, weights)) - weighted_mean(&entropies, weights)
}

/// The mixture of distributions: `[M]`.
///
/// # Panics
/// If there are no distributions, they differ in length, or there is not one weight a distribution.
#[must_use]
pub fn mixture(distributions: &[impl AsRef<[f64]>], weights: &[f64]) -> Vec<f64> {
    across(distributions, |probabilities| weighted_mean(probabilities, weights))
}

/// `-Σ p ln p`, in nats; what is impossible adds nothing.
#[must_use]
pub fn entropy(probabilities: &[f64]) -> f64 {
    let possible = probabilities.iter().filter(|p| **p > 0.0);
    -possible.map(|p| p * p.ln()).sum::<f64>()
}

/// `n` weights that sum to one, each the same share of the one before, down to a third of the first
/// (`dec_JS` in §C.4.3).
#[must_use]
pub fn decreasing(n: usize) -> Vec<f64> {
    let last = real(n.saturating_sub(1)).max(1.0);
    shares(&(0..n).map(|k| LAST.powf(real(k) / last)).collect::<Vec<f64>>())
}

/// The same weights the other way round (`inc_JS` in §C.4.3).
#[must_use]
pub fn increasing(n: usize) -> Vec<f64> {
    decreasing(n).into_iter().rev().collect()
}

#[cfg(test)]
mod tests {
    use rand::RngExt as _;

    use super::*;
    use crate::moments::uniform;

    #[test]
    fn by_hand() {
        // Apart entirely, two distributions disagree by the entropy of their weights.
        let (a, b) = ([0.5, 0.5, 0.0, 0.0], [0.0, 0.0, 0.25, 0.75]);
        assert!((jensen_shannon(&[a, b], &[0.5, 0.5]) - 2.0_f64.ln()).abs() < 1e-15);
        let weighted = -(0.9_f64 * 0.9_f64.ln() + 0.1 * 0.1_f64.ln());
        assert!((jensen_shannon(&[a, b], &[0.9, 0.1]) - weighted).abs() < 1e-15);
        assert_eq!(jensen_shannon(&[a, a], &[0.5, 0.5]), 0.0);
        assert_eq!(mixture(&[a, b], &[0.5, 0.5]), [0.25, 0.25, 0.125, 0.375]);
    }

    #[test]
    fn weights_go_down_to_a_third() {
        // 1, 1/√3, 1/3.
        let weights = decreasing(3);
        assert!((weights[2] / weights[0] - 1.0 / 3.0).abs() < 1e-15);
        assert!((weights[1] * weights[1] - weights[0] * weights[2]).abs() < 1e-15);
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        assert_eq!(increasing(3), [weights[2], weights[1], weights[0]]);
        assert_eq!((decreasing(1), decreasing(0)), (vec![1.0], vec![]));
    }

    #[test]
    fn it_lies_between_none_and_the_entropy_of_the_weights() {
        let mut rng = ivx_op::Ctx::new("", 0, None).rng("distributions", &[]);
        for weights in [uniform(4), decreasing(4), increasing(4)] {
            for _ in 0..50 {
                let mut draw =
                    || shares(&(0..6).map(|_| rng.random::<f64>().powi(9)).collect::<Vec<f64>>());
                let distributions = [draw(), draw(), draw(), draw()];
                let jsd = jensen_shannon(&distributions, &weights);
                assert!(jsd > 0.0 && jsd <= entropy(&weights));
            }
        }
    }
}
