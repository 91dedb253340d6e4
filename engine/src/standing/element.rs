//! One element on the page: where it is, how that differs from its source, and what came out.

use std::collections::BTreeMap;

use ivx_grammar::ir::Param;
use ivx_op::escape::markdown as plain;

use super::judged::judged;
use super::look::{Found, Looked, named};
use super::{Element, Files, List, Place};
use crate::markdown::code;
use crate::told::{deviations, other_sizes, verdict};

/// At which element something was told first.
#[derive(Default)]
pub(super) struct Told<'a> {
    /// How an experiment differs, by file and name.
    differs: BTreeMap<(&'a str, &'a str), &'a Element>,
    /// A claim, by experiment and words.
    claims: BTreeMap<(&'a str, String), &'a Element>,
    /// A table, by experiment and name.
    tables: BTreeMap<(&'a str, &'a str), &'a Element>,
}

/// The paragraphs of one element.
pub(super) fn paragraphs<'a>(
    list: &'a List,
    files: &'a Files,
    looked: &'a Looked<'a>,
    element: &'a Element,
    told: &mut Told<'a>,
) -> Vec<String> {
    let writer = Writer { list, files, looked, element };
    let mut page = vec![format!("### {}", plain(&heading(element)))];
    if !element.says.is_empty() {
        page.push(format!("The source: {}", sentence(&element.says)));
    }
    let numbers = element.published.iter().map(|file| {
        let own = &files.published[file];
        format!("[{}](<{}>) ({})", code(file), own.link, plain(&own.source))
    });
    let numbers: Vec<String> = numbers.collect();
    if !numbers.is_empty() {
        page.push(format!("Its numbers: {}.", numbers.join(", ")));
    }
    for place in &element.places {
        writer.place(place, told, &mut page);
    }
    let tested = element.tested.iter().map(|file| {
        format!("[{}](<{}>)", code(file.trim_start_matches("../")), files.tested[file])
    });
    let tested: Vec<String> = tested.collect();
    if !tested.is_empty() {
        page.push(format!("Tested in {}.", tested.join(", ")));
    }
    if !element.deviation.is_empty() {
        page.push(format!("Differs: {}", sentence(&element.deviation)));
    }
    if !element.explained.is_empty() {
        page.push(format!("**Why so**: {}", sentence(&element.explained)));
    }
    if !element.why_not.is_empty() {
        let what = if element.is_somewhere() { "There in part" } else { "Not there yet" };
        page.push(format!("**{what}**: {}", sentence(&element.why_not)));
    }
    page
}

struct Writer<'a> {
    list: &'a List,
    files: &'a Files,
    looked: &'a Looked<'a>,
    element: &'a Element,
}

impl<'a> Writer<'a> {
    /// Adds where it is, and what it has there; of what was told before, where.
    fn place(&self, place: &'a Place, told: &mut Told<'a>, page: &mut Vec<String>) {
        let found = self.looked.at(place);
        let (file, name) = (place.file.as_str(), place.experiment.as_str());
        let link = &self.files.specs[file].link;
        let mut at = vec![format!("In [{}](<{link}>): experiment {}", code(file), code(name))];
        for (what, names) in [("figure", &place.figures), ("table", &place.tables)] {
            let plural = if names.len() > 1 { "s" } else { "" };
            let names: Vec<String> = names.iter().map(|name| code(name)).collect();
            if !names.is_empty() {
                at.push(format!("{what}{plural} {}", names.join(", ")));
            }
        }
        page.push(format!("{}.", at.join(", ")));
        let first = *told.differs.entry((file, name)).or_insert(self.element);
        if first == self.element {
            page.extend(self.deviations(place, found));
        } else {
            page.push(format!("Differs, and has its sizes, as under {}.", link_to(first)));
        }
        let mut items = Vec::new();
        for words in named(place, found) {
            let first = *told.claims.entry((name, words.to_owned())).or_insert(self.element);
            items.push(self.claim(
                found,
                words,
                Some(first).filter(|first| *first != self.element),
            ));
        }
        page.push(items.join("\n"));
        for table in &place.tables {
            let first = *told.tables.entry((name, table)).or_insert(self.element);
            if first == self.element {
                page.extend(self.table(found, table));
            }
        }
    }

