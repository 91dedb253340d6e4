//! What a sample of seeds says of a mean, a share or any number made of all: intervals, and how probable the
//! like would be by chance. One rule for claims, tables and figures.

use ivx_op::Finding;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{Beta, Binomial, ContinuousCDF as _, DiscreteCDF as _, StudentsT};

use super::moments::{mean, real, skewness, std, stderr};
use super::order::{quantile_of_sorted, sorted};

/// How often a bootstrap draws a sample anew.
pub const N_RESAMPLES: usize = 1000;

/// Ends that are stretched further are shown as open.
const FURTHEST: f64 = 10.0;

/// What is seen of equal numbers: that nothing else comes so often.
const RARE: f64 = 0.05;

/// What was seen, and by which method it is judged.
#[derive(Clone, Debug, PartialEq)]
pub enum Evidence {
    /// A number with a standard error, by Student's t; stretched where the sample has a tail.
    Mean(Spread),
    /// So many successes among so many, by the binomial distribution.
    Share {
        /// Successes.
        k: usize,
        /// Trials.
        n: usize,
    },
    /// A number and what it is of resamples, sorted: by their percentiles. No level is below that of as many coins, since
    /// so few seeds know no more.
    Percentiles {
        /// The number.
        estimate: f64,
        /// Sorted.
        resamples: Vec<f64>,
        /// How many seeds there are.
        n: usize,
    },
    /// The sorted means of all pairs of differences, by Wilcoxon's signed ranks: of a symmetric distribution.
    Ranks {
        /// The median of the means of pairs.
        centre: f64,
        /// Sorted; `n (n + 1) / 2` of them.
        pairs: Vec<f64>,
        /// How many differences there were.
        n: usize,
    },
}

/// A number, and what is known of how far off it may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The number.
    pub estimate: f64,
    /// Its standard error.
    pub stderr: f64,
    /// The skewness of its distribution: of a mean that of the sample over `√n`.
    pub tail: f64,
    /// How many seeds it rests on.
    pub n: usize,
}

impl Spread {
    /// Of the mean of a sample.
    ///
    /// # Panics
    /// If there are fewer than two values.
    #[must_use]
    pub fn of_mean(xs: &[f64]) -> Self {
        assert!(xs.len() > 1, "an interval needs two values");
        let equal = xs.iter().all(|x| *x == xs[0]);
        let stderr = if equal { 0.0 } else { stderr(xs) };
        let tail = if stderr > 0.0 { skewness(xs) / real(xs.len()).sqrt() } else { 0.0 };
        Self { estimate: if equal { xs[0] } else { mean(xs) }, stderr, tail, n: xs.len() }
    }

    /// Of a number made of all seeds: its standard error from what it is of resamples, its tail from what it is with each
    /// seed in turn given up for others, as many for each. Of a mean it is that of [`of_mean`](Self::of_mean) but for the
    /// number of resamples.
    ///
    /// # Panics
    /// If there are no resamples, or fewer than two seeds.
    #[must_use]
    pub fn of_resamples(estimate: f64, resamples: &[f64], exchanged: &[f64], n: usize) -> Self {
        assert!(!resamples.is_empty() && n > 1, "an interval needs resamples of two seeds");
        if resamples.iter().all(|x| *x == estimate) {
            return Self { estimate, stderr: 0.0, tail: 0.0, n };
        }
        let stderr = std(resamples) * (real(n) / real(n - 1)).sqrt();
        let without = exchanged.chunks((exchanged.len() / n).max(1)).map(mean);
        let influences: Vec<f64> = without.map(|without| estimate - without).collect();
        Self { estimate, stderr, tail: skewness(&influences) / real(n).sqrt(), n }
    }

    /// The same by Student's t alone.
    #[must_use]
    pub fn plain(self) -> Self {
        Self { tail: 0.0, ..self }
    }

    /// The interval of Student's t, each end stretched by the sample's tail on its side.
    fn interval(&self, confidence: f64) -> (f64, f64) {
        if self.stderr == 0.0 {
            return (self.estimate, self.estimate);
        }
        let half = self.student().inverse_cdf(0.5 + confidence / 2.0) * self.stderr;
        let [below, above] = [-self.tail, self.tail].map(|tail| half * stretch(tail, self.n));
        (self.estimate - below, self.estimate + above)
    }

