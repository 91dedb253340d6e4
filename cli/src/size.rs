//! Numbers of bytes, as people write and say them.

const UNITS: [&str; 4] = ["KiB", "MiB", "GiB", "TiB"];

/// A number of bytes as people say it: `512 B`, `1.5 MiB`.
pub(crate) fn spell_bytes(bytes: u64) -> String {
    let unit = UNITS.iter().enumerate().rev().find(|(i, _)| bytes >> (10 * (i + 1)) > 0);
    unit.map_or_else(
        || format!("{bytes} B"),
        |(i, unit)| {
            // In tenths, rounded down.
            let tenths = (u128::from(bytes) * 10) >> (10 * (i + 1));
            format!("{}.{} {unit}", tenths / 10, tenths % 10)
        },
    )
}

/// The number of bytes that a text says: `800MB`, `4GiB`, `2.5 G`. Without a unit nobody knows which
/// was meant.
///
/// # Errors
/// What to write instead.
pub(crate) fn parse_bytes(text: &str) -> Result<u64, String> {
    let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    let factor = match unit.trim().to_ascii_uppercase().as_str() {
        "B" => Some(1.0),
        "K" | "KB" => Some(1e3),
        "M" | "MB" => Some(1e6),
        "G" | "GB" => Some(1e9),
        "T" | "TB" => Some(1e12),
        "KIB" => Some(1024.0),
        "MIB" => Some(1024.0 * 1024.0),
        "GIB" => Some(1024.0 * 1024.0 * 1024.0),
        "TIB" => Some(1024.0 * 1024.0 * 1024.0 * 1024.0),
        _ => None,
    };
    let number = number.parse::<f64>().ok().filter(|number| number.is_finite());
    let Some((number, factor)) = number.zip(factor) else {
        return Err(match number {
            Some(_) if unit.trim().is_empty() => {
                let number = text.trim();
                format!("it has no unit: write `{number}GiB`, or `{number}B` if bytes are meant")
            }
            _ => "write a number and a unit, such as `4GiB` or `800MB`".to_owned(),
        });
    };
    let bytes = number * factor;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is in range")]
    let whole = |bytes: f64| bytes as u64;
    if bytes < 9e18 { Ok(whole(bytes)) } else { Err("that is more than any disk has".to_owned()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_as_people_write_them() {
        let read = ["17B", "2kb", "1.5M", "4GiB", "1 GB", "0B"].map(|text| parse_bytes(text).ok());
        assert_eq!(read, [17, 2000, 1_500_000, 4 << 30, 1_000_000_000, 0].map(Some));
        for text in ["", "GB", "-1", "1e9", "3 apples", "1..2", "99999999999G", "nanGB", ".GB"] {
            assert!(parse_bytes(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_size_without_a_unit_is_no_size() {
        for text in ["10", "4", "0", "2.5", "4 "] {
            let why = parse_bytes(text).expect_err(text);
            assert!(why.contains(&format!("`{}GiB`", text.trim())), "{why}");
        }
    }

    #[test]
    fn bytes_are_said_in_the_largest_unit_that_they_fill() {
        let spelt = [0, 1023, 1024, 1536, 10 << 30, u64::MAX].map(spell_bytes);
        assert_eq!(spelt, ["0 B", "1023 B", "1.0 KiB", "1.5 KiB", "10.0 GiB", "16777215.9 TiB"]);
    }
}
