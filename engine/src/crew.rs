//! Other machines that run nodes: what the engine asks of who hands them out, and what it hears.
//!
//! Nothing that is heard is believed: a result is what the second store has on record.

use std::io;

use ivx_cache::Digest;
use ivx_op::Needs;

/// What there is to run nodes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Room {
    /// How many threads all machines have.
    pub threads: usize,
    /// What the largest machine has.
    pub largest: Needs,
}

/// Hands nodes to other machines.
pub trait Crew {
    /// What there is by now; no thread where no machine is there yet.
    fn room(&self) -> Room;

    /// Begins, before the first batch.
    ///
    /// - `tell`: is told from another thread what becomes of batches, and that there is more room.
    ///
    /// # Errors
    /// If it cannot.
    fn begin(&self, tell: Box<dyn FnMut(News) + Send>) -> io::Result<()>;

    /// Has some keys run one after another on one machine, which finds their tickets in the second store.
    ///
    /// - `needs`: the most that one of them takes.
    ///
    /// # Errors
    /// If nobody hears it.
    fn run(&self, batch: u64, keys: &[Digest], needs: Needs) -> io::Result<()>;

    /// Has a batch ended; what came of it is told as of any other.
    ///
    /// # Errors
    /// If nobody hears it.
    fn cancel(&self, batch: u64) -> io::Result<()>;
}

/// What becomes of batches.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum News {
    /// It has ended, and will not be run again.
    Done {
        /// Which.
        batch: u64,
        /// What is said of its keys, as far as they were come to.
        words: Vec<(Digest, Word)>,
        /// What else is said of it, such as the end of a log; may be empty.
        why: String,
    },
    /// The machine that ran it is gone; it runs again.
    Lost {
        /// Which.
        batch: u64,
        /// What happened.
        why: String,
    },
    /// Something else happened; there may be more room.
    Noted {
        /// What.
        what: String,
    },
    /// Nobody runs anything any more.
    Gone {
        /// What happened.
        why: String,
    },
}

/// What is said of a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Word {
    /// Its result is on record for this platform.
    Done(String),
    /// Its operation failed.
    Failed(String),
    /// Bytes that it takes are nowhere.
    Missing(Digest),
    /// It was not begun, and would be begun nowhere.
    Refused(String),
}
