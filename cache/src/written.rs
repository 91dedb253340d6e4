//! When records were written, as far as the names of journals tell.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use crate::cache::names_if_any;
use crate::journal::{self, Seen};
use crate::{Cache, CacheError, Digest};

impl Cache {
    /// When the journal of each record was begun, by key and platform: by the process that made
    /// the record, or by a sweep. It reads all journals once more.
    ///
    /// # Errors
    /// If the disk fails.
    pub fn written(&self) -> Result<BTreeMap<(Digest, String), SystemTime>, CacheError> {
        let folder = self.root.join("journal");
        let mut all = BTreeMap::new();
        for name in names_if_any(&folder)? {
            let Some(begun) = begun(&name) else { continue };
            // Damage was told when the store was opened.
            journal::read(&folder.join(&name), &mut Seen::default(), &mut Vec::new(), |record| {
                // The first writer's record is the one that stays.
                all.entry((record.key, record.platform)).or_insert(begun);
            })?;
        }
        Ok(all)
    }
}

/// When a journal of this name was begun.
fn begun(name: &OsStr) -> Option<SystemTime> {
    let nanos = name.to_str()?.strip_suffix(".log")?.split('-').next()?;
    let nanos = u64::from_str_radix(nanos, 16).ok()?;
    UNIX_EPOCH.checked_add(Duration::from_nanos(nanos))
}
