//! Two samples: how far they lie apart, and how surprising that would be by chance.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use super::moments::{mean, real, sample_variance, stderr};

/// Student's t of a difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TTest {
    /// The difference over its standard error.
    pub t: f64,
    /// Degrees of freedom.
    pub df: f64,
    /// The difference.
    pub difference: f64,
    /// Its standard error.
    pub stderr: f64,
}

impl TTest {
    /// Welch's test of the means of two samples, whose variances may differ.
    ///
    /// # Panics
    /// If a sample has fewer than two values.
    #[must_use]
    pub fn welch(xs: &[f64], ys: &[f64]) -> Self {
        assert!(xs.len() > 1 && ys.len() > 1, "a variance needs two values");
        let [x, y] = [xs, ys].map(|sample| stderr(sample).powi(2));
        let difference = mean(xs) - mean(ys);
        let share = |part: f64, sample: &[f64]| part.powi(2) / real(sample.len() - 1);
        let df = (x + y).powi(2) / (share(x, xs) + share(y, ys));
        let stderr = (x + y).sqrt();
        Self { t: difference / stderr, df, difference, stderr }
    }

    /// The test of pairs: of the mean of their differences.
    ///
    /// # Panics
    /// If there are fewer than two, or not as many of both.
    #[must_use]
    pub fn paired(xs: &[f64], ys: &[f64]) -> Self {
        let differences = differences(xs, ys);
        assert!(differences.len() > 1, "a variance needs two values");
        let (difference, stderr) = (mean(&differences), stderr(&differences));
        Self { t: difference / stderr, df: real(differences.len() - 1), difference, stderr }
    }

    /// How probable at least as large a difference, of either sign, is by chance.
    #[must_use]
    pub fn p_two_sided(&self) -> f64 {
        2.0 * self.distribution().sf(self.t.abs())
    }

    /// How probable at least as large a difference is by chance.
    #[must_use]
    pub fn p_greater(&self) -> f64 {
        self.distribution().sf(self.t)
    }

    /// The interval of the difference.
    ///
    /// # Panics
    /// If `confidence` is not between 0 and 1.
    #[must_use]
    pub fn interval(&self, confidence: f64) -> (f64, f64) {
        assert!(0.0 < confidence && confidence < 1.0, "a confidence between 0 and 1");
        let half = self.distribution().inverse_cdf(0.5 + confidence / 2.0) * self.stderr;
        (self.difference - half, self.difference + half)
    }

    fn distribution(&self) -> StudentsT {
        StudentsT::new(0.0, 1.0, self.df).expect("positive degrees of freedom")
    }
}

/// Cohen's d: the difference of means in units of the root of the mean of both variances.
///
/// # Panics
/// If a sample has fewer than two values.
#[must_use]
pub fn cohen_d(xs: &[f64], ys: &[f64]) -> f64 {
    assert!(xs.len() > 1 && ys.len() > 1, "a variance needs two values");
    let variance = f64::midpoint(sample_variance(xs), sample_variance(ys));
    (mean(xs) - mean(ys)) / variance.sqrt()
}

/// Mann and Whitney's U of the first sample: how many pairs it has the larger number of, ties half.
#[must_use]
pub fn mann_whitney_u(xs: &[f64], ys: &[f64]) -> f64 {
    let won = |x: &f64, y: &f64| match x.total_cmp(y) {
        _ if x == y => 0.5,
        std::cmp::Ordering::Greater => 1.0,
        _ => 0.0,
    };
    xs.iter().map(|x| ys.iter().map(|y| won(x, y)).sum::<f64>()).sum()
}

/// The probability that a number of the first sample is above one of the second, ties half.
///
/// # Panics
/// If a sample is empty.
#[must_use]
pub fn probability_of_improvement(xs: &[f64], ys: &[f64]) -> f64 {
    assert!(!xs.is_empty() && !ys.is_empty(), "pairs of something");
    mann_whitney_u(xs, ys) / real(xs.len() * ys.len())
}

/// How probable at least as extreme a U, on either side, is for samples of one distribution without
/// ties; exact.
///
/// # Panics
/// If a sample is empty.
#[must_use]
pub fn mann_whitney_p(xs: &[f64], ys: &[f64]) -> f64 {
    let (n, m) = (xs.len(), ys.len());
    assert!(n > 0 && m > 0, "pairs of something");
    let u = mann_whitney_u(xs, ys);
    let least = u.max(real(n * m) - u);
    // How many arrangements of i and j numbers have each U: the largest is of the first or second.
    let mut counts = vec![vec![vec![0.0]; m + 1]; n + 1];
    counts[0].iter_mut().for_each(|count| *count = vec![1.0]);
    for i in 1..=n {
        counts[i][0] = vec![1.0];
        for j in 1..=m {
            let (of_first, of_second) = (&counts[i - 1][j], &counts[i][j - 1]);
            let at = |list: &[f64], u: usize| list.get(u).copied().unwrap_or(0.0);
            let here = (0..=i * j).map(|u| {
                let won = u.checked_sub(j).map_or(0.0, |u| at(of_first, u));
                won + at(of_second, u)
            });
            counts[i][j] = here.collect();
        }
    }
    let counts = &counts[n][m];
    let extreme: f64 =
        counts.iter().enumerate().filter(|(u, _)| real(*u) >= least).map(|(_, c)| c).sum();
    (2.0 * extreme / counts.iter().sum::<f64>()).min(1.0)
}

