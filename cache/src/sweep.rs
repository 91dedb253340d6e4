//! Dropping what nobody wants any more.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::broom::{Broom, folders, now, size, written};
use crate::cache::{names, prepare};
use crate::found::{FOUND, named};
use crate::journal::frame_len;
use crate::lock::try_lock;
use crate::merge::{self, Journals, WEEK};
use crate::runs::{self, Run};
use crate::select::{Uses, select};
use crate::{CacheError, Digest, Disk, Record, Trouble, in_use};

/// What a sweep leaves. Without a limit that is all that a record or a run leads to.
///
/// A record was last used when the last run ended that used it; one that no run mentions, when
/// its journal was last written. What kept runs and these ones used always stays.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Names of runs to keep what they used. Without another limit, all else goes; but not what
    /// no run mentions and was written in the last week.
    pub runs: Option<BTreeSet<String>>,
    /// What was last used before goes: milliseconds since 1970. So do runs that ended before.
    pub since: Option<u64>,
    /// Of what was used longest ago, so much goes that at most these bytes are left.
    pub max_bytes: Option<u64>,
    /// Outputs that stay.
    pub locked: BTreeSet<Digest>,
}

/// What a sweep removed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Swept {
    /// Action records.
    pub records: usize,
    /// Artifacts that no record is left to name.
    pub objects: usize,
    /// States of computations that nobody went on with.
    pub checkpoints: usize,
    /// The names of runs of the history.
    pub runs: BTreeSet<String>,
    /// How many of the records each experiment made: the first word of a node's address.
    pub experiments: BTreeMap<String, usize>,
    /// How many bytes less the store takes.
    pub freed: u64,
    /// How many records stay.
    pub kept: usize,
    /// How many bytes the store takes, without the durations.
    pub left: u64,
    /// What was found damaged on the way; journals are put aside, and whole records saved.
    pub troubles: Vec<Trouble>,
}

/// Whether a sweep only says what it would do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sweep {
    /// Removes, while nobody else uses the store.
    Wet,
    /// Only looks, beside others.
    Dry,
}

/// Removes what is not wanted, what killed processes left, and what was found damaged before;
/// merges the journals.
///
/// - `wanted`: is asked with the history, to which nobody adds before the end of a wet sweep.
///
/// At every moment of a sweep that is killed the store is correct, and no root is gone.
///
/// # Errors
/// [`CacheError::Busy`] if the store is open anywhere; [`CacheError::NoKeys`] if what a kept
/// run used can't be told; otherwise, if the disk fails.
pub fn sweep(
    root: &Path,
    how: Sweep,
    wanted: impl FnOnce(&[Run]) -> Wanted,
) -> Result<Swept, CacheError> {
    let in_use = prepare(&Disk::default(), root)?;
    let dry = how == Sweep::Dry;
    let _in_use = if dry { in_use::shared(in_use, root) } else { in_use::alone(in_use, root) }?;
    let (mut swept, now) = (Swept::default(), now());
    let journals = merge::read(root, &mut swept.troubles)?;
    let history = runs::runs(root, &mut swept.troubles)?;
    for trouble in &swept.troubles {
        if let Trouble::DamagedRun { path, kept: true } = trouble {
            let run = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            return Err(CacheError::NoKeys { run, path: path.clone() });
        }
    }
    let wanted = &wanted(&history);
    let uses = uses(root, &history, wanted, &journals, &mut swept.troubles)?;
    let others = sizes_of(root, &["tmp", "corrupt", "checkpoints", "runs", "keys", FOUND])?;
    let before = others + sizes_of(root, &["journal"])? + objects_size(root)?;

    let mut broom = Broom::new(root, dry);
    for folder in ["tmp", "corrupt"] {
        broom.sweep(&root.join(folder), |_| true)?;
    }
    let folder = root.join("checkpoints");
    let since = wanted.since.unwrap_or(now.saturating_sub(WEEK));
    swept.checkpoints = broom.sweep(&folder, |name| written(&folder.join(name)) < since)?;
    swept.runs = forget(root, &history, wanted, &mut broom)?;

    let records = journals.records.values().flatten();
    let others = others.saturating_sub(broom.freed()) + journals.overhead();
    let (kept, gone) = select(records, &uses, wanted, now, others, frame_len);
    (swept.records, swept.kept) = (gone.len(), kept.len());
    for record in &gone {
        let experiment = record.provenance.node.split('/').next().unwrap_or_default();
        *swept.experiments.entry(experiment.to_owned()).or_default() += 1;
    }
    merge::write(root, &journals, &kept, &mut broom)?;
    swept.objects = sweep_objects(root, &kept, wanted, &mut broom)?;
    if !dry {
        for name in names(&root.join("locks"))? {
            // Letting go of a lock removes its file; one that is held stays.
            drop(try_lock(&Disk::default(), &root.join("locks").join(name))?);
        }
    }
    (swept.freed, swept.left) = (broom.freed(), before.saturating_sub(broom.freed()));
    Ok(swept)
}

