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

/// The sum, exact and rounded once (Shewchuk, 1997), in whatever order the values are; 0 of nothing.
///
/// It is infinite where it is beyond the largest number or a value is infinite, and NaN where a value is, or two
/// are infinite with different signs.
#[must_use]
pub fn sum(xs: &[f64]) -> f64 {
    if !xs.iter().all(|x| x.is_finite()) {
        return xs.iter().filter(|x| !x.is_finite()).sum();
    }
    let largest = xs.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    if largest == 0.0 {
        // Only the sum of nothing but −0 is −0.
        let is_negative = !xs.is_empty() && xs.iter().all(|x| x.is_sign_negative());
        return if is_negative { -0.0 } else { 0.0 };
    }
    let mut parts = Parts::default();
    if largest < f64::MAX / 4.0 / real(xs.len()) {
        for x in xs {
            parts.add(*x);
        }
        return parts.rounded();
    }
    // With signs by turns no part overflows before the whole does.
    let (mut above, mut below): (Vec<f64>, Vec<f64>) = xs.iter().partition(|x| **x > 0.0);
    while let Some(x) = if parts.rounded() > 0.0 { below.pop() } else { above.pop() }
        .or_else(|| above.pop())
        .or_else(|| below.pop())
    {
        parts.add(x);
        if parts.rounded().is_infinite() {
            return parts.rounded();
        }
    }
    parts.rounded()
}

/// A sum as parts that do not overlap, the smallest first: nothing of it is lost.
#[derive(Default)]
struct Parts(Vec<f64>);

impl Parts {
    fn add(&mut self, mut x: f64) {
        let mut n = 0;
        for i in 0..self.0.len() {
            let mut y = self.0[i];
            if x.abs() < y.abs() {
                std::mem::swap(&mut x, &mut y);
            }
            let high = x + y;
            if high.is_infinite() {
                self.0 = vec![high];
                return;
            }
            let low = y - (high - x);
            if low != 0.0 {
                self.0[n] = low;
                n += 1;
            }
            x = high;
        }
        self.0.truncate(n);
        self.0.push(x);
    }

    /// The number nearest to the sum, of two the even one.
    fn rounded(&self) -> f64 {
        let mut parts = self.0.iter().rev();
        let Some(&(mut sum)) = parts.next() else { return 0.0 };
        while let Some(part) = parts.next() {
            let high = sum + part;
            let low = part - (high - sum);
            sum = high;
            if low != 0.0 {
                // Half way between two numbers, what is left decides.
                let beyond = parts.next().is_some_and(|rest| (*rest < 0.0) == (low < 0.0));
                let (twice, moved) = (low * 2.0, sum + low * 2.0);
                if beyond && twice == moved - sum {
                    sum = moved;
                }
                break;
            }
        }
        sum
    }
}

/// The arithmetic mean: the exact sum over the number of values, and never outside them; NaN of nothing.
#[must_use]
pub fn mean(xs: &[f64]) -> f64 {
    let (n, total) = (real(xs.len()), sum(xs));
    if xs.is_empty() || !xs.iter().all(|x| x.is_finite()) {
        return total / n;
    }
    let mean = if total.is_finite() {
        total / n
    } else {
        // The sum is beyond the largest number, which the mean is not.
        sum(&xs.iter().map(|x| x * TINY).collect::<Vec<_>>()) / n / TINY
    };
    let (low, high) = xs.iter().fold((xs[0], xs[0]), |(low, high), x| (low.min(*x), high.max(*x)));
    mean.clamp(low, high)
}

/// A power of two: what is multiplied by it can be summed, and keeps the bits that count.
const TINY: f64 = 1.0 / 1_152_921_504_606_846_976.0;

