//! Where one node keeps its progress.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use ivx_cache::{Checkpoints, Digest};
use ivx_op::Progress;

/// The progress of one node: kept under its key, the platform and the build, so that no other
/// computation takes it for its own.
#[derive(Debug)]
pub(crate) struct Checkpoint<'a> {
    store: Checkpoints,
    key: Digest,
    platform: &'a str,
    build: &'a str,
    every: Duration,
    last: Mutex<Instant>,
    /// Whether something was asked for or kept; most nodes are too short for that.
    used: AtomicBool,
}

impl<'a> Checkpoint<'a> {
    /// - `every`: how much time lies between two states that are kept.
    pub(crate) fn new(
        store: Checkpoints,
        key: Digest,
        (platform, build): (&'a str, &'a str),
        every: Duration,
    ) -> Self {
        let (last, used) = (Mutex::new(Instant::now()), AtomicBool::new(false));
        Self { store, key, platform, build, every, last, used }
    }

    /// Forgets what was kept: the node has its result.
    pub(crate) fn remove(&self) {
        if self.used.load(Ordering::Relaxed) {
            self.store.remove(&self.name());
        }
    }

    /// What it is kept under. Who asks uses it.
    fn name(&self) -> Digest {
        self.used.store(true, Ordering::Relaxed);
        let Self { key, platform, build, .. } = self;
        Digest::of(format!("{key} {platform} {build}").as_bytes())
    }

    fn last(&self) -> std::sync::MutexGuard<'_, Instant> {
        self.last.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

impl Progress for Checkpoint<'_> {
    fn load(&self) -> Option<Vec<u8>> {
        self.store.load(&self.name())
    }

    fn due(&self) -> bool {
        self.last().elapsed() >= self.every
    }

    fn save(&self, state: Vec<u8>) {
        // A full disk will be told of when the result is written.
        self.store.save(&self.name(), &state).ok();
        *self.last() = Instant::now();
    }
}
