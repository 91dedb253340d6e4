//! What a run would do, as far as it can be known without running.

use std::collections::BTreeSet;

use ivx_cache::{Cache, Digest, Output, Record};
use ivx_op::Registry;
use petgraph::Direction::Incoming;
use petgraph::graph::NodeIndex;

use crate::key::{key, number_digest};
use crate::plan::{Plan, Source};

/// What a run would do with a node, if it runs to its end and nobody else writes to the cache.
///
/// A plan looks at records, not at bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Foreseen {
    /// Its result is known, and it is a hit. Only if the bytes of the result are gone, and a node
    /// that runs or the results need them, it runs again.
    Hit,
    /// Its inputs are known, its result is not: it runs, unless another node of the run has the
    /// same key and is first.
    Run,
    /// An input is not known, so that its key is not: it runs, or is a hit once that is known.
    Unknown,
}

impl Foreseen {
    /// What a run would do with a node of which this is known.
    pub(crate) fn of(known: Known<'_>) -> Self {
        match (known.key, known.record) {
            (_, Some(_)) => Self::Hit,
            (Some(_), None) => Self::Run,
            (None, None) => Self::Unknown,
        }
    }
}

/// What is known of one node without running anything.
#[derive(Clone, Copy)]
pub(crate) struct Known<'c> {
    /// Its key, if all its inputs are known.
    pub(crate) key: Option<Digest>,
    /// Its record, if there is one.
    pub(crate) record: Option<&'c Record>,
}

/// What is known of each node, by its index.
pub(crate) fn known<'c>(plan: &Plan, registry: &Registry, cache: &'c Cache) -> Vec<Known<'c>> {
    let digest = |key: &Digest| cache.lookup(key).map(|record| record.output.digest);
    let known = |key: Option<Digest>| Known { key, record: key.and_then(|k| cache.lookup(&k)) };
    keys(plan, registry, digest).into_iter().map(known).collect()
}

/// Asks the second store of the cache, if it has one, for what is not known here, as a run does.
pub fn consult(plan: &Plan, registry: &Registry, cache: &mut Cache) {
    if cache.second().is_none() {
        return;
    }
    let mut results = vec![None; plan.graph.node_count()];
    for wave in waves(plan) {
        let keyed = |node: NodeIndex| Some((node, key_of(plan, registry, node, &results)?));
        let keyed: Vec<_> = wave.into_iter().filter_map(keyed).collect();
        cache.seek(&keyed.iter().map(|(_, key)| *key).collect::<Vec<_>>());
        for (node, key) in keyed {
            results[node.index()] = cache.lookup(&key).map(|record| record.output.digest);
        }
    }
}

/// The nodes, each in a later wave than its inputs.
fn waves(plan: &Plan) -> Vec<Vec<NodeIndex>> {
    let mut waves: Vec<Vec<NodeIndex>> = Vec::new();
    let mut wave_of = vec![0; plan.graph.node_count()];
    for node in plan.graph.node_indices() {
        let inputs = plan.graph.neighbors_directed(node, Incoming);
        let wave = inputs.map(|input| wave_of[input.index()] + 1).max().unwrap_or(0);
        wave_of[node.index()] = wave;
        if wave == waves.len() {
            waves.push(Vec::new());
        }
        waves[wave].push(node);
    }
    waves
}

/// The key of each node whose inputs are known, by its index.
///
/// - `result`: the digest of what is known of a key.
fn keys(
    plan: &Plan,
    registry: &Registry,
    mut result: impl FnMut(&Digest) -> Option<Digest>,
) -> Vec<Option<Digest>> {
    let mut results = Vec::with_capacity(plan.graph.node_count());
    let mut keys = Vec::with_capacity(plan.graph.node_count());
    for node in plan.graph.node_indices() {
        let key = key_of(plan, registry, node, &results);
        keys.push(key);
        results.push(key.and_then(|key| result(&key)));
    }
    keys
}

/// The key of a node, if its inputs are known.
///
/// - `results`: what is known of each node, as far as that of its inputs.
fn key_of(
    plan: &Plan,
    registry: &Registry,
    node: NodeIndex,
    results: &[Option<Digest>],
) -> Option<Digest> {
    let step = &plan.graph[node];
    let digest = |source: &Source| match source {
        Source::Number(x) => Some(number_digest(*x)),
        Source::Node(node) => results[node.index()],
    };
    let ready = step.sources().all(|source| digest(&source).is_some());
    ready.then(|| key(step, registry, |source| digest(source).expect("all inputs are known")))
}

/// The record of a node; none if its result is not known.
///
/// # Panics
/// If the plan has no such node.
#[must_use]
pub fn record_of<'c>(
    plan: &Plan,
    registry: &Registry,
    cache: &'c Cache,
    node: NodeIndex,
) -> Option<&'c Record> {
    known(plan, registry, cache)[node.index()].record
}

/// The result of each node that is known.
#[must_use]
pub fn outputs(plan: &Plan, registry: &Registry, cache: &Cache) -> Vec<Option<Output>> {
    let known = known(plan, registry, cache).into_iter();
    known.map(|known| known.record.map(|record| record.output.clone())).collect()
}

/// Whether the result of each node is known and its bytes are gone.
#[must_use]
pub fn gone(plan: &Plan, registry: &Registry, cache: &Cache) -> Vec<bool> {
    let objects = cache.objects();
    let known = known(plan, registry, cache).into_iter();
    known.map(|known| known.record.is_some_and(|record| !objects.has(&record.output))).collect()
}

/// The keys of the nodes whose results are known.
#[must_use]
pub fn recorded(plan: &Plan, registry: &Registry, cache: &Cache) -> BTreeSet<Digest> {
    let known = known(plan, registry, cache).into_iter();
    known.filter(|known| known.record.is_some()).filter_map(|known| known.key).collect()
}

/// What a run would do, by the index of the node.
///
/// # Panics
/// If an input does not come before its user, which `expand` sees to.
#[must_use]
pub fn foresee(plan: &Plan, registry: &Registry, cache: &Cache) -> Vec<Foreseen> {
    known(plan, registry, cache).into_iter().map(Foreseen::of).collect()
}
