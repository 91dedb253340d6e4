//! Probabilities of actions by their values.

use crate::moments::{real, uniform};

/// The first action of the highest value.
///
/// # Panics
/// If there is none.
#[must_use]
pub fn greedy(values: &[f64]) -> usize {
    assert!(!values.is_empty(), "there is an action");
    (1..values.len()).fold(0, |best, a| if values[a] > values[best] { a } else { best })
}

/// Every action with a share of `epsilon`, and those of the highest value with the rest, in
/// equal parts.
#[must_use]
pub fn epsilon_greedy(values: &[f64], epsilon: f64) -> Vec<f64> {
    let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let n_best = values.iter().filter(|value| **value == highest).count();
    let (each, best) = (epsilon / real(values.len()), (1.0 - epsilon) / real(n_best));
    values.iter().map(|value| if *value == highest { each + best } else { each }).collect()
}

/// `π(a) ∝ e^{q(a) / temperature}`.
#[must_use]
pub fn boltzmann(values: &[f64], temperature: f64) -> Vec<f64> {
    let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> =
        values.iter().map(|value| ((value - highest) / temperature).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}

/// What each number is of the sum of all, such as weights of a distribution; equal parts if all are 0.
#[must_use]
pub fn shares(xs: &[f64]) -> Vec<f64> {
    let sum: f64 = xs.iter().sum();
    if sum == 0.0 { uniform(xs.len()) } else { xs.iter().map(|x| x / sum).collect() }
}

/// A policy mixed with a signal of each action in the space of probabilities (§C.4.3).
///
/// ```text
/// (1 - β) π + β σ
/// ```
///
/// The signal, such as the disagreement of an ensemble, is thought of as a distribution: that of
/// [`shares`] makes the mixture one too, which the thesis does not tell.
///
/// # Panics
/// If there is not one number of the signal an action.
#[must_use]
pub fn mix_probabilities(policy: &[f64], signal: &[f64], beta: f64) -> Vec<f64> {
    assert_eq!(policy.len(), signal.len(), "one number an action");
    policy.iter().zip(signal).map(|(p, s)| (1.0 - beta) * p + beta * s).collect()
}

/// A policy mixed with a signal of each action in the space of logits (§C.4.3): drawn to it if `beta` is
/// above 0, and averse to it below (§C.4.4).
///
/// ```text
/// softmax(z + β σ)
/// ```
///
/// # Panics
/// If there is not one number of the signal an action.
#[must_use]
pub fn mix_logits(logits: &[f64], signal: &[f64], beta: f64) -> Vec<f64> {
    assert_eq!(logits.len(), signal.len(), "one number an action");
    let mixed: Vec<f64> = logits.iter().zip(signal).map(|(z, s)| z + beta * s).collect();
    boltzmann(&mixed, 1.0)
}

/// The first place at which the probabilities so far exceed `share`; the last possible if none does. Of an
/// even `share` of 1, it is a draw.
///
/// # Panics
/// If nothing is possible.
#[must_use]
pub fn pick(probabilities: &[f64], share: f64) -> usize {
    let mut below = 0.0;
    for (i, p) in probabilities.iter().enumerate() {
        below += p;
        if share < below {
            return i;
        }
    }
    probabilities.iter().rposition(|p| *p > 0.0).expect("something is possible")
}

/// Advantages with mean 0 and sample standard deviation 1 (but for `1e-8`).
#[must_use]
pub fn normalised(advantages: &[f64]) -> Vec<f64> {
    let mean = advantages.iter().sum::<f64>() / real(advantages.len());
    let squares: f64 = advantages.iter().map(|a| (a - mean).powi(2)).sum();
    let std = (squares / (real(advantages.len()) - 1.0)).sqrt();
    advantages.iter().map(|a| (a - mean) / (std + 1e-8)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_share_and_the_first_is_greedy() {
        // A third of 0.3 each, and half of 0.7 for both best.
        let probs = epsilon_greedy(&[2.0, 2.0, 1.0], 0.3);
        let expected = [0.45, 0.45, 0.1];
        assert!(probs.iter().zip(expected).all(|(p, e)| (p - e).abs() < 1e-12), "{probs:?}");
        assert_eq!(greedy(&[1.0, 2.0, 2.0]), 1);
    }

    #[test]
    fn temperature_flattens() {
        // e^{1/0.5} : 1 and, at a temperature above all values, nearly 1 : 1.
        let sharp = boltzmann(&[1.0, 0.0], 0.5);
        assert!((sharp[0] / sharp[1] - 2.0_f64.exp()).abs() < 1e-12);
        assert!((boltzmann(&[1.0, 0.0], 1e9)[0] - 0.5).abs() < 1e-9);
        assert_eq!(boltzmann(&[1000.0, -1000.0], 1.0), [1.0, 0.0]);
    }

    #[test]
    fn a_signal_draws_a_policy_or_repels_it() {
        let signal = shares(&[3.0, 1.0, 0.0]);
        assert_eq!(signal, [0.75, 0.25, 0.0]);
        assert_eq!(mix_probabilities(&[0.25, 0.25, 0.5], &signal, 0.5), [0.5, 0.25, 0.25]);
        assert_eq!(shares(&[0.0, 0.0]), [0.5, 0.5]);
        // e^{±ln 3} : 1.
        let by = |beta| mix_logits(&[0.5, 0.5], &[3.0_f64.ln(), 0.0], beta)[0];
        assert!((by(1.0) - 0.75).abs() < 1e-15 && (by(-1.0) - 0.25).abs() < 1e-15);
    }

    #[test]
    fn a_share_picks_a_place() {
        let picked = [0.0, 0.2, 0.25, 0.9, 1.0].map(|share| pick(&[0.25, 0.0, 0.75, 0.0], share));
        assert_eq!(picked, [0, 0, 2, 2, 2]);
    }

    #[test]
    fn three_advantages() {
        // Mean 2, sample variance (1 + 0 + 1)/2.
        let scaled = normalised(&[1.0, 2.0, 3.0]);
        assert!((scaled[0] + 1.0).abs() < 1e-7 && scaled[1] == 0.0);
    }
}
