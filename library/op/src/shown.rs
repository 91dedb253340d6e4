//! How numbers are shown to people: one rule, for every place where one stands.
//!
//! A number has as few digits as tell it from those beside it. Where its last digits are cut off, it ends where
//! they are cut off, zeros among them; where nothing is cut off, it ends with its last digit that is not 0. So
//! `0.25` is a quarter, and `0.2500` is near it.

/// Digits that count, of the largest of the numbers that stand together.
const DIGITS: i32 = 4;

/// With so many digits that count every number is itself.
const ALL_DIGITS: i32 = 17;

/// A number alone.
#[must_use]
pub fn shown(x: f64) -> String {
    shown_to(DIGITS, &[x]).remove(0)
}

/// Numbers that stand beside each other, such as an estimate and its interval: no two different ones look the
/// same, and none but 0 like 0.
#[must_use]
pub fn shown_together(xs: &[f64]) -> Vec<String> {
    shown_to(DIGITS, xs)
}

/// As [`shown_together`], with at least so many digits that count of the largest.
#[must_use]
pub fn shown_to(n_digits: i32, xs: &[f64]) -> Vec<String> {
    let mut finite: Vec<f64> = xs.iter().filter(|x| x.is_finite()).map(|x| x + 0.0).collect();
    finite.sort_by(f64::total_cmp);
    finite.dedup();
    let largest = finite.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    let first = magnitude(largest) - n_digits + 1;
    // Beyond all digits of the smallest.
    let smallest = finite.iter().map(|x| magnitude(*x)).min().unwrap_or(0);
    let last = first.min(smallest) - ALL_DIGITS;
    let place =
        (last..first).rev().find(|place| tells_apart(&to_place(&finite, n_digits, *place + 1)));
    to_place(xs, n_digits, place.map_or(last, |place| place + 1))
}

/// The numbers to the digit that counts `10^place`; those too small for it stand together on their own.
fn to_place(xs: &[f64], n_digits: i32, place: i32) -> Vec<String> {
    let is_small = |x: &f64| x.is_finite() && *x != 0.0 && magnitude(*x) < place;
    let small: Vec<f64> = xs.iter().copied().filter(is_small).collect();
    let mut small = if small.is_empty() { vec![] } else { shown_to(n_digits, &small) }.into_iter();
    let text = |x: &f64| {
        let own = if is_small(x) { small.next() } else { None };
        own.unwrap_or_else(|| at_place(*x, n_digits, place))
    };
    xs.iter().map(text).collect()
}

/// Numbers too many to tell each from the next: to a hundredth of what lies between the lowest and the highest, with
/// at least so many digits that count of the largest.
#[must_use]
pub fn shown_roughly(n_digits: i32, xs: &[f64]) -> Vec<String> {
    let ends = xs.iter().copied().filter(|x| x.is_finite()).map(|x| (x, x));
    let ends = ends.reduce(|(low, high), (x, _)| (low.min(x), high.max(x)));
    let (low, high) = ends.unwrap_or((0.0, 0.0));
    let first = magnitude(low.abs().max(high.abs())) - n_digits + 1;
    let span = high / 2.0 - low / 2.0;
    let place = if span > 0.0 { first.min(magnitude(span) - 1) } else { first };
    xs.iter().map(|x| at_place(*x, n_digits, place)).collect()
}

/// The number with this many digits after the point, in scientific notation where that would show a small number
/// as 0 or a large one at great length.
#[must_use]
pub fn shown_to_decimals(n_decimals: usize, x: f64) -> String {
    let plain = format!("{x:.n_decimals$}");
    let vanishes = x != 0.0 && plain.parse() == Ok(0.0);
    if vanishes || (x.is_finite() && x.abs() >= 1e9) {
        return format!("{x:.n_decimals$e}");
    }
    if x == 0.0 { format!("{:.n_decimals$}", 0.0) } else { plain }
}

