//! Dropping what nobody wants any more.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::Path;

use crate::cache::{names, sizes};
use crate::error::At as _;
use crate::journal::journal_of;
use crate::lock::try_lock;
use crate::{Cache, CacheError, Digest, Record, Trouble, durable};

/// What a sweep removed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Swept {
    /// Action records.
    pub records: usize,
    /// Artifacts that no record is left to name.
    pub objects: usize,
    /// The bytes of these.
    pub bytes: u64,
    /// What was found damaged on the way, and is gone now.
    pub troubles: Vec<Trouble>,
}

/// Removes every record that `keep` refuses, every object that no kept record names, and what
/// killed processes left; merges the journals into one.
///
/// `keep` also receives the day, counted from 1970, on which the record was last used, where
/// that is known. At every moment of a sweep that is killed the store is correct.
///
/// # Errors
/// [`CacheError::Busy`] if a [`Cache`] of this store is open anywhere; otherwise, if the disk
/// fails.
pub fn sweep(
    root: &Path,
    mut keep: impl FnMut(&Record, Option<u32>) -> bool,
) -> Result<Swept, CacheError> {
    let mut cache = Cache::open_alone(root)?;
    let hints = cache.hints().clone();
    let (kept, dropped): (Vec<&Record>, Vec<_>) =
        cache.records().partition(|record| keep(record, hints.last_use(&record.key)));
    let mut swept = Swept { records: dropped.len(), ..Swept::default() };
    let keys: BTreeSet<Digest> = kept.iter().map(|record| record.key).collect();
    let outputs: BTreeSet<String> = kept.iter().map(|r| r.output.digest.to_string()).collect();

    merge_journals(root, &kept)?;
    for shelf in names(&root.join("objects"))? {
        let shelf = root.join("objects").join(shelf);
        for (name, bytes) in sizes(&shelf)? {
            if !name.to_str().is_some_and(|name| outputs.contains(name)) {
                remove(&shelf.join(name))?;
                swept.objects += 1;
                swept.bytes += bytes;
            }
        }
    }
    for folder in ["tmp", "corrupt"] {
        for name in names(&root.join(folder))? {
            remove(&root.join(folder).join(name))?;
        }
    }
    for name in names(&root.join("locks"))? {
        // Letting go of a lock removes its file; one that is held stays.
        drop(try_lock(&root.join("locks").join(name))?);
    }
    cache.hints().retain_uses(|key| keys.contains(key));
    cache.save_hints();
    swept.troubles = cache.troubles();
    Ok(swept)
}

/// The new journal is in place before the old ones go: a record in two journals is one.
fn merge_journals(root: &Path, kept: &[&Record]) -> Result<(), CacheError> {
    let folder = root.join("journal");
    let old = names(&folder)?;
    if !kept.is_empty() {
        let name = durable::unique_name();
        let merged = journal_of(kept.iter().copied())?;
        let path = folder.join(format!("{name}.log"));
        durable::publish(&root.join("tmp").join(name), &path, &merged)?;
    }
    for name in old {
        remove(&folder.join(name))?;
    }
    durable::sync_folder(&folder)
}

fn remove(path: &Path) -> Result<(), CacheError> {
    let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    match removed {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        removed => removed.at(path),
    }
}