    /// How probable so low a number would be, were the truth `bound`.
    fn p_below(&self, bound: f64, or_equal: bool) -> f64 {
        if self.stderr == 0.0 {
            let on_side = self.estimate < bound || or_equal && self.estimate == bound;
            return if on_side { (1.0 - RARE).powf(real(self.n)) } else { 1.0 };
        }
        let t = (bound - self.estimate) / (self.stderr * stretch(self.tail, self.n));
        // Spreads too small for a number leave no quotient.
        if t.is_nan() { f64::NAN } else { self.student().sf(t.clamp(-1e100, 1e100)) }
    }

    fn mirrored(&self) -> Self {
        Self { estimate: -self.estimate, tail: -self.tail, ..*self }
    }

    fn student(&self) -> StudentsT {
        StudentsT::new(0.0, 1.0, real(self.n - 1)).expect("positive degrees of freedom")
    }
}

/// By how much Student's interval is too short towards a tail, from the simulation in `docs/claims.md`.
///
/// The tail is the skewness of the mean's distribution. Up to a bound Student's t needs no help, and beyond it, so
/// much that it grows by a power of e. The bound is none at 5 seeds, where skewed distributions show half of their
/// samples no tail, and steady from 20 on. A tail on the other side shortens the interval by `1/n` at most.
#[must_use]
pub fn stretch(tail: f64, n: usize) -> f64 {
    /// One over the number of seeds, and the bound for it.
    const MANY: (f64, f64) = (0.05, 0.15);
    const SOME: (f64, f64) = (0.1, 0.19);
    const FEW: (f64, f64) = (0.2, 0.0);
    if tail.is_nan() {
        return f64::NAN;
    }
    let n = real(n.max(FEWEST));
    if tail < 0.0 {
        return (1.0 + tail).max(1.0 - 1.0 / n);
    }
    let rate = (200.0 / n).clamp(8.0, 20.0);
    let inverse = (1.0 / n).max(MANY.0);
    let between =
        |(x0, y0): (f64, f64), (x1, y1): (f64, f64)| y0 + (y1 - y0) * (inverse - x0) / (x1 - x0);
    let bound = if n >= 10.0 { between(MANY, SOME) } else { between(SOME, FEW) };
    (rate * (tail - bound.max(0.0))).max(0.0).exp()
}

impl Evidence {
    /// Of the mean of a sample by the percentiles of its bootstrap.
    ///
    /// # Panics
    /// If there are no values.
    #[must_use]
    pub fn bootstrap(xs: &[f64], rng: &mut ChaCha8Rng) -> Self {
        assert!(!xs.is_empty(), "a sample");
        let mut one = |_| {
            let drawn: Vec<f64> = xs.iter().map(|_| xs[rng.random_range(0..xs.len())]).collect();
            mean(&drawn)
        };
        let means: Vec<f64> = (0..N_RESAMPLES).map(&mut one).collect();
        Self::percentiles(mean(xs), &means, xs.len())
    }

    /// Of a number made of all seeds, by the percentiles of what it is of resamples of them.
    #[must_use]
    pub fn percentiles(estimate: f64, resamples: &[f64], n: usize) -> Self {
        Self::Percentiles { estimate, resamples: sorted(resamples), n }
    }

    /// Of the centre of a symmetric distribution by signed ranks.
    ///
    /// # Panics
    /// If there are no values.
    #[must_use]
    pub fn ranks(xs: &[f64]) -> Self {
        let pairs = xs.iter().enumerate().flat_map(|(i, x)| {
            xs[i..].iter().map(move |y| if x == y { *x } else { f64::midpoint(*x, *y) })
        });
        let pairs = sorted(&pairs.collect::<Vec<_>>());
        Self::Ranks { centre: quantile_of_sorted(&pairs, 0.5), pairs, n: xs.len() }
    }

    /// What the number is estimated at.
    #[must_use]
    pub fn estimate(&self) -> f64 {
        match self {
            Self::Mean(spread) => spread.estimate,
            Self::Share { k, n } => real(*k) / real(*n),
            Self::Percentiles { estimate, .. } => *estimate,
            Self::Ranks { centre, .. } => *centre,
        }
    }

