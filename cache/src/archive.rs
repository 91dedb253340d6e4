//! Archives: records and objects of a store in one file, to be taken elsewhere.
//!
//! An archive is read and checked whole before anything of it can be seen in the store.

mod export;
mod import;

use crate::CacheError;

pub use export::{Exported, export};
pub use import::{Imported, Limits, import};

/// The first entry, and what it says.
const HEAD: &str = "ivx-archive";
const FORMAT: &str = "ivx archive 1\n";
/// The second: a journal.
const JOURNAL: &str = "journal";
/// The folder of the others, named by their digests.
const OBJECTS: &str = "objects/";
/// The last, and empty: an archive without it was cut off.
const END: &str = "end";

/// Why an archive was not taken in.
#[derive(Debug, thiserror::Error)]
pub enum ArchiveError {
    /// It is not what `export` writes, or does not go with the store. The store is as before.
    #[error("the archive is refused: {0}")]
    Refused(String),
    /// The disk failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
}
