//! The journals of a store, read as one and written as few.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::path::Path;

use crate::broom::{Broom, written};
use crate::cache::{Records, find, insert, sizes};
use crate::journal::{self, Seen, journal_of};
use crate::{CacheError, Digest, Record, Trouble, durable};

/// Journals last written in one week become one, so that what is in them keeps its age but
/// for a week.
pub(crate) const WEEK: u64 = 7 * 24 * 3600 * 1000;

/// The records of a store, and where they lie.
#[derive(Debug, Default)]
pub(crate) struct Journals {
    pub(crate) records: Records,
    /// When a journal with a key was last written, in milliseconds since 1970.
    pub(crate) written: BTreeMap<Digest, u64>,
    files: Vec<Source>,
}

#[derive(Debug)]
struct Source {
    name: OsString,
    bytes: u64,
    written: u64,
    n_records: usize,
    /// Whether there is anything in it but whole records that agree with others, and whether
    /// that is damage.
    torn: bool,
    damaged: bool,
}

impl Journals {
    /// How many bytes the journals take at most besides their records, once they are merged.
    pub(crate) fn overhead(&self) -> u64 {
        let weeks: BTreeSet<u64> = self.files.iter().map(|source| source.written / WEEK).collect();
        weeks.len() as u64 * journal::MAGIC.len() as u64
    }
}

/// Reads every journal of a store.
pub(crate) fn read(root: &Path, troubles: &mut Vec<Trouble>) -> Result<Journals, CacheError> {
    let folder = root.join("journal");
    let mut journals = Journals::default();
    let Journals { records, written: last, files } = &mut journals;
    for (name, bytes) in sizes(&folder)? {
        let path = folder.join(&name);
        if path.extension().is_none_or(|extension| extension != "log") {
            continue;
        }
        let (written, mut n_records) = (written(&path), 0);
        let (mut found, mut conflicts) = (Vec::new(), Vec::new());
        journal::read(&path, &mut Seen::default(), &mut found, |record| {
            n_records += 1;
            let last = last.entry(record.key).or_default();
            *last = written.max(*last);
            match find(records, &record) {
                Ok(Some(_)) => {}
                Ok(None) => insert(records, record),
                Err(conflict) => conflicts.push(Trouble::Conflict(conflict)),
            }
        })?;
        let is_tear = |trouble: &Trouble| matches!(trouble, Trouble::TornJournal { .. });
        let torn = !found.is_empty() || !conflicts.is_empty();
        let damaged = !found.iter().all(is_tear);
        files.push(Source { name, bytes, written, n_records, torn, damaged });
        troubles.append(&mut found);
        troubles.append(&mut conflicts);
    }
    Ok(journals)
}

/// Makes the journals hold these records and nothing else.
///
/// The new ones are in place before the old ones go: a record in two journals is one. Damaged
/// ones are put aside. Returns how many journals there were, and are.
pub(crate) fn write(
    root: &Path,
    journals: &Journals,
    kept: &[&Record],
    broom: &mut Broom<'_>,
) -> Result<(usize, usize), CacheError> {
    let folder = root.join("journal");
    let mut weeks = BTreeMap::<u64, Vec<&Record>>::new();
    for record in kept {
        weeks.entry(journals.written[&record.key] / WEEK).or_default().push(record);
    }
    let mut stays = BTreeSet::new();
    let mut after = 0;
    for (week, records) in weeks {
        after += 1;
        let sources = journals.files.iter().filter(|source| source.written / WEEK == week);
        let sources: Vec<_> = sources.collect();
        if let [only] = sources[..]
            && !only.torn
            && only.n_records == records.len()
        {
            stays.insert(&only.name);
            continue;
        }
        let last = sources.iter().map(|source| source.written).max();
        let last = last.expect("a record comes from a journal");
        let path = folder.join(format!("{}.log", durable::unique_name()));
        broom.publish(&path, &journal_of(records.iter().copied())?, last)?;
    }
    for source in &journals.files {
        let path = folder.join(&source.name);
        if source.damaged {
            broom.put_aside(&path)?;
        } else if !stays.contains(&source.name) {
            broom.remove(&path, source.bytes)?;
        }
    }
    broom.sync(&folder)?;
    Ok((journals.files.len(), after))
}
