//! What became of a run.

use std::collections::BTreeMap;
use std::sync::Arc;

use ivx_cache::{Digest, Output};
use petgraph::graph::NodeIndex;

/// What became of every node.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// By the index of the node.
    pub nodes: Vec<Node>,
    /// The bytes of the nodes asked for, as far as there are any.
    pub values: BTreeMap<NodeIndex, Arc<[u8]>>,
}

/// What became of one node.
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// Its key, once its inputs were known.
    pub key: Option<Digest>,
    /// Its result.
    pub output: Option<Output>,
    /// How it came about.
    pub fate: Fate,
}

/// How a node's result came about.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Fate {
    /// The run ended before its turn.
    #[default]
    Waiting,
    /// It was known.
    Hit,
    /// It was computed.
    Ran {
        /// How long that took.
        millis: u64,
    },
    /// It could not be computed.
    Failed {
        /// Why.
        why: String,
    },
    /// It was not run, because of another.
    Skipped {
        /// The node that failed.
        cause: NodeIndex,
    },
}
