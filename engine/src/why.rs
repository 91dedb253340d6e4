//! Why a node is known, or not: which part of its key differs from the nearest earlier record,
//! followed through its inputs to where it began.

mod search;

use std::time::SystemTime;

use ivx_cache::{Cache, CacheError, Digest, Record};
use ivx_op::Registry;
use petgraph::graph::NodeIndex;

use crate::difference::Difference;
use crate::foresee::Foreseen;
use crate::plan::Plan;

use search::Search;

/// Why a node is known, or not.
#[derive(Clone, Debug)]
pub struct Why<'c> {
    /// The node.
    pub node: NodeIndex,
    /// What a run would do with it.
    pub foreseen: Foreseen,
    /// Its key, if its inputs are known.
    pub key: Option<Digest>,
    /// Its record if it is known, otherwise the nearest of the same operation.
    pub record: Option<Earlier<'c>>,
    /// What differs from that record, but for inputs.
    pub differences: Vec<Difference>,
    /// The inputs that differ, and those that are not known.
    pub inputs: Vec<Changed>,
}

/// A record, and when its journal was begun.
#[derive(Clone, Copy, Debug)]
pub struct Earlier<'c> {
    /// The record.
    pub record: &'c Record,
    /// When its journal was begun, where that is known.
    pub begun: Option<SystemTime>,
    /// Whether the bytes of its result are gone.
    pub gone: bool,
}

/// An input that differs or is not known.
#[derive(Clone, Debug, PartialEq)]
pub struct Changed {
    /// The port, or the path of the argument that holds it.
    pub port: String,
    /// The node that makes it; nothing if it is no input any more.
    pub node: Option<NodeIndex>,
    /// Where it was made before; nothing if it was no input.
    pub before: Option<String>,
    /// How it changed.
    pub change: InputChange,
    /// Why, each reason once.
    pub causes: Vec<Cause>,
}

/// How an input changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum InputChange {
    /// It is another.
    Changed,
    /// It is not known, and so may be another.
    Unknown,
    /// There was no such input.
    Added,
    /// There is no such input any more.
    Removed,
}

/// Where a change began.
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// The nodes from the input to there.
    pub path: Vec<NodeIndex>,
    /// What is different there.
    pub reason: Reason,
}

/// What is different where a change began.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// A part of the key.
    Differs(Difference),
    /// The cache has no record of the operation.
    New,
    /// The cache does not know what the earlier input was made from.
    Lost,
}

/// Why each of some nodes is known, or not.
///
/// The nearest record is the one of the node's address with the fewest differences, or else of the
/// operation; among equals it is the own platform's and then of the latest journal.
///
/// # Errors
/// If the disk fails.
pub fn why<'c>(
    plan: &Plan,
    registry: &Registry,
    cache: &'c Cache,
    nodes: &[NodeIndex],
) -> Result<Vec<Why<'c>>, CacheError> {
    let mut search = Search::new(plan, registry, cache)?;
    search.find_nearest(nodes);
    let targets = nodes.iter().filter(|node| search.known[node.index()].record.is_none());
    let targets: Vec<NodeIndex> = targets.copied().collect();
    search.compare_from(&targets);
    let causes = search.causes();
    Ok(nodes.iter().map(|node| search.why(*node, &causes)).collect())
}
