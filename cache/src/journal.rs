//! Journals: files of action records, one a process, only ever appended to by their owner.

use std::fs::{File, TryLockError};
use std::io::{self, BufReader, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use crate::error::At as _;
use crate::record::{decode, encode};
use crate::{CacheError, Digest, Disk, Record, Trouble, durable};

pub(crate) const MAGIC: &[u8; 14] = b"ivx journal 1\n";
const LEN: usize = 4;
const HEADER: usize = LEN + 8;
const PAYLOAD_MAX: usize = 64 << 20;

/// The journal of this process, locked so that readers know that it may grow.
#[derive(Debug)]
pub(crate) struct Journal {
    path: PathBuf,
    disk: Disk,
    file: File,
    /// Where the last whole frame ends.
    len: u64,
    unsynced: bool,
    /// Whether half a frame stays at the end: what came after it would not be read.
    torn: bool,
}

impl Journal {
    /// A new, empty journal in `folder`.
    pub(crate) fn create(disk: &Disk, folder: &Path) -> Result<Self, CacheError> {
        let path = folder.join(format!("{}.log", durable::unique_name()));
        let file = disk.create(&path).at(&path)?;
        file.lock().at(&path)?;
        let disk = disk.clone();
        let mut journal = Self { path, disk, file, len: 0, unsynced: true, torn: false };
        if let Err(error) = journal.write(MAGIC) {
            // The first error is the one to tell; an empty journal is harmless.
            journal.disk.remove(&journal.path).ok();
            return Err(error);
        }
        journal.disk.sync_folder(folder).at(folder)?;
        Ok(journal)
    }

    /// Adds a record; from here on it outlives the process, and after [`Self::sync`] the machine.
    pub(crate) fn append(&mut self, record: &Record) -> Result<(), CacheError> {
        let frame = frame(record)?;
        self.write(&frame)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), CacheError> {
        self.unsynced = true;
        let written = self.disk.append(&mut self.file, &self.path, bytes);
        match written {
            Ok(()) => self.len += bytes.len() as u64,
            Err(_) => {
                self.torn = self.disk.truncate(&self.file, &self.path, self.len).is_err();
            }
        }
        written.at(&self.path)
    }

    pub(crate) fn sync(&mut self) -> Result<(), CacheError> {
        if self.unsynced {
            self.disk.sync(&self.file, &self.path).at(&self.path)?;
            self.unsynced = false;
        }
        Ok(())
    }

    /// Whether what is appended will be read.
    pub(crate) fn is_whole(&self) -> bool {
        !self.torn
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }
}

/// The bytes of a journal of these records.
pub(crate) fn journal_of<'a>(
    records: impl Iterator<Item = &'a Record>,
) -> Result<Vec<u8>, CacheError> {
    let mut bytes = MAGIC.to_vec();
    for record in records {
        bytes.extend(frame(record)?);
    }
    Ok(bytes)
}

/// Length of the payload, checksum, payload.
fn frame(record: &Record) -> Result<Vec<u8>, CacheError> {
    let payload = encode(record);
    if payload.len() > PAYLOAD_MAX {
        let node = record.provenance.node.clone();
        return Err(CacheError::TooLong { node, bytes: payload.len(), max: PAYLOAD_MAX });
    }
    let len = u32::try_from(payload.len()).expect("the most is below 4 GiB").to_le_bytes();
    let mut frame = Vec::with_capacity(HEADER + payload.len());
    frame.extend(len);
    frame.extend([0; HEADER - LEN]);
    frame.extend(payload);
    let checksum = checksum(&mut frame);
    frame[LEN..HEADER].copy_from_slice(&checksum);
    Ok(frame)
}

/// How many bytes a record takes in a journal.
pub(crate) fn frame_len(record: &Record) -> u64 {
    (HEADER + encode(record).len()) as u64
}

/// The first 8 bytes of the SHA-256 of a frame whose checksum is zeroed, which this does.
fn checksum(frame: &mut [u8]) -> [u8; 8] {
    frame[LEN..HEADER].fill(0);
    *Digest::of(frame).0.first_chunk().expect("a digest has 32 bytes")
}

