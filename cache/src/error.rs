//! What the world can do to a cache: what stops the caller, and what it went on without.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use crate::Digest;

/// Why the cache could not do what was asked.
#[derive(Debug, thiserror::Error)]
pub enum CacheError {
    /// The disk, or the permission to use it, failed. The store is as before.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The disk is full. The store is as before.
    #[error(
        "the disk is full: {} could not be written ({source}); what is finished is kept, \
         and the next run goes on from there once there is room", path.display()
    )]
    Full {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The folder holds a store of another format, or none of ours.
    #[error(
        "{} says {found:?}, but this program keeps {expected:?}: \
         use another folder, or move this one away", path.display()
    )]
    Version {
        /// The version file.
        path: PathBuf,
        /// What it says.
        found: String,
        /// What this program writes.
        expected: &'static str,
    },
    /// One key has two different results on one platform.
    #[error(transparent)]
    Conflict(Box<Conflict>),
    /// The store can't be swept while another handle has it open.
    #[error("the cache {} is in use{}: try again when that has ended", root.display(), by(users))]
    Busy {
        /// The folder of the store.
        root: PathBuf,
        /// The processes that have it open, as far as the system tells.
        users: Vec<String>,
    },
    /// What a run used is not known any more, so that it can't be kept.
    #[error(
        "run {run} can't be kept, or what it used: the list of that is damaged or gone ({})",
        path.display()
    )]
    NoKeys {
        /// The name of the run.
        run: String,
        /// Where the list should be.
        path: PathBuf,
    },
    /// A record exceeds what a journal can hold.
    #[error("the record of `{node}` takes {bytes} bytes; a journal holds at most {max} in one")]
    TooLong {
        /// The address of the node.
        node: String,
        /// The size of the encoded record.
        bytes: usize,
        /// The most that a frame holds.
        max: usize,
    },
}

fn by(users: &[String]) -> String {
    if users.is_empty() { String::new() } else { format!(" by {}", users.join(", ")) }
}

/// One key with two different results on one platform: the operation is not deterministic,
/// or its version did not rise when its output changed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{op}` gave two results for one key on {platform}: {first} is kept, {second} came from \
     `{node}` (key {key}); the operation is not deterministic, or its version should have risen"
)]
pub struct Conflict {
    /// The operation, `name@version`.
    pub op: String,
    /// The address of the node that came second.
    pub node: String,
    /// The key.
    pub key: Digest,
    /// The platform of both.
    pub platform: String,
    /// The result that stays.
    pub first: Digest,
    /// The result that was refused.
    pub second: Digest,
}

/// Damage that the cache found and went on without; what it held will be recomputed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Trouble {
    /// The last record of a journal is incomplete: its writer was killed, or its disk was full.
    #[error("{}: the last {bytes} bytes are an incomplete record", path.display())]
    TornJournal {
        /// The journal.
        path: PathBuf,
        /// How much was left unread.
        bytes: u64,
    },
    /// A record does not match its checksum, and was skipped.
    #[error("{}: the record at byte {offset} is damaged", path.display())]
    DamagedRecord {
        /// The journal.
        path: PathBuf,
        /// Where the record starts.
        offset: u64,
    },
    /// A journal makes no sense from a position on, and was left there.
    #[error("{}: not a journal from byte {offset} on", path.display())]
    DamagedJournal {
        /// The journal.
        path: PathBuf,
        /// Where reading ended.
        offset: u64,
    },
    /// Two processes recorded different results.
    #[error(transparent)]
    Conflict(Box<Conflict>),
    /// A file does not match its digest, and is out of the way.
    #[error("{}: damaged; it is {} now", path.display(), moved_to.display())]
    DamagedFile {
        /// Where it was.
        path: PathBuf,
        /// Where it is.
        moved_to: PathBuf,
    },
    /// A run of the history does not match its checksum.
    #[error(
        "{}: this run is damaged{}",
        path.display(),
        if *kept { ", and what it used is not kept any more" } else { "" }
    )]
    DamagedRun {
        /// The file.
        path: PathBuf,
        /// Whether it was a run that is kept.
        kept: bool,
    },
    /// The list of the keys that runs used is damaged or gone.
    #[error("{}: this list of what runs used is damaged or gone", path.display())]
    DamagedKeys {
        /// The file.
        path: PathBuf,
    },
    /// The durations were unreadable and start anew.
    #[error("the hints were damaged ({reason}) and start anew; the old ones are {}", moved_to.display())]
    DamagedHints {
        /// What was wrong.
        reason: String,
        /// Where the old ones are kept.
        moved_to: PathBuf,
    },
    /// A second store had what is not used, or failed; what it might have had runs here.
    #[error("the store {store}: {what}")]
    Store {
        /// What the store is called.
        store: String,
        /// What was wrong.
        what: String,
    },
    /// The durations were not available.
    #[error("the hints were left alone: {reason}")]
    NoHints {
        /// Why.
        reason: String,
    },
}

/// Adds the path to a failure of the disk.
pub(crate) trait At<T> {
    fn at(self, path: &Path) -> Result<T, CacheError>;
}

impl<T> At<T> for io::Result<T> {
    fn at(self, path: &Path) -> Result<T, CacheError> {
        self.map_err(|source| {
            let path = path.to_owned();
            match source.kind() {
                ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
                    CacheError::Full { path, source }
                }
                _ => CacheError::Io { path, source },
            }
        })
    }
}
