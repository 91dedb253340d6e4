//! What makes a run faster and may be lost: durations.
//!
//! They lie in sled, which is named in this file only and is open for moments only. Stores
//! of it have been lost to crashes and it can panic on damaged ones, so it works on a copy
//! that has been checked against a digest, and the copy becomes the current one only after
//! it was closed.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io;
use std::panic::{self, AssertUnwindSafe};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use sha2::{Digest as _, Sha256};

use crate::error::At as _;
use crate::lock::{FileLock, try_lock};
use crate::{CacheError, Digest, Disk, Trouble, durable};

/// How often, and how long between, we look whether somebody let go of a lock.
const N_TRIES: usize = 100;
const PATIENCE: Duration = Duration::from_millis(5);

/// How long operations take. Wrong or missing durations cost time, never a result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hints {
    millis: BTreeMap<String, u64>,
    /// Operations whose durations sled does not know yet.
    unsaved: BTreeSet<String>,
}

impl Hints {
    /// How long an operation, `name@version`, is expected to take, in milliseconds.
    #[must_use]
    pub fn expected_millis(&self, op: &str) -> Option<u64> {
        self.millis.get(op).copied()
    }

    /// Learns from one execution: `expected ← (3 expected + millis) / 4`, rounded to nearest.
    pub fn note_millis(&mut self, op: &str, millis: u64) {
        let expected = match self.millis.get(op) {
            Some(expected) => {
                expected.saturating_mul(3).saturating_add(millis).saturating_add(2) / 4
            }
            None => millis,
        };
        self.millis.insert(op.to_owned(), expected);
        self.unsaved.insert(op.to_owned());
    }

    /// Takes the mean duration of each operation for those not known.
    pub(crate) fn guess_millis<'a>(&mut self, executions: impl Iterator<Item = (&'a str, u64)>) {
        let mut sums = BTreeMap::<&str, (u64, u64)>::new();
        for (op, millis) in executions {
            let (sum, n) = sums.entry(op).or_default();
            *sum = sum.saturating_add(millis);
            *n += 1;
        }
        for (op, (sum, n)) in sums {
            self.millis.entry(op.to_owned()).or_insert(sum / n);
        }
    }

    /// Makes [`save`] write every duration. Returns how many there are.
    pub(crate) fn save_all(&mut self) -> usize {
        self.unsaved = self.millis.keys().cloned().collect();
        self.unsaved.len()
    }

    fn read(&mut self, db: &sled::Db) -> sled::Result<()> {
        for entry in db.iter() {
            let (key, value) = entry?;
            self.insert(&key, &value);
        }
        Ok(())
    }

    /// Adds an entry of sled; one that makes no sense is as good as none.
    fn insert(&mut self, key: &[u8], value: &[u8]) -> Option<()> {
        if let (b'd', op) = key.split_first()? {
            let millis = u64::from_le_bytes(value.try_into().ok()?);
            self.millis.insert(str::from_utf8(op).ok()?.to_owned(), millis);
        }
        Some(())
    }
}

/// The hints of the store at `root`; those that can't be had are empty.
pub(crate) fn load(root: &Path, disk: &Disk, troubles: &mut Vec<Trouble>) -> Hints {
    let mut hints = Hints::default();
    if root.join(FOLDER).exists() {
        with_sled(root, disk, troubles, Keep::No, |db| hints.read(db));
    }
    hints
}

/// Writes what sled does not know yet. If there is nothing, sled is not opened.
pub(crate) fn save(hints: &mut Hints, root: &Path, disk: &Disk, troubles: &mut Vec<Trouble>) {
    if hints.unsaved.is_empty() {
        return;
    }
    let mut batch = sled::Batch::default();
    for op in &hints.unsaved {
        let millis = hints.millis[op].to_le_bytes();
        batch.insert([b"d", op.as_bytes()].concat(), &millis);
    }
    let saved = with_sled(root, disk, troubles, Keep::Yes, |db| {
        db.apply_batch(batch)?;
        db.flush().map(drop)
    });
    if saved {
        hints.unsaved.clear();
    }
}

