//! What a run found, kept beside its spec and held against later runs.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::diff::diff;
use crate::outcome::Outcome;
use crate::plan::Plan;
use crate::platform::platform;
use crate::registration::Registration;
use crate::results::{ExperimentResults, Measure, Results, to_ron};

/// By how much measures may differ from those of another platform, relative to their size.
const TOLERANCE: f64 = 1e-6;

/// The locks of the specs in one folder, by the name of the spec: `ivx.lock`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Locks {
    /// The format of this file.
    pub format: u32,
    /// By the name of the spec.
    pub specs: BTreeMap<String, Lock>,
}

/// What a run of one spec found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lock {
    /// Where it ran.
    pub platform: String,
    /// The profile in force.
    pub profile: Option<String>,
    /// The digest of every node, by address.
    pub nodes: BTreeMap<String, String>,
    /// The measures, by experiment and name.
    pub measures: BTreeMap<String, BTreeMap<String, Measure>>,
    /// What it claims, and what came out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub registered: Option<Registration>,
}

impl Locks {
    /// As text: sorted, with shortest round-trip numbers.
    #[must_use]
    pub fn to_ron(&self) -> String {
        to_ron(self)
    }

    /// Back from text.
    ///
    /// # Errors
    /// If the text is no lock file; the error has line and column.
    pub fn from_ron(text: &str) -> Result<Self, ron::error::SpannedError> {
        ron::from_str(text)
    }
}

impl Lock {
    /// What a run found.
    #[must_use]
    pub fn of(plan: &Plan, outcome: &Outcome, results: &Results) -> Self {
        let nodes = plan.graph.node_weights().zip(&outcome.nodes).filter_map(|(step, node)| {
            let output = node.output.as_ref()?;
            Some((step.address.clone(), output.digest.to_string()))
        });
        let measures = results.experiments.iter();
        let measures = measures.map(|(name, found)| (name.clone(), found.measures.clone()));
        Self {
            platform: platform(),
            profile: results.profile.clone(),
            nodes: nodes.collect(),
            measures: measures.collect(),
            registered: None,
        }
    }

    /// What it claims and what came out, without the bytes of one machine.
    #[must_use]
    pub fn registering(results: &Results, registered: Registration) -> Self {
        Self {
            platform: platform(),
            profile: results.profile.clone(),
            nodes: BTreeMap::new(),
            measures: BTreeMap::new(),
            registered: Some(registered),
        }
    }

    /// What differs in `now`, a line each: nodes on one platform, measures from one to another.
    #[must_use]
    pub fn differences(&self, now: &Self) -> Vec<String> {
        if self.profile != now.profile {
            let called = |profile: &Option<String>| {
                profile.clone().map_or("no profile".to_owned(), |name| format!("profile `{name}`"))
            };
            let (locked, run) = (called(&self.profile), called(&now.profile));
            return vec![format!("locked under {locked}, run under {run}")];
        }
        let tolerance = if self.platform == now.platform { 0.0 } else { TOLERANCE };
        let mut lines = Vec::new();
        if let (Some(registered), Some(now)) = (&self.registered, &now.registered) {
            lines.extend(registered.changes(now));
            lines.extend(registered.moved(now));
        }
        if self.nodes.is_empty() {
            return lines;
        }
        if self.platform == now.platform {
            for (address, locked) in &self.nodes {
                match now.nodes.get(address) {
                    None => lines.push(format!("- {address}")),
                    Some(found) if found != locked => {
                        lines.push(format!("~ {address}: {} -> {}", short(locked), short(found)));
                    }
                    Some(_) => {}
                }
            }
            let new = now.nodes.keys().filter(|address| !self.nodes.contains_key(*address));
            lines.extend(new.map(|address| format!("+ {address}")));
        }
        if lines.is_empty() {
            let changes = diff(&self.results(), &now.results(), tolerance, |_| None);
            lines.extend(changes.iter().map(ToString::to_string));
        }
        lines
    }

    /// Results that have nothing but the measures.
    fn results(&self) -> Results {
        let experiment = |measures: &BTreeMap<String, Measure>| ExperimentResults {
            measures: measures.clone(),
            ..ExperimentResults::default()
        };
        let experiments = self.measures.iter();
        Results {
            experiments: experiments.map(|(name, m)| (name.clone(), experiment(m))).collect(),
            ..Results::default()
        }
    }
}

fn short(digest: &str) -> &str {
    digest.get(..12).unwrap_or(digest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lock(platform: &str, digest: &str, value: f64) -> Lock {
        let measure = Measure { dims: Vec::new(), values: vec![value], ..Measure::default() };
        Lock {
            platform: platform.to_owned(),
            profile: None,
            nodes: [("e/x".to_owned(), digest.to_owned())].into(),
            measures: [("e".to_owned(), [("x".to_owned(), measure)].into())].into(),
            registered: None,
        }
    }

    #[test]
    fn digests_count_at_home_and_measures_elsewhere() {
        let locked = lock("here", "aaaa", 1.0);
        assert_eq!(locked.differences(&locked), [""; 0]);
        assert_eq!(locked.differences(&lock("here", "bbbb", 1.0)), ["~ e/x: aaaa -> bbbb"]);
        assert_eq!(locked.differences(&lock("there", "bbbb", 1.0 + 1e-9)), [""; 0]);
        assert_eq!(locked.differences(&lock("there", "bbbb", 1.1)).len(), 1);
        let renamed =
            Lock { nodes: [("e/y".to_owned(), "aaaa".to_owned())].into(), ..locked.clone() };
        assert_eq!(locked.differences(&renamed), ["- e/x", "+ e/y"]);
        let profile = Lock { profile: Some("quick".to_owned()), ..locked.clone() };
        assert_eq!(
            locked.differences(&profile),
            ["locked under no profile, run under profile `quick`"]
        );
        let locks = Locks { format: 1, specs: [("s".to_owned(), locked)].into() };
        assert_eq!(Locks::from_ron(&locks.to_ron()), Ok(locks));
    }
}
