//! What became of a run.

use std::collections::BTreeMap;
use std::sync::Arc;

use ivx_cache::{Digest, Output};
use petgraph::graph::NodeIndex;

use crate::plan::Plan;
use crate::shift::{Ended, Made};

/// What became of every node.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// By the index of the node.
    pub nodes: Vec<Node>,
    /// The bytes of the nodes asked for, as far as there are any.
    pub values: BTreeMap<NodeIndex, Arc<[u8]>>,
}

impl Outcome {
    /// What is known of each node, with its address.
    ///
    /// # Panics
    /// If the plan is another's.
    #[must_use]
    pub fn made<'a>(&self, plan: &'a Plan) -> Vec<(&'a str, Made)> {
        let made = |node: &Node| Made {
            key: node.key,
            output: node.output.as_ref().map(|output| output.digest),
            fate: match node.fate {
                Fate::Hit | Fate::Ran { .. } => Ended::Known,
                Fate::Failed { .. } => Ended::Failed,
                Fate::Skipped { .. } => Ended::Skipped,
                Fate::Waiting => Ended::Waiting,
            },
            cause: match node.fate {
                Fate::Skipped { cause } => Some(plan.graph[cause].address.clone()),
                _ => None,
            },
            explanation: node.explanation.clone(),
        };
        let addresses = plan.graph.node_weights().map(|step| step.address.as_str());
        addresses.zip(self.nodes.iter().map(made)).collect()
    }
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
    /// What its key was made of, where no record says so: of a node that failed.
    pub explanation: Option<String>,
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