/// The label of a coordinate: the shortest text that is this number, as a spec may write it.
#[must_use]
pub fn label(x: f64) -> String {
    let size = x.abs();
    if size == 0.0 || (1e-4..1e16).contains(&size) || !x.is_finite() {
        x.to_string()
    } else {
        format!("{x:e}")
    }
}

/// Whether numbers that differ look different: `1` and `1.000` do not.
fn tells_apart(ascending: &[String]) -> bool {
    let looks: Vec<Option<f64>> = ascending.iter().map(|text| text.parse().ok()).collect();
    looks.windows(2).all(|pair| pair[0] != pair[1])
}

/// The number to the digit that counts `10^place`. One that is too small for it has `n_digits` of its own, and one
/// that would have more digits than numbers have has those.
fn at_place(x: f64, n_digits: i32, place: i32) -> String {
    if !x.is_finite() {
        return x.to_string();
    }
    if x == 0.0 {
        return "0".to_owned();
    }
    let n_digits = match magnitude(x) - place + 1 {
        n if n < 1 => n_digits,
        n => n.min(ALL_DIGITS),
    };
    to_digits(x, n_digits)
}

/// The number to this many digits that count, fewer if it has no more.
fn to_digits(x: f64, n_digits: i32) -> String {
    let decimals = usize::try_from(n_digits - 1).unwrap_or(0);
    let rounded = format!("{x:.decimals$e}");
    let exact = format!("{x:e}");
    let is_exact = exact.len() <= rounded.len();
    let short = if is_exact { exact } else { rounded };
    // In plain digits, if that is no longer or the number is of everyday size.
    let magnitude = exponent(&short);
    let after = if is_exact {
        let digits =
            short.split('e').next().unwrap_or_default().chars().filter(char::is_ascii_digit);
        i32::try_from(digits.count()).unwrap_or(ALL_DIGITS) - 1 - magnitude
    } else {
        n_digits - 1 - magnitude
    };
    let decimals = usize::try_from(after).unwrap_or(0);
    let is_everyday = (-4..7).contains(&magnitude);
    if !is_everyday && (after < 0 || magnitude < -20) {
        return short;
    }
    let plain = format!("{x:.decimals$}");
    if is_everyday || plain.len() <= short.len() { plain } else { short }
}

/// `n` of `10^n`, the power of ten that is not above the number's size; 0 for 0.
fn magnitude(x: f64) -> i32 {
    if x == 0.0 { 0 } else { exponent(&format!("{x:e}")) }
}

