//! Intervals that others report: percentiles, and Wilson's of a probability. Ours are in [`evidence`](super::evidence).

use statrs::distribution::{ContinuousCDF as _, Normal};

use super::moments::real;
use super::order::{quantile_of_sorted, sorted};

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
    use super::*;

    #[test]
    fn a_share_of_none_has_an_interval() {
        // At p = 0 and z = 1.96 it ends at z² / (n + z²).
        let (low, high) = wilson(0, 10, 0.95);
        assert!(low.abs() < 1e-12 && (high - 3.841_459 / 13.841_459).abs() < 1e-6);
    }

    #[test]
    fn a_share_by_hand() {
        // Both ends are where (p − 8/10)² = z² p (1 − p) / 10: at z² = 1, 11 p² − 17 p + 6.4 = 0. Of the normal
        // distribution 0.682 689 492 lie within one.
        let (low, high) = wilson(8, 10, 0.682_689_492_137_086);
        let root = (17.0_f64.powi(2) - 4.0 * 11.0 * 6.4).sqrt();
        assert!((low - (17.0 - root) / 22.0).abs() < 1e-9, "{low}");
        assert!((high - (17.0 + root) / 22.0).abs() < 1e-9, "{high}");
        // The interval about the share itself, 0.8 ± √(0.16 / 10), is another.
        assert!((low - (0.8 - 0.016_f64.sqrt())).abs() > 0.01);
        // Failures are the successes of the others.
        let (few, many) = wilson(2, 10, 0.682_689_492_137_086);
        assert!((few - (1.0 - high)).abs() < 1e-12 && (many - (1.0 - low)).abs() < 1e-12);
    }
}
