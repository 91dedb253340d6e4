//! Text that means itself, in each format that results are written in: one function a format.
//!
//! Labels, names and messages come from specs, programs and papers, and may hold anything. What a reader of
//! the format shows of what these functions return is the text.

mod latex;
mod markdown;

pub use latex::{latex, latex_number};
pub use markdown::{markdown, markdown_cell};

/// Text inside HTML or XML, in an attribute between `"` too. Controls, those of writing direction among
/// them, show as what they are.
#[must_use]
pub fn xml(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' => out.push(c),
            // XML has no place for them.
            '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            c if acts(c) => out.extend(c.escape_default()),
            c => out.push(c),
        }
    }
    out
}

/// A field of comma-separated values (RFC 4180). Blanks at its ends are kept by readers that trim, and text that
/// is empty is told from a field that is not there.
#[must_use]
pub fn csv(text: &str) -> String {
    let special = text.contains([',', '"', '\n', '\r']) || text.trim() != text || text.is_empty();
    if special { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// What stands in JSON, as text, for a number that it lacks: names that most languages read as numbers. None for
/// numbers that it has.
#[must_use]
pub fn json_name(x: f64) -> Option<&'static str> {
    match x {
        x if x.is_nan() => Some("NaN"),
        f64::INFINITY => Some("Infinity"),
        f64::NEG_INFINITY => Some("-Infinity"),
        _ => None,
    }
}

/// Whether a character is a control, or one of writing direction, which makes text look like another.
fn acts(c: char) -> bool {
    c.is_control() || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// The characters of a text on one line: each break of lines is one blank, and what acts is written out.
fn on_one_line(text: &str) -> Vec<char> {
    let text = text.replace("\r\n", " ").replace(['\n', '\r', '\t', '\u{2028}', '\u{2029}'], " ");
    let mut plain = Vec::with_capacity(text.len());
    for c in text.chars() {
        if acts(c) { plain.extend(c.escape_default()) } else { plain.push(c) }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn html_and_xml_show_the_text() {
        let found = xml("<a href='x' \"y\">&\u{1b}\u{202e}\n\u{ffff}");
        assert_eq!(found, "&lt;a href='x' &quot;y&quot;&gt;&amp;\\u{1b}\\u{202e}\n\u{fffd}");
    }

    #[test]
    fn a_field_is_one_field() {
        let found = ["a", "", " a", "a,b", "a\"b", "a\rb", "-1"].map(csv);
        assert_eq!(found, ["a", "\"\"", "\" a\"", "\"a,b\"", "\"a\"\"b\"", "\"a\rb\"", "-1"]);
    }
}