/// What follows `e` in a number that is written so.
fn exponent(text: &str) -> i32 {
    text.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn together(xs: &[f64], expected: &[&str]) {
        assert_eq!(shown_together(xs), expected, "{xs:?}");
    }

    #[test]
    fn a_number_alone_has_four_digits_or_fewer() {
        let numbers = [0.0, -0.0, 0.25, -1.5, 1.0 / 3.0, 123.456, 0.1 + 0.2, 3.0, 54_321.7, 0.0001];
        let expected =
            ["0", "0", "0.25", "-1.5", "0.3333", "123.5", "0.3000", "3", "54322", "0.0001"];
        assert_eq!(numbers.map(shown), expected);
        let numbers = [1e200, 1e-300, 1e22, 1e-6, 1.000_000_000_000_000_6e-6, 1e9, f64::MAX];
        let expected = ["1e200", "1e-300", "1e22", "1e-6", "1.000e-6", "1e9", "1.798e308"];
        assert_eq!(numbers.map(shown), expected);
        let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 5e-324];
        assert_eq!(odd.map(shown), ["NaN", "inf", "-inf", "5e-324"]);
    }

    #[test]
    fn neighbours_are_told_apart() {
        together(&[100.1, 100.2, 100.3], &["100.1", "100.2", "100.3"]);
        together(&[999_999_999.0, 1e9, 1_000_000_001.0], &["999999999", "1e9", "1000000001"]);
        together(&[1.0, 1.0 + f64::EPSILON], &["1", "1.0000000000000002"]);
        together(&[0.5, 0.625], &["0.5", "0.625"]);
        together(&[-1.428_31, -1.8126, -1.048_91], &["-1.428", "-1.813", "-1.049"]);
        together(&[1.0 / 3.0, 1.0 / 3.0 + 1e-7], &["0.3333333", "0.3333334"]);
        together(&[1e10, 1.0, 1.00001], &["1e10", "1", "1.00001"]);
        together(&[1e-9, 0.0, 5.25], &["1e-9", "0", "5.25"]);
        together(&[f64::NAN, 2.0, f64::INFINITY], &["NaN", "2", "inf"]);
        assert_eq!(shown_to(3, &[12.34, 1.0, 0.123]), ["12.3", "1", "0.1"]);
        let many = [100.123, 100.124, 100.2, 1e-3];
        assert_eq!(shown_roughly(3, &many), ["100", "100", "100", "0.001"]);
        assert_eq!(shown_roughly(3, &many[..3]), ["100.123", "100.124", "100.2"]);
    }

    #[test]
    fn labels_are_the_number() {
        let numbers = [5.0, 0.5, -2.0, 1e-300, 1e-8, 1e22, 0.0001, 1e15, 0.1 + 0.2, 1e16];
        let expected = [
            "5",
            "0.5",
            "-2",
            "1e-300",
            "1e-8",
            "1e22",
            "0.0001",
            "1000000000000000",
            "0.30000000000000004",
            "1e16",
        ];
        assert_eq!(numbers.map(label), expected);
    }

    /// The lower half of some bits.
    fn low(bits: u64) -> u32 {
        u32::try_from(bits & u64::from(u32::MAX)).unwrap()
    }

    /// Random bits, and numbers near each other.
    fn some(n: usize, state: &mut u64) -> Vec<f64> {
        let mut next = || {
            // SplitMix64.
            *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        };
        let mut found: Vec<f64> = Vec::new();
        while found.len() < n {
            let bits = next();
            let x = match (bits % 4, found.last()) {
                (0, Some(last)) => f64::from_bits(last.to_bits().wrapping_add(next() % 3)),
                (1, Some(last)) => last * (1.0 + f64::from(low(next())) * 1e-16),
                (2, _) => f64::from(low(next() % 2000)) / 1000.0 - 1.0,
                _ => f64::from_bits(next()),
            };
            if x.is_finite() {
                found.push(x);
            }
        }
        found
    }

    #[test]
    fn different_numbers_look_different_and_are_near_what_is_shown() {
        let mut state = 7;
        for i in 0..20_000 {
            let xs = some(1 + i % 6, &mut state);
            let texts = shown_together(&xs);
            for (x, text) in xs.iter().zip(&texts) {
                assert!(text.len() <= 24, "{x:e} is {text}");
                let back: f64 = text.parse().expect("it is a number");
                assert!((x == &0.0) == (back == 0.0), "{x:e} is {text}");
                let (digits, power) = text.split_once('e').unwrap_or((text, "0"));
                let after = digits.split_once('.').map_or(0, |(_, after)| after.len());
                let unit =
                    format!("1e{}", power.parse::<i64>().unwrap() - i64::try_from(after).unwrap());
                let unit: f64 = unit.parse().unwrap();
                let is_near = (back / 2.0 - x / 2.0).abs()
                    <= unit * 0.25 * (1.0 + 1e-9) + (x.abs() * f64::EPSILON).max(5e-324);
                assert!(is_near, "{x:e} is {text}");
                assert_eq!(label(*x).parse(), Ok(*x));
            }
            for (x, first) in xs.iter().zip(&texts) {
                for (y, second) in xs.iter().zip(&texts) {
                    assert_eq!(x == y, first == second, "{x:e} and {y:e} are {first} and {second}");
                }
            }
        }
    }
}
