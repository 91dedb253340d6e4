//! What replications say about a mean.

use ivx_math::evidence::{Evidence, Spread};
use ivx_math::moments::mean;

/// A mean and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    /// The mean.
    pub(super) mean: f64,
    /// The 95 % interval; none for a single sample or one that is not finite. An end of which so few seeds say nothing
    /// is infinite.
    pub(super) interval: Option<(f64, f64)>,
}

/// The mean of the samples with its 95 % interval, by the rule of claims.
///
/// # Panics
/// If there are no samples.
pub(super) fn interval(samples: &[f64]) -> Estimate {
    assert!(!samples.is_empty(), "a mean needs a sample");
    let ends =
        (samples.len() > 1).then(|| Evidence::Mean(Spread::of_mean(samples)).shown_interval(0.95));
    let whole = |x: &f64| x.is_finite();
    let interval =
        ends.filter(|(low, high)| !low.is_nan() && !high.is_nan() && samples.iter().all(whole));
    Estimate { mean: mean(samples), interval }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_students() {
        // m = 2, s² = 1, t_{0.975, 2} = 4.302653: 2 ± 4.302653 / √3.
        let found = interval(&[1.0, 2.0, 3.0]);
        let (low, high) = found.interval.unwrap();
        assert_eq!(found.mean, 2.0);
        assert!((high - 2.0 - 2.484_138).abs() < 1e-6, "{high}");
        assert!((2.0 - low - 2.484_138).abs() < 1e-6, "{low}");
        // m = 1, s² = 2, t_{0.975, 1} = 12.706205: 1 ± 12.706205.
        let (low, _) = interval(&[0.0, 2.0]).interval.unwrap();
        assert!((low + 11.706_205).abs() < 1e-5, "{low}");
    }

    #[test]
    fn one_sample_has_no_interval_and_equal_ones_no_width() {
        assert_eq!(interval(&[0.5]), Estimate { mean: 0.5, interval: None });
        assert_eq!(interval(&[0.5, 0.5]).interval, Some((0.5, 0.5)));
        let broken = interval(&[f64::NAN, 1.0]);
        assert!(broken.mean.is_nan() && broken.interval.is_none());
    }

    #[test]
    fn the_interval_moves_and_grows_with_the_samples() {
        for n in 2..30 {
            let samples: Vec<f64> = (0..n).map(|i| f64::from(i * i % 7)).collect();
            let scaled: Vec<f64> = samples.iter().map(|x| 4.0 * x - 8.0).collect();
            let ((low, high), mean) =
                (interval(&samples).interval.unwrap(), interval(&samples).mean);
            let (scaled_low, scaled_high) = interval(&scaled).interval.unwrap();
            assert!(low < mean && mean < high);
            assert!((scaled_low - (4.0 * low - 8.0)).abs() < 1e-9);
            let open = high == f64::INFINITY && scaled_high == high;
            assert!(open || (scaled_high - (4.0 * high - 8.0)).abs() < 1e-9);
        }
    }
}
