//! What a spec claims, written down: so that a claim, a threshold or a parameter that changed after its results were
//! seen can be told.

use std::collections::BTreeMap;

use ivx_grammar::ir::{Param, Spec};
use ivx_op::{Dim, Finding, Outcome as Verdict, shown_together};
use serde::{Deserialize, Serialize};

use crate::diff::pairs;
use crate::moved::{Interval, mean, near};
use crate::results::{Claim, Corrected, Measure, Results, TABLES, path};
use crate::told::{listed, verdict};

/// What counts as the same number where there is no interval, relative to its size.
const TOLERANCE: f64 = 1e-6;

/// The claims of a spec, and what came out when they were registered.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Registration {
    /// Every parameter by its address, as the language writes its value, and the labels of every axis.
    pub params: BTreeMap<String, String>,
    /// The claims, by experiment and words.
    pub claims: BTreeMap<String, BTreeMap<String, Registered>>,
    /// The measures, by experiment and name: in the order of their coordinates but `seed`, last fastest.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub measures: BTreeMap<String, BTreeMap<String, Vec<Seen>>>,
    /// The tables as Markdown, by experiment and name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub tables: BTreeMap<String, BTreeMap<String, String>>,
}

/// A claim as it was registered.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Registered {
    /// The comparison with its margin, the reason for that, confidence, method and family, as written.
    pub claim: String,
    /// Since when it is so, as `2026-11-29`.
    pub since: String,
    /// Its verdict by itself; none if it was not run.
    pub verdict: Option<Verdict>,
    /// What it amounts to among the claims of its family; none where it is in none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub corrected: Option<Corrected>,
    /// What a reader is to know of it, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub marks: Vec<String>,
    /// Coordinate by coordinate.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<Finding>,
}

/// A mean over seeds and its 95 % interval; a number without, where there are no seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seen(pub f64, pub Option<(f64, f64)>);

impl Registration {
    /// What a checked spec claims; nothing was run.
    ///
    /// - `date`: today, as `2026-11-29`.
    #[must_use]
    pub fn of(spec: &Spec, date: &str) -> Self {
        let own = |prefix: &str, params: &[Param]| -> Vec<(String, String)> {
            let address =
                |param: &Param| (format!("{prefix}{}", param.name), param.value.to_string());
            params.iter().map(address).collect()
        };
        let mut params: BTreeMap<String, String> = own("", &spec.params).into_iter().collect();
        let mut claims = BTreeMap::new();
        for experiment in &spec.experiments {
            params.extend(own(&format!("{}.", experiment.name), &experiment.params));
            params.extend(experiment.axes.iter().map(|declared| {
                let axis = spec.axis(declared.axis);
                let labels: Vec<String> = axis.coords.iter().map(|own| own.label.clone()).collect();
                (format!("{}.axis {}", experiment.name, axis.name), listed(&labels))
            }));
            let registered = experiment.claims.iter().map(|claim| {
                let (claim, since) = (claim.output.source.clone(), date.to_owned());
                Registered { claim, since, ..Registered::default() }
            });
            let words = experiment.claims.iter().map(|claim| claim.output.name.clone());
            claims.insert(experiment.name.clone(), words.zip(registered).collect());
        }
        Self { params, claims, ..Self::default() }
    }

    /// The same, with what a run found.
    ///
    /// - `files`: those that show its results, by path in their folder.
    #[must_use]
    pub fn with(
        mut self,
        results: &Results,
        files: &BTreeMap<String, String>,
        interval: Interval,
    ) -> Self {
        for (name, found) in &results.experiments {
            for (words, claim) in self.claims.entry(name.clone()).or_default() {
                if let Some(found) = found.claims.get(words) {
                    claim.find(found);
                }
            }
            let tables = found.tables.keys().filter_map(|table| {
                let text = files.get(&path(TABLES, table, "md"))?;
                Some((table.clone(), text.clone()))
            });
            let tables: BTreeMap<String, String> = tables.collect();
            if !tables.is_empty() {
                self.tables.insert(name.clone(), tables);
            }
            let seen = found.measures.iter().map(|(name, own)| (name.clone(), seen(own, interval)));
            self.measures.insert(name.clone(), seen.collect());
        }
        self
    }

    /// The same, with the dates of claims that have not changed since `earlier`.
    #[must_use]
    pub fn after(mut self, earlier: &Self) -> Self {
        for (experiment, claims) in &mut self.claims {
            for (words, claim) in claims {
                let before = earlier.claims.get(experiment).and_then(|claims| claims.get(words));
                if let Some(before) = before.filter(|before| before.claim == claim.claim) {
                    claim.since.clone_from(&before.since);
                }
            }
        }
        self
    }

