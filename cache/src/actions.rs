//! Who executes what: an action is one byte of `locks/actions`, and its executor locks it.
//!
//! A byte costs one system call to lock and one to let go, where a file that comes and goes
//! costs ten, half of them to the disk.

use std::collections::BTreeSet;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, fcntl};
use nix::libc;

use crate::error::At as _;
use crate::{CacheError, Digest, Disk};

/// The byte that every process with a right to execute has locked, shared. Actions lie below.
const PRESENT: i64 = 1 << 62;

/// The right to execute one action; given back when dropped, or when the process ends.
#[derive(Debug)]
pub struct ActionLock {
    bytes: Arc<Bytes>,
    byte: i64,
}

/// The actions that this handle may execute.
#[derive(Debug)]
pub(crate) struct Actions {
    bytes: Arc<Bytes>,
    /// How many had come when nobody else was there and everything was read.
    settled: Option<u64>,
}

#[derive(Debug)]
struct Bytes {
    path: PathBuf,
    file: File,
    /// What this handle holds: to the system, who locks a byte twice has locked it once.
    held: Mutex<BTreeSet<i64>>,
}

impl Actions {
    /// - `path`: the file, made if it is not there.
    pub(crate) fn open(disk: &Disk, path: &Path) -> Result<Self, CacheError> {
        let file = disk.open(path).at(path)?;
        let mut bytes = Bytes { path: path.to_owned(), file, held: Mutex::default() };
        bytes.set(libc::F_RDLCK, PRESENT).at(path)?;
        // In this order: whoever counts this byte and finds nobody there knows that we are gone.
        disk.append(&mut bytes.file, path, b".").at(path)?;
        Ok(Self { bytes: Arc::new(bytes), settled: None })
    }

    /// The right to execute the action of `key`, or `None` while someone else has it.
    pub(crate) fn try_lock(&self, key: &Digest) -> Result<Option<ActionLock>, CacheError> {
        let head = u64::from_be_bytes(*key.0.first_chunk().expect("a digest has 32 bytes"));
        let byte = i64::try_from(head >> 2).expect("62 bits are no sign");
        let mut held = self.bytes.held();
        if held.contains(&byte) {
            return Ok(None);
        }
        match self.bytes.set(libc::F_WRLCK, byte) {
            Ok(()) => {
                held.insert(byte);
                Ok(Some(ActionLock { bytes: Arc::clone(&self.bytes), byte }))
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(None),
            Err(error) => Err(error).at(&self.bytes.path),
        }
    }

    /// Whether others may have committed something since this was last asked. If so, the
    /// caller reads it before asking again.
    pub(crate) fn others_came(&mut self) -> Result<bool, CacheError> {
        let Bytes { path, file, .. } = &*self.bytes;
        // In this order: who came later than counted will be counted next time, and who came
        // before is there or has committed all it ever will.
        let n_came = file.metadata().at(path)?.len();
        let alone = self.bytes.is_alone().at(path)?;
        let is_settled = alone && self.settled == Some(n_came);
        self.settled = alone.then_some(n_came);
        Ok(!is_settled)
    }
}

impl Bytes {
    fn held(&self) -> MutexGuard<'_, BTreeSet<i64>> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Locks or unlocks a byte for this open file, not waiting.
    fn set(&self, kind: i32, byte: i64) -> io::Result<()> {
        loop {
            match fcntl(&self.file, FcntlArg::F_OFD_SETLK(&range(kind, byte))) {
                Err(Errno::EINTR) => {}
                // Of the two errors that POSIX allows for a lock that is taken, std knows one.
                Err(Errno::EACCES) => return Err(io::ErrorKind::WouldBlock.into()),
                result => return Ok(result.map(drop)?),
            }
        }
    }

    /// Whether no other open file holds the byte of presence.
    fn is_alone(&self) -> io::Result<bool> {
        let mut range = range(libc::F_WRLCK, PRESENT);
        fcntl(&self.file, FcntlArg::F_OFD_GETLK(&mut range))?;
        Ok(i32::from(range.l_type) == libc::F_UNLCK)
    }
}

fn range(kind: i32, byte: i64) -> libc::flock {
    libc::flock {
        l_type: i16::try_from(kind).expect("kinds of locks are small"),
        l_whence: i16::try_from(libc::SEEK_SET).expect("it is 0"),
        l_start: byte,
        l_len: 1,
        l_pid: 0,
    }
}

impl Drop for ActionLock {
    fn drop(&mut self) {
        let mut held = self.bytes.held();
        // What cannot be unlocked is when the file is closed.
        self.bytes.set(libc::F_UNLCK, self.byte).ok();
        held.remove(&self.byte);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::thread;

    use super::*;

    fn key(n: u8) -> Digest {
        Digest([n; 32])
    }

    #[test]
    fn an_action_has_one_executor_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("actions");
        let (a, b) = (
            Actions::open(&Disk::default(), &path).unwrap(),
            Actions::open(&Disk::default(), &path).unwrap(),
        );
        let first = a.try_lock(&key(7)).unwrap().unwrap();
        for handle in [&a, &b] {
            assert!(handle.try_lock(&key(7)).unwrap().is_none());
            assert!(handle.try_lock(&key(8)).unwrap().is_some());
        }
        drop(first);
        let second = b.try_lock(&key(7)).unwrap();
        assert!(second.is_some() && a.try_lock(&key(7)).unwrap().is_none());
        // The handle may go before its locks.
        drop(b);
        assert!(a.try_lock(&key(7)).unwrap().is_none());
        drop(second);
        assert!(a.try_lock(&key(7)).unwrap().is_some());
    }

    #[test]
    fn threads_and_handles_never_meet_in_one_action() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("actions");
        let (inside, entries) = (AtomicU32::new(0), AtomicU32::new(0));
        let shared = Actions::open(&Disk::default(), &path).unwrap();
        let meet = |actions: &Actions| {
            for _ in 0..2_000 {
                if let Some(lock) = actions.try_lock(&key(1)).unwrap() {
                    assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0);
                    entries.fetch_add(1, Ordering::SeqCst);
                    inside.fetch_sub(1, Ordering::SeqCst);
                    drop(lock);
                }
            }
        };
        thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| meet(&shared));
                scope.spawn(|| meet(&Actions::open(&Disk::default(), &path).unwrap()));
            }
        });
        assert!(entries.into_inner() > 0);
    }

    #[test]
    fn news_are_looked_for_while_others_are_there_and_once_after() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("actions");
        let mut own = Actions::open(&Disk::default(), &path).unwrap();
        let mut came = || own.others_came().unwrap();
        assert_eq!([came(), came()], [true, false]);
        let other = Actions::open(&Disk::default(), &path).unwrap();
        assert_eq!([came(), came()], [true, true]);
        drop(other);
        assert_eq!([came(), came()], [true, false]);
        // One that came and went unseen.
        drop(Actions::open(&Disk::default(), &path).unwrap());
        assert_eq!([came(), came()], [true, false]);
    }
}
