//! What there is to say of a run that has ended: what the history remembers, what the report says that it was made
//! of, what `run.ron` keeps and what the terminal shows are told from one account.

use std::collections::BTreeSet;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use ivx_cache::Digest;
use ivx_engine::{Fate, Node, Outcome, Plan, Results};
use ivx_grammar::ir::Spec;
use serde::{Deserialize, Serialize};

use crate::history::Files;

/// A run that has ended.
#[derive(Clone, Copy)]
pub(crate) struct Account<'a> {
    pub(crate) spec: &'a Spec,
    /// Which texts it is of.
    pub(crate) files: &'a Files,
    pub(crate) plan: &'a Plan,
    pub(crate) outcome: &'a Outcome,
    /// What came out; none of a run that was stopped.
    pub(crate) results: Option<&'a Results>,
    /// How many nodes ran at once.
    pub(crate) jobs: usize,
    /// When it began.
    pub(crate) began: SystemTime,
    /// How long it took.
    pub(crate) took: Duration,
}

/// What became of the nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Nodes {
    pub(crate) all: usize,
    pub(crate) executed: usize,
    pub(crate) hit: usize,
    pub(crate) failed: usize,
    pub(crate) skipped: usize,
}

impl<'a> Account<'a> {
    /// That of a run which ends now.
    pub(crate) fn of(
        (spec, files): (&'a Spec, &'a Files),
        (plan, outcome): (&'a Plan, &'a Outcome),
        jobs: usize,
        started: Instant,
    ) -> Self {
        let took = started.elapsed();
        let began = SystemTime::now().checked_sub(took).unwrap_or(UNIX_EPOCH);
        Self { spec, files, plan, outcome, results: None, jobs, began, took }
    }

    /// What became of its nodes.
    pub(crate) fn nodes(&self) -> Nodes {
        let mut nodes = Nodes { all: self.outcome.nodes.len(), ..Nodes::default() };
        for node in &self.outcome.nodes {
            match node.fate {
                Fate::Waiting => {}
                Fate::Hit => nodes.hit += 1,
                Fate::Ran { .. } => nodes.executed += 1,
                Fate::Failed { .. } => nodes.failed += 1,
                Fate::Skipped { .. } => nodes.skipped += 1,
            }
        }
        nodes
    }

    /// How many nodes have the result of another one that was executed.
    pub(crate) fn n_equal(&self) -> usize {
        n_equal(&self.outcome.nodes)
    }
}

fn n_equal(nodes: &[Node]) -> usize {
    let ran = nodes.iter().filter(|node| matches!(node.fate, Fate::Ran { .. }));
    let ran: BTreeSet<Digest> = ran.filter_map(|node| node.key).collect();
    let hits = nodes.iter().filter(|node| node.fate == Fate::Hit);
    hits.filter(|node| node.key.is_some_and(|key| ran.contains(&key))).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_executed_was_known_or_equals_what_was() {
        let node = |key: u8, fate| Node { key: Some(Digest([key; 32])), fate, ..Node::default() };
        let ran = Fate::Ran { millis: 1 };
        let nodes = [
            node(1, Fate::Hit),
            node(2, Fate::Hit),
            node(2, ran.clone()),
            node(3, ran),
            node(4, Fate::Waiting),
            node(5, Fate::Hit),
            node(2, Fate::Hit),
        ];
        assert_eq!(n_equal(&nodes), 2);
    }
}
