//! Making anew what can be lost, from what can't.

use std::io;
use std::path::Path;

use crate::broom::Broom;
use crate::cache::prepare;
use crate::error::At as _;
use crate::hints::{self, Hints};
use crate::{CacheError, Disk, Record, Trouble, in_use, merge};

/// What was made anew.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Rebuilt {
    /// The records that there are.
    pub records: usize,
    /// How many journals they lay in, and lie in now.
    pub journals: (usize, usize),
    /// Operations whose durations are known now.
    pub ops: usize,
    /// What was found damaged: journals are put aside, and whole records saved.
    pub troubles: Vec<Trouble>,
}

/// Merges the journals without what is torn or damaged in them, and takes the durations from
/// the records.
///
/// # Errors
/// [`CacheError::Busy`] if the store is open anywhere; otherwise, if the disk fails.
pub fn rebuild(root: &Path) -> Result<Rebuilt, CacheError> {
    let _in_use = in_use::alone(prepare(&Disk::default(), root)?, root)?;
    let mut rebuilt = Rebuilt::default();
    let journals = merge::read(root, &mut rebuilt.troubles)?;
    let records: Vec<&Record> = journals.records.values().flatten().collect();
    rebuilt.records = records.len();
    rebuilt.journals = merge::write(root, &journals, &records, &mut Broom::new(root, false))?;
    match Disk::default().remove_folder(&root.join(hints::FOLDER)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        removed => removed.at(root)?,
    }
    let mut durations = Hints::default();
    durations.guess_millis(records.iter().map(|r| (r.provenance.op.as_str(), r.provenance.millis)));
    rebuilt.ops = durations.save_all();
    hints::save(&mut durations, root, &Disk::default(), &mut rebuilt.troubles);
    Ok(rebuilt)
}
