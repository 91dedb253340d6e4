//! Runs again what is known, to see whether it comes out the same.

use std::sync::mpsc;
use std::time::Instant;

use ivx_cache::{Cache, CacheError, Digest, Fetched, Objects, Record};
use ivx_op::{Registry, distance};
use petgraph::graph::NodeIndex;

use crate::event::{Event, Listen};
use crate::execute::{Failure, Problem, compute, read};
use crate::foresee::{Known, known};
use crate::plan::{Plan, Step};
use crate::platform::platform;
use crate::pool::pool;

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
/// If not one worker thread can be started.
pub fn verify(
    plan: &Plan,
    registry: &Registry,
    cache: &Cache,
    share: f64,
    jobs: usize,
    listen: &mut dyn Listen,
) -> Result<Vec<(NodeIndex, Verified)>, CacheError> {
    let known = known(plan, registry, cache);
    let chosen = plan.graph.node_indices().filter_map(|node| {
        let Known { key: Some(key), record: Some(record) } = known[node.index()] else {
            return None;
        };
        chosen(&key, share).then_some((node, record))
    });
    let chosen: Vec<(NodeIndex, &Record)> = chosen.collect();
    listen.event(Event::Planned { nodes: chosen.len() });
    let pool = pool(jobs.min(chosen.len()));
    let (sender, receiver) = mpsc::channel();
    let mut verified = pool.in_place_scope(|scope| {
        for &(node, record) in &chosen {
            let (sender, objects, known) = (sender.clone(), cache.objects(), &known);
            scope.spawn(move |_| {
                let started = Instant::now();
                let found = again(&plan.graph[node], record, known, registry, &objects);
                let millis = u64::try_from(started.elapsed().as_millis()).unwrap_or(u64::MAX);
                // The receiver is gone only when another node ended with an error.
                let _ = sender.send((node, found, millis));
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

/// Whether a key is among the lowest `share` of all keys.
fn chosen(key: &Digest, share: f64) -> bool {
    let head = u32::from_be_bytes([key.0[0], key.0[1], key.0[2], key.0[3]]);
    f64::from(head) < share * (f64::from(u32::MAX) + 1.0)
}

fn again(
    step: &Step,
    record: &Record,
    known: &[Known<'_>],
    registry: &Registry,
    objects: &Objects,
) -> Result<Verified, CacheError> {
    let output = |node: NodeIndex| {
        let input = known[node.index()].record.expect("what has a key has known inputs");
        (node, input.output.clone())
    };
    let outputs = step.sources().filter_map(|source| source.node()).map(output).collect();
    let inputs = match read(objects, &outputs) {
        Ok(inputs) => inputs,
        Err(Problem::Cache(error)) => return Err(error),
        Err(_) => return Ok(Verified::Gone),
    };
    let bytes = match compute(step, registry, &inputs, None) {
        Ok(bytes) => bytes,
        Err(Failure::Failed(why)) => return Ok(Verified::Failed { why }),
        Err(Failure::Stopped) => unreachable!("nobody stops what keeps no progress"),
    };
    let found = Digest::of(&bytes);
    if found == record.output.digest {
        return Ok(Verified::Same);
    }
    if record.platform != platform() {
        let before = match objects.read(&record.output)? {
            Fetched::Bytes(before) => before,
            Fetched::Missing | Fetched::Corrupt { .. } => return Ok(Verified::Gone),
        };
        if let Some(by) = distance(&before, &bytes).filter(|by| *by <= TOLERANCE) {
            return Ok(Verified::Close { by });
        }
    }
    let (known, platform) = (record.output.digest, record.platform.clone());
    Ok(Verified::Differs { known, found, platform })
}
