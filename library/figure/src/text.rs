//! Text and numbers inside an SVG file.

use ivx_op::escape::xml;
use ivx_op::shown;

/// The text with what XML reserves written out, and control characters as spaces.
pub(super) fn escape(text: &str) -> String {
    xml(&text.replace(|c: char| c.is_control(), " "))
}

/// A coordinate in pixels, to a hundredth.
///
/// Far outside the panel it is cut off, since viewers compute in single precision.
pub(super) fn px(x: f64) -> String {
    let hundredths = (x.clamp(-1e5, 1e5) * 100.0).round() + 0.0;
    (hundredths / 100.0).to_string()
}

/// About how wide the text is in a sans-serif font of this size, rather too wide than too narrow.
pub(super) fn width(text: &str, size: f64) -> f64 {
    let em = |c: char| match c {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' | ' ' | 'I' => 0.33,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '-' | '/' => 0.42,
        'm' | 'w' | 'M' | 'W' | '@' | '%' => 0.96,
        '−' | '±' | '×' | '=' | '+' | '<' | '>' => 0.84,
        c if c.is_ascii_uppercase() => 0.74,
        c if c.is_ascii() => 0.64,
        _ => 0.8,
    };
    text.chars().map(em).sum::<f64>() * size
}

/// A probability to a thousandth; where that would be 0 or 1, to as many digits as tell it from these.
pub(super) fn chance(p: f64) -> String {
    let decimals = (3..=15).find(|n| {
        let near = rounded(p, *n);
        (near == 0.0) == (p == 0.0) && (near == 1.0) == (p == 1.0)
    });
    match decimals {
        Some(n) if p == 0.0 || p >= 1e-4 => rounded(p, n).to_string(),
        None => p.to_string(),
        Some(_) => shown(p).replace('-', "−"),
    }
}

fn rounded(p: f64, decimals: i32) -> f64 {
    let unit = 10_f64.powi(decimals);
    (p * unit).round() / unit
}

/// `×10ⁿ`.
pub(super) fn power_of_ten(exponent: i32) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        c => c.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(c),
    };
    format!("×10{}", exponent.to_string().chars().map(raised).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_break_out() {
        assert_eq!(escape("a<b & \"c\"\u{0}>"), "a&lt;b &amp; &quot;c&quot; &gt;");
    }

    #[test]
    fn coordinates_are_short_and_bounded() {
        let found = [1.0, -0.001, 1.0 / 3.0, -2.346, 1e300].map(px);
        assert_eq!(found, ["1", "0", "0.33", "-2.35", "100000"]);
    }

    #[test]
    fn chances_have_no_digits_of_rounding_and_only_certain_ones_are_1() {
        let given = [1.0, 1.0 - 0.9, 1.0 / 3.0, 0.075, 0.9999, 0.0001, 1e-12, 0.0];
        let found = given.map(chance);
        let expected = ["1", "0.1", "0.333", "0.075", "0.9999", "0.0001", "1e−12", "0"];
        assert_eq!(found, expected);
        assert_eq!(chance(1.0 - 1e-16), "0.9999999999999999");
        assert_eq!(chance(1.0 - 1e-12), "0.999999999999");
    }

    #[test]
    fn powers_are_raised() {
        assert_eq!(power_of_ten(-12), "×10⁻¹²");
        assert_eq!(power_of_ten(6), "×10⁶");
    }

    #[test]
    fn wide_letters_count_more() {
        assert!((width("il", 10.0) - 6.6).abs() < 1e-9);
        assert!(width("WM", 10.0) > width("ab", 10.0));
    }
}
