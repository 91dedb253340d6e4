//! What differs between two results.

use std::collections::BTreeMap;
use std::fmt;

use ivx_op::{Finding, Outcome, shown_together};

use crate::moved::{Interval, Move, moved};
use crate::results::{Claim, Results, Setting};

/// One difference.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// Something is there only on one side.
    Only {
        /// `experiment`, `param`, `measure`, `claim`, `figure` or `table`.
        kind: &'static str,
        /// Its address.
        name: String,
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
        /// How far.
        moved: Move,
    },
    /// A claim has another outcome, or has one at some coordinates.
    Claim {
        /// Its address.
        name: String,
        /// Its outcome before.
        before: Option<Outcome>,
        /// Its outcome after.
        after: Option<Outcome>,
        /// The coordinates at which it has.
        flips: Vec<Flip>,
    },
    /// A figure or table looks different.
    File {
        /// `figure` or `table`.
        kind: &'static str,
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

/// A coordinate at which a claim has another outcome.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// What came out before.
    pub before: Finding,
    /// What came out after.
    pub after: Finding,
}

/// The differences from `before` to `after`. Numbers count as moved when they differ by more
/// than `tolerance` relative to the larger of the two.
#[must_use]
pub fn diff(before: &Results, after: &Results, tolerance: f64, interval: Interval) -> Vec<Change> {
    let mut changes = Vec::new();
    params("", &before.params, &after.params, &mut changes);
    for (name, old, new) in pairs(&before.experiments, &after.experiments) {
        let (Some(old), Some(new)) = (old, new) else {
            changes.push(only("experiment", name.clone(), new.is_some()));
            continue;
        };
        params(&format!("{name}."), &old.params, &new.params, &mut changes);
        for (claim, old, new) in pairs(&old.claims, &new.claims) {
            let name = format!("{name}/\"{claim}\"");
            match (old, new) {
                (Some(old), Some(new)) => changes.extend(flipped(name, old, new)),
                (_, new) => changes.push(only("claim", name, new.is_some())),
            }
        }
        for (measure, old, new) in pairs(&old.measures, &new.measures) {
            let name = format!("{name}/{measure}");
            match (old, new) {
                (Some(old), Some(new)) => {
                    let moved = moved(old, new, tolerance, interval);
                    changes.extend(moved.map(|moved| Change::Measure { name, moved }));
                }
                (_, new) => changes.push(only("measure", name, new.is_some())),
            }
        }
        let files = pairs(&old.figures, &new.figures).map(|f| ("figure", f));
        for (kind, (file, old, new)) in
            files.chain(pairs(&old.tables, &new.tables).map(|t| ("table", t)))
        {
            let name = format!("{name}/\"{file}\"");
            match (old, new) {
                (Some(old), Some(new)) if old != new => changes.push(Change::File { kind, name }),
                (Some(_), Some(_)) => {}
                (_, new) => changes.push(only(kind, name, new.is_some())),
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
                changes.push(only("param", name, new.is_some()));
            }
        }
    }
}

fn only(kind: &'static str, name: String, new: bool) -> Change {
    Change::Only { kind, name, new }
}

fn flipped(name: String, before: &Claim, after: &Claim) -> Option<Change> {
    let mut flips = Vec::new();
    for new in &after.findings {
        let old = before.findings.iter().find(|old| old.at == new.at);
        if let Some(old) = old.filter(|old| old.outcome != new.outcome) {
            flips.push(Flip { before: old.clone(), after: new.clone() });
        }
    }
    let (before, after) = (before.outcome, after.outcome);
    let is_flipped = before != after || !flips.is_empty();
    is_flipped.then_some(Change::Claim { name, before, after, flips })
}

pub(crate) type Pair<'a, T> = (&'a String, Option<&'a T>, Option<&'a T>);

pub(crate) fn pairs<'a, T>(
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

/// `~ param e.members: 8 -> 16`: what differs, without the details.
impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, name) = self.subject();
        write!(f, "{} {kind} {name}", self.sign())?;
        let how = self.how();
        if how.is_empty() { Ok(()) } else { write!(f, ": {how}") }
    }
}

/// An outcome in a word or three.
fn outcome(outcome: Option<Outcome>) -> String {
    outcome.map_or_else(|| "failed to run".to_owned(), |outcome| outcome.to_string())
}

impl Change {
    /// `+` for what is new or mended, `-` for what is gone, `!` for what is to be looked at first.
    #[must_use]
    pub fn sign(&self) -> char {
        match self {
            Self::Only { new: true, .. } | Self::Failure { why: None, .. } => '+',
            Self::Only { new: false, .. } => '-',
            Self::Claim { .. } | Self::Failure { .. } => '!',
            Self::Param { .. } | Self::Measure { .. } | Self::File { .. } => '~',
        }
    }

    /// The kind of what differs, and its address.
    #[must_use]
    pub fn subject(&self) -> (&'static str, &str) {
        match self {
            Self::Only { kind, name, .. } | Self::File { kind, name } => (kind, name),
            Self::Param { name, .. } => ("param", name),
            Self::Measure { name, .. } => ("measure", name),
            Self::Claim { name, .. } => ("claim", name),
            Self::Failure { node, .. } => ("node", node),
        }
    }