pub(crate) const FOLDER: &str = "hints.sled";
const CURRENT: &str = "current";

/// Whether the copy that sled worked on becomes the current one.
#[derive(Clone, Copy, PartialEq)]
enum Keep {
    Yes,
    No,
}

/// Whether `work` was done with sled open on a copy of what was last kept; if not, the reason
/// is among the troubles.
fn with_sled(
    root: &Path,
    disk: &Disk,
    troubles: &mut Vec<Trouble>,
    keep: Keep,
    work: impl FnOnce(&sled::Db) -> sled::Result<()>,
) -> bool {
    let copy = root.join(FOLDER).join(durable::unique_name());
    let outcome = lock(root, disk).and_then(|lock| {
        let Some(_lock) = lock else {
            return Err(Trouble::NoHints { reason: "another process has them open".into() });
        };
        copy_current(root, disk, &copy, troubles)?;
        disk.lend(&copy).at(&copy)?;
        let config = sled::Config::new()
            .path(&copy)
            .mode(sled::Mode::LowSpace)
            .cache_capacity(16 << 20)
            .flush_every_ms(None);
        match panic::catch_unwind(AssertUnwindSafe(|| work(&config.open()?))) {
            Ok(Ok(())) if keep == Keep::Yes => make_current(root, disk, &copy),
            Ok(Ok(())) => Ok(()),
            // The disk, not what lies on it.
            Ok(Err(sled::Error::Io(error))) => Err(Trouble::NoHints { reason: error.to_string() }),
            Ok(Err(error)) => Err(put_aside(root, disk, error.to_string())?),
            Err(_) => Err(put_aside(root, disk, "sled panicked".into())?),
        }
    });
    if keep == Keep::No || outcome.is_err() {
        // What stays is removed when another copy is kept.
        disk.remove_folder(&copy).ok();
    }
    outcome.map_err(|trouble| troubles.push(trouble)).is_ok()
}

fn lock(root: &Path, disk: &Disk) -> Result<Option<FileLock>, Trouble> {
    let path = root.join("locks").join("hints");
    for _ in 0..N_TRIES {
        if let Some(lock) = try_lock(disk, &path)? {
            return Ok(Some(lock));
        }
        thread::sleep(PATIENCE);
    }
    Ok(None)
}

/// Copies the current folder, if it is as it was kept; if not, puts it aside.
fn copy_current(
    root: &Path,
    disk: &Disk,
    copy: &Path,
    troubles: &mut Vec<Trouble>,
) -> Result<(), Trouble> {
    let hints = root.join(FOLDER);
    let current = match fs::read_to_string(hints.join(CURRENT)) {
        Ok(current) => current,
        // None yet, or thrown away.
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Ok(disk.create_folder(copy).at(copy)?);
        }
        // Bytes that are no text, or a file in place of the folder.
        Err(_) => String::new(),
    };
    let is = |folder: &Path, digest: &str| {
        digest_of(folder).is_ok_and(|found| found.to_string() == digest)
    };
    let is_whole = match current.split_once(' ') {
        Some((name, digest)) => match copy_folder(disk, &hints.join(name), copy) {
            Ok(()) => is(copy, digest),
            // They are as they were kept: it is the disk that has no room for another.
            Err(error) if is(&hints.join(name), digest) => return Err(error).at(copy)?,
            Err(_) => false,
        },
        None => false,
    };
    if !is_whole {
        troubles.push(put_aside(root, disk, "not as they were kept".into())?);
        disk.create_folder(copy).at(copy)?;
    }
    Ok(())
}

/// Makes the copy the current folder. A kill leaves the old one current, or the new one.
fn make_current(root: &Path, disk: &Disk, copy: &Path) -> Result<(), Trouble> {
    await_closed(&copy.join("db"))?;
    let name = copy.file_name().and_then(OsStr::to_str).expect("copies have unique names");
    let current = format!("{name} {}", digest_of(copy).at(copy)?);
    let hints = root.join(FOLDER);
    let temporary = root.join("tmp").join(name);
    durable::publish(disk, &temporary, &hints.join(CURRENT), current.as_bytes())?;
    for old in paths(&hints).at(&hints)? {
        if old != copy && old != hints.join(CURRENT) {
            // One that stays is removed after the next change.
            disk.remove_folder(&old).ok();
        }
    }
    Ok(())
}

