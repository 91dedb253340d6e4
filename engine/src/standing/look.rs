//! Finds what a list names, and says what is not there or not told.

use std::collections::{BTreeMap, BTreeSet};

use ivx_grammar::ir::{Experiment, Output};
use ivx_grammar::suggest;
use ivx_op::Outcome as Verdict;

use super::{Files, List, Named, Place, Run, Wrong};
use crate::registration::{Registered, Registration};
use crate::results::Claim;

/// What a list is about, found.
pub(super) struct Looked<'a> {
    /// By file, then by name.
    pub(super) experiments: BTreeMap<&'a str, BTreeMap<&'a str, Found<'a>>>,
}

/// An experiment, and what its runs registered.
pub(super) struct Found<'a> {
    /// As it is under the first profile of the list.
    pub(super) experiment: &'a Experiment,
    /// By profile; none where it was not run.
    pub(super) runs: BTreeMap<&'a str, &'a Run>,
}

impl<'a> Looked<'a> {
    /// What is at a place.
    ///
    /// # Panics
    /// If there is nothing, which [`look`] says of a list.
    pub(super) fn at(&self, place: &Place) -> &Found<'a> {
        self.find(place).expect("a list is looked through before its page is written")
    }

    fn find(&self, place: &Place) -> Option<&Found<'a>> {
        self.experiments.get(place.file.as_str())?.get(place.experiment.as_str())
    }
}

impl Found<'_> {
    /// The verdict of a claim at a profile.
    pub(super) fn outcome(&self, profile: &str, words: &str) -> Option<Verdict> {
        self.claim(profile, words).and_then(|claim| claim.outcome)
    }

    /// A claim with what a run at a profile found; none where there was no such run.
    pub(super) fn claim(&self, profile: &str, words: &str) -> Option<Claim> {
        let claims = self.runs.get(profile)?.registered.claims.get(&self.experiment.name)?;
        claims.get(words).map(Registered::found)
    }
}

/// Finds everything that a list names.
pub(super) fn look<'a>(list: &'a List, files: &'a Files) -> Result<Looked<'a>, Vec<Wrong>> {
    let mut wrong = Vec::new();
    if list.profiles.is_empty() {
        let help = "name the profiles that the page is to tell of, such as `profiles: [\"quick\"]`";
        wrong.push(Wrong::new("the list has no profiles".to_owned(), help));
    }
    let mut experiments = BTreeMap::new();
    for (file, named) in &files.specs {
        let first = list.profiles.first().and_then(|profile| named.specs.get(profile));
        let own = first.into_iter().flat_map(|spec| &spec.experiments).map(|experiment| {
            let runs = runs(list, named, experiment, &mut wrong);
            (experiment.name.as_str(), Found { experiment, runs })
        });
        experiments.insert(file.as_str(), own.collect());
    }
    let looked = Looked { experiments };
    elements(list, &looked, &mut wrong);
    hidden(list, &looked, &mut wrong);
    if wrong.is_empty() { Ok(looked) } else { Err(wrong) }
}

/// The runs of an experiment, by profile.
fn runs<'a>(
    list: &'a List,
    named: &'a Named,
    experiment: &Experiment,
    wrong: &mut Vec<Wrong>,
) -> BTreeMap<&'a str, &'a Run> {
    let mut found = BTreeMap::new();
    for profile in &list.profiles {
        let Some(spec) = named.specs.get(profile) else { continue };
        let now = Registration::of(spec, "").only(&experiment.name);
        let with = named.runs.iter().filter(|run| run.registered.has(&experiment.name));
        let (own, others): (Vec<&Run>, Vec<&Run>) =
            with.partition(|run| run.profile.as_ref() == Some(profile));
        let changes = |run: &Run| run.registered.like(&now).changes(&now);
        // A run of another profile is this one where nothing of the experiment differs.
        let same = own.iter().chain(&others).find(|run| changes(run).is_empty());
        if let Some(run) = same {
            found.insert(profile.as_str(), *run);
        } else if let Some(run) = own.first() {
            wrong.push(Wrong {
                message: format!(
                    "`{}` is not what {} registered: {}",
                    experiment.name,
                    run.name,
                    changes(run).join("; ")
                ),
                help: "`ivx exec SPEC --register` runs it and registers it anew".to_owned(),
            });
        }
    }
    found
}

