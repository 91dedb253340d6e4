//! The nearest known name.

/// Longer names, in bytes, are not compared: that takes memory for the product of their lengths.
const LONGEST: usize = 100;

/// With more names than these known, the others are not compared.
const MOST: usize = 10_000;

/// `did you mean X?` for the known name nearest to `name`, or else the known names where there
/// are few.
#[must_use]
pub fn suggest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let mut known: Vec<&str> = known.into_iter().collect();
    known.sort_unstable();
    known.dedup();
    let allowed = (name.chars().count() / 3).max(1);
    let alike = known.iter().filter(|other| name.len().max(other.len()) <= LONGEST);
    let near =
        alike.take(MOST).map(|other| (strsim::damerau_levenshtein(name, other), *other)).min();
    match near {
        Some((distance, other)) if distance <= allowed => Some(format!("did you mean `{other}`?")),
        _ if !known.is_empty() && known.len() <= 13 => {
            let known: Vec<_> = known.iter().map(|other| format!("`{other}`")).collect();
            Some(format!("known here: {}", known.join(", ")))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_suggested() {
        let known = ["argmax", "argmin", "sample"];
        assert_eq!(suggest("agrmax", known).as_deref(), Some("did you mean `argmax`?"));
        assert_eq!(
            suggest("zzz", known).as_deref(),
            Some("known here: `argmax`, `argmin`, `sample`")
        );
        assert_eq!(suggest("zzz", []), None);
        let long = "a".repeat(100_000);
        assert_eq!(suggest(&long[1..], [long.as_str(); 20]).map(|help| help.len()), Some(100_014));
    }
}
