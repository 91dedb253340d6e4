//! Who uses a store: everyone who has it open, or the one that sweeps it.

use std::fs::{File, TryLockError};
use std::path::Path;
use std::thread;
use std::time::Duration;

use crate::CacheError;
use crate::error::At as _;

/// The file, locked as by those who use the store; waits while it is swept.
pub(crate) fn shared(in_use: File, root: &Path) -> Result<File, CacheError> {
    in_use.lock_shared().at(root)?;
    Ok(in_use)
}

/// How often, and how long between, we look whether somebody let go.
const N_TRIES: usize = 40;
const PATIENCE: Duration = Duration::from_millis(5);

/// The file, locked as by the one that sweeps the store; [`CacheError::Busy`] if it is in use.
///
/// A program that a former user has just started shares its lock until it has begun, so one look
/// is not enough.
pub(crate) fn alone(in_use: File, root: &Path) -> Result<File, CacheError> {
    for _ in 0..N_TRIES {
        match in_use.try_lock() {
            Ok(()) => return Ok(in_use),
            Err(TryLockError::WouldBlock) => thread::sleep(PATIENCE),
            Err(TryLockError::Error(source)) => {
                return Err(CacheError::Io { path: root.to_owned(), source });
            }
        }
    }
    Err(CacheError::Busy { root: root.to_owned(), users: users(&in_use) })
}

/// The processes that hold a lock on a file, as far as the system tells.
#[cfg(target_os = "linux")]
fn users(file: &File) -> Vec<String> {
    use std::fs;
    use std::os::unix::fs::MetadataExt as _;
    let (Ok(file), Ok(locks)) = (file.metadata(), fs::read_to_string("/proc/locks")) else {
        return Vec::new();
    };
    let ino = file.ino().to_string();
    let user = |line: &str| {
        // `1: FLOCK  ADVISORY  READ 4242 fd:01:1234567 0 EOF`; waiting ones have an arrow.
        let words: Vec<&str> = line.split_whitespace().collect();
        let &[_, "FLOCK", _, _, pid, place, ..] = &words[..] else { return None };
        (place.rsplit(':').next() == Some(&ino)).then(|| match command(pid) {
            Some(command) => format!("process {pid} (`{command}`)"),
            None => format!("process {pid}"),
        })
    };
    locks.lines().filter_map(user).collect()
}

#[cfg(target_os = "linux")]
fn command(pid: &str) -> Option<String> {
    let line = std::fs::read(format!("/proc/{pid}/cmdline")).ok()?;
    let words: Vec<_> = line.split(|byte| *byte == 0).map(String::from_utf8_lossy).collect();
    let line = words.join(" ");
    (!line.trim().is_empty()).then(|| line.trim().to_owned())
}

#[cfg(not(target_os = "linux"))]
fn users(_: &File) -> Vec<String> {
    Vec::new()
}
