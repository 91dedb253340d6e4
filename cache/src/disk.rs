//! Everything that the cache changes on a disk, and where a test makes it fail.

use std::fmt;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::Path;
use std::sync::Arc;

/// The file system, or with [`Faults`] one that fails.
#[derive(Clone, Debug, Default)]
pub struct Disk {
    faults: Option<Arc<dyn Faults>>,
}

/// Decides which writes fail, for tests.
#[doc(hidden)]
pub trait Faults: fmt::Debug + Send + Sync {
    /// Asked before each write; a fault takes its place.
    fn before(&self, write: &Write<'_>) -> Option<Fault>;
}

/// A write that is about to be done.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct Write<'a> {
    /// What it does.
    pub kind: WriteKind,
    /// The file or folder that it changes.
    pub path: &'a Path,
    /// How many bytes it appends.
    pub len: usize,
}

/// What a write does.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WriteKind {
    /// Makes a folder.
    Folder,
    /// Makes an empty file.
    Create,
    /// Adds bytes to a file.
    Append,
    /// Cuts a file.
    Truncate,
    /// Makes a file read-only.
    Protect,
    /// Brings a file or folder from the system's memory to the disk.
    Sync,
    /// Gives a file or folder another name.
    Rename,
    /// Removes a file or folder.
    Remove,
    /// Lets other code write in a folder.
    Lend,
}

/// How a write fails.
#[doc(hidden)]
#[derive(Debug)]
pub struct Fault {
    /// How many of the bytes to append reach the disk all the same.
    pub written: usize,
    /// What the system says.
    pub error: io::Error,
}

impl Disk {
    /// The file system with these faults.
    #[doc(hidden)]
    #[must_use]
    pub fn with(faults: Arc<dyn Faults>) -> Self {
        Self { faults: Some(faults) }
    }

    fn ask(&self, kind: WriteKind, path: &Path, len: usize) -> Result<(), Fault> {
        let fault = self.faults.as_ref().and_then(|f| f.before(&Write { kind, path, len }));
        fault.map_or(Ok(()), Err)
    }

    fn whole(&self, kind: WriteKind, path: &Path) -> io::Result<()> {
        self.ask(kind, path, 0).map_err(|fault| fault.error)
    }

    /// Makes a folder and those around it, where they are not there.
    pub(crate) fn create_folder(&self, path: &Path) -> io::Result<()> {
        if path.is_dir() {
            return Ok(());
        }
        self.whole(WriteKind::Folder, path)?;
        fs::create_dir_all(path)
    }

    /// A new file, to append to.
    pub(crate) fn create(&self, path: &Path) -> io::Result<File> {
        self.whole(WriteKind::Create, path)?;
        File::options().append(true).create_new(true).open(path)
    }

    /// A file to lock; made if it is not there.
    pub(crate) fn open(&self, path: &Path) -> io::Result<File> {
        if !path.exists() {
            self.whole(WriteKind::Create, path)?;
        }
        File::options().create(true).read(true).append(true).open(path)
    }

    /// Adds bytes to a file. On an error, some may have been added.
    pub(crate) fn append(&self, file: &mut File, path: &Path, bytes: &[u8]) -> io::Result<()> {
        match self.ask(WriteKind::Append, path, bytes.len()) {
            Ok(()) => file.write_all(bytes),
            Err(fault) => file.write_all(&bytes[..fault.written]).and(Err(fault.error)),
        }
    }

    /// Cuts a file.
    pub(crate) fn truncate(&self, file: &File, path: &Path, len: u64) -> io::Result<()> {
        self.whole(WriteKind::Truncate, path)?;
        file.set_len(len)
    }

    /// Makes a file read-only.
    pub(crate) fn protect(&self, file: &File, path: &Path) -> io::Result<()> {
        self.whole(WriteKind::Protect, path)?;
        let mut permissions = file.metadata()?.permissions();
        permissions.set_readonly(true);
        file.set_permissions(permissions)
    }

    /// Makes the content of a file survive a loss of power.
    pub(crate) fn sync(&self, file: &File, path: &Path) -> io::Result<()> {
        self.whole(WriteKind::Sync, path)?;
        file.sync_all()
    }

    /// Makes the names in a folder survive a loss of power.
    pub(crate) fn sync_folder(&self, path: &Path) -> io::Result<()> {
        self.sync(&File::open(path)?, path)
    }

    /// Gives a file or folder another name; a file that had it is gone.
    pub(crate) fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.whole(WriteKind::Rename, to)?;
        fs::rename(from, to)
    }

    /// Removes a file.
    pub(crate) fn remove(&self, path: &Path) -> io::Result<()> {
        self.whole(WriteKind::Remove, path)?;
        fs::remove_file(path)
    }

    /// Removes a folder and what is in it.
    pub(crate) fn remove_folder(&self, path: &Path) -> io::Result<()> {
        self.whole(WriteKind::Remove, path)?;
        fs::remove_dir_all(path)
    }

    /// Lets other code write in a folder.
    pub(crate) fn lend(&self, path: &Path) -> io::Result<()> {
        self.whole(WriteKind::Lend, path)
    }
}
