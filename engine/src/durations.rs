//! How long nodes take: learned from earlier runs and this one, operation by operation.

use std::collections::BTreeMap;

use ivx_cache::Hints;
use ivx_op::Registry;
use petgraph::graph::NodeIndex;

use crate::plan::Plan;

/// How long the nodes of a plan are expected to take.
#[derive(Debug)]
pub(crate) struct Durations {
    /// The operation of each node.
    of: Vec<usize>,
    ops: Vec<Timed>,
}

#[derive(Debug)]
struct Timed {
    /// `name@version`.
    name: String,
    /// How many nodes have not ended.
    left: u64,
    expected_millis: Option<u64>,
}

impl Durations {
    /// Those of a plan, of which nothing is known yet.
    pub(crate) fn new(plan: &Plan, registry: &Registry) -> Self {
        let (mut known, mut ops) = (BTreeMap::<&str, usize>::new(), Vec::<Timed>::new());
        let of = plan.graph.node_weights().map(|step| {
            let op = *known.entry(&step.op).or_insert_with(|| {
                let version = registry.decl(&step.op).map_or(0, |decl| decl.version);
                let name = format!("{}@{version}", step.op);
                ops.push(Timed { name, left: 0, expected_millis: None });
                ops.len() - 1
            });
            ops[op].left += 1;
            op
        });
        Self { of: of.collect(), ops }
    }

    /// The operation of a node, `name@version`.
    pub(crate) fn op(&self, node: NodeIndex) -> &str {
        &self.ops[self.of[node.index()]].name
    }

    /// How long a node is expected to take, where that is known.
    pub(crate) fn expected_millis(&self, node: NodeIndex) -> Option<u64> {
        self.ops[self.of[node.index()]].expected_millis
    }

    /// Takes what earlier runs took.
    pub(crate) fn learn(&mut self, hints: &Hints) {
        for op in &mut self.ops {
            op.expected_millis = hints.expected_millis(&op.name);
        }
    }

    /// Learns from one execution.
    pub(crate) fn note(&mut self, node: NodeIndex, millis: u64, hints: &mut Hints) {
        let op = &mut self.ops[self.of[node.index()]];
        hints.note_millis(&op.name, millis);
        op.expected_millis = hints.expected_millis(&op.name);
    }

    /// Notes that a node has ended, however it did.
    pub(crate) fn ended(&mut self, node: NodeIndex) {
        self.ops[self.of[node.index()]].left -= 1;
    }

    /// Expected milliseconds of what is left, not counting operations that were never seen;
    /// `None` if that is all of them.
    pub(crate) fn left_millis(&self) -> Option<u64> {
        let left = self.ops.iter().filter(|op| op.left > 0);
        let expected = left.filter_map(|op| Some(op.expected_millis?.saturating_mul(op.left)));
        expected.reduce(u64::saturating_add)
    }

    /// The longest path from each node to the end, itself included, in expected milliseconds;
    /// what is not known takes one.
    pub(crate) fn longest_paths(&self, plan: &Plan) -> Vec<u64> {
        let mut longest = vec![0_u64; self.of.len()];
        for node in plan.graph.node_indices().rev() {
            let after = plan.graph.neighbors(node).map(|next| longest[next.index()]).max();
            let own = self.expected_millis(node).unwrap_or(1).max(1);
            longest[node.index()] = after.unwrap_or(0).saturating_add(own);
        }
        longest
    }
}
