//! The page: how much stands, then each section at a glance, then each element.

use std::collections::BTreeMap;

use ivx_op::escape::{markdown as plain, markdown_cell as cell};

use super::element::{Told, link_to, paragraphs};
use super::look::{Looked, named};
use super::tally::Tally;
use super::{Element, Files, List, Section};
use crate::markdown::code;
use crate::told::verdict;

/// What stands where nothing of an element is there.
const NOT_THERE: &str = "not there yet";

/// The page, as Markdown.
pub(super) fn page(list: &List, files: &Files, looked: &Looked<'_>) -> String {
    let mut page = vec![format!("# {}", plain(&list.title)), list.about.trim().to_owned()];
    page.push(elements_counted(list));
    page.push(claims_counted(list, looked));
    let mut told = Told::default();
    for section in &list.sections {
        page.push(format!("## {}", plain(&section.title)));
        page.push(section.about.trim().to_owned());
        page.push(glance(list, looked, section));
        for element in &section.elements {
            page.extend(paragraphs(list, files, looked, element, &mut told));
        }
    }
    page.retain(|paragraph| !paragraph.is_empty());
    page.join("\n\n") + "\n"
}

/// How many elements are there, by section.
fn elements_counted(list: &List) -> String {
    let mut rows =
        vec![["", "elements", "there", "there in part", NOT_THERE].map(str::to_owned).to_vec()];
    let own = list.sections.iter().map(|section| (&section.title, &section.elements[..]));
    let all: Vec<Element> = list.elements().cloned().collect();
    let together = "together".to_owned();
    for (title, elements) in own.chain([(&together, &all[..])]) {
        let count = |is: fn(&Element) -> bool| {
            elements.iter().filter(|element| is(element)).count().to_string()
        };
        rows.push(vec![
            cell(title),
            elements.len().to_string(),
            count(|element| element.why_not.is_empty()),
            count(|element| element.is_somewhere() && !element.why_not.is_empty()),
            count(|element| !element.is_somewhere()),
        ]);
    }
    table(&rows)
}

/// How many claims hold, by profile: each counts once, wherever it is named.
fn claims_counted(list: &List, looked: &Looked<'_>) -> String {
    let mut all = BTreeMap::new();
    for place in list.places() {
        let found = looked.at(place);
        let own = named(place, found).map(|words| ((&found.experiment.name, words), found));
        all.extend(own);
    }
    let head = format!("{} claims at", all.len());
    let mut rows = vec![
        [head.as_str(), "hold", "fail", "undecided", "describe their seeds", "not run"]
            .map(str::to_owned)
            .to_vec(),
    ];
    for profile in &list.profiles {
        let verdicts = all.iter().map(|((_, words), found)| found.outcome(profile, words));
        let tally = Tally::of(verdicts);
        let counts = [tally.holds, tally.fails, tally.undecided, tally.describes, tally.not_run];
        rows.push([code(profile)].into_iter().chain(counts.map(|n| n.to_string())).collect());
    }
    table(&rows)
}

/// The elements of a section, a line each.
fn glance(list: &List, looked: &Looked<'_>, section: &Section) -> String {
    let profiles = &list.profiles;
    let head = ["element", "what it is"].into_iter().chain(profiles.iter().map(String::as_str));
    let mut rows = vec![head.map(cell).collect::<Vec<_>>()];
    for element in &section.elements {
        let verdicts = profiles.iter().map(|profile| verdicts(looked, element, profile));
        rows.push([link_to(element), cell(&element.title)].into_iter().chain(verdicts).collect());
    }
    table(&rows)
}

/// What came out of an element at a profile, counted.
fn verdicts(looked: &Looked<'_>, element: &Element, profile: &str) -> String {
    if element.places.is_empty() {
        return if element.is_somewhere() { "tested" } else { NOT_THERE }.to_owned();
    }
    let mut all = Vec::new();
    let mut is_run = true;
    for place in &element.places {
        let found = looked.at(place);
        is_run &= found.runs.contains_key(profile);
        all.extend(named(place, found).map(|words| found.outcome(profile, words)));
    }
    let tally = Tally::of(all);
    match (tally.all(), is_run) {
        (0, true) => "shown".to_owned(),
        (0, false) => verdict(None),
        _ => tally.words(),
    }
}

/// A table whose first row is its head.
fn table(rows: &[Vec<String>]) -> String {
    let line = |row: &Vec<String>| format!("| {} |", row.join(" | "));
    let rule = format!("|{}", "---|".repeat(rows[0].len()));
    let body = rows[1..].iter().map(line);
    [line(&rows[0]), rule].into_iter().chain(body).collect::<Vec<_>>().join("\n")
}
