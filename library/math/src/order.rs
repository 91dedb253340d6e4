//! What depends on the order of numbers. Numbers are sorted by `total_cmp`.

use super::moments::{mean, real};

/// The numbers in ascending order.
#[must_use]
pub fn sorted(xs: &[f64]) -> Vec<f64> {
    let mut xs = xs.to_vec();
    xs.sort_by(f64::total_cmp);
    xs
}

/// The smallest number, NaN if any is; infinity of nothing.
#[must_use]
pub fn min(xs: &[f64]) -> f64 {
    xs.iter().copied().fold(f64::INFINITY, lower)
}

/// The smaller of two numbers, NaN if one is.
#[must_use]
pub fn lower(low: f64, x: f64) -> f64 {
    if x < low || x.is_nan() { x } else { low }
}

/// The larger of two numbers, NaN if one is.
#[must_use]
pub fn higher(high: f64, x: f64) -> f64 {
    if x > high || x.is_nan() { x } else { high }
}

/// The largest number, NaN if any is; minus infinity of nothing.
#[must_use]
pub fn max(xs: &[f64]) -> f64 {
    xs.iter().copied().fold(f64::NEG_INFINITY, higher)
}

/// The place of the first of the largest numbers; `None` of nothing.
#[must_use]
pub fn argmax(xs: &[f64]) -> Option<usize> {
    (0..xs.len()).reduce(|best, i| if xs[i] > xs[best] { i } else { best })
}

/// The numbers on a scale on which the smallest is 0 and the largest 1; 0 if all are equal.
#[must_use]
pub fn rescaled(xs: &[f64]) -> Vec<f64> {
    let (low, high) = (min(xs), max(xs));
    let place = |x: &f64| if high > low { (x - low) / (high - low) } else { 0.0 };
    xs.iter().map(place).collect()
}

/// The quantile at `q`, between neighbours by linear interpolation (type 7 of Hyndman and Fan); infinite between
/// a number and an infinity; NaN if any number is.
///
/// # Panics
/// If `xs` is empty or `q` is outside `[0, 1]`.
#[must_use]
pub fn quantile(xs: &[f64], q: f64) -> f64 {
    if xs.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    quantile_of_sorted(&sorted(xs), q)
}

/// The quantile at `q` of numbers in ascending order.
///
/// # Panics
/// If `xs` is empty or `q` is outside `[0, 1]`.
#[must_use]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a place among `xs`: whole, not negative and below their number"
)]
pub fn quantile_of_sorted(xs: &[f64], q: f64) -> f64 {
    assert!(!xs.is_empty() && (0.0..=1.0).contains(&q), "a quantile of something, in [0, 1]");
    let place = real(xs.len() - 1) * q;
    let (low, high) = (xs[place.floor() as usize], xs[place.ceil() as usize]);
    between(low, high, place - place.floor())
}

/// The number this share of the way from `low` to `high`, which is not below.
///
/// Between a number and an infinity lies the infinity, and between the two what is not a number.
fn between(low: f64, high: f64, share: f64) -> f64 {
    let apart = high - low;
    match share {
        _ if low == high || share == 0.0 => low,
        0.5 => f64::midpoint(low, high),
        _ if !apart.is_finite() => (1.0 - share) * low + share * high,
        // From the nearer end, as NumPy does it: so that a sample and its negative agree.
        _ if share < 0.5 => (low + apart * share).min(high),
        _ => (high - apart * (1.0 - share)).max(low),
    }
}

/// The median; NaN if any number is.
///
/// # Panics
/// If `xs` is empty.
#[must_use]
pub fn median(xs: &[f64]) -> f64 {
    quantile(xs, 0.5)
}

