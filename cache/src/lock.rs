//! Advisory locks of the operating system on files that come and go.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use crate::error::At as _;
use crate::{CacheError, Disk};

/// A lock that is held; given back when dropped, or when the process ends.
#[derive(Debug)]
pub struct FileLock {
    path: PathBuf,
    disk: Disk,
    // Held for its lock, which closing it releases.
    _file: File,
}

/// The lock on `path`, or `None` while another handle or process has it.
///
/// The holder removes the file before it lets go. Whoever locks a file that was removed
/// meanwhile has locked nothing, notices that the path leads elsewhere, and tries again.
pub(crate) fn try_lock(disk: &Disk, path: &Path) -> Result<Option<FileLock>, CacheError> {
    loop {
        let file = disk.open(path).at(path)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Error(source)) => {
                return Err(CacheError::Io { path: path.to_owned(), source });
            }
        }
        if leads_to(path, &file).at(path)? {
            return Ok(Some(FileLock { path: path.to_owned(), disk: disk.clone(), _file: file }));
        }
    }
}

/// The lock on a file anywhere, which is made for it; waits while another handle or process has it.
///
/// # Errors
/// If the disk fails.
pub fn wait_lock(path: &Path) -> Result<FileLock, CacheError> {
    let disk = Disk::default();
    loop {
        let file = disk.open(path).at(path)?;
        file.lock().at(path)?;
        if leads_to(path, &file).at(path)? {
            return Ok(FileLock { path: path.to_owned(), disk, _file: file });
        }
    }
}

#[cfg(unix)]
fn leads_to(path: &Path, file: &File) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt as _;
    let held = file.metadata()?;
    match fs::metadata(path) {
        Ok(there) => Ok((there.dev(), there.ino()) == (held.dev(), held.ino())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

#[cfg(not(unix))]
fn leads_to(_: &Path, _: &File) -> io::Result<bool> {
    Ok(true)
}

impl Drop for FileLock {
    fn drop(&mut self) {
        // Where files can't be compared, removing one could leave two holders. A file that
        // stays behind is harmless.
        if cfg!(unix) {
            self.disk.remove(&self.path).ok();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::thread;

    use super::*;

    #[test]
    fn a_lock_excludes_until_it_is_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let first = try_lock(&Disk::default(), &path).unwrap().unwrap();
        assert!(try_lock(&Disk::default(), &path).unwrap().is_none());
        assert!(try_lock(&Disk::default(), &folder.path().join("b")).unwrap().is_some());
        drop(first);
        assert!(!path.exists());
        assert!(try_lock(&Disk::default(), &path).unwrap().is_some());
    }

    #[test]
    fn who_waits_comes_in_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let inside = AtomicU32::new(0);
        thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..500 {
                        let lock = wait_lock(&path).unwrap();
                        assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0);
                        assert_eq!(inside.fetch_sub(1, Ordering::SeqCst), 1);
                        drop(lock);
                    }
                });
            }
        });
        assert!(!path.exists());
    }

    #[test]
    fn a_file_left_by_a_killed_process_does_not_lock() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        fs::write(&path, "").unwrap();
        assert!(try_lock(&Disk::default(), &path).unwrap().is_some());
    }

    #[test]
    fn removing_the_file_never_lets_two_in() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let (inside, entries) = (AtomicU32::new(0), AtomicU32::new(0));
        thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..2_000 {
                        if let Some(lock) = try_lock(&Disk::default(), &path).unwrap() {
                            assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0);
                            entries.fetch_add(1, Ordering::SeqCst);
                            inside.fetch_sub(1, Ordering::SeqCst);
                            drop(lock);
                        }
                    }
                });
            }
        });
        assert!(entries.into_inner() > 0);
    }
}
