//! What makes a run nicer and may be lost: durations, access times, run history.
//!
//! They lie in sled, which is named in this file only and is open for moments only. It has
//! lost stores to crashes, and panics on bytes that it did not write, so it never sees any:
//! a seal holds the digest of the folder as it was last closed, and a folder that doesn't
//! match is put aside.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::panic::{self, AssertUnwindSafe};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use sha2::{Digest as _, Sha256};

use crate::error::At as _;
use crate::lock::{ActionLock, try_lock};
use crate::{CacheError, Digest, Trouble, durable};

/// Runs beyond this many are forgotten, the oldest first.
const N_RUNS_MAX: usize = 1000;
/// How often, and how long between, another process is awaited that has the hints open.
const N_TRIES: usize = 20;
const PATIENCE: Duration = Duration::from_millis(5);

/// Durations, access times and run history. Wrong or missing ones cost time, never a result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hints {
    millis: BTreeMap<String, u64>,
    last_use: BTreeMap<Digest, u32>,
    runs: Vec<Run>,
    /// What sled does not know yet, as it will lie there; `None` is removed.
    unsaved: BTreeMap<Vec<u8>, Option<Vec<u8>>>,
}

/// One run in the history.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Run {
    /// When it started, in milliseconds since 1970.
    pub started: u64,
    /// What the caller wants to remember of it.
    pub summary: String,
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
                expected
                    .saturating_mul(3)
                    .saturating_add(millis)
                    .saturating_add(2)
                    / 4
            }
            None => millis,
        };
        self.millis.insert(op.to_owned(), expected);
        self.unsaved.insert(
            key(b'd', op.as_bytes()),
            Some(expected.to_le_bytes().to_vec()),
        );
    }

    /// The day, counted from 1970, on which the result of a key was last used.
    #[must_use]
    pub fn last_use(&self, key: &Digest) -> Option<u32> {
        self.last_use.get(key).copied()
    }

    /// Notes that the result of a key was used. The second note of a day costs nothing.
    pub fn note_use(&mut self, digest: &Digest, day: u32) {
        if self.last_use.insert(*digest, day) != Some(day) {
            self.unsaved
                .insert(key(b'u', &digest.0), Some(day.to_le_bytes().to_vec()));
        }
    }

    /// The runs noted, oldest first.
    #[must_use]
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// Notes a run.
    pub fn note_run(&mut self, run: Run) {
        self.unsaved
            .insert(run_key(&run), Some(run.summary.as_bytes().to_vec()));
        self.runs.push(run);
        self.runs.sort();
        let n_old = self.runs.len().saturating_sub(N_RUNS_MAX);
        for old in self.runs.drain(..n_old) {
            self.unsaved.insert(run_key(&old), None);
        }
    }

    /// Forgets the uses of all keys but these.
    pub(crate) fn retain_uses(&mut self, mut keep: impl FnMut(&Digest) -> bool) {
        let unsaved = &mut self.unsaved;
        self.last_use.retain(|digest, _| {
            let keeps = keep(digest);
            if !keeps {
                unsaved.insert(key(b'u', &digest.0), None);
            }
            keeps
        });
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

    fn read(&mut self, db: &sled::Db) -> sled::Result<()> {
        for entry in db.iter() {
            let (key, value) = entry?;
            self.insert(&key, &value);
        }
        Ok(())
    }

    /// Adds an entry of sled; one that makes no sense is as good as none.
    fn insert(&mut self, key: &[u8], value: &[u8]) -> Option<()> {
        match key.split_first()? {
            (b'd', op) => {
                let millis = u64::from_le_bytes(value.try_into().ok()?);
                self.millis
                    .insert(str::from_utf8(op).ok()?.to_owned(), millis);
            }
            (b'u', digest) => {
                let day = u32::from_le_bytes(value.try_into().ok()?);
                self.last_use.insert(Digest(digest.try_into().ok()?), day);
            }
            (b'r', started) => {
                let started = u64::from_be_bytes(*started.first_chunk()?);
                let summary = str::from_utf8(value).ok()?.to_owned();
                self.runs.push(Run { started, summary });
            }
            _ => {}
        }
        Some(())
    }
}

fn key(kind: u8, name: &[u8]) -> Vec<u8> {
    [&[kind], name].concat()
}

