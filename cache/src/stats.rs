//! How much a store holds.

use std::collections::BTreeMap;

use crate::cache::{names_if_any, sizes};
use crate::found::FOUND;
use crate::{Cache, CacheError, runs};

/// How much a store holds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// Action records.
    pub records: usize,
    /// By operation, `name@version`.
    pub ops: BTreeMap<String, OpStats>,
    /// Journals that the records lie in.
    pub journals: usize,
    /// The bytes of these.
    pub journal_bytes: u64,
    /// Artifacts that are not inside a record.
    pub objects: usize,
    /// The bytes of these.
    pub object_bytes: u64,
    /// States of computations that have no result yet.
    pub checkpoints: usize,
    /// The bytes of these.
    pub checkpoint_bytes: u64,
    /// Runs of the history.
    pub runs: usize,
    /// How many of these are kept.
    pub kept_runs: usize,
    /// The bytes of the runs, and of the lists of what they used.
    pub run_bytes: u64,
    /// Damaged files kept aside until the next sweep.
    pub corrupt: usize,
}

/// What a store holds of one operation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OpStats {
    /// Action records.
    pub records: usize,
    /// The bytes of their outputs, wherever they lie; equal ones are counted each time.
    pub bytes: u64,
    /// How long they took to make, in milliseconds.
    pub millis: u64,
}

impl Cache {
    /// How much the store holds.
    ///
    /// # Errors
    /// If the disk fails.
    pub fn stats(&self) -> Result<Stats, CacheError> {
        let mut stats = Stats::default();
        for record in self.records() {
            stats.records += 1;
            let op = stats.ops.entry(record.provenance.op.clone()).or_default();
            op.records += 1;
            op.bytes = op.bytes.saturating_add(record.output.size);
            op.millis = op.millis.saturating_add(record.provenance.millis);
        }
        let count = |folder| {
            let sizes = sizes(&self.root.join(folder))?;
            Ok::<_, CacheError>((sizes.len(), sizes.iter().map(|(_, bytes)| bytes).sum()))
        };
        (stats.journals, stats.journal_bytes) = count("journal")?;
        (stats.checkpoints, stats.checkpoint_bytes) = count("checkpoints")?;
        let history = runs::runs(&self.root, &mut Vec::new())?;
        stats.runs = history.len();
        stats.kept_runs = history.iter().filter(|run| run.kept).count();
        stats.run_bytes = count("runs")?.1 + count("keys")?.1 + count(FOUND)?.1;
        for shelf in names_if_any(&self.root.join("objects"))? {
            for (_, bytes) in sizes(&self.root.join("objects").join(shelf))? {
                stats.objects += 1;
                stats.object_bytes += bytes;
            }
        }
        stats.corrupt = names_if_any(&self.root.join("corrupt"))?.len();
        Ok(stats)
    }
}
