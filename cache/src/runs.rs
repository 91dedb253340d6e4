//! The history of runs: a small file each, and lists of the keys that they used.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::cache::{look, names, names_if_any};
use crate::error::At as _;
use crate::{Cache, CacheError, Digest, Disk, Trouble, durable};

/// Runs that are not kept go beyond this many, the oldest first.
const N_RUNS_MAX: usize = 1000;
const RUNS: &str = "runs";
const KEYS: &str = "keys";
/// Ends the name of a run that is kept.
const KEPT: &str = ".kept";

/// One run in the history.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// What it is called: 8 hexadecimal digits.
    pub name: String,
    /// When it ended, in milliseconds since 1970.
    pub ended: u64,
    /// Whether a sweep keeps what it used, and the history it.
    pub kept: bool,
    /// The digest of the list of keys whose results it used.
    pub(crate) keys: Digest,
    /// What the caller wants to remember of it.
    pub summary: String,
}

impl Run {
    /// The name of its file.
    pub(crate) fn file(&self, kept: bool) -> String {
        format!("{:012x}-{}{}", self.ended, self.name, if kept { KEPT } else { "" })
    }

    fn path(&self, root: &Path) -> PathBuf {
        root.join(RUNS).join(self.file(self.kept))
    }
}

impl Cache {
    /// Adds a run to the history, and returns its name. The oldest runs that are not kept go.
    ///
    /// Runs that used the same keys share the list of them.
    ///
    /// - `ended`: milliseconds since 1970.
    ///
    /// # Errors
    /// If the disk fails or is full.
    pub fn note_run(
        &self,
        ended: u64,
        mut keys: Vec<Digest>,
        summary: &str,
    ) -> Result<String, CacheError> {
        keys.sort_unstable();
        keys.dedup();
        let list: Vec<u8> = keys.iter().flat_map(|key| key.0).collect();
        let keys = Digest::of(&list);
        if !self.holds_keys(&keys, &list) {
            self.publish(&place(&self.root, &keys), &list)?;
        }
        let body = [&ended.to_le_bytes()[..], &keys.0, summary.as_bytes()].concat();
        let check = Digest::of(&body);
        let (name, summary) = (check.short(), String::new());
        let run = Run { name, ended, kept: false, keys, summary };
        self.publish(&run.path(&self.root), &[&check.0[..], &body].concat())?;
        self.forget_oldest(N_RUNS_MAX)?;
        Ok(run.name)
    }

    fn holds_keys(&self, keys: &Digest, list: &[u8]) -> bool {
        fs::read(place(&self.root, keys)).is_ok_and(|found| found == list)
    }

    pub(crate) fn publish(&self, path: &Path, bytes: &[u8]) -> Result<(), CacheError> {
        let temporary = self.root.join("tmp").join(durable::unique_name());
        durable::publish(&self.disk, &temporary, path, bytes)
    }

    /// Leaves so many runs that are not kept.
    fn forget_oldest(&self, max: usize) -> Result<(), CacheError> {
        let folder = self.root.join(RUNS);
        let mut names = names(&folder)?;
        names.retain(|name| !name.to_string_lossy().ends_with(KEPT));
        let n_old = names.len().saturating_sub(max);
        for old in &names[..n_old] {
            remove(&self.disk, &folder.join(old))?;
        }
        Ok(())
    }
}

/// The runs of a store, while nobody sweeps it.
#[derive(Debug)]
pub struct History {
    pub(crate) root: PathBuf,
    disk: Disk,
    /// The runs, the one that ended first first.
    pub runs: Vec<Run>,
    /// What was found damaged.
    pub troubles: Vec<Trouble>,
    // Held for its lock, as by a cache that is open.
    _in_use: Option<File>,
}

impl History {
    /// The runs of the store at `root`. Waits while another process sweeps it.
    ///
    /// # Errors
    /// If the disk fails, or the store is of another format.
    pub fn open(root: &Path) -> Result<Self, CacheError> {
        let in_use = look(root)?;
        let mut troubles = Vec::new();
        let runs = runs(root, &mut troubles)?;
        Ok(Self { root: root.to_owned(), disk: Disk::default(), runs, troubles, _in_use: in_use })
    }

    /// Makes sure that sweeps keep what a run used, and the history the run.
    ///
    /// # Errors
    /// [`CacheError::NoKeys`] if what it used is not known any more; otherwise, if the disk
    /// fails.
    pub fn keep(&self, run: &Run) -> Result<(), CacheError> {
        keys(&self.root, run)?;
        let kept = self.root.join(RUNS).join(run.file(true));
        self.disk.rename(&run.path(&self.root), &kept).at(&kept)?;
        self.disk.sync_folder(&self.root.join(RUNS)).at(&kept)
    }

    /// Takes a run out of the history, kept or not.
    ///
    /// # Errors
    /// If the disk fails.
    pub fn forget(&self, run: &Run) -> Result<(), CacheError> {
        let path = run.path(&self.root);
        remove(&self.disk, &path)?;
        self.disk.sync_folder(&self.root.join(RUNS)).at(&path)
    }
}

