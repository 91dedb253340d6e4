//! The time now, and ages as people write them.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Milliseconds since 1970.
pub(crate) fn now_millis() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}

/// The age that a text says: `90m`, `12h`, `30d`.
///
/// # Errors
/// What to write instead.
pub(crate) fn parse_age(text: &str) -> Result<Duration, String> {
    parse(text, "d", "an age such as `12h`, `30d` or `8w`")
}

/// The span of time that a text says: `0.5s`, `10s`, `2m`.
///
/// # Errors
/// What to write instead.
pub(crate) fn parse_span(text: &str) -> Result<Duration, String> {
    parse(text, "s", "a span of time such as `0.5s`, `10s` or `2m`")
}

/// - `usual`: the unit that is most likely meant where there is none.
fn parse(text: &str, usual: &str, such: &str) -> Result<Duration, String> {
    const UNITS: [(&str, f64); 6] =
        [("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("h", 3600.0), ("d", 86_400.0), ("w", 604_800.0)];
    let text = text.trim();
    let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    let factor = UNITS.iter().find(|(known, _)| *known == unit.trim());
    let number = number.parse::<f64>().ok();
    let span = number.zip(factor).map(|(number, (_, seconds))| number * seconds);
    let span = span.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    span.ok_or_else(|| match number {
        Some(_) if unit.is_empty() => format!("it has no unit: write `{text}{usual}`"),
        _ => format!("write {such}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_of_time_have_a_unit() {
        for (text, seconds) in [("0s", 0), ("90m", 5400), ("12 h", 43_200), ("30d", 2_592_000)] {
            assert_eq!(parse_age(text), Ok(Duration::from_secs(seconds)));
        }
        assert_eq!(parse_span("0.003s"), Ok(Duration::from_millis(3)));
        assert_eq!(parse_span("250ms"), Ok(Duration::from_millis(250)));
        for text in ["", "d", "-1d", "1y", "99999999999999999999w", "d30", "nan s", "."] {
            assert!(parse_age(text).is_err(), "{text}");
        }
        assert_eq!(parse_age("30"), Err("it has no unit: write `30d`".to_owned()));
        assert_eq!(parse_span("0.5"), Err("it has no unit: write `0.5s`".to_owned()));
    }
}
