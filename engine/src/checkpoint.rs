//! Where one node keeps its progress.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use ivx_cache::{Checkpoints, Digest};
use ivx_op::Progress;

/// The progress of one node: kept under its key, the platform and the build, so that no other
/// computation takes it for its own.
#[derive(Debug)]
pub(crate) struct Checkpoint {
    store: Checkpoints,
    name: Digest,
    every: Duration,
    last: Mutex<Instant>,
}

impl Checkpoint {
    /// - `every`: how much time lies between two states that are kept.
    pub(crate) fn new(
        store: Checkpoints,
        key: &Digest,
        (platform, build): (&str, &str),
        every: Duration,
    ) -> Self {
        let name = Digest::of(format!("{key} {platform} {build}").as_bytes());
        Self { store, name, every, last: Mutex::new(Instant::now()) }
    }

    /// Forgets what was kept: the node has its result.
    pub(crate) fn remove(&self) {
        self.store.remove(&self.name);
    }

    fn last(&self) -> std::sync::MutexGuard<'_, Instant> {
        self.last.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

impl Progress for Checkpoint {
    fn load(&self) -> Option<Vec<u8>> {
        self.store.load(&self.name)
    }

    fn due(&self) -> bool {
        self.last().elapsed() >= self.every
    }

    fn save(&self, state: Vec<u8>) {
        // A full disk will be told of when the result is written.
        self.store.save(&self.name, &state).ok();
        *self.last() = Instant::now();
    }
}
