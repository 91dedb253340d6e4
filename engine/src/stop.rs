//! How a run is asked to end early.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Asks a run to start nothing more. Clones ask the same run.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<Inner>);

#[derive(Debug, Default)]
struct Inner {
    asked: AtomicBool,
    busy: AtomicUsize,
}

impl Stop {
    /// Asks.
    pub fn ask(&self) {
        self.0.asked.store(true, Ordering::SeqCst);
    }

    /// Takes that back, for a run that comes after one that was asked to end.
    pub fn take_back(&self) {
        self.0.asked.store(false, Ordering::SeqCst);
    }

    /// Whether the run was asked to end.
    #[must_use]
    pub fn asked(&self) -> bool {
        self.0.asked.load(Ordering::SeqCst)
    }

    /// Whether an operation computes whose result would be lost if the process ended now.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.0.busy.load(Ordering::SeqCst) > 0
    }

    /// Says that an operation computes, until what is returned is dropped.
    pub(crate) fn busy(&self) -> Busy {
        self.0.busy.fetch_add(1, Ordering::SeqCst);
        Busy(self.clone())
    }
}

/// An operation that computes, or whose result is not committed yet.
pub(crate) struct Busy(Stop);

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.0.busy.fetch_sub(1, Ordering::SeqCst);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_busy_while_any_operation_computes() {
        let stop = Stop::default();
        let (one, two) = (stop.busy(), stop.clone().busy());
        drop(one);
        assert!(stop.is_busy());
        drop(two);
        assert!(!stop.is_busy() && !stop.asked());
    }
}
