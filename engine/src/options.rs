//! How a run goes about its work.

use std::time::Duration;

use crate::stop::Stop;

/// How a run goes about its work; nothing here can change a result.
#[derive(Clone, Debug)]
pub struct Options {
    /// How many threads nodes keep busy at once.
    pub jobs: usize,
    /// How many bytes of memory nodes take at once, by their own estimates.
    pub memory: u64,
    /// Whether the first failure ends the run.
    pub fail_fast: bool,
    /// The digest of the library's source, for provenance.
    pub library: String,
    /// How much time lies between two checkpoints of a node, at least; where 0, they are made at every step.
    pub checkpoint: Duration,
    /// How long a node may compute, if it can keep what it did: then it fails, and the next run goes on from there.
    pub limit: Option<Duration>,
    /// Ends the run early: what runs keeps what it did, or is finished and kept, and nothing more is started. What
    /// fails then is taken to have been ended, and runs again the next time.
    pub stop: Stop,
}
