//! Numbers as distributions over bins, and distributions of values on a common support.

use super::moments::{real, weighted_mean};

/// Evenly spaced values, the lowest and the highest of which are given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bins {
    /// The lowest value.
    pub low: f64,
    /// The highest, above it.
    pub high: f64,
    /// How many there are, at least two.
    pub n: usize,
}

impl Bins {
    /// The value of each bin: `[n]`.
    #[must_use]
    pub fn values(&self) -> Vec<f64> {
        (0..self.n).map(|i| self.low + real(i) * self.width()).collect()
    }

    /// How far values lie apart.
    fn width(&self) -> f64 {
        assert!(self.n > 1 && self.low < self.high, "two bins at least, from low to high");
        (self.high - self.low) / real(self.n - 1)
    }

    /// The distribution on the two bins next to a number, whose mean it is: `[n]`. What lies outside goes to
    /// the outermost bin.
    ///
    /// # Panics
    /// If there are fewer than two bins or they do not rise.
    #[must_use]
    pub fn two_hot(&self, x: f64) -> Vec<f64> {
        let (x, width) = (x.clamp(self.low, self.high), self.width());
        self.values().iter().map(|value| (1.0 - (x - value).abs() / width).max(0.0)).collect()
    }

    /// The number that a distribution stands for: its mean.
    ///
    /// # Panics
    /// If there is not one probability a bin.
    #[must_use]
    pub fn mean(&self, probabilities: &[f64]) -> f64 {
        weighted_mean(&self.values(), probabilities)
    }

    /// The distribution over the bins of a number that is one on other places (Bellemare et al., 2017): each
    /// place is shared between the bins next to it.
    ///
    /// Values of `k` steps of a model lie at `Σ_{i<k} γ^i r^{i+1} + γ^k z` for each bin `z`; so projected, they
    /// can be compared (Eqn. C.5).
    ///
    /// - `places`, `probabilities`: one for each place.
    ///
    /// # Panics
    /// If there are fewer than two bins, they do not rise, or there is not one probability a place.
    #[must_use]
    pub fn projected(&self, places: &[f64], probabilities: &[f64]) -> Vec<f64> {
        assert_eq!(places.len(), probabilities.len(), "one probability a place");
        let mut projected = vec![0.0; self.n];
        for (x, probability) in places.iter().zip(probabilities) {
            let shared = projected.iter_mut().zip(self.two_hot(*x));
            shared.for_each(|(sum, share)| *sum += probability * share);
        }
        projected
    }
}

/// The signed hyperbolic scale, on which large values lie closer together (Pohlen et al., 2018).
///
/// ```text
/// h(x) = sign(x) (√(|x| + 1) - 1) + ε x
/// ```
#[must_use]
pub fn signed_hyperbolic(x: f64, eps: f64) -> f64 {
    x.signum() * ((x.abs() + 1.0).sqrt() - 1.0) + eps * x
}

/// The number whose signed hyperbolic scale it is.
///
/// ```text
/// h⁻¹(y) = sign(y) (((√(1 + 4 ε (|y| + 1 + ε)) - 1) / 2 ε)² - 1)
/// ```
///
/// - `eps`: above 0.
#[must_use]
pub fn signed_parabolic(y: f64, eps: f64) -> f64 {
    let root = ((1.0 + 4.0 * eps * (y.abs() + 1.0 + eps)).sqrt() - 1.0) / (2.0 * eps);
    y.signum() * (root * root - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BINS: Bins = Bins { low: -1.0, high: 2.0, n: 4 };

    #[test]
    fn numbers_lie_between_two_bins() {
        assert_eq!(BINS.values(), [-1.0, 0.0, 1.0, 2.0]);
        assert_eq!(BINS.two_hot(0.25), [0.0, 0.75, 0.25, 0.0]);
        assert_eq!(BINS.two_hot(1.0), [0.0, 0.0, 1.0, 0.0]);
        assert_eq!(BINS.two_hot(9.0), BINS.two_hot(2.0));
        assert_eq!(BINS.two_hot(-9.0), [1.0, 0.0, 0.0, 0.0]);
        for i in 0..300 {
            let x = real(i) / 100.0 - 1.0;
            assert!((BINS.mean(&BINS.two_hot(x)) - x).abs() < 1e-14);
        }
    }

    #[test]
    fn projection_keeps_the_mean_within_the_bins() {
        // Half at 0.5 and half at 2.
        assert_eq!(BINS.projected(&[0.5, 2.0], &[0.5, 0.5]), [0.0, 0.25, 0.25, 0.5]);
        let probabilities = [0.1, 0.2, 0.3, 0.4];
        assert!(
            BINS.projected(&BINS.values(), &probabilities)
                .iter()
                .zip(probabilities)
                .all(|(a, b)| (a - b).abs() < 1e-15)
        );
        let places: Vec<f64> = BINS.values().iter().map(|z| 0.3 + 0.6 * z).collect();
        let mean = BINS.mean(&BINS.projected(&places, &probabilities));
        assert!((mean - (0.3 + 0.6 * BINS.mean(&probabilities))).abs() < 1e-14);
    }

    #[test]
    fn the_scale_has_an_inverse() {
        // √(8 + 1) − 1 and a tenth of 8.
        assert!((signed_hyperbolic(8.0, 0.1) - 2.8).abs() < 1e-15);
        assert!((signed_hyperbolic(-8.0, 0.1) + 2.8).abs() < 1e-15);
        assert_eq!(
            (signed_hyperbolic(0.0, 0.1), signed_parabolic(0.0, 1e-3).abs() < 1e-12),
            (0.0, true)
        );
        for i in -50..50 {
            let x = f64::from(i) * 7.3;
            let back = signed_parabolic(signed_hyperbolic(x, 1e-3), 1e-3);
            assert!((back - x).abs() < 1e-9 * (1.0 + x.abs()), "{x}: {back}");
        }
    }
}
