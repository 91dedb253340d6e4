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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_said_in_the_largest_unit_that_they_fill() {
        let spelt = [0, 1023, 1024, 1536, 10 << 30, u64::MAX].map(spell_bytes);
        assert_eq!(spelt, ["0 B", "1023 B", "1.0 KiB", "1.5 KiB", "10.0 GiB", "16777215.9 TiB"]);
    }
}