    /// How it differs; nothing where its sign says all.
    #[must_use]
    pub fn how(&self) -> String {
        match self {
            Self::Only { .. } => String::new(),
            Self::Param { before, after, .. } => format!("{before} -> {after}"),
            Self::Measure { moved, .. } => moved.to_string(),
            Self::Claim { before, after, .. } if before == after => {
                format!("{}, but otherwise", outcome(*before))
            }
            Self::Claim { before, after, .. } => {
                format!("{} -> {}", outcome(*before), outcome(*after))
            }
            Self::File { .. } => "looks different".to_owned(),
            Self::Failure { why: Some(why), .. } => format!("fails: {why}"),
            Self::Failure { why: None, .. } => "no longer fails".to_owned(),
        }
    }

    /// The details, a line each.
    #[must_use]
    pub fn details(&self) -> Vec<String> {
        match self {
            Self::Measure { moved, .. } => moved.details(),
            Self::Claim { flips, .. } => flips.iter().map(Flip::to_string).collect(),
            _ => Vec::new(),
        }
    }
}

/// `at ke=MA: holds, difference -0.5 in [-1, 0], n = 8 -> fails, difference 0.25`
impl fmt::Display for Flip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = self.after.at.iter().map(|(axis, label)| format!("{axis}={label}"));
        let at: Vec<String> = at.collect();
        if !at.is_empty() {
            write!(f, "at {}: ", at.join(", "))?;
        }
        let (before, after) = (numbers(&self.before), numbers(&self.after));
        let texts = shown_together(&[&before[..], &after].concat());
        let (old, new) = texts.split_at(before.len());
        write!(f, "{} -> {}", found(&self.before, old), found(&self.after, new))
    }
}

/// What stands in a finding: the difference, and its interval where there is one.
fn numbers(finding: &Finding) -> Vec<f64> {
    let ends = finding.interval.map(|(low, high)| [low, high]);
    [finding.estimate].into_iter().chain(ends.into_iter().flatten()).collect()
}

fn found(Finding { outcome, n, .. }: &Finding, numbers: &[String]) -> String {
    let interval = match numbers {
        [_, low, high] => format!(" in [{low}, {high}]"),
        _ => String::new(),
    };
    let seeds = if *n > 0 { format!(", n = {n}") } else { String::new() };
    format!("{outcome}, difference {}{interval}{seeds}", numbers[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::{ExperimentResults, Measure};

    fn none(_: &[f64]) -> Option<(f64, f64)> {
        None
    }

    fn results(value: f64, outcome: Outcome, members: i64) -> Results {
        let measure = Measure { dims: Vec::new(), values: vec![value], ..Measure::default() };
        let claim = Claim { claim: "a < b".into(), outcome: Some(outcome), ..Claim::default() };
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
        assert_eq!(diff(&before, &before, 0.0, none), []);
        assert_eq!(diff(&before, &results(1.0 + 1e-12, Outcome::Holds, 8), 1e-9, none), []);
        let changes = diff(&before, &results(1.5, Outcome::Fails, 16), 1e-9, none);
        let told: Vec<_> = changes.iter().map(ToString::to_string).collect();
        assert_eq!(
            told,
            [
                "~ param e.members: 8 -> 16",
                "! claim e/\"less\": holds -> fails",
                "~ measure e/gap: 1 of 1 moved, at most 1 -> 1.5 (+50 %)",
            ]
        );
        let gone = diff(&before, &Results::default(), 0.0, none);
        assert_eq!(gone, [only("experiment", "e".into(), false)]);
    }

    #[test]
    fn a_claim_is_told_where_it_flipped() {
        let finding = |label: &str, outcome, estimate, interval| Finding {
            at: vec![("ke".into(), label.into())],
            outcome,
            estimate,
            interval,
            n: 8,
            ..Finding::default()
        };
        let claim = |findings: [Finding; 2]| Claim {
            claim: "a < b".into(),
            outcome: Some(Outcome::Fails),
            findings: findings.into(),
            ..Claim::default()
        };
        let stays = finding("WCM", Outcome::Fails, 2.0, None);
        let before = claim([stays.clone(), finding("MA", Outcome::Holds, -1.0 / 3.0, None)]);
        let after = finding("MA", Outcome::Undecided, 1e-7, Some((-0.25, 12345.6)));
        let change = flipped("e/\"less\"".into(), &before, &claim([after, stays])).unwrap();
        assert_eq!(change.to_string(), "! claim e/\"less\": fails, but otherwise");
        let told = "at ke=MA: holds, difference -0.3333, n = 8 -> \
                    undecided, difference 1e-7 in [-0.25, 12346], n = 8";
        assert_eq!(change.details(), [told]);
        assert_eq!(flipped("e".into(), &before, &before), None);
    }

    #[test]
    fn results_survive_the_round_trip() {
        let results = results(-0.1, Outcome::Undecided, 3);
        assert_eq!(Results::from_ron(&results.to_ron()), Ok(results));
    }
}
