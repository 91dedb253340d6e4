//! How long nodes take: learned from earlier runs and this one, by what is the same but for the seed, or else by
//! operation; and of those under way, from what they tell.

use std::collections::BTreeMap;
use std::time::Instant;

use ivx_cache::{Digest, Hints};
use ivx_op::Registry;
use petgraph::graph::NodeIndex;

use crate::plan::{Plan, Step};

/// Nodes that take so many milliseconds are told apart by their arguments; others are not worth it.
const LONG: u64 = 100;

/// How long the nodes of a plan are expected to take.
#[derive(Debug)]
pub(crate) struct Durations {
    /// The operation of each node.
    of: Vec<usize>,
    /// Each, `name@version`.
    ops: Vec<String>,
    /// The kind of each node, once durations were learned; before, that of its operation.
    kind: Vec<usize>,
    kinds: Vec<Kind>,
    ended: Vec<bool>,
    running: BTreeMap<NodeIndex, Running>,
}

/// Nodes that are expected to take equally long.
#[derive(Debug)]
struct Kind {
    op: usize,
    /// `name@version`, and for long ones a digest of what is asked.
    name: String,
    /// How many nodes have not ended.
    left: u64,
    expected_millis: Option<u64>,
}

/// A node that tells how far it is.
#[derive(Debug)]
struct Running {
    /// When it told that first, and how far it was.
    first: (Instant, f64),
    left_millis: Option<u64>,
}

impl Durations {
    /// Those of a plan, of which nothing is known yet.
    pub(crate) fn new(plan: &Plan, registry: &Registry) -> Self {
        let (mut known, mut ops) = (BTreeMap::<&str, usize>::new(), Vec::new());
        let of = plan.graph.node_weights().map(|step| {
            *known.entry(&step.op).or_insert_with(|| {
                let version = registry.decl(&step.op).map_or(0, |decl| decl.version);
                ops.push(format!("{}@{version}", step.op));
                ops.len() - 1
            })
        });
        let of: Vec<usize> = of.collect();
        let kind = |(op, name): (usize, &String)| Kind {
            op,
            name: name.clone(),
            left: 0,
            expected_millis: None,
        };
        let mut kinds: Vec<Kind> = ops.iter().enumerate().map(kind).collect();
        for op in &of {
            kinds[*op].left += 1;
        }
        let (kind, ended) = (of.clone(), vec![false; of.len()]);
        Self { of, ops, kind, kinds, ended, running: BTreeMap::new() }
    }

    /// The operation of a node, `name@version`.
    pub(crate) fn op(&self, node: NodeIndex) -> &str {
        &self.ops[self.of[node.index()]]
    }

    /// How long a node is expected to take, where that is known.
    pub(crate) fn expected_millis(&self, node: NodeIndex) -> Option<u64> {
        self.kinds[self.kind[node.index()]].expected_millis
    }

    /// Takes what earlier runs took.
    pub(crate) fn learn(&mut self, plan: &Plan, hints: &Hints) {
        let mut known = BTreeMap::new();
        for kind in &mut self.kinds {
            kind.expected_millis = hints.expected_millis(&kind.name);
        }
        for node in plan.graph.node_indices() {
            let (i, op) = (node.index(), self.of[node.index()]);
            let expected_millis = self.kinds[op].expected_millis;
            if expected_millis.is_none_or(|millis| millis < LONG) || self.ended[i] {
                continue;
            }
            let name = alike(&self.ops[op], &plan.graph[node]);
            let expected_millis = hints.expected_millis(&name).or(expected_millis);
            let kind = *known.entry(name).or_insert_with_key(|name| {
                self.kinds.push(Kind { op, name: name.clone(), left: 0, expected_millis });
                self.kinds.len() - 1
            });
            self.kinds[op].left -= 1;
            self.kinds[kind].left += 1;
            self.kind[i] = kind;
        }
    }

    /// Learns from one execution.
    pub(crate) fn note(&mut self, node: NodeIndex, step: &Step, millis: u64, hints: &mut Hints) {
        let op = &self.ops[self.of[node.index()]];
        hints.note_millis(op, millis);
        let kind = &mut self.kinds[self.kind[node.index()]];
        if millis >= LONG || kind.name != *op {
            hints.note_millis(&alike(op, step), millis);
        }
        kind.expected_millis = hints.expected_millis(&kind.name);
        let op = self.of[node.index()];
        self.kinds[op].expected_millis = hints.expected_millis(&self.ops[op]);
    }

    /// Learns from how far a node is.
    pub(crate) fn told(&mut self, node: NodeIndex, done: u64, of: u64) {
        #[expect(clippy::cast_precision_loss, reason = "shares need no more digits")]
        let share = done as f64 / of.max(1) as f64;
        let now = Instant::now();
        let running = self.running.entry(node);
        let running = running.or_insert(Running { first: (now, share), left_millis: None });
        let (then, before) = running.first;
        if share > before {
            let left = (now - then).as_secs_f64() * (1.0 - share).max(0.0) / (share - before);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "it saturates"
            )]
            let millis = (left * 1e3) as u64;
            running.left_millis = Some(millis);
        }
    }

    /// Notes that a node has ended, however it did.
    pub(crate) fn ended(&mut self, node: NodeIndex) {
        self.kinds[self.kind[node.index()]].left -= 1;
        self.ended[node.index()] = true;
        self.running.remove(&node);
    }

    /// Expected milliseconds of what is left, not counting operations that were never seen;
    /// `None` if that is all of them.
    pub(crate) fn left_millis(&self) -> Option<u64> {
        let expected = |kind: &Kind| kind.expected_millis.or(self.kinds[kind.op].expected_millis);
        let all = self.kinds.iter().filter(|kind| kind.left > 0);
        let all = all.filter_map(|kind| Some(expected(kind)?.saturating_mul(kind.left)));
        let all = all.reduce(u64::saturating_add);
        // Of those under way what they told, instead of all that was expected.
        let under_way = self.running.iter().filter_map(|(node, running)| {
            let kind = &self.kinds[self.kind[node.index()]];
            Some((running.left_millis?, expected(kind).unwrap_or(0)))
        });
        under_way.fold(all, |all, (left, expected)| {
            Some(all.unwrap_or(0).saturating_sub(expected).saturating_add(left))
        })
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

/// What nodes have in common that are the same but for their seeds and inputs.
fn alike(op: &str, step: &Step) -> String {
    let args = step.args.iter().map(|(name, lit)| format!("{name}: {lit}\n"));
    let digest = Digest::of(args.collect::<String>().as_bytes()).to_string();
    format!("{op} {}", &digest[..16])
}
