//! Profiles: which is in force, and what it builds on.

use std::collections::{BTreeMap, BTreeSet};

use super::Checker;
use crate::ast::{ItemKind, Name};
use crate::{Code, Diagnostic, suggest};

/// The profile in which every parameter has its default, unless a spec declares it.
const DEFAULTS: &str = "paper";
/// The profile used where it is declared and no other is asked for.
const USUAL: &str = "quick";

impl<'a> Checker<'a> {
    /// Chooses the profile. It is one thing across all files and experiments, and so is its base.
    pub(super) fn profile(&mut self) {
        let items = self.scopes.all.iter().flat_map(|scope| scope.items);
        let declared = items.filter_map(|item| match &item.kind {
            ItemKind::Profile { name, base, .. } => Some((name.value.as_str(), base.as_ref())),
            _ => None,
        });
        let declared: Vec<(&'a str, Option<&'a Name>)> = declared.collect();
        let names: BTreeSet<&str> = declared.iter().map(|(name, _)| *name).collect();
        let bases = self.bases(&declared, &names);
        let asked = self.params.asked();
        let chosen = match asked {
            Some(name) if names.contains(name) => Some(name),
            None => names.contains(USUAL).then_some(USUAL),
            Some(DEFAULTS) => None,
            Some(name) => {
                let help = suggest(name, names.iter().copied().chain([DEFAULTS]));
                self.unplaced(format!("no profile is called `{name}`"), help);
                None
            }
        };
        self.program.set_profile(chosen);
        let mut profiles: Vec<String> = Vec::new();
        let mut next = chosen;
        while let Some(name) = next.filter(|name| !profiles.iter().any(|known| known == name)) {
            profiles.push(name.to_owned());
            next = bases.get(name).map(|base| base.value.as_str());
        }
        profiles.reverse();
        self.params.choose(profiles);
    }

    /// The base of each profile that has one.
    fn bases(
        &mut self,
        declared: &[(&'a str, Option<&'a Name>)],
        names: &BTreeSet<&str>,
    ) -> BTreeMap<&'a str, &'a Name> {
        let mut bases: BTreeMap<&str, &Name> = BTreeMap::new();
        for (name, base) in declared.iter().filter_map(|(name, base)| Some((*name, (*base)?))) {
            if !names.contains(base.value.as_str()) && base.value != DEFAULTS {
                let message = format!("no profile is called `{}`", base.value);
                let fault =
                    Diagnostic::new(Code::UnknownParameter, base.span, message, "not declared");
                let known = names.iter().copied().filter(|known| *known != name);
                self.fault(fault.maybe_help(suggest(&base.value, known.chain([DEFAULTS]))));
            }
            let first = *bases.entry(name).or_insert(base);
            if first.value != base.value {
                let message = format!("profile `{name}` has two bases");
                let label = format!("here it is `{}`", base.value);
                let fault = Diagnostic::new(Code::Shadowing, base.span, message, label)
                    .also(first.span, format!("here it is `{}`", first.value))
                    .help("a profile is the same in every file and experiment: name one base");
                self.fault(fault);
            }
        }
        for start in bases.keys() {
            let follow = |base: &&Name| bases.get(base.value.as_str()).copied();
            let circle = std::iter::successors(Some(bases[start]), follow).take(bases.len());
            let Some(closes) = circle.clone().position(|base| base.value == *start) else {
                continue;
            };
            let circle: Vec<&Name> = circle.take(closes + 1).collect();
            // Each profile of a circle leads here; it is reported from the first.
            if circle.iter().any(|base| base.value.as_str() < *start) {
                continue;
            }
            let path = circle.iter().map(|base| format!(" -> {}", base.value));
            let message = format!(
                "profiles build on each other in a circle: {start}{}",
                path.collect::<String>()
            );
            let fault = Diagnostic::new(Code::Recursion, circle[0].span, message, "begins here");
            let fault =
                circle[1..].iter().fold(fault, |fault, base| fault.also(base.span, "goes on"));
            self.faults.add(fault.help("leave out one of the bases"));
        }
        bases
    }
}