/// `Σ (x_i − x̄)²` in units of the square of a power of two, and this power, as a product: so that no square is too large or
/// too small for a number. Of equal numbers it is 0; of numbers of which one is not finite, NaN.
fn squares(xs: &[f64]) -> (f64, [f64; 2]) {
    let scaled = |unit: f64| -> Vec<f64> { xs.iter().map(|x| x / unit).collect() };
    let largest = |xs: &[f64]| xs.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    // A quarter of the numbers, where their differences could overflow.
    let (xs, by) =
        if largest(xs) > f64::MAX / 4.0 { (scaled(4.0), 4.0) } else { (xs.to_vec(), 1.0) };
    let centre = mean(&xs);
    let deviations: Vec<f64> = xs.iter().map(|x| x - centre).collect();
    if deviations.iter().all(|d| *d == 0.0) || xs.iter().any(|x| !x.is_finite()) {
        return (if centre.is_finite() { 0.0 } else { f64::NAN }, [1.0, 1.0]);
    }
    let unit = power_of_two(largest(&deviations));
    let deviations: Vec<f64> = deviations.iter().map(|d| d / unit).collect();
    let squares: Vec<f64> = deviations.iter().map(|d| d * d).collect();
    // The mean was rounded: what is left of the deviations' sum says by how much.
    let left = sum(&deviations);
    ((sum(&squares) - left * left / real(xs.len())).max(0.0), [unit, by])
}

/// The largest power of two that is not above a positive number.
fn power_of_two(x: f64) -> f64 {
    let x = if x < f64::MIN_POSITIVE { f64::MIN_POSITIVE } else { x };
    f64::from_bits(x.to_bits() & 0x7ff0_0000_0000_0000)
}

/// The population variance (`ddof = 0`); NaN of nothing.
#[must_use]
pub fn variance(xs: &[f64]) -> f64 {
    let (squares, [unit, by]) = squares(xs);
    squares / real(xs.len()) * unit * by * unit * by
}

/// The sample variance (`ddof = 1`); NaN of fewer than two values.
#[must_use]
pub fn sample_variance(xs: &[f64]) -> f64 {
    if xs.len() < 2 {
        return f64::NAN;
    }
    let (squares, [unit, by]) = squares(xs);
    squares / real(xs.len() - 1) * unit * by * unit * by
}

/// The population standard deviation (`ddof = 0`): 0 of equal numbers; NaN of nothing and of what is not finite.
#[must_use]
pub fn std(xs: &[f64]) -> f64 {
    let (squares, [unit, by]) = squares(xs);
    (squares / real(xs.len())).sqrt() * unit * by
}

/// The standard error of the mean, from the sample variance; NaN of fewer than two values.
#[must_use]
pub fn stderr(xs: &[f64]) -> f64 {
    if xs.len() < 2 {
        return f64::NAN;
    }
    let (squares, [unit, by]) = squares(xs);
    (squares / real(xs.len() - 1) / real(xs.len())).sqrt() * unit * by
}