/// Sorts by start; two runs that start together differ in what follows.
fn run_key(run: &Run) -> Vec<u8> {
    let digest = Digest::of(run.summary.as_bytes());
    [b"r", &run.started.to_be_bytes()[..], &digest.0[..8]].concat()
}

/// The hints of the store at `root`; those that can't be had are empty.
pub(crate) fn load(root: &Path, troubles: &mut Vec<Trouble>) -> Hints {
    let mut hints = Hints::default();
    if root.join(FOLDER).exists() {
        with_sled(root, troubles, |db| hints.read(db));
    }
    hints.runs.sort();
    hints
}

/// Writes what sled does not know yet. If there is nothing, sled is not opened.
pub(crate) fn save(hints: &mut Hints, root: &Path, troubles: &mut Vec<Trouble>) {
    if hints.unsaved.is_empty() {
        return;
    }
    let mut batch = sled::Batch::default();
    for (key, value) in &hints.unsaved {
        match value {
            Some(value) => batch.insert(key.as_slice(), value.as_slice()),
            None => batch.remove(key.as_slice()),
        }
    }
    let saved = with_sled(root, troubles, |db| {
        db.apply_batch(batch)?;
        db.flush().map(drop)
    });
    if saved {
        hints.unsaved.clear();
    }
}

const FOLDER: &str = "hints.sled";
const SEAL: &str = "hints.seal";

/// Whether `work` was done with sled open; if not, the reason is among the troubles.
fn with_sled(
    root: &Path,
    troubles: &mut Vec<Trouble>,
    work: impl FnOnce(&sled::Db) -> sled::Result<()>,
) -> bool {
    let outcome = lock(root).and_then(|lock| {
        let Some(_lock) = lock else {
            troubles.push(Trouble::NoHints {
                reason: "another process has them open".into(),
            });
            return Ok(false);
        };
        let (folder, seal) = (root.join(FOLDER), root.join(SEAL));
        let sealed = fs::read_to_string(&seal).unwrap_or_default();
        if folder.exists() && seal_of(&folder)? != sealed {
            troubles.push(put_aside(root, "not as it was closed".into())?);
        }
        let config = sled::Config::new()
            .path(&folder)
            .mode(sled::Mode::LowSpace)
            .cache_capacity(16 << 20)
            .flush_every_ms(None);
        let worked = panic::catch_unwind(AssertUnwindSafe(|| work(&config.open()?)));
        let reason = match worked {
            Ok(Ok(())) => {
                let closed = seal_of(&folder)?;
                if closed != sealed {
                    let temporary = root.join("tmp").join(durable::unique_name());
                    durable::publish(&temporary, &seal, closed.as_bytes())?;
                }
                return Ok(true);
            }
            Ok(Err(error)) => error.to_string(),
            Err(_) => "sled panicked".into(),
        };
        troubles.push(put_aside(root, reason)?);
        Ok(false)
    });
    outcome.unwrap_or_else(|error| {
        troubles.push(Trouble::NoHints {
            reason: error.to_string(),
        });
        false
    })
}

fn lock(root: &Path) -> Result<Option<ActionLock>, CacheError> {
    let path = root.join("locks").join("hints");
    for _ in 0..N_TRIES {
        if let Some(lock) = try_lock(&path)? {
            return Ok(Some(lock));
        }
        thread::sleep(PATIENCE);
    }
    Ok(None)
}

fn put_aside(root: &Path, reason: String) -> Result<Trouble, CacheError> {
    let folder = root.join(FOLDER);
    let moved_to = root
        .join("corrupt")
        .join(format!("hints-{}", durable::unique_name()));
    fs::rename(&folder, &moved_to).at(&folder)?;
    Ok(Trouble::DamagedHints { reason, moved_to })
}

/// The digest of the names and contents of all files in a folder.
fn seal_of(folder: &Path) -> Result<String, CacheError> {
    let mut files = Vec::new();
    list(folder, &mut files)?;
    files.sort();
    let mut hash = Sha256::new();
    for path in files {
        let name = path
            .strip_prefix(folder)
            .expect("a listed file lies inside");
        let bytes = fs::read(&path).at(&path)?;
        hash.update(Digest::of(name.as_os_str().as_encoded_bytes()).0);
        hash.update(Digest::of(&bytes).0);
    }
    Ok(Digest(hash.finalize().into()).to_string())
}