    /// Whether it is of this experiment, among others.
    #[must_use]
    pub fn has(&self, experiment: &str) -> bool {
        self.claims.contains_key(experiment)
    }

    /// The claims of one experiment, with all that may decide them: its parameters and axes, and those of files.
    pub(crate) fn only(mut self, experiment: &str) -> Self {
        let others: Vec<String> = self.claims.keys().map(|name| format!("{name}.")).collect();
        let own = format!("{experiment}.");
        self.params.retain(|address, _| {
            address.starts_with(&own) || !others.iter().any(|other| address.starts_with(other))
        });
        self.claims.retain(|name, _| name == experiment);
        self
    }

    /// What of it another is about: the claims of the same experiments, and the parameters that are theirs or that
    /// the other has.
    pub(crate) fn like(&self, other: &Self) -> Self {
        let is_own = |address: &String| {
            let own = |name: &String| address.starts_with(&format!("{name}."));
            other.params.contains_key(address) || other.claims.keys().any(own)
        };
        let params = self.params.iter().filter(|(address, _)| is_own(address));
        let claims = self.claims.iter().filter(|(name, _)| other.claims.contains_key(*name));
        Self {
            params: params.map(|(address, value)| (address.clone(), value.clone())).collect(),
            claims: claims.map(|(name, own)| (name.clone(), own.clone())).collect(),
            ..Self::default()
        }
    }

    /// Which parameters and claims are others `now`, a line each.
    #[must_use]
    pub fn changes(&self, now: &Self) -> Vec<String> {
        let mut lines = Vec::new();
        for (param, old, new) in pairs(&self.params, &now.params) {
            match (old, new) {
                (Some(old), Some(new)) if old == new => {}
                (Some(old), Some(new)) => lines.push(format!("~ param {param}: {old} -> {new}")),
                (None, Some(new)) => lines.push(format!("+ param {param}: {new}")),
                (old, _) => lines.extend(old.map(|old| format!("- param {param}: {old}"))),
            }
        }
        let nothing = BTreeMap::new();
        for (experiment, old, new) in pairs(&self.claims, &now.claims) {
            let (old, new) = (old.unwrap_or(&nothing), new.unwrap_or(&nothing));
            for (words, old, new) in pairs(old, new) {
                let name = format!("claim {experiment}/{words:?}");
                match (old, new) {
                    (Some(old), Some(new)) if old.claim == new.claim => {}
                    (Some(old), Some(new)) => lines.push(format!(
                        "~ {name}, registered on {}: {} -> {}",
                        old.since, old.claim, new.claim
                    )),
                    (None, Some(new)) => lines.push(format!("+ {name}: {}", new.claim)),
                    (old, _) => lines.extend(old.map(|old| format!("- {name}: {}", old.claim))),
                }
            }
        }
        lines
    }

    /// Which verdicts are others `now`, and which measures lie outside of their intervals, a line each.
    #[must_use]
    pub fn moved(&self, now: &Self) -> Vec<String> {
        let mut lines = Vec::new();
        for (experiment, claims) in &self.claims {
            for (words, old) in claims {
                let new = now.claims.get(experiment).and_then(|claims| claims.get(words));
                let Some(new) = new.filter(|new| new.verdict != old.verdict) else { continue };
                let (old, new) = (verdict(old.verdict), verdict(new.verdict));
                lines.push(format!("! claim {experiment}/{words:?}: {old} -> {new}"));
            }
        }
        for (experiment, measures) in &self.measures {
            for (name, old) in measures {
                let new = now.measures.get(experiment).and_then(|measures| measures.get(name));
                let line = match new {
                    None => Some("gone".to_owned()),
                    Some(new) if new.len() != old.len() => {
                        Some(format!("{} numbers -> {}", old.len(), new.len()))
                    }
                    Some(new) => {
                        let outside = || old.iter().zip(new).filter(|(old, new)| !old.holds(new.0));
                        let first = outside().next().map(|(old, new)| old.told(new.0));
                        first.map(|first| {
                            format!("{} of {} moved, {first}", outside().count(), old.len())
                        })
                    }
                };
                lines.extend(line.map(|line| format!("~ measure {experiment}/{name}: {line}")));
            }
        }
        lines
    }
}

impl Registered {
    /// Takes what a run found.
    fn find(&mut self, found: &Claim) {
        self.verdict = found.outcome;
        self.corrected = found.corrected;
        self.marks.clone_from(&found.marks);
        self.findings.clone_from(&found.findings);
    }

    /// The claim with what came out, as results have it.
    #[must_use]
    pub fn found(&self) -> Claim {
        Claim {
            claim: self.claim.clone(),
            outcome: self.verdict,
            corrected: self.corrected,
            marks: self.marks.clone(),
            findings: self.findings.clone(),
        }
    }
}