/// Wilcoxon's signed-rank statistic of pairs without ties: the smaller of the sums of ranks of
/// differences above and below 0, and how probable at least as small a one is by chance; exact.
///
/// # Panics
/// If there are not as many of both, or none.
#[must_use]
pub fn wilcoxon(xs: &[f64], ys: &[f64]) -> (f64, f64) {
    let mut differences = differences(xs, ys);
    assert!(!differences.is_empty(), "pairs of something");
    differences.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let n = differences.len();
    let above: usize = (1..=n).filter(|rank| differences[rank - 1] > 0.0).sum();
    let w = above.min(n * (n + 1) / 2 - above);
    // How many choices of ranks have each sum.
    let mut counts = vec![0.0; n * (n + 1) / 2 + 1];
    counts[0] = 1.0;
    for rank in 1..=n {
        for sum in (rank..counts.len()).rev() {
            counts[sum] += counts[sum - rank];
        }
    }
    let p = 2.0 * counts[..=w].iter().sum::<f64>() / counts.iter().sum::<f64>();
    (real(w), p.min(1.0))
}

/// The most pairs whose signs are flipped in every way.
pub const MOST_FLIPS: usize = 20;

/// How probable at least as large a mean difference of pairs, of either sign, is when each sign is by
/// chance; exact.
///
/// # Panics
/// If there are not as many of both, none, or more than [`MOST_FLIPS`].
#[must_use]
pub fn sign_flip_p(xs: &[f64], ys: &[f64]) -> f64 {
    let differences = differences(xs, ys);
    let n = differences.len();
    assert!((1..=MOST_FLIPS).contains(&n), "between one and {MOST_FLIPS} pairs");
    let flipped = |signs: u32| -> f64 {
        let signed = differences.iter().enumerate();
        signed.map(|(i, d)| if signs >> i & 1 == 1 { -d } else { *d }).sum()
    };
    let observed = flipped(0).abs() * (1.0 - 1e-12);
    let extreme = (0..1_u32 << n).filter(|signs| flipped(*signs).abs() >= observed).count();
    real(extreme) / real(1 << n)
}

fn differences(xs: &[f64], ys: &[f64]) -> Vec<f64> {
    assert_eq!(xs.len(), ys.len(), "as many of both");
    xs.iter().zip(ys).map(|(x, y)| x - y).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_above_three_is_the_rarest_of_twenty() {
        // 6 over 3 = 20 arrangements, of which one and its mirror are as extreme.
        let (high, low) = ([4.0, 5.0, 6.0], [1.0, 2.0, 3.0]);
        assert_eq!(mann_whitney_u(&high, &low), 9.0);
        assert!((mann_whitney_p(&high, &low) - 0.1).abs() < 1e-15);
        assert_eq!(probability_of_improvement(&high, &low), 1.0);
        assert_eq!(probability_of_improvement(&[1.0, 2.0], &[1.0, 2.0]), 0.5);
    }

    #[test]
    fn all_signs_alike_are_two_of_all() {
        let (xs, ys) = ([1.0, 2.0, 3.0, 4.0], [0.0; 4]);
        assert_eq!(wilcoxon(&xs, &ys), (0.0, 0.125));
        assert_eq!(sign_flip_p(&xs, &ys), 0.125);
    }

    #[test]
    fn welch_with_equal_samples_is_student() {
        // Means 2 and 4, both of variance 1: t = −2 / √(2/3), and 2 (3 − 1) degrees of freedom.
        let test = TTest::welch(&[1.0, 2.0, 3.0], &[3.0, 4.0, 5.0]);
        assert!((test.t + 6.0_f64.sqrt()).abs() < 1e-12 && (test.df - 4.0).abs() < 1e-12);
        let (low, high) = test.interval(0.95);
        let half = 2.776_445_105 * (2.0_f64 / 3.0).sqrt();
        assert!((low + 2.0 + half).abs() < 1e-8 && (high + 2.0 - half).abs() < 1e-8);
        assert!((test.p_two_sided() - 2.0 * (1.0 - test.p_greater())).abs() < 1e-12);
    }
}