/// The records of a journal's bytes; `None` if anything in it is damaged or missing.
pub(crate) fn whole(bytes: &[u8]) -> Option<Vec<Record>> {
    let mut rest = bytes.strip_prefix(MAGIC)?;
    let mut records = Vec::new();
    while !rest.is_empty() {
        let n_payload = u32::from_le_bytes(*rest.first_chunk()?) as usize;
        let mut frame = rest.split_off(..n_payload.checked_add(HEADER)?)?.to_vec();
        let expected = frame.get(LEN..HEADER)?.to_vec();
        let is_whole = n_payload <= PAYLOAD_MAX && checksum(&mut frame) == *expected;
        records.push(is_whole.then(|| decode(&frame[HEADER..])).flatten()?);
    }
    Some(records)
}

/// How far a journal was read.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seen {
    offset: u64,
    /// Nothing more will come: its owner is gone, or it makes no sense from here on.
    ended: bool,
}

impl Seen {
    /// A journal to read nothing from: one's own.
    pub(crate) const END: Self = Self { offset: 0, ended: true };
}

/// Gives `take` the records that a journal has beyond `seen`.
pub(crate) fn read(
    path: &Path,
    seen: &mut Seen,
    troubles: &mut Vec<Trouble>,
    mut take: impl FnMut(Record),
) -> Result<(), CacheError> {
    if seen.ended {
        return Ok(());
    }
    let mut file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(source) => {
            return Err(CacheError::Io { path: path.to_owned(), source });
        }
    };
    // The owner locks the journal before the first byte; without one, it may yet do so.
    if file.metadata().at(path)?.len() == 0 {
        return Ok(());
    }
    // Asked before the length: if the owner is gone by now, the length is final.
    seen.ended = owner_is_gone(&file);
    let len = file.metadata().at(path)?.len();
    if len <= seen.offset {
        return Ok(());
    }
    file.seek(SeekFrom::Start(seen.offset)).at(path)?;
    let mut file = BufReader::with_capacity(1 << 16, file);
    let mut frame = Vec::new();
    if seen.offset == 0 && len >= MAGIC.len() as u64 {
        frame.resize(MAGIC.len(), 0);
        file.read_exact(&mut frame).at(path)?;
        if frame != MAGIC {
            seen.ended = true;
            troubles.push(Trouble::DamagedJournal { path: path.to_owned(), offset: 0 });
            return Ok(());
        }
        seen.offset = MAGIC.len() as u64;
    }
    while len - seen.offset >= HEADER as u64 {
        frame.resize(HEADER, 0);
        file.read_exact(&mut frame).at(path)?;
        let n_payload = frame.first_chunk().map(|len| u32::from_le_bytes(*len));
        let n_payload = n_payload.expect("a header holds a length") as usize;
        if n_payload == 0 || n_payload > PAYLOAD_MAX {
            seen.ended = true;
            troubles.push(Trouble::DamagedJournal { path: path.to_owned(), offset: seen.offset });
            return Ok(());
        }
        let n_frame = HEADER + n_payload;
        if n_frame as u64 > len - seen.offset {
            break;
        }
        frame.resize(n_frame, 0);
        file.read_exact(&mut frame[HEADER..]).at(path)?;
        let expected = frame[LEN..HEADER].to_vec();
        match (checksum(&mut frame) == *expected).then(|| decode(&frame[HEADER..])).flatten() {
            Some(record) => take(record),
            None => {
                troubles
                    .push(Trouble::DamagedRecord { path: path.to_owned(), offset: seen.offset });
            }
        }
        seen.offset += n_frame as u64;
    }
    // A living owner may be about to write the rest.
    if seen.ended && seen.offset < len {
        let bytes = len - seen.offset;
        troubles.push(Trouble::TornJournal { path: path.to_owned(), bytes });
    }
    Ok(())
}

