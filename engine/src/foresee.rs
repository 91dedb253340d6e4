//! What a run would do, as far as it can be known without running.

use ivx_cache::{Cache, Digest};
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

/// What a run would do, by the index of the node.
///
/// # Panics
/// If an input does not come before its user, which `expand` sees to.
#[must_use]
pub fn foresee(plan: &Plan, registry: &Registry, cache: &Cache) -> Vec<Foreseen> {
    let mut digests: Vec<Option<Digest>> = Vec::new();
    let mut foreseen = Vec::new();
    for step in plan.graph.node_weights() {
        let digest = |source: &Source| match source {
            Source::Number(x) => Some(number_digest(*x)),
            Source::Node(node) => digests[node.index()],
        };
        if step.sources().any(|source| digest(&source).is_none()) {
            digests.push(None);
            foreseen.push(Foreseen::Unknown);
            continue;
        }
        let key = key(step, registry, |source| digest(source).expect("all are known"));
        let known = cache.lookup(&key).map(|record| record.output.digest);
        foreseen.push(if known.is_some() { Foreseen::Hit } else { Foreseen::Run });
        digests.push(known);
    }
    foreseen
}
