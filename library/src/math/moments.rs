//! Means and spreads.

/// A count as a real number.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "counts stay far below 2^53")]
pub fn real(n: usize) -> f64 {
    n as f64
}

/// `n` equal weights that sum to one.
#[must_use]
pub fn uniform(n: usize) -> Vec<f64> {
    vec![1.0 / real(n); n]
}

/// The sum, from the first value to the last.
#[must_use]
pub fn sum(xs: &[f64]) -> f64 {
    xs.iter().sum()
}

/// The arithmetic mean; NaN of nothing.
#[must_use]
pub fn mean(xs: &[f64]) -> f64 {
    sum(xs) / real(xs.len())
}

/// The population variance (`ddof = 0`); NaN of nothing.
#[must_use]
pub fn variance(xs: &[f64]) -> f64 {
    let centre = mean(xs);
    xs.iter().map(|x| (x - centre).powi(2)).sum::<f64>() / real(xs.len())
}

/// The sample variance (`ddof = 1`); NaN of fewer than two values.
#[must_use]
pub fn sample_variance(xs: &[f64]) -> f64 {
    if xs.len() < 2 {
        return f64::NAN;
    }
    variance(xs) * real(xs.len()) / real(xs.len() - 1)
}

/// The population standard deviation (`ddof = 0`); NaN of nothing.
#[must_use]
pub fn std(xs: &[f64]) -> f64 {
    variance(xs).sqrt()
}

/// The standard error of the mean, from the sample variance; NaN of fewer than two values.
#[must_use]
pub fn stderr(xs: &[f64]) -> f64 {
    (sample_variance(xs) / real(xs.len())).sqrt()
}

/// `Σ w_i x_i` for weights that sum to one.
///
/// # Panics
/// If there is not one weight a value.
#[must_use]
pub fn weighted_mean(xs: &[f64], weights: &[f64]) -> f64 {
    assert_eq!(xs.len(), weights.len(), "one weight a value");
    xs.iter().zip(weights).map(|(x, w)| w * x).sum()
}

/// `Σ w_i (x_i − μ)²` for weights that sum to one and their mean `μ`.
///
/// # Panics
/// If there is not one weight a value.
#[must_use]
pub fn weighted_variance(xs: &[f64], weights: &[f64]) -> f64 {
    let centre = weighted_mean(xs, weights);
    xs.iter().zip(weights).map(|(x, w)| w * (x - centre).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_of_four_numbers() {
        // Mean 5; squared deviations 9, 1, 1, 9 sum to 20.
        let xs = [2.0, 4.0, 6.0, 8.0];
        assert_eq!(mean(&xs), 5.0);
        assert_eq!(variance(&xs), 5.0);
        assert_eq!(sample_variance(&xs), 20.0 / 3.0);
        assert_eq!(std(&xs), 5.0_f64.sqrt());
        assert_eq!(stderr(&xs), (20.0_f64 / 12.0).sqrt());
    }

    #[test]
    fn one_value_has_no_standard_error() {
        assert_eq!(std(&[3.0]), 0.0);
        assert!(stderr(&[3.0]).is_nan());
        assert!(mean(&[]).is_nan());
    }

    #[test]
    fn weights_shift_mean_and_variance() {
        // μ = 0.75·0 + 0.25·4 = 1; 0.75·1 + 0.25·9 = 3.
        assert_eq!(weighted_mean(&[0.0, 4.0], &[0.75, 0.25]), 1.0);
        assert_eq!(weighted_variance(&[0.0, 4.0], &[0.75, 0.25]), 3.0);
        assert_eq!(weighted_variance(&[2.0, 4.0], &uniform(2)), variance(&[2.0, 4.0]));
    }
}
