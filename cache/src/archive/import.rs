//! Reading an archive that may be of anyone.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use sha2::{Digest as _, Sha256};
use tar::Entry;

use super::{ArchiveError, END, FORMAT, HEAD, JOURNAL, OBJECTS};
use crate::error::At as _;
use crate::journal::{journal_of, whole};
use crate::{Cache, CacheError, Digest, Disk, Output, Record, durable};

/// How large an archive may be.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// How many files it may hold.
    pub entries: usize,
    /// How many bytes one file may have.
    pub entry: u64,
    /// How many bytes all may have.
    pub total: u64,
    /// How many times as many bytes as the archive has itself all may have, beyond `free`.
    pub ratio: u64,
    /// So many bytes are not too many for an archive of any size.
    pub free: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { entries: 4_000_000, entry: 16 << 30, total: 1 << 40, ratio: 1000, free: 256 << 20 }
    }
}

/// What was taken in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Imported {
    /// Records in the archive.
    pub records: usize,
    /// How many of these were not known.
    pub new_records: usize,
    /// Objects in the archive.
    pub objects: usize,
    /// The bytes of these.
    pub bytes: u64,
}

/// Takes the records and objects of an archive into a store, which may be in use.
///
/// All is read and checked, and lies in a folder of its own, before anything is published; the
/// records come last and at once.
///
/// # Errors
/// [`ArchiveError::Refused`] with the store as before; otherwise, if the disk fails.
pub fn import(
    cache: &mut Cache,
    archive: impl Read,
    limits: &Limits,
) -> Result<Imported, ArchiveError> {
    let staged = Staged::in_folder(&cache.root, cache.disk.clone())?;
    let (records, objects) = unpack(archive, limits, &staged)?;
    let mut imported =
        Imported { records: records.len(), objects: objects.len(), ..Imported::default() };
    cache.refresh()?;
    let mut new = Vec::new();
    for record in &records {
        match cache.knows(record) {
            Ok(true) => {}
            Ok(false) => new.push(record),
            Err(conflict) => return Err(refused(conflict.to_string())),
        }
    }
    imported.new_records = new.len();
    for (digest, bytes) in objects {
        imported.bytes += bytes;
        staged.publish(&cache.root, &digest)?;
    }
    if !new.is_empty() {
        let name = durable::unique_name();
        let path = cache.root.join("journal").join(format!("{name}.log"));
        let journal = journal_of(new.into_iter())?;
        durable::publish(&cache.disk, &cache.root.join("tmp").join(name), &path, &journal)?;
    }
    cache.refresh()?;
    Ok(imported)
}

fn refused(why: impl Into<String>) -> ArchiveError {
    ArchiveError::Refused(why.into())
}

/// What cannot be read is not what was written.
fn unread(error: &io::Error) -> ArchiveError {
    refused(format!("it does not read: {error}"))
}

/// A folder for what is not published yet; it goes with this.
struct Staged {
    folder: PathBuf,
    disk: Disk,
}

impl Staged {
    fn in_folder(root: &Path, disk: Disk) -> Result<Self, CacheError> {
        let folder = root.join("tmp").join(durable::unique_name());
        disk.create_folder(&folder).at(&folder)?;
        Ok(Self { folder, disk })
    }

    /// Writes an object where nobody looks, if its bytes are what its name says.
    fn stage(&self, entry: &mut impl Read, digest: &Digest) -> Result<(), ArchiveError> {
        let path = self.folder.join(digest.to_string());
        let mut file = self.disk.create(&path).at(&path)?;
        let (mut hash, mut buffer) = (Sha256::new(), vec![0; 1 << 16]);
        loop {
            let n = entry.read(&mut buffer).map_err(|error| unread(&error))?;
            if n == 0 {
                break;
            }
            hash.update(&buffer[..n]);
            self.disk.append(&mut file, &path, &buffer[..n]).at(&path)?;
        }
        let found = Digest(hash.finalize().into());
        if found != *digest {
            return Err(refused(format!("the object {digest} has the digest {found}")));
        }
        self.disk.protect(&file, &path).at(&path)?;
        Ok(self.disk.sync(&file, &path).at(&path)?)
    }

    /// Moves a checked object to its place; one that is there gives way to equal bytes.
    fn publish(&self, root: &Path, digest: &Digest) -> Result<(), CacheError> {
        let hex = digest.to_string();
        let shelf = root.join("objects").join(&hex[..2]);
        self.disk.create_folder(&shelf).at(&shelf)?;
        let path = shelf.join(&hex);
        self.disk.rename(&self.folder.join(&hex), &path).at(&path)?;
        self.disk.sync_folder(&shelf).at(&shelf)
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        // What stays is swept with the rest of `tmp`.
        self.disk.remove_folder(&self.folder).ok();
    }
}

type Unpacked = (Vec<Record>, BTreeMap<Digest, u64>);

