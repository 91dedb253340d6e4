//! How bytes reach the disk so that they are there whole, or not at all.

use std::io;
use std::path::Path;
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::error::At as _;
use crate::{CacheError, Disk};

/// Makes `path` a read-only file of `bytes`, by way of `temporary` in the same file system.
///
/// When it returns, file and name are on the disk. On an error, `path` is as before and
/// `temporary` is gone.
pub(crate) fn publish(
    disk: &Disk,
    temporary: &Path,
    path: &Path,
    bytes: &[u8],
) -> Result<(), CacheError> {
    let written = write_synced(disk, temporary, bytes)
        .at(temporary)
        .and_then(|()| disk.rename(temporary, path).at(path));
    if written.is_err() {
        // The first error is the one to tell; what stays in `tmp` is swept.
        disk.remove(temporary).ok();
    }
    written?;
    let folder = path.parent().expect("a file lies in a folder");
    disk.sync_folder(folder).at(folder)
}

fn write_synced(disk: &Disk, path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = disk.create(path)?;
    disk.append(&mut file, path, bytes)?;
    disk.protect(&file, path)?;
    disk.sync(&file, path)
}

/// A file name that no other process or thread uses; names of one process sort by age.
pub(crate) fn unique_name() -> String {
    static N_NAMES: AtomicU64 = AtomicU64::new(0);
    let n = N_NAMES.fetch_add(1, Ordering::Relaxed);
    // A clock before 1970 costs the order of names, not their uniqueness.
    let nanos = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |t| t.as_nanos());
    format!("{nanos:018x}-{}-{n}", process::id())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_published_file_replaces_the_old_one_and_leaves_no_temporary() {
        let folder = tempfile::tempdir().unwrap();
        let (temporary, path) = (folder.path().join("t"), folder.path().join("f"));
        for text in ["one", "two"] {
            publish(&Disk::default(), &temporary, &path, text.as_bytes()).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
            assert!(fs::metadata(&path).unwrap().permissions().readonly());
            assert!(!temporary.exists());
        }
    }

    #[test]
    fn a_failure_names_the_path_and_leaves_no_temporary() {
        let folder = tempfile::tempdir().unwrap();
        let (temporary, path) = (folder.path().join("t"), folder.path().join("f"));
        fs::create_dir(&path).unwrap();
        let error = publish(&Disk::default(), &temporary, &path, b"x").unwrap_err();
        assert!(matches!(error, CacheError::Io { path: at, .. } if at == path));
        assert!(!temporary.exists());
    }

    #[test]
    fn unique_names_differ_and_sort_by_age() {
        let names: Vec<_> = (0..100).map(|_| unique_name()).collect();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
        std::thread::sleep(std::time::Duration::from_millis(1));
        assert!(names[0] < unique_name());
    }
}