/// The skewness `m₃ / m₂^{3/2}` of the numbers themselves: 0 of equal numbers; NaN of nothing and of what is not finite.
#[must_use]
pub fn skewness(xs: &[f64]) -> f64 {
    let (centre, spread) = (mean(xs), std(xs));
    if spread == 0.0 {
        return 0.0;
    }
    // Halves, so that no difference is too large for a number.
    let cubes = xs.iter().map(|x| ((x / 2.0 - centre / 2.0) / (spread / 2.0)).powi(3));
    mean(&cubes.collect::<Vec<_>>())
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

    /// Random numbers of every size.
    fn samples() -> impl Iterator<Item = Vec<f64>> {
        let mut bits = 1_u64;
        let mut next = move || {
            bits = bits
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            bits >> 12
        };
        (0..2_000).map(move |i| {
            let unit = 2.0_f64.powi(i % 1900 - 950);
            (0..=i % 40).map(|_| (f64::from_bits(next() | 0x3ff0 << 48) - 1.5) * unit).collect()
        })
    }

    #[test]
    fn equal_numbers_have_their_mean_and_no_spread() {
        for x in samples().map(|xs| xs[0]).chain([0.1, 0.7, f64::MAX, -f64::MAX, 5e-324, -0.0]) {
            for n in [1, 2, 3, 5, 6, 10, 19, 20, 40, 97] {
                let xs = vec![x; n];
                assert_eq!(mean(&xs).to_bits(), x.to_bits(), "{n} of {x:e}");
                assert_eq!((std(&xs), variance(&xs)), (0.0, 0.0), "{n} of {x:e}");
            }
        }
        assert_eq!(mean(&[f64::INFINITY; 3]), f64::INFINITY);
        assert!(std(&[f64::INFINITY; 3]).is_nan() && std(&[1.0, f64::NAN]).is_nan());
    }

    #[test]
    fn statistics_move_and_scale_with_their_numbers() {
        for xs in samples() {
            let (low, high) = (crate::order::min(&xs), crate::order::max(&xs));
            assert!(low <= mean(&xs) && mean(&xs) <= high, "{xs:?}");
            let mut turned = xs.clone();
            turned.reverse();
            assert_eq!((sum(&turned), mean(&turned)), (sum(&xs), mean(&xs)));
            let negated: Vec<f64> = xs.iter().map(|x| -x).collect();
            assert_eq!((sum(&negated), std(&negated)), (-sum(&xs), std(&xs)));
            let scaled: Vec<f64> = xs.iter().map(|x| x * 8.0).collect();
            assert_eq!((mean(&scaled), std(&scaled)), (mean(&xs) * 8.0, std(&xs) * 8.0));
            // Near a larger number the last bits are rounded.
            let moved: Vec<f64> = xs.iter().map(|x| x + std(&xs) * 1e3).collect();
            assert!((std(&moved) - std(&xs)).abs() <= std(&xs) * 1e-12, "{xs:?}");
        }
    }

    #[test]
    fn nothing_is_lost_and_nothing_overflows_on_the_way() {
        assert_eq!(sum(&[1e16, 1.0, -1e16]), 1.0);
        assert_eq!(sum(&[0.1; 10]), 1.0);
        assert_eq!(sum(&[1e308, 1e308, -1e308, -1e308, 5e-324]), 5e-324);
        assert_eq!(sum(&[f64::MAX, f64::MAX]), f64::INFINITY);
        assert_eq!(sum(&[1e308, 1e308, f64::NEG_INFINITY]), f64::NEG_INFINITY);
        assert!(sum(&[f64::INFINITY, f64::NEG_INFINITY]).is_nan());
        assert_eq!((sum(&[]).to_bits(), sum(&[-0.0, -0.0]).to_bits()), (0, (-0.0_f64).to_bits()));
        assert_eq!(mean(&[1e308, 1e308]), 1e308);
        // Half way between 1 and its neighbour, and a little more.
        assert_eq!(sum(&[1.0, f64::EPSILON / 2.0, 1e-40]), 1.0 + f64::EPSILON);
        assert_eq!(std(&[1e200, 3e200]), 1e200);
        let large = [1.7e308, -1.7e308, 1.7e308, -1.7e308, 1.6e308];
        let small: Vec<f64> = large.iter().map(|x| x / 16.0).collect();
        assert_eq!((std(&large), stderr(&large)), (std(&small) * 16.0, stderr(&small) * 16.0));
        assert_eq!(std(&[-f64::MAX, f64::MAX]), f64::MAX);
        assert_eq!(std(&[1e-200, 3e-200]), 1e-200);
        assert_eq!(stderr(&[1e-200, 3e-200]), 1e-200);
    }

    #[test]
    fn skewness_of_one_in_four() {
        // Of 0, 0, 0 and 4 the mean is 1, m₂ = 3 and m₃ = (27 − 3) / 4 = 6.
        let by_hand = 6.0 / 3.0_f64.powf(1.5);
        assert!((skewness(&[0.0, 0.0, 0.0, 4.0]) - by_hand).abs() < 1e-15);
        assert!((skewness(&[0.0, 0.0, 0.0, -4e200]) + by_hand).abs() < 1e-15);
        assert_eq!((skewness(&[1.0, 2.0, 3.0]), skewness(&[0.1; 3])), (0.0, 0.0));
        assert!(skewness(&[1.0, f64::INFINITY]).is_nan() && skewness(&[]).is_nan());
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
