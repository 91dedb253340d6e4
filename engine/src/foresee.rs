//! What a run would do, as far as it can be known without running.

use ivx_cache::{Cache, Digest, Record};
use ivx_op::Registry;

use crate::key::{key, number_digest};
use crate::plan::{Plan, Source};

/// What a run would do with a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Foreseen {
    /// Its result is known.
    Hit,
    /// Its inputs are known, its result is not.
    Run,
    /// An input is not known, so that its key is not.
    Unknown,
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
    let mut known: Vec<Known<'_>> = Vec::with_capacity(plan.graph.node_count());
    for step in plan.graph.node_weights() {
        let digest = |source: &Source| match source {
            Source::Number(x) => Some(number_digest(*x)),
            Source::Node(node) => known[node.index()].record.map(|record| record.output.digest),
        };
        let ready = step.sources().all(|source| digest(&source).is_some());
        let key = ready
            .then(|| key(step, registry, |source| digest(source).expect("all inputs are known")));
        let record = key.and_then(|key| cache.lookup(&key));
        known.push(Known { key, record });
    }
    known
}

/// What a run would do, by the index of the node.
///
/// # Panics
/// If an input does not come before its user, which `expand` sees to.
#[must_use]
pub fn foresee(plan: &Plan, registry: &Registry, cache: &Cache) -> Vec<Foreseen> {
    let foreseen = |known: Known<'_>| match (known.key, known.record) {
        (_, Some(_)) => Foreseen::Hit,
        (Some(_), None) => Foreseen::Run,
        (None, None) => Foreseen::Unknown,
    };
    known(plan, registry, cache).into_iter().map(foreseen).collect()
}
