//! What replications say about a mean.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// A mean and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimate {
    /// The mean.
    pub(super) mean: f64,
    /// The 95 % interval; none for a single sample or one that is not finite.
    pub(super) interval: Option<(f64, f64)>,
}

/// The mean of the samples with its 95 % interval by Student's t.
///
/// ```text
/// m ± t_{0.975, n-1} · s / √n,    s² = Σ (x_i − m)² / (n − 1)
/// ```
///
/// # Panics
/// If there are no samples.
#[expect(clippy::cast_precision_loss, reason = "samples number far below 2^53")]
pub(super) fn interval(samples: &[f64]) -> Estimate {
    assert!(!samples.is_empty(), "a mean needs a sample");
    let n = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / n;
    if samples.len() == 1 {
        return Estimate { mean, interval: None };
    }
    let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let half = student_quantile(n - 1.0) * (variance / n).sqrt();
    let interval = half.is_finite().then_some((mean - half, mean + half));
    Estimate { mean, interval }
}

/// `t_{0.975}` with these degrees of freedom.
fn student_quantile(freedom: f64) -> f64 {
    let student = StudentsT::new(0.0, 1.0, freedom).expect("there is a degree of freedom");
    student.inverse_cdf(0.975)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        let table = [(1.0, 12.706), (2.0, 4.303), (4.0, 2.776), (19.0, 2.093), (999.0, 1.962)];
        for (freedom, expected) in table {
            let found = student_quantile(freedom);
            assert!((found - expected).abs() < 5e-4, "{freedom}: {found}");
        }
    }

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
            assert!((scaled_high - (4.0 * high - 8.0)).abs() < 1e-9);
        }
    }
}
