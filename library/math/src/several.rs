//! Several tests at once, and what many runs on many tasks come to.

pub use ivx_op::holm;

use super::compare::probability_of_improvement;
use super::moments::{mean, real};
use super::order::{iqm, median};

/// The adjusted probabilities of Benjamini and Hochberg (1995): of those below `q`, a share of at most
/// `q` is expected to be false.
#[must_use]
pub fn benjamini_hochberg(ps: &[f64]) -> Vec<f64> {
    let order = ascending(ps);
    let mut adjusted = vec![0.0; ps.len()];
    let mut lowest = 1.0_f64;
    for (rank, &i) in order.iter().enumerate().rev() {
        lowest = lowest.min(ps[i] * real(ps.len()) / real(rank + 1));
        adjusted[i] = lowest;
    }
    adjusted
}

fn ascending(ps: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..ps.len()).collect();
    order.sort_by(|&i, &j| ps[i].total_cmp(&ps[j]));
    order
}

/// What scores of runs `[runs][tasks]` come to (Agarwal et al., 2021).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aggregate {
    /// The mean of all.
    pub mean: f64,
    /// The median over tasks of the mean over runs.
    pub median: f64,
    /// The interquartile mean of all.
    pub iqm: f64,
    /// How far scores fall short of 1, on average; what is above it does not count.
    pub optimality_gap: f64,
}

impl Aggregate {
    /// Of scores `[runs][tasks]`.
    ///
    /// # Panics
    /// If there are none, or runs have different numbers of tasks.
    #[must_use]
    pub fn of(scores: &[Vec<f64>]) -> Self {
        let all = scores.concat();
        let means: Vec<f64> = tasks(scores).iter().map(|task| mean(task)).collect();
        Self {
            mean: mean(&all),
            median: median(&means),
            iqm: iqm(&all),
            optimality_gap: shortfall(&all, 1.0),
        }
    }
}

/// How far scores fall short of a target, on average; what is above it does not count.
#[must_use]
pub fn shortfall(scores: &[f64], target: f64) -> f64 {
    let short = |x: &f64| if x.is_nan() { f64::NAN } else { target - x.min(target) };
    mean(&scores.iter().map(short).collect::<Vec<_>>())
}

/// The probability that a run of the first is above one of the second, averaged over tasks.
///
/// # Panics
/// If there are no scores, or runs have different numbers of tasks.
#[must_use]
pub fn improvement(scores: &[Vec<f64>], others: &[Vec<f64>]) -> f64 {
    let (ours, theirs) = (tasks(scores), tasks(others));
    assert_eq!(ours.len(), theirs.len(), "the same tasks");
    let each = ours.iter().zip(&theirs).map(|(x, y)| probability_of_improvement(x, y));
    mean(&each.collect::<Vec<_>>())
}

fn tasks(scores: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = scores.first().expect("there is a run").len();
    assert!(scores.iter().all(|run| run.len() == n), "as many tasks in each run");
    (0..n).map(|task| scores.iter().map(|run| run[task]).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adjustments_by_hand() {
        // Holm: 3·0.01, 2·0.02, 1·0.5; Benjamini and Hochberg: 3·0.01/1, 3·0.02/2, 0.5.
        let ps = [0.02, 0.5, 0.01];
        assert_eq!(holm(&ps), [0.04, 0.5, 0.03]);
        assert_eq!(benjamini_hochberg(&ps), [0.03, 0.5, 0.03]);
        assert_eq!(holm(&[0.9, 0.8]), [1.0, 1.0]);
        assert!(holm(&[]).is_empty());
    }

    #[test]
    fn two_runs_on_two_tasks() {
        let scores = [vec![0.0, 1.0], vec![0.5, 3.0]];
        let of = Aggregate::of(&scores);
        // Means of tasks 0.25 and 2; short by 1, 0, 0.5 and 0; no quarter is cut off of four but one.
        assert_eq!((of.mean, of.median, of.iqm, of.optimality_gap), (1.125, 1.125, 0.75, 0.375));
        assert_eq!(improvement(&scores, &[vec![0.2, 2.0]]), 0.5);
    }
}
