//! Batches in a store, from where workers pull them: names, and what lies under them.
//!
//! A batch lies in `queue/ready`. Who creates its name in `queue/claimed` runs it, counts on in `queue/beats` meanwhile,
//! and answers in `queue/done`. Whether someone lives is seen by whether it counts, never by a clock.

use ivx_cache::{Store, StoreError};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::words::Batch;

pub(super) const READY: &str = "queue/ready";
pub(super) const CLAIMED: &str = "queue/claimed";
pub(super) const BEATS: &str = "queue/beats";
pub(super) const DONE: &str = "queue/done";
pub(super) const CANCELLED: &str = "queue/cancelled";
pub(super) const WORKERS: &str = "queue/workers";
pub(super) const ENDED: &str = "queue/ended";

/// The most names in a folder, and the most bytes under a name.
pub(super) const N_MAX: usize = 100_000;
const BYTES_MAX: u64 = 32 << 20;

/// A batch to run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Laid {
    pub(super) batch: Batch,
    /// The digest of the library that is to run it.
    pub(super) library: String,
}

/// What a worker has, and how often it has counted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Here {
    pub(super) cpus: usize,
    /// Bytes.
    pub(super) memory: u64,
    pub(super) machine: String,
    pub(super) beat: u64,
}

/// How a batch ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Answer {
    /// The exit code; below 0 for a signal.
    pub(super) code: i64,
    /// The standard output.
    pub(super) said: String,
    /// The end of the standard error.
    pub(super) err: String,
    pub(super) machine: String,
}

/// What lies under a name, if it is of this kind.
pub(super) fn get<T: DeserializeOwned>(
    store: &dyn Store,
    name: &str,
) -> Result<Option<T>, StoreError> {
    let bytes = store.get(name, BYTES_MAX)?;
    Ok(bytes.and_then(|bytes| serde_json::from_slice(&bytes).ok()))
}

/// Puts something under a name.
pub(super) fn put(store: &dyn Store, name: &str, what: &impl Serialize) -> Result<(), StoreError> {
    store.put(name, &serde_json::to_vec(what).unwrap_or_default())
}