    /// The interval that holds the truth so often. An end is infinite where nothing is known of it.
    ///
    /// # Panics
    /// If `confidence` is not between 0 and 1.
    #[must_use]
    pub fn interval(&self, confidence: f64) -> (f64, f64) {
        assert!(0.0 < confidence && confidence < 1.0, "a confidence between 0 and 1");
        let outside = (1.0 - confidence) / 2.0;
        if self.is_unknown() {
            return (f64::NAN, f64::NAN);
        }
        match self {
            Self::Mean(spread) => spread.interval(confidence),
            Self::Share { k, n } => clopper_pearson(*k, *n, outside),
            Self::Percentiles { n, .. } if 0.5_f64.powf(real(*n)) > outside => {
                (f64::NEG_INFINITY, f64::INFINITY)
            }
            Self::Percentiles { resamples, .. } => (
                quantile_of_sorted(resamples, outside),
                quantile_of_sorted(resamples, 1.0 - outside),
            ),
            Self::Ranks { pairs, n, .. } => {
                let rejected = cumulative_ranks(*n).iter().take_while(|p| **p <= outside).count();
                match rejected.checked_sub(1) {
                    Some(last) => (pairs[last], pairs[pairs.len() - 1 - last]),
                    None => (f64::NEG_INFINITY, f64::INFINITY),
                }
            }
        }
    }

    /// How probable so low a number, or a lower one, would be by chance, were the truth `bound`: 1 where it is
    /// not below at all.
    ///
    /// - `or_equal`: whether numbers that are all equal to `bound` count as below.
    #[must_use]
    pub fn p_below(&self, bound: f64, or_equal: bool) -> f64 {
        if self.is_unknown() || bound.is_nan() {
            return f64::NAN;
        }
        let not_below = |xs: &[f64]| {
            xs.iter().filter(|x| if or_equal { **x > bound } else { **x >= bound }).count()
        };
        match self {
            Self::Mean(spread) => spread.p_below(bound, or_equal),
            Self::Share { k, n } => match bound {
                _ if bound > 1.0 || or_equal && bound >= 1.0 => 0.0,
                _ if bound <= 0.0 => 1.0,
                _ => Binomial::new(bound, *n as u64).map_or(f64::NAN, |law| law.cdf(*k as u64)),
            },
            Self::Percentiles { resamples, n, .. } => {
                let share = (real(not_below(resamples)) + 1.0) / (real(resamples.len()) + 1.0);
                share.max(0.5_f64.powf(real(*n)))
            }
            Self::Ranks { pairs, n, .. } => cumulative_ranks(*n)[not_below(pairs)],
        }
    }

    /// Whether a number that it is made of is not one.
    fn is_unknown(&self) -> bool {
        match self {
            Self::Mean(Spread { estimate, stderr, tail, .. }) => {
                estimate.is_nan() || tail.is_nan() || !stderr.is_finite()
            }
            Self::Share { .. } => false,
            Self::Percentiles { estimate, resamples, .. } => {
                estimate.is_nan() || resamples.iter().any(|x| x.is_nan())
            }
            Self::Ranks { centre, pairs, .. } => {
                centre.is_nan() || pairs.iter().any(|x| x.is_nan())
            }
        }
    }

    /// As [`p_below`](Self::p_below), of so high a number.
    #[must_use]
    pub fn p_above(&self, bound: f64, or_equal: bool) -> f64 {
        let mirrored = match self {
            Self::Mean(spread) => Self::Mean(spread.mirrored()),
            Self::Share { k, n } => {
                return Self::Share { k: n - k, n: *n }.p_below(1.0 - bound, or_equal);
            }
            Self::Percentiles { estimate, resamples, n } => {
                let resamples = resamples.iter().rev().map(|x| -x).collect();
                Self::Percentiles { estimate: -estimate, resamples, n: *n }
            }
            Self::Ranks { centre, pairs, n } => {
                let pairs = pairs.iter().rev().map(|x| -x).collect();
                Self::Ranks { centre: -centre, pairs, n: *n }
            }
        };
        mirrored.p_below(-bound, or_equal)
    }
}

/// Fewer seeds decide nothing.
const FEWEST: usize = Finding::MIN_SEEDS;

/// With which chance a difference that these seeds could have told would have been told.
const POWER: f64 = 0.8;

