//! What removes files from a store, or only says what it would remove.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use crate::cache::{names, sizes};
use crate::error::At as _;
use crate::{CacheError, Disk, durable};

/// Removes files of a store that nobody else uses.
#[derive(Debug)]
pub(crate) struct Broom<'a> {
    root: &'a Path,
    disk: Disk,
    /// Whether files stay where they are.
    dry: bool,
    removed: u64,
    added: u64,
}

impl<'a> Broom<'a> {
    pub(crate) fn new(root: &'a Path, dry: bool) -> Self {
        Self { root, disk: Disk::default(), dry, removed: 0, added: 0 }
    }

    /// The bytes of what was removed, less those of what was added.
    pub(crate) fn freed(&self) -> u64 {
        self.removed.saturating_sub(self.added)
    }

    /// Removes a file or folder of that many bytes.
    pub(crate) fn remove(&mut self, path: &Path, bytes: u64) -> Result<(), CacheError> {
        self.removed += bytes;
        if self.dry {
            return Ok(());
        }
        let removed =
            if path.is_dir() { self.disk.remove_folder(path) } else { self.disk.remove(path) };
        match removed {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            removed => removed.at(path),
        }
    }

    /// Removes what `goes` in a folder: it is asked by name. Returns how many files went.
    pub(crate) fn sweep(
        &mut self,
        folder: &Path,
        mut goes: impl FnMut(&str) -> bool,
    ) -> Result<usize, CacheError> {
        let mut n_gone = 0;
        for (name, bytes) in sizes(folder)? {
            if goes(&name.to_string_lossy()) {
                self.remove(&folder.join(name), bytes)?;
                n_gone += 1;
            }
        }
        Ok(n_gone)
    }

    /// Moves a damaged file to `corrupt`, where the next sweep finds it.
    pub(crate) fn put_aside(&self, path: &Path) -> Result<(), CacheError> {
        if self.dry { Ok(()) } else { put_aside(&self.disk, self.root, path).map(drop) }
    }

    /// Adds a file that counts as written at a time.
    pub(crate) fn publish(
        &mut self,
        path: &Path,
        bytes: &[u8],
        written: u64,
    ) -> Result<(), CacheError> {
        self.added += bytes.len() as u64;
        if self.dry {
            return Ok(());
        }
        let temporary = self.root.join("tmp").join(durable::unique_name());
        durable::publish(&self.disk, &temporary, path, bytes)?;
        // Until then it counts as written now, and what is in it lasts longer.
        let file = fs::File::open(path).at(path)?;
        file.set_modified(SystemTime::UNIX_EPOCH + Duration::from_millis(written)).at(path)
    }

    /// Makes what happened in a folder survive a loss of power.
    pub(crate) fn sync(&self, folder: &Path) -> Result<(), CacheError> {
        if self.dry { Ok(()) } else { self.disk.sync_folder(folder).at(folder) }
    }
}

/// Moves a damaged file to `corrupt`, and returns where it is now.
pub(crate) fn put_aside(disk: &Disk, root: &Path, path: &Path) -> Result<PathBuf, CacheError> {
    let name = path.file_name().expect("a file has a name").to_string_lossy().into_owned();
    let moved_to = root.join("corrupt").join(format!("{name}-{}", durable::unique_name()));
    disk.rename(path, &moved_to).at(path)?;
    Ok(moved_to)
}

/// When a file was last written, in milliseconds since 1970; what is not known is now.
pub(crate) fn written(path: &Path) -> u64 {
    fs::metadata(path).and_then(|file| file.modified()).map_or_else(|_| now(), millis)
}

/// Milliseconds since 1970.
pub(crate) fn now() -> u64 {
    millis(SystemTime::now())
}

fn millis(time: SystemTime) -> u64 {
    let since = time.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}

/// The sum of the sizes in a folder.
pub(crate) fn size(folder: &Path) -> Result<u64, CacheError> {
    Ok(sizes(folder)?.iter().map(|(_, bytes)| bytes).sum())
}

/// The sorted folders in a folder.
pub(crate) fn folders(folder: &Path) -> Result<Vec<PathBuf>, CacheError> {
    Ok(names(folder)?.into_iter().map(|name| folder.join(name)).filter(|p| p.is_dir()).collect())
}
