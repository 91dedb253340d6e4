//! Writing an archive.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

use tar::{Builder, EntryType, Header};

use super::{END, FORMAT, HEAD, JOURNAL, OBJECTS};
use crate::error::At as _;
use crate::journal::journal_of;
use crate::{Cache, CacheError, Digest, Fetched, Output, Record};

/// How hard it is pressed: more takes much longer and gains little on numbers.
const LEVEL: i32 = 3;

/// What an archive holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exported {
    /// Records.
    pub records: usize,
    /// Objects.
    pub objects: usize,
    /// The bytes of these.
    pub bytes: u64,
    /// Objects that records name and the store has not, or has damaged.
    pub missing: usize,
}

/// Writes the records that `keep` wants to an archive, and the objects that they name. Of the
/// same records and objects it has the same bytes.
///
/// - `path`: of the archive, for errors.
///
/// # Errors
/// If a disk fails.
pub fn export(
    cache: &Cache,
    keep: impl Fn(&Record) -> bool,
    archive: &mut dyn Write,
    path: &Path,
) -> Result<Exported, CacheError> {
    let records: Vec<&Record> = cache.records().filter(|record| keep(record)).collect();
    let journal = journal_of(records.iter().copied())?;
    let mut exported = Exported { records: records.len(), ..Exported::default() };
    let objects = records.iter().filter(|record| record.output.inline.is_none());
    let objects: BTreeMap<Digest, &Output> =
        objects.map(|record| (record.output.digest, &record.output)).collect();

    let mut press = zstd::Encoder::new(archive, LEVEL).at(path)?;
    press.include_checksum(true).at(path)?;
    let mut tar = Builder::new(press);
    add(&mut tar, HEAD, FORMAT.as_bytes()).at(path)?;
    add(&mut tar, JOURNAL, &journal).at(path)?;
    for (digest, output) in objects {
        let Fetched::Bytes(bytes) = cache.objects().read(output)? else {
            exported.missing += 1;
            continue;
        };
        add(&mut tar, &format!("{OBJECTS}{digest}"), &bytes).at(path)?;
        exported.objects += 1;
        exported.bytes += bytes.len() as u64;
    }
    add(&mut tar, END, &[]).at(path)?;
    let pressed = tar.into_inner().and_then(zstd::Encoder::finish);
    pressed.and_then(Write::flush).at(path)?;
    Ok(exported)
}

/// Adds a file without owner or time.
fn add(tar: &mut Builder<impl Write>, name: &str, bytes: &[u8]) -> io::Result<()> {
    let mut header = Header::new_ustar();
    header.set_entry_type(EntryType::Regular);
    header.set_path(name)?;
    header.set_mode(0o444);
    header.set_size(bytes.len() as u64);
    header.set_cksum();
    tar.append(&header, bytes)
}
