//! The nearest known name.

/// Longer names, in bytes, are not compared: that takes memory for the product of their lengths.
const LONGEST: usize = 100;

/// With more names than these known, the others are not compared.
const MOST: usize = 10_000;

/// What would mend a fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Advice {
    /// In words.
    pub said: String,
    /// A word at the place of the fault, and what would stand there rightly.
    pub instead: Option<Box<(String, String)>>,
}

impl Advice {
    /// Whether it names what was probably meant.
    #[must_use]
    pub fn is_near(&self) -> bool {
        self.instead.is_some()
    }
}

impl From<String> for Advice {
    fn from(said: String) -> Self {
        Self { said, instead: None }
    }
}

impl From<&str> for Advice {
    fn from(said: &str) -> Self {
        said.to_owned().into()
    }
}

impl From<Advice> for String {
    fn from(advice: Advice) -> Self {
        advice.said
    }
}

/// `did you mean X?` for the known name nearest to `name`, or else the known names where there
/// are few.
#[must_use]
pub fn suggest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<Advice> {
    let mut known: Vec<&str> = known.into_iter().collect();
    known.sort_unstable();
    known.dedup();
    let allowed = (name.chars().count() / 3).max(1);
    let alike = known.iter().filter(|other| name.len().max(other.len()) <= LONGEST);
    let near =
        alike.take(MOST).map(|other| (strsim::damerau_levenshtein(name, other), *other)).min();
    match near {
        Some((distance, other)) if distance <= allowed => {
            let instead = Some(Box::new((name.to_owned(), other.to_owned())));
            Some(Advice { said: format!("did you mean `{other}`?"), instead })
        }
        _ if !known.is_empty() && known.len() <= 13 => {
            let known: Vec<_> = known.iter().map(|other| format!("`{other}`")).collect();
            Some(format!("known here: {}", known.join(", ")).into())
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
        let instead = Some(Box::new(("agrmax".to_owned(), "argmax".to_owned())));
        let said = "did you mean `argmax`?".to_owned();
        assert_eq!(suggest("agrmax", known), Some(Advice { said, instead }));
        assert_eq!(suggest("zzz", known), Some("known here: `argmax`, `argmin`, `sample`".into()));
        assert_eq!(suggest("zzz", []), None);
        let long = "a".repeat(100_000);
        assert_eq!(
            suggest(&long[1..], [long.as_str(); 20]).map(|help| help.said.len()),
            Some(100_014)
        );
    }
}
