//! What replications say about a mean.

use std::iter::Sum;
use std::ops::Add;

use ivx_math::evidence::{Evidence, Spread};
use ivx_math::moments::mean;
use ivx_op::{MISSING, is_missing};
use serde::{Deserialize, Serialize};

/// A mean and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(super) struct Estimate {
    /// The mean.
    pub(super) mean: f64,
    /// The 95 % interval; none for a single sample or one that is not finite. An end of which so few seeds say nothing
    /// is infinite.
    pub(super) interval: Option<(f64, f64)>,
    /// What it could not be made of.
    pub(super) lacks: Lacks,
}

/// How many of some values are missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Lacks {
    /// These.
    pub missing: usize,
    /// Of so many.
    pub of: usize,
    /// Whether what is shown is made of the rest.
    pub skips: bool,
}

impl Lacks {
    /// Whether none are.
    #[must_use]
    pub fn nothing(&self) -> bool {
        self.missing == 0
    }

    /// What a figure says of it; nothing if none are.
    pub(super) fn told(&self) -> String {
        let Self { missing, of, skips } = *self;
        let verb = if missing == 1 { "is" } else { "are" };
        match (missing, skips) {
            (0, _) => String::new(),
            (_, true) => format!(
                "{missing} of {of} values {verb} missing; what is shown is made of the rest"
            ),
            (_, false) => {
                format!("{missing} of {of} values {verb} missing, and what is made of them")
            }
        }
    }
}

impl Add for Lacks {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let skips = self.skips || other.skips;
        Self { missing: self.missing + other.missing, of: self.of + other.of, skips }
    }
}

impl Sum for Lacks {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), Add::add)
    }
}

/// The mean of samples of which some may be missing: it is missing too, unless the rest are to make it.
///
/// # Panics
/// If there are no samples.
pub(super) fn interval_of_rest(samples: &[f64], skips: bool) -> Estimate {
    let rest: Vec<f64> = samples.iter().copied().filter(|x| !is_missing(*x)).collect();
    let lacks = Lacks { missing: samples.len() - rest.len(), of: samples.len(), skips };
    if rest.is_empty() || !skips && !lacks.nothing() {
        return Estimate { mean: MISSING, interval: None, lacks };
    }
    Estimate { lacks, ..interval(&rest) }
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
    Estimate { mean: mean(samples), interval, lacks: Lacks::default() }
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
        assert_eq!(interval(&[0.5]), Estimate { mean: 0.5, ..Estimate::default() });
        assert_eq!(interval(&[0.5, 0.5]).interval, Some((0.5, 0.5)));
        let broken = interval(&[f64::NAN, 1.0]);
        assert!(broken.mean.is_nan() && broken.interval.is_none());
    }

    #[test]
    fn what_is_missing_is_left_out_only_where_that_is_said() {
        let samples = [1.0, MISSING, 3.0];
        let lacks = |skips| Lacks { missing: 1, of: 3, skips };
        let kept = interval_of_rest(&samples, true);
        assert_eq!(kept, Estimate { lacks: lacks(true), ..interval(&[1.0, 3.0]) });
        let lost = interval_of_rest(&samples, false);
        assert!(is_missing(lost.mean) && lost.interval.is_none());
        assert_eq!(lost.lacks, lacks(false));
        assert!(is_missing(interval_of_rest(&[MISSING], true).mean));
        // What was computed and is not a number is no less there.
        let odd = interval_of_rest(&[f64::NAN, 1.0], true);
        assert!(odd.mean.is_nan() && !is_missing(odd.mean) && odd.lacks.nothing());
        let both = lacks(true) + Lacks { missing: 0, of: 2, skips: true };
        assert_eq!(both.told(), "1 of 5 values is missing; what is shown is made of the rest");
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