/// Looks whether each element is said once and whole, and what it names is there.
fn elements(list: &List, looked: &Looked<'_>, wrong: &mut Vec<Wrong>) {
    let mut ids = BTreeSet::new();
    for element in list.elements() {
        let id = &element.id;
        if !ids.insert(id) {
            wrong.push(Wrong::new(format!("`{id}` is on the list twice"), "keep one of them"));
        }
        let is_nowhere = element.places.is_empty() && element.tested.is_empty();
        if is_nowhere && element.why_not.is_empty() {
            let help = "give it `places` or `tested`, or say in `why_not` why it has none";
            wrong.push(Wrong::new(format!("`{id}` is nowhere, and nothing says why"), help));
        }
        for place in &element.places {
            let Some(found) = looked.find(place) else {
                let what = format!("`{id}`: {} has no experiment", place.file);
                let own = looked.experiments.get(place.file.as_str()).into_iter();
                let known = own.flat_map(BTreeMap::keys).copied();
                wrong.push(missing(&what, &place.experiment, known));
                continue;
            };
            outputs(id, place, found.experiment, wrong);
        }
    }
}

/// Looks whether an experiment has what a place names.
fn outputs(id: &str, place: &Place, experiment: &Experiment, wrong: &mut Vec<Wrong>) {
    let lacks = |what: &str| format!("`{id}`: `{}` has no {what}", place.experiment);
    for (what, named, known) in [
        ("figure", &place.figures, &experiment.figures),
        ("table", &place.tables, &experiment.tables),
    ] {
        for name in named.iter().filter(|name| !known.iter().any(|own| own.name == **name)) {
            wrong.push(missing(&lacks(what), name, names(known)));
        }
    }
    for words in &place.claims {
        if claims(experiment, words).next().is_none() {
            let known = experiment.claims.iter().map(|claim| claim.output.name.as_str());
            wrong.push(missing(&lacks("claim"), words, known));
        }
    }
}

/// The claims that words mean, in the order of the spec.
fn claims<'e>(experiment: &'e Experiment, words: &str) -> impl Iterator<Item = &'e str> {
    let all = experiment.claims.iter().map(|claim| claim.output.name.as_str());
    let (words, beginning) = (words.to_owned(), words.strip_suffix('*').map(str::to_owned));
    all.filter(move |own| match &beginning {
        Some(beginning) => own.starts_with(beginning),
        None => *own == words,
    })
}

/// The claims that a place names, in the order of its words.
pub(super) fn named<'f>(place: &'f Place, found: &'f Found<'_>) -> impl Iterator<Item = &'f str> {
    place.claims.iter().flat_map(|words| claims(found.experiment, words))
}

/// Looks whether the list hides an experiment or a claim.
fn hidden(list: &List, looked: &Looked<'_>, wrong: &mut Vec<Wrong>) {
    let mut told: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for place in list.places() {
        let Some(found) = looked.find(place) else { continue };
        let named = place.claims.iter().flat_map(|words| claims(found.experiment, words));
        told.entry(&found.experiment.name).or_default().extend(named);
    }
    let mut seen = BTreeSet::new();
    for found in looked.experiments.values().flat_map(BTreeMap::values) {
        let (experiment, name) = (found.experiment, found.experiment.name.as_str());
        if !seen.insert(name) {
            continue;
        }
        let Some(told) = told.get(name) else {
            let message = format!("no element is in the experiment `{name}`");
            wrong.push(Wrong::new(message, "give it to the `places` of one, so that it is told"));
            continue;
        };
        for claim in experiment.claims.iter().map(|claim| claim.output.name.as_str()) {
            if !told.contains(claim) {
                let message = format!("no element names the claim {claim:?} of `{name}`");
                wrong
                    .push(Wrong::new(message, "give it to the `claims` of one: nothing is hidden"));
            }
        }
    }
}

fn names(outputs: &[Output]) -> impl Iterator<Item = &str> {
    outputs.iter().map(|output| output.name.as_str())
}

fn missing<'n>(what: &str, name: &str, known: impl Iterator<Item = &'n str>) -> Wrong {
    let known: Vec<&str> = known.collect();
    let help = match suggest(name, known.iter().copied()) {
        Some(help) => help.said,
        None if known.is_empty() => "there is none".to_owned(),
        None => "`ivx claims SPEC` lists claims, and `report.md` has the rest".to_owned(),
    };
    Wrong { message: format!("{what} {name:?}"), help }
}

impl Wrong {
    fn new(message: String, help: &str) -> Self {
        Self { message, help: help.to_owned() }
    }
}