/// Waits for the threads of sled, which may outlive its handle: the last one to end lets go of
/// the lock on the file.
fn await_closed(path: &Path) -> Result<(), Trouble> {
    let file = File::open(path).at(path)?;
    for _ in 0..N_TRIES {
        if file.try_lock().is_ok() {
            return Ok(());
        }
        thread::sleep(PATIENCE);
    }
    Err(Trouble::NoHints { reason: "sled did not close".into() })
}

fn put_aside(root: &Path, disk: &Disk, reason: String) -> Result<Trouble, CacheError> {
    let folder = root.join(FOLDER);
    let moved_to = root.join("corrupt").join(format!("hints-{}", durable::unique_name()));
    disk.rename(&folder, &moved_to).at(&folder)?;
    Ok(Trouble::DamagedHints { reason, moved_to })
}

fn copy_folder(disk: &Disk, from: &Path, to: &Path) -> io::Result<()> {
    disk.create_folder(to)?;
    for path in paths(from)? {
        let copy = to.join(path.file_name().expect("a listed path has a name"));
        if path.is_dir() {
            copy_folder(disk, &path, &copy)?;
        } else {
            let mut file = disk.create(&copy)?;
            disk.append(&mut file, &copy, &fs::read(&path)?)?;
        }
    }
    Ok(())
}

/// The digest of the names and contents of a folder.
fn digest_of(folder: &Path) -> io::Result<Digest> {
    let mut hash = Sha256::new();
    for path in paths(folder)? {
        let name = path.file_name().expect("a listed path has a name");
        let content = if path.is_dir() { digest_of(&path)? } else { Digest::of(&fs::read(&path)?) };
        hash.update(Digest::of(name.as_encoded_bytes()).0);
        hash.update(content.0);
    }
    Ok(Digest(hash.finalize().into()))
}

fn paths(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder)? {
        paths.push(entry?.path());
    }
    paths.sort();
    Ok(paths)
}

impl From<CacheError> for Trouble {
    fn from(error: CacheError) -> Self {
        Self::NoHints { reason: error.to_string() }
    }
}

#[cfg(test)]
mod tests {
    use tempfile::TempDir;

    use super::*;

    fn store() -> TempDir {
        let root = tempfile::tempdir().unwrap();
        for folder in ["tmp", "locks", "corrupt"] {
            fs::create_dir(root.path().join(folder)).unwrap();
        }
        root
    }

    fn load_clean(root: &TempDir) -> Hints {
        let mut troubles = vec![];
        let hints = load(root.path(), &Disk::default(), &mut troubles);
        assert_eq!(troubles, []);
        hints
    }

    fn save_clean(hints: &mut Hints, root: &TempDir) {
        let mut troubles = vec![];
        save(hints, root.path(), &Disk::default(), &mut troubles);
        assert_eq!((troubles, hints.unsaved.len()), (vec![], 0));
    }

    fn some_hints() -> Hints {
        let mut hints = Hints::default();
        hints.note_millis("f@1", 100);
        hints
    }

    #[test]
    fn durations_follow_slowly() {
        let mut hints = Hints::default();
        assert_eq!(hints.expected_millis("f@1"), None);
        // 100; (300 + 200 + 2) / 4 = 125; (375 + 0 + 2) / 4 = 94.
        for (millis, expected) in [(100, 100), (200, 125), (0, 94)] {
            hints.note_millis("f@1", millis);
            assert_eq!(hints.expected_millis("f@1"), Some(expected));
        }
        assert_eq!(hints.expected_millis("f@2"), None);
    }

