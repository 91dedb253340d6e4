//! Runs again what is known, to see whether it comes out the same.

use std::collections::BTreeMap;
use std::sync::mpsc;
use std::time::Instant;

use ivx_cache::{Cache, CacheError, Digest, Objects, Output};
use ivx_op::{Registry, distance};
use petgraph::graph::NodeIndex;

use crate::event::{Event, Listen};
use crate::execute::{Problem, compute, read};
use crate::key::{key, number_digest};
use crate::plan::{Plan, Source, Step};
use crate::platform::platform;

/// By how much numbers of another platform may differ, relative to their size.
const TOLERANCE: f64 = 1e-6;

/// What came of running a known node again.
#[derive(Clone, Debug, PartialEq)]
pub enum Verified {
    /// The same bytes.
    Same,
    /// Not the same bytes, which were made on another platform, but numbers within tolerance.
    Close {
        /// The largest relative difference.
        by: f64,
    },
    /// Something else.
    Differs {
        /// The digest on record.
        known: Digest,
        /// The digest found.
        found: Digest,
        /// The platform on record.
        platform: String,
    },
    /// Nothing: it failed.
    Failed {
        /// Why.
        why: String,
    },
    /// Nothing: bytes that it needs are gone.
    Gone,
}

/// Runs a share of the known nodes again, chosen by their keys, and changes nothing.
///
/// # Errors
/// If the disk fails.
///
/// # Panics
/// If worker threads cannot be started.
pub fn verify(
    plan: &Plan,
    registry: &Registry,
    cache: &Cache,
    share: f64,
    jobs: usize,
    listen: &mut dyn Listen,
) -> Result<Vec<(NodeIndex, Verified)>, CacheError> {
    let known = known(plan, registry, cache);
    let chosen: Vec<&Known> = known.values().filter(|known| known.chosen(share)).collect();
    listen.event(Event::Planned { nodes: chosen.len() });
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs.max(1)).build();
    let pool = pool.expect("the system starts threads");
    let (sender, receiver) = mpsc::channel();
    let mut verified = pool.in_place_scope(|scope| {
        for one in &chosen {
            let (sender, objects, known) = (sender.clone(), cache.objects(), &known);
            scope.spawn(move |_| {
                let started = Instant::now();
                let step = &plan.graph[one.node];
                let found = again(step, one, known, registry, &objects);
                let millis = u64::try_from(started.elapsed().as_millis()).unwrap_or(u64::MAX);
                // The receiver is gone only when another node ended with an error.
                let _ = sender.send((one.node, found, millis));
            });
        }
        drop(sender);
        let mut verified = Vec::new();
        for (node, found, millis) in receiver {
            let address = &plan.graph[node].address;
            listen.event(Event::Finished { address, millis, left_millis: None });
            verified.push((node, found?));
        }
        Ok(verified)
    })?;
    verified.sort_by_key(|(node, _)| *node);
    Ok(verified)
}

/// A node whose record is known.
struct Known {
    node: NodeIndex,
    key: Digest,
    output: Output,
    platform: String,
}

impl Known {
    /// Whether its key is among the lowest `share` of all keys.
    fn chosen(&self, share: f64) -> bool {
        let head = u32::from_be_bytes([self.key.0[0], self.key.0[1], self.key.0[2], self.key.0[3]]);
        f64::from(head) < share * (f64::from(u32::MAX) + 1.0)
    }
}

fn known(plan: &Plan, registry: &Registry, cache: &Cache) -> BTreeMap<NodeIndex, Known> {
    let mut known: BTreeMap<NodeIndex, Known> = BTreeMap::new();
    for node in plan.graph.node_indices() {
        let step = &plan.graph[node];
        let digest = |source: &Source| match source {
            Source::Number(x) => Some(number_digest(*x)),
            Source::Node(input) => known.get(input).map(|known| known.output.digest),
        };
        if step.sources().any(|source| digest(&source).is_none()) {
            continue;
        }
        let key = key(step, registry, |source| digest(source).expect("all are known"));
        if let Some(record) = cache.lookup(&key) {
            let (output, platform) = (record.output.clone(), record.platform.clone());
            known.insert(node, Known { node, key, output, platform });
        }
    }
    known
}

fn again(
    step: &Step,
    one: &Known,
    known: &BTreeMap<NodeIndex, Known>,
    registry: &Registry,
    objects: &Objects,
) -> Result<Verified, CacheError> {
    let nodes = step.sources().filter_map(|source| match source {
        Source::Node(node) => Some(node),
        Source::Number(_) => None,
    });
    let outputs = nodes.map(|node| (node, known[&node].output.clone())).collect();
    let inputs = match read(objects, &outputs) {
        Ok(inputs) => inputs,
        Err(Problem::Cache(error)) => return Err(error),
        Err(_) => return Ok(Verified::Gone),
    };
    let bytes = match compute(step, registry, &inputs, None) {
        Ok(bytes) => bytes,
        Err(why) => return Ok(Verified::Failed { why }),
    };
    let found = Digest::of(&bytes);
    if found == one.output.digest {
        return Ok(Verified::Same);
    }
    if one.platform != platform() {
        let own = BTreeMap::from([(one.node, one.output.clone())]);
        let before = match read(objects, &own) {
            Ok(before) => before,
            Err(Problem::Cache(error)) => return Err(error),
            Err(_) => return Ok(Verified::Gone),
        };
        if let Some(by) = distance(&before[&one.node], &bytes).filter(|by| *by <= TOLERANCE) {
            return Ok(Verified::Close { by });
        }
    }
    let (known, platform) = (one.output.digest, one.platform.clone());
    Ok(Verified::Differs { known, found, platform })
}
