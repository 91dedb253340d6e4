//! How well a number tells what will happen.

use statrs::distribution::{ContinuousCDF as _, Normal};

use super::evidence::Evidence;
use super::moments::{mean, real, sample_variance};
use super::order::{quantile, sorted};

/// The area under the receiver operating characteristic: the probability that a score of what happened
/// is above one of what did not, ties half.
///
/// # Panics
/// If there is not one outcome a score, or all are the same.
#[must_use]
pub fn auroc(scores: &[f64], happened: &[bool]) -> f64 {
    let (yes, no) = split(scores, happened);
    super::compare::probability_of_improvement(&yes, &no)
}

/// The area under the receiver operating characteristic of a sample, and what is known of how far off it may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Auroc {
    /// The area, as [`auroc`] has it.
    pub estimate: f64,
    /// Its standard error; NaN where something happened, or did not, only once.
    pub stderr: f64,
    /// How many pairs of what happened and what did not can be made, none of both in two of them.
    pub n_pairs: usize,
}

impl Auroc {
    /// By `DeLong`, `DeLong` and Clarke-Pearson (1988), from which shares of the others each score is on the right side of, ties
    /// half.
    ///
    /// ```text
    /// V_i = (1/n) Σ_j ψ(x_i, y_j)    W_j = (1/m) Σ_i ψ(x_i, y_j)    stderr² = s²(V)/m + s²(W)/n
    /// ```
    ///
    /// `x_1, …, x_m` are scores of what happened, `y_1, …, y_n` of what did not, and `s²` has `ddof = 1`.
    ///
    /// # Panics
    /// As [`auroc`] does.
    #[must_use]
    pub fn delong(scores: &[f64], happened: &[bool]) -> Self {
        let estimate = auroc(scores, happened);
        let (yes, no) = split(scores, happened);
        let n_pairs = yes.len().min(no.len());
        if scores.iter().any(|score| score.is_nan()) {
            return Self { estimate: f64::NAN, stderr: f64::NAN, n_pairs };
        }
        let part = |own: &[f64], others: &[f64]| {
            let others = sorted(others);
            let below = |x: &f64| {
                let lower = others.partition_point(|other| other < x);
                let up_to = others.partition_point(|other| other <= x);
                real(lower + up_to) / (2.0 * real(others.len()))
            };
            sample_variance(&own.iter().map(below).collect::<Vec<_>>()) / real(own.len())
        };
        Self { estimate, stderr: (part(&yes, &no) + part(&no, &yes)).sqrt(), n_pairs }
    }

    /// The interval that holds the truth so often, by the normal distribution, within `[0, 1]`.
    ///
    /// Where no pair is the wrong way round, or each is, the standard error is 0 and tells nothing. Then it is Clopper and
    /// Pearson's interval of [`n_pairs`](Self::n_pairs) successes, or failures, which is never too short.
    ///
    /// # Panics
    /// If `confidence` is not between 0 and 1.
    #[must_use]
    pub fn interval(&self, confidence: f64) -> (f64, f64) {
        assert!(0.0 < confidence && confidence < 1.0, "a confidence between 0 and 1");
        let n = self.n_pairs;
        if self.estimate == 0.0 || self.estimate == 1.0 {
            let k = if self.estimate == 0.0 { 0 } else { n };
            return Evidence::Share { k, n }.interval(confidence);
        }
        let half = Normal::standard().inverse_cdf(0.5 + confidence / 2.0) * self.stderr;
        let ends = [self.estimate - half, self.estimate + half];
        ends.map(|end| end.clamp(0.0, 1.0)).into()
    }
}

/// The average precision: the mean, over what happened, of the share of what happened among all that
/// score at least as high.
///
/// # Panics
/// If there is not one outcome a score, or nothing happened.
#[must_use]
pub fn average_precision(scores: &[f64], happened: &[bool]) -> f64 {
    assert_eq!(scores.len(), happened.len(), "one outcome a score");
    let at_least = |threshold: f64, all: bool| {
        let pairs = scores.iter().zip(happened);
        pairs.filter(|(s, h)| **s >= threshold && (all || **h)).count()
    };
    let pairs = scores.iter().zip(happened).filter(|(_, happened)| **happened);
    let precisions: Vec<f64> =
        pairs.map(|(s, _)| real(at_least(*s, false)) / real(at_least(*s, true))).collect();
    assert!(!precisions.is_empty(), "something happened");
    mean(&precisions)
}

/// The share of what happened among scores above their quantile at `q`.
///
/// # Panics
/// If there is not one outcome a score, or `q` is outside `[0, 1]`.
#[must_use]
pub fn rate_above(scores: &[f64], happened: &[bool], q: f64) -> f64 {
    assert_eq!(scores.len(), happened.len(), "one outcome a score");
    let threshold = quantile(scores, q);
    let above: Vec<f64> = scores
        .iter()
        .zip(happened)
        .filter(|(score, _)| **score > threshold)
        .map(|(_, happened)| f64::from(u8::from(*happened)))
        .collect();
    mean(&above)
}

/// Pearson's correlation.
///
/// # Panics
/// If there are not as many of both.
#[must_use]
pub fn pearson(xs: &[f64], ys: &[f64]) -> f64 {
    assert_eq!(xs.len(), ys.len(), "as many of both");
    let (x, y) = (mean(xs), mean(ys));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        xs.iter().zip(ys).map(|(a, b)| f(a - x, b - y)).sum()
    };
    sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
}