    #[test]
    fn durations_not_known_are_guessed_by_the_mean() {
        let mut hints = some_hints();
        hints.guess_millis([("g", 1), ("g", 4), ("f@1", 9)].into_iter());
        assert_eq!(
            (hints.expected_millis("g"), hints.expected_millis("f@1")),
            (Some(2), Some(100))
        );
    }

    #[test]
    fn what_was_saved_is_loaded_and_others_notes_stay() {
        let root = store();
        save_clean(&mut some_hints(), &root);
        let mut other = Hints::default();
        other.note_millis("g@1", 5);
        save_clean(&mut other, &root);
        let hints = load_clean(&root);
        assert_eq!(hints.expected_millis("f@1"), Some(100));
        assert_eq!(hints.expected_millis("g@1"), Some(5));
    }

    #[test]
    fn nothing_new_leaves_sled_closed() {
        let root = store();
        save_clean(&mut Hints::default(), &root);
        assert!(!root.path().join(FOLDER).exists());
        let mut hints = some_hints();
        save_clean(&mut hints, &root);
        let before = fs::read(root.path().join(FOLDER).join(CURRENT)).unwrap();
        save_clean(&mut hints, &root);
        assert_eq!(fs::read(root.path().join(FOLDER).join(CURRENT)).unwrap(), before);
    }

    #[test]
    fn damage_anywhere_costs_the_hints_only() {
        let root = store();
        let hints = root.path().join(FOLDER);
        save_clean(&mut some_hints(), &root);
        let current = paths(&hints).unwrap().remove(0);
        let names: Vec<_> = paths(&current).unwrap().into_iter().filter(|p| p.is_file()).collect();
        assert!(names.len() > 1);
        for n in 0..=names.len() {
            save_clean(&mut some_hints(), &root);
            let current = paths(&hints).unwrap().remove(0);
            let files = paths(&current).unwrap().into_iter().filter(|p| p.is_file());
            let file = files.chain([hints.join(CURRENT)]).nth(n).unwrap();
            let mut bytes = fs::read(&file).unwrap();
            bytes[0] ^= 0x80;
            fs::remove_file(&file).unwrap();
            fs::write(&file, bytes).unwrap();
            let mut troubles = vec![];
            assert_eq!(load(root.path(), &Disk::default(), &mut troubles), Hints::default());
            assert!(matches!(troubles[..], [Trouble::DamagedHints { .. }]), "{file:?}");
            assert_eq!(load_clean(&root), Hints::default());
        }
        save_clean(&mut some_hints(), &root);
        assert_eq!(load_clean(&root).expected_millis("f@1"), Some(100));
        assert_eq!(paths(&root.path().join("tmp")).unwrap(), Vec::<PathBuf>::new());
    }

    #[test]
    fn a_save_that_was_killed_leaves_the_hints_before_it() {
        let root = store();
        save_clean(&mut some_hints(), &root);
        let unfinished = root.path().join(FOLDER).join("a copy");
        fs::create_dir(&unfinished).unwrap();
        assert_eq!(load_clean(&root).expected_millis("f@1"), Some(100));
        save_clean(&mut some_hints(), &root);
        assert!(!unfinished.exists());
    }

    #[test]
    fn a_file_in_place_of_the_folder_is_put_aside() {
        let root = store();
        fs::write(root.path().join(FOLDER), "garbage").unwrap();
        let mut troubles = vec![];
        save(&mut some_hints(), root.path(), &Disk::default(), &mut troubles);
        assert!(matches!(troubles[..], [Trouble::DamagedHints { .. }]));
        assert_eq!(load_clean(&root).expected_millis("f@1"), Some(100));
    }

    #[test]
    fn without_the_lock_notes_wait() {
        let root = store();
        let held = try_lock(&Disk::default(), &root.path().join("locks").join("hints")).unwrap();
        let (mut hints, mut troubles) = (some_hints(), vec![]);
        save(&mut hints, root.path(), &Disk::default(), &mut troubles);
        assert!(matches!(troubles[..], [Trouble::NoHints { .. }]));
        drop(held);
        save_clean(&mut hints, &root);
        assert_eq!(load_clean(&root).expected_millis("f@1"), Some(100));
    }
}