/// The runs of a store, the one that ended first first.
pub(crate) fn runs(root: &Path, troubles: &mut Vec<Trouble>) -> Result<Vec<Run>, CacheError> {
    let folder = root.join(RUNS);
    let mut runs = Vec::new();
    for name in names_if_any(&folder)? {
        let path = folder.join(&name);
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            // Forgotten meanwhile.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(source) => return Err(CacheError::Io { path, source }),
        };
        let kept = name.to_string_lossy().ends_with(KEPT);
        match decode(&bytes, kept).filter(|run| *run.file(kept) == *name) {
            Some(run) => runs.push(run),
            None => troubles.push(Trouble::DamagedRun { path, kept }),
        }
    }
    Ok(runs)
}

fn decode(bytes: &[u8], kept: bool) -> Option<Run> {
    let (check, body) = bytes.split_first_chunk::<32>()?;
    if Digest::of(body).0 != *check {
        return None;
    }
    let (ended, rest) = body.split_first_chunk()?;
    let (keys, summary) = rest.split_first_chunk()?;
    Some(Run {
        name: Digest(*check).short(),
        ended: u64::from_le_bytes(*ended),
        kept,
        keys: Digest(*keys),
        summary: String::from_utf8(summary.to_vec()).ok()?,
    })
}

/// The keys whose results a run used, sorted.
pub(crate) fn keys(root: &Path, run: &Run) -> Result<Vec<Digest>, CacheError> {
    let path = place(root, &run.keys);
    let list = match fs::read(&path) {
        Ok(list) => list,
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        Err(source) => return Err(CacheError::Io { path, source }),
    };
    if Digest::of(&list) != run.keys {
        return Err(CacheError::NoKeys { run: run.name.clone(), path });
    }
    Ok(list.as_chunks().0.iter().map(|key| Digest(*key)).collect())
}

/// Where a list of keys lies.
fn place(root: &Path, keys: &Digest) -> PathBuf {
    root.join(KEYS).join(keys.to_string())
}

/// When each key was last used, in milliseconds since 1970, by the runs that are given.
pub(crate) fn last_uses(
    root: &Path,
    runs: &[Run],
    troubles: &mut Vec<Trouble>,
) -> Result<BTreeMap<Digest, u64>, CacheError> {
    // Many runs share a list: the latest of them counts.
    let mut lists = BTreeMap::<Digest, &Run>::new();
    for run in runs {
        let latest = lists.entry(run.keys).or_insert(run);
        if latest.ended < run.ended {
            *latest = run;
        }
    }
    let mut uses = BTreeMap::new();
    for run in lists.into_values() {
        match keys(root, run) {
            Ok(keys) => {
                for key in keys {
                    let last = uses.entry(key).or_default();
                    *last = run.ended.max(*last);
                }
            }
            Err(CacheError::NoKeys { path, .. }) => troubles.push(Trouble::DamagedKeys { path }),
            Err(error) => return Err(error),
        }
    }
    Ok(uses)
}

fn remove(disk: &Disk, path: &Path) -> Result<(), CacheError> {
    match disk.remove(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        removed => removed.at(path),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_runs_go_and_kept_ones_stay() {
        let root = tempfile::tempdir().unwrap();
        let cache = Cache::open(root.path(), "x").unwrap();
        let note = |ended| cache.note_run(ended, vec![Digest([1; 32])], "").unwrap();
        let names: Vec<_> = (0..6).map(note).collect();
        let history = || History::open(root.path()).unwrap();
        let told = || history().runs.into_iter().map(|run| run.name).collect::<Vec<_>>();
        assert_eq!(told(), names);
        history().keep(&history().runs[1]).unwrap();
        cache.forget_oldest(3).unwrap();
        assert_eq!(told(), [&names[1..2], &names[3..]].concat());
        let kept: Vec<_> = history().runs.iter().map(|run| run.kept).collect();
        assert_eq!(kept, [true, false, false, false]);
        history().forget(&history().runs[0]).unwrap();
        assert_eq!(told(), names[3..]);
    }

    #[test]
    fn every_flipped_bit_of_a_run_is_noticed() {
        let root = tempfile::tempdir().unwrap();
        Cache::open(root.path(), "x").unwrap().note_run(7, vec![], "all held").unwrap();
        let path = History::open(root.path()).unwrap().runs[0].path(root.path());
        let bytes = fs::read(&path).unwrap();
        for bit in 0..bytes.len() * 8 {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            fs::remove_file(&path).unwrap();
            fs::write(&path, damaged).unwrap();
            let history = History::open(root.path()).unwrap();
            assert_eq!(history.runs, []);
            let expected = Trouble::DamagedRun { path: path.clone(), kept: false };
            assert_eq!(history.troubles, [expected], "bit {bit}");
        }
    }
}