/// The records of an archive, and the sizes of its objects, which are staged then.
fn unpack(archive: impl Read, limits: &Limits, staged: &Staged) -> Result<Unpacked, ArchiveError> {
    let read = Rc::new(Cell::new(0));
    let packed = Counted { inner: archive, n: Rc::clone(&read) };
    let plain = zstd::Decoder::new(packed).map_err(|error| unread(&error))?.single_frame();
    let mut plain = Guarded { inner: plain, n: 0, read, limits };
    let mut tar = tar::Archive::new(&mut plain);
    // Raw: what other programs understand beyond plain files is refused, not followed.
    let mut entries = tar.entries().map_err(|error| unread(&error))?.raw(true);
    let mut n_entries = 0_usize;
    let mut next = || {
        n_entries += 1;
        if n_entries > limits.entries {
            return Err(refused(format!("it holds more than {} files", limits.entries)));
        }
        let entry = entries.next().ok_or_else(|| refused("it was cut off"))?;
        let entry = entry.map_err(|error| unread(&error))?;
        let name = plain_name(&entry)?;
        if entry.size() > limits.entry {
            return Err(refused(format!("`{name}` has more than {} bytes", limits.entry)));
        }
        Ok((name, entry))
    };

    let (name, mut entry) = next()?;
    if name != HEAD || content(&mut entry)? != FORMAT.as_bytes() {
        return Err(refused(format!("it does not begin as {:?} does", FORMAT.trim_end())));
    }
    let (name, mut entry) = next()?;
    if name != JOURNAL {
        return Err(unexpected(&name));
    }
    let records = whole(&content(&mut entry)?);
    let records = records.ok_or_else(|| refused("a record in it is damaged"))?;
    let wanted = objects_of(&records)?;
    let mut objects: BTreeMap<Digest, u64> = BTreeMap::new();
    loop {
        let (name, mut entry) = next()?;
        if name == END && entry.size() == 0 {
            break;
        }
        let digest = name.strip_prefix(OBJECTS).and_then(|hex| hex.parse::<Digest>().ok());
        let Some((digest, size)) = digest.and_then(|d| Some((d, *wanted.get(&d)?))) else {
            return Err(unexpected(&name));
        };
        if objects.last_key_value().is_some_and(|(last, _)| *last >= digest) {
            return Err(refused(format!("`{name}` is there twice, or out of order")));
        }
        if entry.size() != size {
            return Err(refused(format!("`{name}` has {} bytes, not {size}", entry.size())));
        }
        staged.stage(&mut entry, &digest)?;
        objects.insert(digest, size);
    }
    ended(plain)?;
    Ok((records, objects))
}

/// The name of an entry that is a plain file, as we write them.
fn plain_name(entry: &Entry<'_, impl Read>) -> Result<String, ArchiveError> {
    let header = entry.header();
    let name = String::from_utf8_lossy(&header.path_bytes()).escape_debug().to_string();
    let is_linked = header.as_old().linkname.iter().any(|byte| *byte != 0);
    if header.as_ustar().is_none() || header.as_old().linkflag != *b"0" || is_linked {
        return Err(refused(format!("`{name}` is no plain file")));
    }
    Ok(name)
}

fn unexpected(name: &str) -> ArchiveError {
    refused(format!("`{name}` does not belong there"))
}

/// All of an entry.
fn content(entry: &mut impl Read) -> Result<Vec<u8>, ArchiveError> {
    let mut bytes = Vec::new();
    entry.read_to_end(&mut bytes).map_err(|error| unread(&error))?;
    Ok(bytes)
}

/// The objects that records name, with their sizes.
fn objects_of(records: &[Record]) -> Result<BTreeMap<Digest, u64>, ArchiveError> {
    let mut keys = BTreeSet::new();
    let mut objects = BTreeMap::new();
    for record in records {
        let node = record.provenance.node.escape_debug();
        if !keys.insert((record.key, &record.platform)) {
            return Err(refused(format!("the record of `{node}` is there twice")));
        }
        let Output { digest, size, inline: None } = &record.output else { continue };
        if objects.entry(*digest).or_insert(*size) != size {
            return Err(refused(format!("the record of `{node}` has another size of its object")));
        }
    }
    Ok(objects)
}

/// Checks that nothing follows the last entry but the zeros that end an archive.
fn ended<R: Read>(mut plain: Guarded<'_, R>) -> Result<(), ArchiveError> {
    let more = || refused("something follows its end");
    let mut rest = [0; 1 << 12];
    loop {
        let n = plain.read(&mut rest).map_err(|error| unread(&error))?;
        if n == 0 {
            break;
        }
        if rest[..n].iter().any(|byte| *byte != 0) {
            return Err(more());
        }
    }
    let n = plain.inner.finish().read(&mut rest).map_err(|error| unread(&error))?;
    if n == 0 { Ok(()) } else { Err(more()) }
}

/// Counts the bytes of an archive as they are read.
struct Counted<R> {
    inner: R,
    n: Rc<Cell<u64>>,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        self.n.set(self.n.get() + n as u64);
        Ok(n)
    }
}

/// What an archive unfolds to, as long as that is not too much.
struct Guarded<'a, R: Read> {
    inner: zstd::Decoder<'static, BufReader<Counted<R>>>,
    n: u64,
    /// How much of the archive was read for it.
    read: Rc<Cell<u64>>,
    limits: &'a Limits,
}

impl<R: Read> Read for Guarded<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        self.n += n as u64;
        let Limits { total, ratio, free, .. } = self.limits;
        let fair = self.read.get().saturating_mul(*ratio).saturating_add(*free);
        if self.n > fair.min(*total) {
            let why = format!("it unfolds to more than {} bytes", fair.min(*total));
            return Err(io::Error::other(why));
        }
        Ok(n)
    }
}