impl Seen {
    /// Whether a number found later is the same, as far as that was known.
    fn holds(self, later: f64) -> bool {
        near(self.0, later, TOLERANCE)
            || self.1.is_some_and(|(low, high)| (low..=high).contains(&later))
    }

    fn told(self, later: f64) -> String {
        let ends = self.1.map(|(low, high)| [low, high]);
        let all: Vec<f64> = [self.0, later].into_iter().chain(ends.into_iter().flatten()).collect();
        match &shown_together(&all)[..] {
            [old, new, low, high] => format!("{old} in [{low}, {high}] -> {new}"),
            told => told.join(" -> "),
        }
    }
}

/// The means over seeds with their intervals, in the order of the other coordinates.
fn seen(measure: &Measure, interval: Interval) -> Vec<Seen> {
    let Some(seed) = measure.dims.iter().position(|dim| dim.name == "seed") else {
        return measure.values.iter().map(|x| Seen(*x, None)).collect();
    };
    let inner: usize = measure.dims[seed + 1..].iter().map(Dim::len).product();
    let n = measure.dims[seed].len();
    let mut means = Vec::new();
    for block in measure.values.chunks((n * inner).max(1)) {
        for place in 0..inner {
            let xs: Vec<f64> = block.iter().skip(place).step_by(inner.max(1)).copied().collect();
            means.push(Seen(mean(&xs), interval(&xs)));
        }
    }
    means
}

#[cfg(test)]
mod tests {
    use ivx_op::Labels;

    use super::*;

    fn registration(claim: &str, members: i64, since: &str) -> Registration {
        let registered = Registered {
            claim: claim.to_owned(),
            since: since.to_owned(),
            verdict: Some(Verdict::Holds),
            ..Registered::default()
        };
        Registration {
            params: [("e.members".to_owned(), members.to_string())].into(),
            claims: [("e".to_owned(), [("less".to_owned(), registered)].into())].into(),
            ..Registration::default()
        }
    }

    #[test]
    fn what_changed_after_it_was_registered_is_told() {
        let before = registration("a < 0.5", 16, "2026-01-01");
        let after = registration("a < 0.6", 64, "2026-02-02");
        assert_eq!(before.changes(&before), [""; 0]);
        let told = [
            "~ param e.members: 16 -> 64",
            "~ claim e/\"less\", registered on 2026-01-01: a < 0.5 -> a < 0.6",
        ];
        assert_eq!(before.changes(&after), told);
        let none = Registration::default();
        assert_eq!(before.changes(&none), ["- param e.members: 16", "- claim e/\"less\": a < 0.5"]);
        assert_eq!(none.changes(&after), ["+ param e.members: 64", "+ claim e/\"less\": a < 0.6"]);
        // A claim keeps its date for as long as it stays as it is.
        let since = |registration: Registration| registration.claims["e"]["less"].since.clone();
        assert_eq!(since(after.clone().after(&before)), "2026-02-02");
        assert_eq!(since(registration("a < 0.5", 64, "2026-02-02").after(&before)), "2026-01-01");
    }

    #[test]
    fn a_measure_may_move_within_its_interval() {
        let measure = |values: &[f64]| {
            let dims = vec![Dim::new("seed", Labels::count(2)), Dim::new("x", Labels::count(2))];
            seen(&Measure { dims, values: values.to_vec(), ..Measure::default() }, |xs| {
                Some((xs[0].min(xs[1]), xs[0].max(xs[1])))
            })
        };
        // Seeds outermost: 1 and 3 at the first place, 2 and 2 at the second.
        let of = |values: &[f64]| {
            let mut one = registration("a < 0.5", 16, "");
            one.measures = [("e".to_owned(), [("m".to_owned(), measure(values))].into())].into();
            one
        };
        let before = of(&[1.0, 2.0, 3.0, 2.0]);
        assert_eq!(before.measures["e"]["m"][0], Seen(2.0, Some((1.0, 3.0))));
        assert_eq!(before.moved(&of(&[2.0, 2.0, 3.9, 2.0])), [""; 0]);
        let told = ["~ measure e/m: 1 of 2 moved, 2 in [1, 3] -> 3.5"];
        assert_eq!(before.moved(&of(&[3.0, 2.0, 4.0, 2.0])), told);
        let mut fails = before.clone();
        fails.claims.get_mut("e").unwrap().get_mut("less").unwrap().verdict = Some(Verdict::Fails);
        assert_eq!(before.moved(&fails), ["! claim e/\"less\": holds -> fails"]);
    }
}
