//! A disk that dies or fills up at a chosen write, for tests.

use std::io::{self, ErrorKind};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::disk::{Disk, Fault, Faults, Write, WriteKind};

/// Counts writes, and fails from one of them on.
#[derive(Debug)]
pub struct Faulty {
    from: usize,
    failure: Failure,
    writes: AtomicUsize,
}

/// What happens at the chosen write.
#[derive(Clone, Copy, Debug)]
pub enum Failure {
    /// The process dies, with so many thousandths of the bytes written: nothing is written after.
    Death(usize),
    /// The disk is full: nothing is written that takes room.
    Full,
    /// The quota ends: as [`Self::Full`], but half of the bytes are still written.
    Quota,
    /// Nothing can be written or removed any more.
    Stuck,
}

impl Faulty {
    /// One that fails from the given write on, counted from 0.
    #[must_use]
    pub fn from(write: usize, failure: Failure) -> Arc<Self> {
        Arc::new(Self { from: write, failure, writes: AtomicUsize::new(0) })
    }

    /// One that only counts.
    #[must_use]
    pub fn never() -> Arc<Self> {
        Self::from(usize::MAX, Failure::Full)
    }

    /// The disk with these faults.
    #[must_use]
    pub fn disk(self: &Arc<Self>) -> Disk {
        Disk::with(Arc::clone(self) as Arc<dyn Faults>)
    }

    /// How many writes were asked for so far.
    #[must_use]
    pub fn n_writes(&self) -> usize {
        self.writes.load(Ordering::SeqCst)
    }
}

impl Faults for Faulty {
    fn before(&self, write: &Write<'_>) -> Option<Fault> {
        let n = self.writes.fetch_add(1, Ordering::SeqCst);
        if n < self.from {
            return None;
        }
        let frees = matches!(
            write.kind,
            WriteKind::Truncate | WriteKind::Remove | WriteKind::Sync | WriteKind::Protect
        );
        let fault =
            |written, kind: ErrorKind| Some(Fault { written, error: io::Error::from(kind) });
        match self.failure {
            Failure::Death(thousandths) if n == self.from => {
                fault(write.len * thousandths / 1000, ErrorKind::Other)
            }
            Failure::Death(_) => fault(0, ErrorKind::Other),
            Failure::Full | Failure::Quota if frees => None,
            Failure::Quota => fault(write.len / 2, ErrorKind::QuotaExceeded),
            Failure::Full | Failure::Stuck => fault(0, ErrorKind::StorageFull),
        }
    }
}
