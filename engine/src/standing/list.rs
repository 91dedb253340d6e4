//! The list of what a source has: what people write of it, since nothing computes it.

use serde::Deserialize;

/// What a source has, and where it is.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct List {
    /// The heading of the page.
    pub title: String,
    /// What a reader is to know first, as Markdown.
    #[serde(default)]
    pub about: String,
    /// The profiles that the page tells of, in this order.
    pub profiles: Vec<String>,
    /// Specs of which every experiment is to be on the page.
    #[serde(default)]
    pub specs: Vec<String>,
    /// The elements, by chapter or kind.
    pub sections: Vec<Section>,
}

/// Elements that belong together.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Its heading.
    pub title: String,
    /// What a reader is to know of it, as Markdown.
    #[serde(default)]
    pub about: String,
    /// The elements, in the order of the source.
    pub elements: Vec<Element>,
}

/// A figure, table, hypothesis or another element of a source.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Element {
    /// What the source calls it, such as `Table 4.2`.
    pub id: String,
    /// What it is, in a few words.
    pub title: String,
    /// What the source says came out, in words.
    #[serde(default)]
    pub says: String,
    /// Where it is.
    #[serde(default)]
    pub places: Vec<Place>,
    /// The files of the project that try it without an experiment, seen from the folder of the list.
    #[serde(default)]
    pub tested: Vec<String>,
    /// The files of numbers that the source has for it.
    #[serde(default)]
    pub published: Vec<String>,
    /// How it differs from the source, beside what its experiments say themselves.
    #[serde(default)]
    pub deviation: String,
    /// Why its claims came out as they did, as far as that was found out.
    #[serde(default)]
    pub explained: String,
    /// What of it is not there yet, and why.
    #[serde(default)]
    pub why_not: String,
}

/// Where an element is.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// The spec, seen from the folder of the list.
    pub file: String,
    /// The experiment.
    pub experiment: String,
    /// Its claims, by their words; `H4: *` for all that begin so.
    #[serde(default)]
    pub claims: Vec<String>,
    /// Its figures.
    #[serde(default)]
    pub figures: Vec<String>,
    /// Its tables, which the page shows.
    #[serde(default)]
    pub tables: Vec<String>,
}

impl Element {
    /// Whether any of it is there.
    pub(super) fn is_somewhere(&self) -> bool {
        !self.places.is_empty() || !self.tested.is_empty()
    }
}

impl List {
    /// A list as written.
    ///
    /// # Errors
    /// If the text is no list; the error has line and column.
    pub fn from_ron(text: &str) -> Result<Self, ron::error::SpannedError> {
        ron::from_str(text)
    }

    /// The places of all elements.
    pub fn places(&self) -> impl Iterator<Item = &Place> {
        self.elements().flat_map(|element| &element.places)
    }

    /// The elements of all sections.
    pub fn elements(&self) -> impl Iterator<Item = &Element> {
        self.sections.iter().flat_map(|section| &section.elements)
    }
}
