//! Reading all of a store, to see whether it is whole.

use std::fs;
use std::io;
use std::path::Path;

use crate::broom::{Broom, folders, put_aside};
use crate::cache::{names, prepare};
use crate::found::{self, FOUND};
use crate::{CacheError, Digest, Disk, Record, Trouble, hints, in_use, merge, runs};

/// What a store holds that is whole, and what was not.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Checked {
    /// Action records.
    pub records: usize,
    /// Artifacts that are not inside a record.
    pub objects: usize,
    /// The bytes of these.
    pub object_bytes: u64,
    /// Records whose artifact is not there; it is made anew when it is needed.
    pub gone: usize,
    /// States of computations that have no result yet.
    pub checkpoints: usize,
    /// Runs of the history.
    pub runs: usize,
    /// What was damaged. Objects, checkpoints, runs and lists are put aside.
    pub damaged: Vec<Trouble>,
    /// Whether damaged journals were put aside, and their whole records saved; not if the store
    /// is in use.
    pub mended: bool,
}

/// Reads every file of the store at `root`, beside others that use it.
///
/// # Errors
/// If the disk fails.
pub fn check(root: &Path) -> Result<Checked, CacheError> {
    let mut checked = Checked::default();
    let in_use = in_use::shared(prepare(&Disk::default(), root)?, root)?;
    let journals = merge::read(root, &mut checked.damaged)?;
    // What a killed writer left undone is no damage.
    checked.damaged.retain(|trouble| !matches!(trouble, Trouble::TornJournal { .. }));
    let is_mendable = !checked.damaged.is_empty();
    checked.records = journals.records.values().map(Vec::len).sum();

    for shelf in folders(&root.join("objects"))? {
        for name in names(&shelf)? {
            let is_whole = |bytes: &[u8]| is_named(&name.to_string_lossy(), bytes);
            if let Some(bytes) = read(root, &shelf.join(&name), is_whole, &mut checked.damaged)? {
                checked.objects += 1;
                checked.object_bytes += bytes;
            }
        }
    }
    let is_there = |record: &&Record| {
        let name = record.output.digest.to_string();
        record.output.inline.is_some() || root.join("objects").join(&name[..2]).join(name).exists()
    };
    checked.gone = journals.records.values().flatten().filter(|record| !is_there(record)).count();
    for name in names(&root.join("checkpoints"))? {
        let path = root.join("checkpoints").join(name);
        checked.checkpoints +=
            usize::from(read(root, &path, is_checkpoint, &mut checked.damaged)?.is_some());
    }
    let mut damaged = Vec::new();
    let history = runs::runs(root, &mut damaged)?;
    checked.runs = history.len();
    runs::last_uses(root, &history, &mut damaged)?;
    for trouble in &damaged {
        if let Trouble::DamagedRun { path, .. } | Trouble::DamagedKeys { path } = trouble
            && path.exists()
        {
            put_aside(&Disk::default(), root, path)?;
        }
    }
    checked.damaged.append(&mut damaged);
    for name in names(&root.join("keys"))? {
        let is_whole = |bytes: &[u8]| is_named(&name.to_string_lossy(), bytes);
        read(root, &root.join("keys").join(&name), is_whole, &mut checked.damaged)?;
    }
    for name in names(&root.join(FOUND))? {
        let is_whole = |bytes: &[u8]| found::is_whole(&name.to_string_lossy(), bytes);
        read(root, &root.join(FOUND).join(&name), is_whole, &mut checked.damaged)?;
    }
    let mut damaged = Vec::new();
    hints::load(root, &Disk::default(), &mut damaged);
    // What another process has open may be whole.
    damaged.retain(|trouble| !matches!(trouble, Trouble::NoHints { .. }));
    checked.damaged.append(&mut damaged);
    drop(in_use);
    if is_mendable {
        checked.mended = mend(root)?;
    }
    Ok(checked)
}

/// The size of a file that is whole; one that is not is put aside.
fn read(
    root: &Path,
    path: &Path,
    is_whole: impl Fn(&[u8]) -> bool,
    damaged: &mut Vec<Trouble>,
) -> Result<Option<u64>, CacheError> {
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        // Removed meanwhile.
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(CacheError::Io { path: path.to_owned(), source }),
    };
    if is_whole(&bytes) {
        return Ok(Some(bytes.len() as u64));
    }
    let moved_to = put_aside(&Disk::default(), root, path)?;
    damaged.push(Trouble::DamagedFile { path: path.to_owned(), moved_to });
    Ok(None)
}

fn is_named(name: &str, bytes: &[u8]) -> bool {
    Digest::of(bytes).to_string() == name
}

fn is_checkpoint(bytes: &[u8]) -> bool {
    let parts = bytes.split_first_chunk::<32>();
    parts.is_some_and(|(digest, state)| Digest::of(state).0 == *digest)
}

/// Puts damaged journals aside, and saves their whole records, unless the store is in use.
fn mend(root: &Path) -> Result<bool, CacheError> {
    let _in_use = match in_use::alone(prepare(&Disk::default(), root)?, root) {
        Ok(in_use) => in_use,
        Err(CacheError::Busy { .. }) => return Ok(false),
        Err(error) => return Err(error),
    };
    let journals = merge::read(root, &mut Vec::new())?;
    let records: Vec<&Record> = journals.records.values().flatten().collect();
    merge::write(root, &journals, &records, &mut Broom::new(root, false))?;
    Ok(true)
}
