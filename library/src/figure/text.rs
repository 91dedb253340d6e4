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

/// A probability to a thousandth; a smaller one as it is.
pub(super) fn chance(p: f64) -> String {
    let text = if p < 0.0005 { shown(p) } else { ((p * 1e3).round() / 1e3).to_string() };
    text.replace('-', "−")
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
    fn chances_have_no_digits_of_rounding() {
        let found = [1.0, 1.0 - 0.9, 1.0 / 3.0, 1e-7].map(chance);
        assert_eq!(found, ["1", "0.1", "0.333", "1e−7"]);
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