impl Evidence {
    /// The interval as it is shown: open at an end so far away that it tells nothing, which is more than ten times as far
    /// as Student's.
    ///
    /// # Panics
    /// If `confidence` is not between 0 and 1.
    #[must_use]
    pub fn shown_interval(&self, confidence: f64) -> (f64, f64) {
        let (low, high) = self.interval(confidence);
        let Self::Mean(spread) = self else { return (low, high) };
        let opened = |tail: f64| stretch(tail, spread.n) > FURTHEST;
        let low = if opened(-spread.tail) { f64::NEG_INFINITY } else { low };
        (low, if opened(spread.tail) { f64::INFINITY } else { high })
    }

    /// The smallest difference that so many seeds of this spread would tell in four of five cases; none where
    /// nothing is known of it.
    #[must_use]
    pub fn smallest(&self, confidence: f64) -> Option<f64> {
        let Self::Mean(spread) = self else { return None };
        let told = stretch(spread.tail.abs(), spread.n) <= FURTHEST;
        Some(spread.smallest(spread.n, confidence)).filter(|x| told && *x > 0.0 && x.is_finite())
    }

    /// How many seeds would tell that the truth is so far away from a bound, in four of five cases, were it what it is
    /// estimated at; none beyond a hundred thousand.
    #[must_use]
    pub fn seeds_to_tell(&self, distance: f64, confidence: f64) -> Option<usize> {
        let Self::Mean(spread) = self else { return None };
        if spread.stderr == 0.0 {
            let outside = (1.0 - confidence) / 2.0;
            return (FEWEST..=100_000).find(|n| (1.0 - RARE).powf(real(*n)) <= outside);
        }
        let told = |n: usize| spread.smallest(n, confidence) <= distance.abs();
        if told(FEWEST) {
            return Some(FEWEST);
        }
        let most = (3..=17).map(|power| 1 << power).find(|n| told(*n))?;
        let (mut few, mut enough) = (FEWEST.max(most / 2), most);
        while enough - few > 1 {
            let half = few.midpoint(enough);
            if told(half) { enough = half } else { few = half }
        }
        Some(enough)
    }

    /// Whether Student's t alone would be as sure as asked that the truth is on one side of `bound`.
    #[must_use]
    pub fn plain_tells(&self, bound: f64, confidence: f64) -> bool {
        let Self::Mean(spread) = self else { return false };
        let plain = Self::Mean(spread.plain());
        let outside = (1.0 - confidence) / 2.0;
        spread.stderr == 0.0 && spread.estimate != bound
            || plain.p_below(bound, false) <= outside
            || plain.p_above(bound, false) <= outside
    }
}

impl Spread {
    /// The smallest difference told with so many seeds of this spread, towards the longer tail.
    fn smallest(&self, n: usize, confidence: f64) -> f64 {
        let (share, law) = ((real(self.n) / real(n)).sqrt(), Self { n, ..*self }.student());
        let stretched =
            stretch(self.tail.abs() * share, n) * law.inverse_cdf(0.5 + confidence / 2.0);
        (stretched + law.inverse_cdf(POWER)) * self.stderr * share
    }
}

/// Clopper and Pearson's interval for a probability: exact, and never too short.
fn clopper_pearson(k: usize, n: usize, outside: f64) -> (f64, f64) {
    let beta = |a: usize, b: usize, p: f64| {
        Beta::new(real(a), real(b)).map_or(f64::NAN, |law| law.inverse_cdf(p))
    };
    let low = if k == 0 { 0.0 } else { beta(k, n - k + 1, outside) };
    let high = if k == n { 1.0 } else { beta(k + 1, n - k, 1.0 - outside) };
    (low, high)
}

/// How probable each sum of ranks of differences above 0, or a lower one, is where signs are by chance.
fn cumulative_ranks(n: usize) -> Vec<f64> {
    let mut shares = vec![0.0; n * (n + 1) / 2 + 1];
    shares[0] = 1.0;
    for rank in 1..=n {
        for sum in (0..shares.len()).rev() {
            let with = sum.checked_sub(rank).map_or(0.0, |rest| shares[rest]);
            shares[sum] = f64::midpoint(shares[sum], with);
        }
    }
    let mut total = 0.0;
    for share in &mut shares {
        total += *share;
        *share = total.min(1.0);
    }
    shares
}

#[cfg(test)]
mod tests;
