//! Who executes what, where no byte can be locked for an open file: each action is a file.

use std::path::{Path, PathBuf};

use crate::lock::{FileLock, try_lock};
use crate::{CacheError, Digest, Disk};

/// The right to execute one action; given back when dropped, or when the process ends.
#[derive(Debug)]
pub struct ActionLock {
    _file: FileLock,
}

/// The actions that this handle may execute.
#[derive(Debug)]
pub(crate) struct Actions {
    folder: PathBuf,
    disk: Disk,
}

impl Actions {
    /// - `path`: a file in the folder where locks lie.
    pub(crate) fn open(disk: &Disk, path: &Path) -> Result<Self, CacheError> {
        Ok(Self { folder: path.with_file_name(""), disk: disk.clone() })
    }

    /// The right to execute the action of `key`, or `None` while someone else has it.
    pub(crate) fn try_lock(&self, key: &Digest) -> Result<Option<ActionLock>, CacheError> {
        let lock = try_lock(&self.disk, &self.folder.join(key.to_string()))?;
        Ok(lock.map(|file| ActionLock { _file: file }))
    }

    /// Whether others may have committed something since this was last asked: who knows.
    #[expect(clippy::unnecessary_wraps, clippy::unused_self, reason = "as where bytes are locked")]
    pub(crate) fn others_came(&mut self) -> Result<bool, CacheError> {
        Ok(true)
    }
}
