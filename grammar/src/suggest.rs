//! The nearest known name.

/// `did you mean X?` for the known name nearest to `name`, or else the known names where there
/// are few.
#[must_use]
pub fn suggest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let mut known: Vec<&str> = known.into_iter().collect();
    known.sort_unstable();
    known.dedup();
    let near = known.iter().map(|other| (strsim::damerau_levenshtein(name, other), *other)).min();
    match near {
        Some((distance, other)) if distance <= (name.chars().count() / 3).max(1) => {
            Some(format!("did you mean `{other}`?"))
        }
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
    }
}
