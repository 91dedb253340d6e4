//! Intervals for the mean of a population, from a sample.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF as _, StudentsT};

use super::moments::{mean, real, stderr};
use super::order::{quantile_of_sorted, sorted};

/// How often the bootstrap draws a sample anew.
const N_RESAMPLES: usize = 10_000;

/// Student's t interval for the mean: `x̄ ± t_{n−1, (1+c)/2} s/√n`.
///
/// # Panics
/// If there are fewer than two values or `confidence` is not between 0 and 1.
#[must_use]
pub fn student_t(xs: &[f64], confidence: f64) -> (f64, f64) {
    assert!(xs.len() > 1, "an interval needs two values");
    assert!(0.0 < confidence && confidence < 1.0, "a confidence between 0 and 1");
    let t = StudentsT::new(0.0, 1.0, real(xs.len() - 1)).expect("positive degrees of freedom");
    let half = t.inverse_cdf(0.5 + confidence / 2.0) * stderr(xs);
    (mean(xs) - half, mean(xs) + half)
}

/// Percentile bootstrap interval for the mean.
///
/// # Panics
/// If there are no values or `confidence` is not between 0 and 1.
#[must_use]
pub fn bootstrap(xs: &[f64], confidence: f64, rng: &mut ChaCha8Rng) -> (f64, f64) {
    assert!(!xs.is_empty(), "an interval needs a value");
    assert!(0.0 < confidence && confidence < 1.0, "a confidence between 0 and 1");
    let mut resampled = || xs.iter().map(|_| xs[rng.random_range(0..xs.len())]).sum::<f64>();
    let means: Vec<f64> = (0..N_RESAMPLES).map(|_| resampled() / real(xs.len())).collect();
    let means = sorted(&means);
    let outside = (1.0 - confidence) / 2.0;
    (quantile_of_sorted(&means, outside), quantile_of_sorted(&means, 1.0 - outside))
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
    fn the_bootstrap_nears_the_normal_interval() {
        // 0, …, 99: mean 49.5, population standard deviation 28.87, so 1.96·2.887 = 5.66.
        let xs: Vec<f64> = (0..100).map(real).collect();
        let mut rng = Ctx::new("test", 0, None).rng("bootstrap", &[]);
        let (low, high) = bootstrap(&xs, 0.95, &mut rng);
        assert!((low - 43.84).abs() < 0.2 && (high - 55.16).abs() < 0.2, "{low} {high}");
    }
}