fn list(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), CacheError> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        // Something else lies in its place.
        Err(error) if error.kind() == io::ErrorKind::NotADirectory => return Ok(()),
        Err(source) => {
            return Err(CacheError::Io {
                path: folder.to_owned(),
                source,
            });
        }
    };
    for entry in entries {
        let path = entry.at(folder)?.path();
        if path.is_dir() {
            list(&path, files)?;
        } else {
            files.push(path);
        }
    }
    Ok(())
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
        let hints = load(root.path(), &mut troubles);
        assert_eq!(troubles, []);
        hints
    }

    fn save_clean(hints: &mut Hints, root: &TempDir) {
        let mut troubles = vec![];
        save(hints, root.path(), &mut troubles);
        assert_eq!((troubles, hints.unsaved.len()), (vec![], 0));
    }

    fn run(started: u64) -> Run {
        Run {
            started,
            summary: format!("run {started}"),
        }
    }

    fn some_hints() -> Hints {
        let mut hints = Hints::default();
        hints.note_millis("f@1", 100);
        hints.note_use(&Digest([1; 32]), 20_000);
        hints.note_run(run(7));
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
        other.note_run(run(3));
        save_clean(&mut other, &root);
        let hints = load_clean(&root);
        assert_eq!(hints.expected_millis("f@1"), Some(100));
        assert_eq!(hints.expected_millis("g@1"), Some(5));
        assert_eq!(hints.last_use(&Digest([1; 32])), Some(20_000));
        assert_eq!(hints.runs(), [run(3), run(7)]);
    }

    #[test]
    fn nothing_new_leaves_sled_closed() {
        let root = store();
        save_clean(&mut Hints::default(), &root);
        assert!(!root.path().join(FOLDER).exists());
        save_clean(&mut some_hints(), &root);
        let mut hints = load_clean(&root);
        hints.note_use(&Digest([1; 32]), 20_000);
        assert!(
            hints.unsaved.is_empty(),
            "the same day again is nothing new"
        );
    }

    #[test]
    fn old_runs_and_uses_of_swept_keys_are_forgotten() {
        let root = store();
        let mut hints = some_hints();
        (100..1102).for_each(|started| hints.note_run(run(started)));
        hints.retain_uses(|key| *key != Digest([1; 32]));
        save_clean(&mut hints, &root);
        let hints = load_clean(&root);
        assert_eq!((hints.runs().len(), hints.runs()[0].started), (1000, 102));
        assert_eq!(hints.last_use(&Digest([1; 32])), None);
    }

    #[test]
    fn damage_anywhere_in_sled_costs_the_hints_only() {
        let root = store();
        let folder = root.path().join(FOLDER);
        save_clean(&mut some_hints(), &root);
        let mut files = vec![];
        list(&folder, &mut files).unwrap();
        assert!(!files.is_empty());
        for file in files {
            save_clean(&mut some_hints(), &root);
            let len = fs::metadata(&file).map_or(0, |f| f.len());
            fs::write(&file, vec![0xA5; usize::try_from(len).unwrap() / 2 + 1]).unwrap();
            let mut troubles = vec![];
            assert_eq!(load(root.path(), &mut troubles), Hints::default());
            assert!(
                matches!(troubles[..], [Trouble::DamagedHints { .. }]),
                "{file:?}"
            );
            assert_eq!(load_clean(&root), Hints::default());
        }
        save_clean(&mut some_hints(), &root);
        assert_eq!(load_clean(&root).runs(), [run(7)]);
    }

    #[test]
    fn a_file_in_place_of_the_folder_is_put_aside() {
        let root = store();
        fs::write(root.path().join(FOLDER), "garbage").unwrap();
        let mut troubles = vec![];
        save(&mut some_hints(), root.path(), &mut troubles);
        assert!(matches!(troubles[..], [Trouble::DamagedHints { .. }]));
        assert_eq!(load_clean(&root).runs(), [run(7)]);
    }

    #[test]
    fn without_the_lock_notes_wait() {
        let root = store();
        let held = try_lock(&root.path().join("locks").join("hints")).unwrap();
        let (mut hints, mut troubles) = (some_hints(), vec![]);
        save(&mut hints, root.path(), &mut troubles);
        assert!(matches!(troubles[..], [Trouble::NoHints { .. }]));
        drop(held);
        save_clean(&mut hints, &root);
        assert_eq!(load_clean(&root).runs(), [run(7)]);
    }
}
