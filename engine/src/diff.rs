//! What differs between two results.

use std::collections::BTreeMap;
use std::fmt;

use ivx_op::Outcome;

use crate::results::{Measure, Results, Setting};

/// One difference.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// Something is there only on one side.
    Only {
        /// What.
        what: String,
        /// Whether it is new; otherwise it is gone.
        new: bool,
    },
    /// A parameter has another value.
    Param {
        /// Its address.
        name: String,
        /// Its value before.
        before: Setting,
        /// Its value after.
        after: Setting,
    },
    /// A measure moved.
    Measure {
        /// Its address.
        name: String,
        /// How many numbers moved, of how many.
        moved: (usize, usize),
        /// The largest move, and its size relative to the value before.
        largest: (f64, f64),
    },
    /// A measure varies over something else.
    Shape {
        /// Its address.
        name: String,
    },
    /// A claim has another outcome.
    Claim {
        /// Its address.
        name: String,
        /// Its outcome before.
        before: Option<Outcome>,
        /// Its outcome after.
        after: Option<Outcome>,
    },
    /// A figure or table looks different.
    File {
        /// Its address.
        name: String,
    },
    /// A node fails now, or no longer does.
    Failure {
        /// The node.
        node: String,
        /// Why it fails; none if it no longer does.
        why: Option<String>,
    },
}

/// The differences from `before` to `after`. Numbers count as moved when they differ by more
/// than `tolerance` relative to the larger of the two.
#[must_use]
pub fn diff(before: &Results, after: &Results, tolerance: f64) -> Vec<Change> {
    let mut changes = Vec::new();
    params("", &before.params, &after.params, &mut changes);
    for (name, old, new) in pairs(&before.experiments, &after.experiments) {
        let (Some(old), Some(new)) = (old, new) else {
            changes.push(Change::Only { what: format!("experiment {name}"), new: new.is_some() });
            continue;
        };
        params(&format!("{name}."), &old.params, &new.params, &mut changes);
        for (claim, old, new) in pairs(&old.claims, &new.claims) {
            let name = format!("{name}/\"{claim}\"");
            match (old, new) {
                (Some(old), Some(new)) if old.outcome != new.outcome => {
                    changes.push(Change::Claim { name, before: old.outcome, after: new.outcome });
                }
                (Some(_), Some(_)) => {}
                (_, new) => {
                    changes
                        .push(Change::Only { what: format!("claim {name}"), new: new.is_some() });
                }
            }
        }
        for (measure, old, new) in pairs(&old.measures, &new.measures) {
            let name = format!("{name}/{measure}");
            match (old, new) {
                (Some(old), Some(new)) => changes.extend(moved(name, old, new, tolerance)),
                (_, new) => changes
                    .push(Change::Only { what: format!("measure {name}"), new: new.is_some() }),
            }
        }
        let files = pairs(&old.figures, &new.figures).map(|f| ("figure", f));
        for (kind, (file, old, new)) in
            files.chain(pairs(&old.tables, &new.tables).map(|t| ("table", t)))
        {
            let name = format!("{kind} {name}/\"{file}\"");
            match (old, new) {
                (Some(old), Some(new)) if old != new => changes.push(Change::File { name }),
                (Some(_), Some(_)) => {}
                (_, new) => changes.push(Change::Only { what: name, new: new.is_some() }),
            }
        }
    }
    for (node, old, new) in pairs(&before.failures, &after.failures) {
        if old.is_some() != new.is_some() {
            changes.push(Change::Failure { node: node.clone(), why: new.cloned() });
        }
    }
    changes
}

fn params(
    prefix: &str,
    before: &BTreeMap<String, Setting>,
    after: &BTreeMap<String, Setting>,
    changes: &mut Vec<Change>,
) {
    for (name, old, new) in pairs(before, after) {
        let name = format!("{prefix}{name}");
        match (old, new) {
            (Some(old), Some(new)) if old != new => {
                changes.push(Change::Param { name, before: old.clone(), after: new.clone() });
            }
            (Some(_), Some(_)) => {}
            (_, new) => {
                changes.push(Change::Only { what: format!("param {name}"), new: new.is_some() });
            }
        }
    }
}

