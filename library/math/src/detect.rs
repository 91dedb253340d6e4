//! How well a number tells what will happen.

use super::moments::{mean, real};
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
    fn ranks_do_not_see_distances() {
        let (xs, ys) = ([1.0, 2.0, 3.0], [1.0, 100.0, 101.0]);
        assert!((spearman(&xs, &ys) - 1.0).abs() < 1e-15 && pearson(&xs, &ys) < 0.9);
        assert_eq!(ranks(&[2.0, 1.0, 2.0]), [2.5, 1.0, 2.5]);
    }
}