fn uses(
    root: &Path,
    history: &[Run],
    wanted: &Wanted,
    journals: &Journals,
    troubles: &mut Vec<Trouble>,
) -> Result<Uses, CacheError> {
    let mut roots = BTreeSet::new();
    for run in history.iter().filter(|run| run.kept || is_chosen(run, wanted)) {
        roots.extend(runs::keys(root, run)?);
    }
    let by_runs = runs::last_uses(root, history, troubles)?;
    Ok(Uses { roots, by_runs, written: journals.written.clone() })
}

fn is_chosen(run: &Run, wanted: &Wanted) -> bool {
    wanted.runs.as_ref().is_some_and(|runs| runs.contains(&run.name))
}

/// Removes the runs that are not wanted, and lists of keys and finds that no other has.
fn forget(
    root: &Path,
    history: &[Run],
    wanted: &Wanted,
    broom: &mut Broom<'_>,
) -> Result<BTreeSet<String>, CacheError> {
    let goes = |run: &Run| match (wanted.since, wanted.max_bytes, &wanted.runs) {
        _ if run.kept || is_chosen(run, wanted) => false,
        (Some(since), ..) => run.ended < since,
        (None, None, Some(_)) => true,
        (None, ..) => false,
    };
    let (gone, stay): (Vec<_>, Vec<_>) = history.iter().partition(|run| goes(run));
    let files: BTreeSet<String> = gone.iter().map(|run| run.file(run.kept)).collect();
    broom.sweep(&root.join("runs"), |name| files.contains(name))?;
    let lists: BTreeSet<String> = stay.iter().map(|run| run.keys.to_string()).collect();
    broom.sweep(&root.join("keys"), |name| !lists.contains(name))?;
    let found = named(stay);
    broom.sweep(&root.join(FOUND), |name| !found.contains(name))?;
    Ok(gone.iter().map(|run| run.name.clone()).collect())
}

fn sweep_objects(
    root: &Path,
    kept: &[&Record],
    wanted: &Wanted,
    broom: &mut Broom<'_>,
) -> Result<usize, CacheError> {
    let outputs = kept.iter().map(|record| &record.output.digest).chain(&wanted.locked);
    let outputs: BTreeSet<String> = outputs.map(ToString::to_string).collect();
    let mut n_gone = 0;
    for shelf in folders(&root.join("objects"))? {
        n_gone += broom.sweep(&shelf, |name| !outputs.contains(name))?;
    }
    Ok(n_gone)
}

fn sizes_of(root: &Path, folders: &[&str]) -> Result<u64, CacheError> {
    folders.iter().map(|folder| size(&root.join(folder))).sum()
}

fn objects_size(root: &Path) -> Result<u64, CacheError> {
    folders(&root.join("objects"))?.iter().map(|shelf| size(shelf)).sum()
}