    /// How an experiment differs from its source: in words, and in the sizes of each profile.
    fn deviations(&self, place: &Place, found: &Found<'_>) -> Vec<String> {
        let named = &self.files.specs[&place.file];
        let params = |profile: &str| -> Vec<Param> {
            let spec = &named.specs[profile];
            let own = spec.experiments.iter().find(|own| own.name == place.experiment);
            let own = own.map_or(&[][..], |own| &own.params);
            spec.params.iter().chain(own).cloned().collect()
        };
        let sizes = self.together(|profile| {
            let sizes = other_sizes(&params(profile)).map(|other| plain(&other));
            let sizes = sizes.unwrap_or_else(|| "full size".to_owned());
            let is_declared = named.declared.contains(profile);
            if is_declared { sizes } else { format!("{sizes} (no profile of that name)") }
        });
        let sizes: Vec<String> =
            sizes.into_iter().map(|(profiles, sizes)| format!("At {profiles}: {sizes}.")).collect();
        let said = &found.experiment.deviations;
        let said = self.list.profiles.first().map(|first| deviations(said, &params(first)));
        let said = said.unwrap_or_default().iter().map(|words| plain(words)).collect::<Vec<_>>();
        let mut lines = vec![sizes.join(" ")];
        if !said.is_empty() {
            lines.insert(0, format!("Differs: {}", sentence(&said.join("; "))));
        }
        lines
    }

    /// A claim, and what came out at each profile; together where that is the same. Of one that was told before, no more
    /// than its verdicts.
    fn claim(&self, found: &Found<'_>, words: &str, told: Option<&Element>) -> String {
        if let Some(told) = told {
            let verdicts = self.together(|profile| verdict(found.outcome(profile, words)));
            let verdicts = verdicts.into_iter();
            let verdicts = verdicts.map(|(profiles, came)| format!("{profiles} **{came}**"));
            let verdicts = verdicts.collect::<Vec<_>>().join(", ");
            return format!("- {}: {verdicts}, as under {}", plain(words), link_to(told));
        }
        let written = found.experiment.claims.iter().find(|own| own.output.name == words);
        let written = written.map_or("", |own| own.output.source.as_str());
        let came = self.together(|profile| {
            found.claim(profile, words).map_or_else(|| vec![verdict(None)], |claim| judged(&claim))
        });
        let came = came.into_iter();
        let came = came.map(|(profiles, came)| format!("{profiles}: {}", came.join("\n    - ")));
        let said = [format!("{}: {}", plain(words), code(written))].into_iter().chain(came);
        format!("- {}", said.collect::<Vec<_>>().join("\n  - "))
    }

    /// A table, for each profile; together where it is the same.
    fn table(&self, found: &Found<'_>, name: &str) -> Vec<String> {
        let experiment = &found.experiment.name;
        let tables = self.together(|profile| {
            let run = found.runs.get(profile)?;
            run.registered.tables.get(experiment).and_then(|tables| tables.get(name)).cloned()
        });
        let shown = tables.into_iter().filter_map(|(profiles, table)| {
            let title = format!("Table {} at {profiles}:", code(name));
            Some([title, table?.trim_end().to_owned()])
        });
        shown.flatten().collect()
    }

    /// What there is at each profile, with the profiles for which it is the same.
    fn together<T: PartialEq>(&self, at: impl Fn(&str) -> T) -> Vec<(String, T)> {
        let mut all: Vec<(Vec<String>, T)> = Vec::new();
        for profile in &self.list.profiles {
            let came = at(profile);
            match all.iter_mut().find(|(_, known)| *known == came) {
                Some((profiles, _)) => profiles.push(code(profile)),
                None => all.push((vec![code(profile)], came)),
            }
        }
        all.into_iter().map(|(profiles, came)| (profiles.join(", "), came)).collect()
    }
}

/// The heading of an element.
pub(super) fn heading(element: &Element) -> String {
    format!("{}: {}", element.id, element.title)
}

/// A link to where an element stands on the page.
pub(super) fn link_to(element: &Element) -> String {
    format!("[{}](#{})", plain(&element.id), anchor(&heading(element)))
}

/// Text with a full stop behind it.
fn sentence(text: &str) -> String {
    let text = text.trim();
    if text.ends_with(['.', '?', '!']) { text.to_owned() } else { format!("{text}.") }
}

/// The name that GitHub gives to a heading.
fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.collect::<String>().to_lowercase().replace(' ', "-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_lead_to_headings() {
        assert_eq!(anchor("Figure 2.4: Bayes, MAP and MLE"), "figure-24-bayes-map-and-mle");
        assert_eq!(anchor("H5.1: σ is low"), "h51-σ-is-low");
    }
}
