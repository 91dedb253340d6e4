//! Digests to bytes: one store per project, shared by processes.
//!
//! Files are the truth: artifacts are objects named by their SHA-256, what was computed is a
//! [`Record`] in a journal, which runs used it is the history. What can be lost lies in sled.
//! `FORMAT.md` has the bytes.
//! The crate knows no operation: keys, names and explanations are its caller's.

#[cfg_attr(not(target_os = "linux"), path = "actions_by_file.rs")]
mod actions;
mod archive;
mod at_once;
mod broom;
mod cache;
mod check;
mod checkpoints;
mod digest;
mod disk;
mod durable;
mod error;
mod exchange;
#[doc(hidden)]
pub mod faulty;
mod found;
mod hints;
mod in_use;
mod journal;
mod lock;
mod merge;
mod objects;
mod rebuild;
mod record;
mod runs;
mod second;
mod select;
mod stats;
mod store;
mod sweep;
mod tickets;
mod writer;
mod written;

pub use actions::ActionLock;
pub use archive::{ArchiveError, Exported, Imported, Limits, export, import};
pub use cache::{Cache, Committed};
pub use check::{Checked, check};
pub use checkpoints::Checkpoints;
pub use digest::{Digest, NotADigest};
pub use disk::Disk;
#[doc(hidden)]
pub use disk::{Fault, Faults, Write, WriteKind};
pub use error::{CacheError, Conflict, Trouble};
pub use exchange::exchange;
pub use hints::Hints;
pub use lock::{FileLock, wait_lock};
pub use objects::{Fetched, INLINE_MAX, Objects};
pub use rebuild::{Rebuilt, rebuild};
pub use record::{Output, Provenance, Record};
pub use runs::{History, Run};
pub use second::{Mode, Second, Traffic};
pub use stats::{OpStats, Stats};
pub use store::{Folder, Place, Store, StoreError};
pub use sweep::{Sweep, Swept, Wanted, sweep};