/// Whether nobody holds the lock of the journal; unknown counts as held.
fn owner_is_gone(file: &File) -> bool {
    match file.try_lock_shared() {
        Ok(()) => true,
        Err(TryLockError::WouldBlock | TryLockError::Error(_)) => false,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::{Output, Provenance};

    fn record(n: u8) -> Record {
        let bytes = vec![n; usize::from(n)];
        Record {
            key: Digest([n; 32]),
            platform: "here".into(),
            output: Output {
                digest: Digest::of(&bytes),
                size: u64::from(n),
                inline: Some(bytes.into()),
            },
            provenance: Provenance {
                op: "f@1".into(),
                node: format!("e/f[{n}]"),
                inputs: vec![],
                explanation: "op f@1".into(),
                library: "l".into(),
                millis: 1,
            },
        }
    }

    fn read_all(bytes: &[u8]) -> (Vec<Record>, Vec<Trouble>) {
        let file = tempfile::NamedTempFile::new().unwrap();
        fs::write(&file, bytes).unwrap();
        let (mut records, mut troubles) = (vec![], vec![]);
        read(file.path(), &mut Seen::default(), &mut troubles, |r| {
            records.push(r);
        })
        .unwrap();
        (records, troubles)
    }

    #[test]
    fn what_was_appended_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::create(&Disk::default(), folder.path()).unwrap();
        let (mut seen, mut records, mut troubles) = (Seen::default(), vec![], vec![]);
        for n in 1..4 {
            journal.append(&record(n)).unwrap();
            read(journal.path(), &mut seen, &mut troubles, |r| {
                records.push(r);
            })
            .unwrap();
            assert_eq!(records.last(), Some(&record(n)));
        }
        assert_eq!((records.len(), troubles), (3, vec![]));
        let bytes = journal_of(records.iter()).unwrap();
        assert_eq!(fs::read(journal.path()).unwrap(), bytes);
    }

    #[test]
    fn a_journal_cut_anywhere_gives_the_whole_records_before_the_cut() {
        let records = [record(1), record(2), record(3)];
        let ends: Vec<_> =
            (0..=3).map(|n| journal_of(records[..n].iter()).unwrap().len()).collect();
        let bytes = journal_of(records.iter()).unwrap();
        for len in 0..=bytes.len() {
            let n_whole = ends.iter().filter(|end| **end <= len).count().saturating_sub(1);
            let (found, troubles) = read_all(&bytes[..len]);
            assert_eq!(found, records[..n_whole], "cut at {len}");
            assert_eq!(whole(&bytes[..len]).is_some(), ends.contains(&len), "cut at {len}");
            let is_clean = len == 0 || ends.contains(&len);
            assert_eq!(troubles.is_empty(), is_clean, "cut at {len}: {troubles:?}");
        }
    }

    #[test]
    fn every_flipped_bit_costs_records_but_never_changes_one() {
        let records = [record(1), record(2), record(3)];
        let bytes = journal_of(records.iter()).unwrap();
        assert_eq!(whole(&bytes).unwrap(), records);
        for bit in 0..bytes.len() * 8 {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let (found, troubles) = read_all(&damaged);
            assert!(found.len() < 3 && !troubles.is_empty(), "bit {bit}");
            assert!(found.iter().all(|record| records.contains(record)), "bit {bit}");
            assert_eq!(whole(&damaged), None, "bit {bit}");
        }
    }

    #[test]
    fn a_damaged_record_costs_only_itself() {
        let mut bytes = journal_of([record(1), record(2)].iter()).unwrap();
        bytes[MAGIC.len() + HEADER + 5] ^= 1;
        let (found, troubles) = read_all(&bytes);
        assert_eq!(found, [record(2)]);
        assert!(matches!(troubles[..], [Trouble::DamagedRecord { offset: 14, .. }]));
    }

    #[test]
    fn the_tail_of_a_living_owner_is_awaited_and_read_when_whole() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::create(&Disk::default(), folder.path()).unwrap();
        let frame = frame(&record(7)).unwrap();
        let (mut seen, mut records, mut troubles) = (Seen::default(), vec![], vec![]);
        for half in frame.chunks(20) {
            journal.write(half).unwrap();
            read(journal.path(), &mut seen, &mut troubles, |r| {
                records.push(r);
            })
            .unwrap();
        }
        assert_eq!((records, troubles), (vec![record(7)], vec![]));
    }

    #[test]
    fn a_journal_not_begun_is_looked_at_again() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let (mut seen, mut records, mut troubles) = (Seen::default(), vec![], vec![]);
        for bytes in [vec![], journal_of([record(1)].iter()).unwrap()] {
            fs::write(&file, bytes).unwrap();
            read(file.path(), &mut seen, &mut troubles, |r| records.push(r)).unwrap();
        }
        assert_eq!((records, troubles), (vec![record(1)], vec![]));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error_with_the_path() {
        let path = PathBuf::from("/dev/full");
        let file = File::options().append(true).open(&path).unwrap();
        let mut journal = Journal {
            path: path.clone(),
            disk: Disk::default(),
            file,
            len: 0,
            unsynced: false,
            torn: false,
        };
        let error = journal.append(&record(1)).unwrap_err();
        assert!(matches!(error, CacheError::Full { path: at, source }
            if at == path && source.kind() == io::ErrorKind::StorageFull));
        assert!(!journal.is_whole(), "a device can't be cut, so what follows would be lost");
    }
}
