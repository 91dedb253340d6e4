//! Intervals for the mean of a population, from a sample.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF as _, Normal, StudentsT};

use super::moments::{mean, real, stderr};
use super::order::{quantile_of_sorted, sorted};

/// How often the bootstrap draws a sample anew.
const N_RESAMPLES: usize = 10_000;

/// Student's t interval for the mean: `x̄ ± t_{n−1, (1+c)/2} s/√n`. Of equal numbers, infinities among them, it has
/// no width.
///
/// # Panics
/// If there are fewer than two values or `confidence` is not between 0 and 1.
#[must_use]
pub fn student_t(xs: &[f64], confidence: f64) -> (f64, f64) {
    assert!(xs.len() > 1, "an interval needs two values");
    assert!(0.0 < confidence && confidence < 1.0, "a confidence between 0 and 1");
    if xs.iter().all(|x| *x == xs[0]) {
        return (xs[0], xs[0]);
    }
    let t = StudentsT::new(0.0, 1.0, real(xs.len() - 1)).expect("positive degrees of freedom");
    let half = t.inverse_cdf(0.5 + confidence / 2.0) * stderr(xs);
    (mean(xs) - half, mean(xs) + half)
}

/// Percentile bootstrap interval for the mean; of the differences of pairs, for theirs.
///
/// # Panics
/// If there are no values or `confidence` is not between 0 and 1.
#[must_use]
pub fn bootstrap(xs: &[f64], confidence: f64, rng: &mut ChaCha8Rng) -> (f64, f64) {
    let means: Vec<f64> = (0..N_RESAMPLES).map(|_| resampled_mean(xs, rng)).collect();
    percentile(&means, confidence)
}

/// Percentile bootstrap interval for the difference of the means of two samples, drawn independently.
///
/// # Panics
/// If a sample has no values or `confidence` is not between 0 and 1.
#[must_use]
pub fn bootstrap_difference(
    xs: &[f64],
    ys: &[f64],
    confidence: f64,
    rng: &mut ChaCha8Rng,
) -> (f64, f64) {
    let one = |rng: &mut ChaCha8Rng| resampled_mean(xs, rng) - resampled_mean(ys, rng);
    let differences: Vec<f64> = (0..N_RESAMPLES).map(|_| one(rng)).collect();
    percentile(&differences, confidence)
}

fn resampled_mean(xs: &[f64], rng: &mut ChaCha8Rng) -> f64 {
    assert!(!xs.is_empty(), "an interval needs a value");
    mean(&xs.iter().map(|_| xs[rng.random_range(0..xs.len())]).collect::<Vec<_>>())
}

/// The interval between percentiles that leaves out as many estimates below as above.
///
/// # Panics
/// If there are no estimates or `confidence` is not between 0 and 1.
#[must_use]
pub fn percentile(estimates: &[f64], confidence: f64) -> (f64, f64) {
    assert!(0.0 < confidence && confidence < 1.0, "a confidence between 0 and 1");
    let estimates = sorted(estimates);
    let outside = (1.0 - confidence) / 2.0;
    (quantile_of_sorted(&estimates, outside), quantile_of_sorted(&estimates, 1.0 - outside))
}

/// Wilson's interval for a probability of which `k` of `n` trials were successes.
///
/// # Panics
/// If there are no trials, more successes than trials, or `confidence` is not between 0 and 1.
#[must_use]
pub fn wilson(k: usize, n: usize, confidence: f64) -> (f64, f64) {
    assert!(0 < n && k <= n, "successes among trials");
    assert!(0.0 < confidence && confidence < 1.0, "a confidence between 0 and 1");
    let z = Normal::standard().inverse_cdf(0.5 + confidence / 2.0);
    let (p, n, z2) = (real(k) / real(n), real(n), z * z);
    let centre = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = z / (1.0 + z2 / n) * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    ((centre - half).max(0.0), (centre + half).min(1.0))
}

#[cfg(test)]
mod tests {
    use ivx_op::Ctx;

    use super::*;

    #[test]
    fn the_t_interval_of_five_values() {
        // Mean 3, s² = 2.5, s/√5 = √0.5; tables give t_{4, 0.975} = 2.776445.
        let (low, high) = student_t(&[1.0, 2.0, 3.0, 4.0, 5.0], 0.95);
        let half = 2.776_445_105 * 0.5_f64.sqrt();
        assert!((low - (3.0 - half)).abs() < 1e-8 && (high - (3.0 + half)).abs() < 1e-8);
    }

    #[test]
    fn equal_values_leave_no_interval() {
        assert_eq!(student_t(&[2.0; 5], 0.95), (2.0, 2.0));
        let mut rng = Ctx::new("test", 0, None).rng("bootstrap", &[]);
        assert_eq!(bootstrap(&[2.0; 20], 0.95, &mut rng), (2.0, 2.0));
    }

    #[test]
    fn a_difference_is_as_wide_as_both() {
        // Deviations 2.887 of both means: 1.96 · 2.887 · √2 = 8.0 around 0.
        let xs: Vec<f64> = (0..100).map(real).collect();
        let mut rng = Ctx::new("test", 0, None).rng("bootstrap", &[]);
        let (low, high) = bootstrap_difference(&xs, &xs, 0.95, &mut rng);
        assert!((low + 8.0).abs() < 0.3 && (high - 8.0).abs() < 0.3, "{low} {high}");
    }

    #[test]
    fn a_share_of_none_has_an_interval() {
        // At p = 0 and z = 1.96 it ends at z² / (n + z²).
        let (low, high) = wilson(0, 10, 0.95);
        assert!(low.abs() < 1e-12 && (high - 3.841_459 / 13.841_459).abs() < 1e-6);
    }

    #[test]
    fn the_bootstrap_nears_the_normal_interval() {
        // 0, …, 99: mean 49.5, population standard deviation 28.87, so 1.96·2.887 = 5.66.
        let xs: Vec<f64> = (0..100).map(real).collect();
        let mut rng = Ctx::new("test", 0, None).rng("bootstrap", &[]);
        let (low, high) = bootstrap(&xs, 0.95, &mut rng);
        assert!((low - 43.84).abs() < 0.2 && (high - 55.16).abs() < 0.2, "{low} {high}");
    }
}