/// Spearman's correlation: Pearson's of ranks; equal numbers have the mean of their ranks.
///
/// # Panics
/// If there are not as many of both.
#[must_use]
pub fn spearman(xs: &[f64], ys: &[f64]) -> f64 {
    pearson(&ranks(xs), &ranks(ys))
}

fn ranks(xs: &[f64]) -> Vec<f64> {
    let order = sorted(xs);
    let rank = |x: &f64| {
        let below = order.partition_point(|other| other < x);
        let up_to = order.partition_point(|other| other <= x);
        real(below + 1 + up_to) / 2.0
    };
    xs.iter().map(rank).collect()
}

fn split(scores: &[f64], happened: &[bool]) -> (Vec<f64>, Vec<f64>) {
    assert_eq!(scores.len(), happened.len(), "one outcome a score");
    let of = |wanted: bool| {
        let pairs = scores.iter().zip(happened).filter(|(_, h)| **h == wanted);
        pairs.map(|(score, _)| *score).collect()
    };
    (of(true), of(false))
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn one_of_four_pairs_is_the_wrong_way_round() {
        let (scores, happened) = ([0.9, 0.4, 0.6, 0.1], [true, true, false, false]);
        assert_eq!(auroc(&scores, &happened), 0.75);
        // At 0.9: 1 of 1; at 0.4: 2 of 3.
        assert!((average_precision(&scores, &happened) - 5.0 / 6.0).abs() < 1e-15);
        assert_eq!(rate_above(&scores, &happened, 0.5), 0.5);
    }

    #[test]
    fn an_area_has_a_standard_error() {
        // 0.9 is above both others and 0.4 above one; 0.6 is below one and 0.1 below both: twice a variance of 1/8,
        // over two.
        let happened = [true, true, false, false];
        let found = Auroc::delong(&[0.9, 0.4, 0.6, 0.1], &happened);
        assert_eq!(found, Auroc { estimate: 0.75, stderr: 0.125_f64.sqrt(), n_pairs: 2 });
        let (low, high) = found.interval(0.5);
        // The quartile of the normal distribution is 0.674 489 75; half of 0.95 would reach beyond 1.
        assert!((low - (0.75 - 0.674_489_75 * 0.125_f64.sqrt())).abs() < 1e-8);
        assert!((high - (0.75 + 0.674_489_75 * 0.125_f64.sqrt())).abs() < 1e-8);
        assert_eq!(found.interval(0.95).1, 1.0);
        let found = Auroc::delong(&[0.5, 0.9, 0.1, 0.5, 0.2], &[true, true, false, false, false]);
        // A tie is half a pair: 2½ of 3 and 3 of 3 are below; 2, 1½ and 2 of 2 above.
        let (v, w) = (1.0 / 72.0, 1.0 / 48.0);
        assert!((found.estimate - 5.5 / 6.0).abs() < 1e-15);
        assert!((found.stderr.powi(2) - (v / 2.0 + w / 3.0)).abs() < 1e-15);
    }

    #[test]
    fn an_area_of_one_is_not_certain() {
        let happened = [true, true, true, false, false, false, false];
        let found = Auroc::delong(&[7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0], &happened);
        assert_eq!((found.estimate, found.stderr, found.n_pairs), (1.0, 0.0, 3));
        // Three successes: 0.025^(1/3).
        let (low, high) = found.interval(0.95);
        assert!((low - 0.292_401_773_8).abs() < 1e-9 && high == 1.0, "{low}");
        let found = Auroc::delong(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], &happened);
        let (low, high) = found.interval(0.95);
        assert!((high - (1.0 - 0.292_401_773_8)).abs() < 1e-9 && low == 0.0, "{high}");
        // Of one alone no spread is known.
        let found = Auroc::delong(&[2.0, 1.0, 3.0], &[true, false, false]);
        assert!(found.stderr.is_nan() && found.interval(0.95).0.is_nan());
        let found = Auroc::delong(&[f64::NAN, 1.0, 3.0, 2.0], &[true, true, false, false]);
        assert!(found.estimate.is_nan() && found.interval(0.95).1.is_nan());
    }

    #[test]
    fn intervals_hold_the_area_as_often_as_they_say() {
        // Even scores, and those of what happened above by 0.4: the area is 1 − 0.6²/2.
        let (area, n) = (0.82, 2000);
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let happened: Vec<bool> = (0..100).map(|i| i < 30).collect();
        let [mut held, mut held_wrong] = [0, 0];
        for _ in 0..n {
            let score = |happened: &bool| rng.random::<f64>() + if *happened { 0.4 } else { 0.0 };
            let scores: Vec<f64> = happened.iter().map(score).collect();
            let found = Auroc::delong(&scores, &happened);
            let holds = |found: &Auroc| {
                let (low, high) = found.interval(0.9);
                low <= area && area <= high
            };
            held += u32::from(holds(&found));
            // As though each pair told as much as one seen alone.
            let alone = (found.estimate * (1.0 - found.estimate) / 2100.0).sqrt();
            held_wrong += u32::from(holds(&Auroc { stderr: alone, ..found }));
        }
        let [held, wrong] = [held, held_wrong].map(|held| f64::from(held) / f64::from(n));
        assert!((held - 0.9).abs() < 0.02 && wrong < 0.5, "{held}, {wrong}");
    }

    #[test]
    fn ranks_do_not_see_distances() {
        let (xs, ys) = ([1.0, 2.0, 3.0], [1.0, 100.0, 101.0]);
        assert!((spearman(&xs, &ys) - 1.0).abs() < 1e-15 && pearson(&xs, &ys) < 0.9);
        assert_eq!(ranks(&[2.0, 1.0, 2.0]), [2.5, 1.0, 2.5]);
    }
}
