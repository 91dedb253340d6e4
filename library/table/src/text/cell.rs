//! The number that a cell is.

use ivx_op::{is_rounded, too_large};

/// What a cell holds.
#[derive(Clone, Copy)]
pub(super) enum Cell {
    /// A number.
    Number(f64),
    /// Nothing, or what programs write for it.
    Gap,
    /// Anything else.
    Other,
}

/// From here on whole numbers may be none of the reals.
pub(super) const LARGE: f64 = 9_007_199_254_740_992.0;

/// What a cell holds, blanks and quotes around it taken away. A whole number that would be rounded is none.
pub(super) fn cell(field: &[u8]) -> Cell {
    // As almost every cell is.
    if let Ok(x) = fast_float2::parse::<f64, _>(field)
        && x.abs() < LARGE
    {
        return Cell::Number(x);
    }
    let Ok(text) = std::str::from_utf8(field) else { return Cell::Other };
    let text = plain(text);
    match text.parse::<f64>() {
        Ok(_) if is_rounded(text) => Cell::Other,
        Ok(x) => Cell::Number(x),
        Err(_) if is_gap(text) => Cell::Gap,
        Err(_) => Cell::Other,
    }
}

/// The text without blanks, and without quotes that stand behind blanks.
pub(super) fn plain(text: &str) -> &str {
    let text = text.trim();
    let inside = text.strip_prefix('"').and_then(|text| text.strip_suffix('"'));
    inside.map_or(text, str::trim)
}

/// What programs write where there is no number.
fn is_gap(text: &str) -> bool {
    let text = text.to_ascii_lowercase();
    matches!(&*text, "" | "na" | "n/a" | "null" | "none" | "-" | "." | "?" | "missing")
}

/// Why a cell is not what it should be.
pub(super) fn refused(field: &[u8], cell: Cell) -> String {
    let text = String::from_utf8_lossy(field);
    let text = plain(&text);
    let short: String = text.chars().take(40).collect();
    let leave = "leave such rows out, or say what is done with them by `missing:`";
    match cell {
        Cell::Gap if text.is_empty() => format!("there is none: {leave}"),
        Cell::Gap => format!("`{short}` is no number: {leave}"),
        Cell::Number(x) if x.is_nan() => format!("`{short}` is not a number: {leave}"),
        Cell::Number(_) => format!("`{short}` is not finite: data have finite numbers"),
        Cell::Other => no_number(text, &short),
    }
}

fn no_number(text: &str, short: &str) -> String {
    let (folded, point) = (text.to_ascii_lowercase(), text.replacen(',', ".", 1));
    match &*folded {
        "true" | "false" => format!("`{short}` is no number: write 1 for true and 0 for false"),
        _ if text.len() < 400 && is_rounded(text) => format!("it {}", too_large(text)),
        _ if text.len() < 40 && point.parse::<f64>().is_ok() => {
            let whole = text.replace(',', "");
            match text.rsplit_once(',') {
                Some((_, rest)) if rest.len() == 3 => {
                    format!("`{text}` is no number: write `{whole}` or `{point}`, whichever it is")
                }
                _ => format!("`{text}` is no number: write `{point}`, with a point"),
            }
        }
        _ => format!("`{short}` is no number"),
    }
}