fn moved(name: String, before: &Measure, after: &Measure, tolerance: f64) -> Option<Change> {
    if before.dims != after.dims || before.values.len() != after.values.len() {
        return Some(Change::Shape { name });
    }
    let mut n_moved = 0;
    let mut largest = (0.0, 0.0);
    for (old, new) in before.values.iter().zip(&after.values) {
        let same = old == new || (old.is_nan() && new.is_nan());
        let apart = (new - old).abs();
        let relative = apart / old.abs().max(new.abs());
        if same || relative <= tolerance {
            continue;
        }
        n_moved += 1;
        if n_moved == 1 || apart > largest.0 || apart.is_nan() {
            largest = (apart, apart / old.abs());
        }
    }
    (n_moved > 0).then_some(Change::Measure {
        name,
        moved: (n_moved, before.values.len()),
        largest,
    })
}

type Pair<'a, T> = (&'a String, Option<&'a T>, Option<&'a T>);

fn pairs<'a, T>(
    before: &'a BTreeMap<String, T>,
    after: &'a BTreeMap<String, T>,
) -> impl Iterator<Item = Pair<'a, T>> {
    let gone_or_kept = before.iter().map(|(name, old)| (name, Some(old), after.get(name)));
    let new = after.iter().filter(|(name, _)| !before.contains_key(*name));
    gone_or_kept.chain(new.map(|(name, new)| (name, None, Some(new))))
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(b) => write!(f, "{b}"),
            Self::Int(n) => write!(f, "{n}"),
            Self::Real(x) => write!(f, "{x:?}"),
            Self::Text(text) => write!(f, "{text:?}"),
        }
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let outcome =
            |o: &Option<Outcome>| o.map_or_else(|| "failed to run".to_owned(), |o| o.to_string());
        match self {
            Self::Only { what, new: true } => write!(f, "+ {what}"),
            Self::Only { what, new: false } => write!(f, "- {what}"),
            Self::Param { name, before, after } => write!(f, "~ param {name}: {before} -> {after}"),
            Self::Measure { name, moved: (n, of), largest: (apart, relative) } => write!(
                f,
                "~ measure {name}: {n} of {of} moved, by at most {apart:.3e} ({:.2} %)",
                relative * 100.0
            ),
            Self::Shape { name } => write!(f, "~ measure {name}: varies over something else"),
            Self::Claim { name, before, after } => {
                write!(f, "! claim {name}: {} -> {}", outcome(before), outcome(after))
            }
            Self::File { name } => write!(f, "~ {name}: looks different"),
            Self::Failure { node, why: Some(why) } => write!(f, "! {node} fails: {why}"),
            Self::Failure { node, why: None } => write!(f, "+ {node} no longer fails"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::{Claim, ExperimentResults};

    fn results(value: f64, outcome: Outcome, members: i64) -> Results {
        let measure = Measure { dims: Vec::new(), values: vec![value] };
        let claim = Claim { claim: "a < b".into(), outcome: Some(outcome), findings: Vec::new() };
        let experiment = ExperimentResults {
            params: [("members".into(), Setting::Int(members))].into(),
            claims: [("less".into(), claim)].into(),
            measures: [("gap".into(), measure)].into(),
            ..ExperimentResults::default()
        };
        Results { experiments: [("e".into(), experiment)].into(), ..Results::default() }
    }

    #[test]
    fn only_what_moved_beyond_tolerance_is_told() {
        let before = results(1.0, Outcome::Holds, 8);
        assert_eq!(diff(&before, &before, 0.0), []);
        assert_eq!(diff(&before, &results(1.0 + 1e-12, Outcome::Holds, 8), 1e-9), []);
        let told: Vec<_> = diff(&before, &results(1.5, Outcome::Fails, 16), 1e-9)
            .iter()
            .map(ToString::to_string)
            .collect();
        assert_eq!(
            told,
            [
                "~ param e.members: 8 -> 16",
                "! claim e/\"less\": holds -> fails",
                "~ measure e/gap: 1 of 1 moved, by at most 5.000e-1 (50.00 %)",
            ]
        );
        let gone = diff(&before, &Results::default(), 0.0);
        assert_eq!(gone, [Change::Only { what: "experiment e".into(), new: false }]);
    }

    #[test]
    fn results_survive_the_round_trip() {
        let results = results(-0.1, Outcome::Undecided, 3);
        assert_eq!(Results::from_ron(&results.to_ron()), Ok(results));
    }
}