/// The interquartile mean: without the `⌊n/4⌋` lowest and the `⌊n/4⌋` highest numbers.
///
/// It is `scipy.stats.trim_mean(xs, 0.25)`; NaN of nothing, and if any number is.
#[must_use]
pub fn iqm(xs: &[f64]) -> f64 {
    if xs.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    let cut = xs.len() / 4;
    mean(&sorted(xs)[cut..xs.len() - cut])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_between_the_smallest_and_the_largest() {
        assert_eq!(rescaled(&[3.0, 1.0, 5.0]), [0.5, 0.0, 1.0]);
        assert_eq!(rescaled(&[3.0, 3.0]), [0.0, 0.0]);
    }

    #[test]
    fn the_first_of_the_largest_wins() {
        assert_eq!(argmax(&[1.0, 3.0, 3.0, -1.0]), Some(1));
        assert_eq!(argmax(&[]), None);
        assert_eq!((min(&[2.0, -1.0, 0.0]), max(&[2.0, -1.0, 0.0])), (-1.0, 2.0));
    }

    #[test]
    fn what_is_not_a_number_shows_through() {
        for xs in [[f64::NAN, 1.0, 2.0, 3.0], [1.0, 2.0, 3.0, f64::NAN]] {
            let found = [min(&xs), max(&xs), median(&xs), iqm(&xs)];
            assert!(found.iter().all(|x| x.is_nan()), "{found:?}");
        }
    }

    #[test]
    #[expect(clippy::unreadable_literal, reason = "as Python prints them")]
    fn golden_numbers_beside_numpy() {
        use super::super::moments::sum;
        const INF: f64 = f64::INFINITY;
        const NAN: f64 = f64::NAN;
        // The exact sum, np.median, np.min and np.max.
        let cases: &[(&[f64], [f64; 4])] = &[
            (&[1.0, INF, INF], [INF, INF, 1.0, INF]),
            (&[1.0, 2.0, INF], [INF, 2.0, 1.0, INF]),
            (&[-INF, 1.0, 2.0], [-INF, 1.0, -INF, 2.0]),
            (&[-INF, INF], [NAN, NAN, -INF, INF]),
            (&[-INF, -INF, 3.0, 4.0], [-INF, -INF, -INF, 4.0]),
            (&[INF, INF], [INF, INF, INF, INF]),
            (&[NAN, 1.0], [NAN, NAN, NAN, NAN]),
            (&[0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1], [0.7000000000000001, 0.1, 0.1, 0.1]),
            (&[1e+308, 1e+308, -1e+308], [1e+308, 1e+308, -1e+308, 1e+308]),
            (&[1.0, 2.0, 4.0, 8.0], [15.0, 3.0, 1.0, 8.0]),
            (&[5e-324, 0.0, 5e-324], [1e-323, 5e-324, 0.0, 5e-324]),
        ];
        for (xs, expected) in cases {
            let found = [sum(xs), median(xs), min(xs), max(xs)];
            let same = |(a, b): (&f64, &f64)| a == b || a.is_nan() && b.is_nan();
            assert!(found.iter().zip(expected).all(same), "{xs:?}: {found:?}");
        }
        // Type 7 of R, where NumPy says NaN.
        assert_eq!(quantile(&[1.0, 0.5, INF], 1.0), INF);
        assert_eq!(quantile(&[-1.0, -0.5, -INF], 0.0), -INF);
        assert_eq!(quantile(&[-1.0, -0.5, -INF], 0.25), -INF);
        assert_eq!(quantile(&[-1.0, -0.5, -INF], 0.75), -0.75);
        assert_eq!(iqm(&[-INF, 1.0, 2.0, INF]), 1.5);
        assert_eq!(quantile(&[-1.5e308, 1.5e308], 0.75), 0.75e308);
    }

    #[test]
    fn quantiles_interpolate() {
        // Place 3·0.25 = 0.75 between 1 and 2.
        assert_eq!(quantile(&[4.0, 1.0, 3.0, 2.0], 0.25), 1.75);
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), 2.5);
        assert_eq!(quantile(&[4.0, 1.0, 3.0], 0.0), 1.0);
        assert_eq!(quantile(&[4.0, 1.0, 3.0], 1.0), 4.0);
        assert_eq!(quantile(&[7.0], 0.3), 7.0);
    }

    #[test]
    fn the_interquartile_mean_ignores_the_ends() {
        // Seven numbers lose one at each end.
        assert_eq!(iqm(&[-100.0, 1.0, 2.0, 3.0, 4.0, 5.0, 900.0]), 3.0);
        assert_eq!(iqm(&[1.0, 2.0, 6.0]), 3.0);
    }
}
