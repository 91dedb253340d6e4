//! What a second store says, believed as far as it can be checked.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::at_once::at_once;
use crate::journal::{journal_of, whole};
use crate::{Digest, INLINE_MAX, Output, Record, Store, StoreError, Trouble};

const RECORDS: &str = "records";
/// The most bytes of one record.
const RECORD_MAX: u64 = 4 << 20;
/// The most bytes of one object.
const OBJECT_MAX: u64 = 1 << 30;
/// The most records of a store.
const N_RECORDS_MAX: usize = 1_000_000;
/// Objects of more bytes go one at a time, so that many at once do not take all of the memory.
const LARGE: u64 = 16 << 20;
/// So many refusals are told one by one.
const N_NOTES: usize = 8;

/// Whether results are put into a second store, or only taken from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Nothing is written there.
    Read,
    /// New results are put there, too.
    Write,
}

/// A second store, checked. It never fails a run: what is wrong is noted, and gone without.
#[derive(Debug)]
pub struct Second {
    store: Box<dyn Store>,
    /// What it is called, for people.
    name: String,
    mode: Mode,
    /// The platforms of which it had records when it was opened, by key.
    listed: BTreeMap<Digest, Vec<String>>,
    state: Mutex<State>,
    large: Mutex<()>,
}

#[derive(Debug, Default)]
struct State {
    reads_ended: bool,
    writes_ended: bool,
    /// Names under which something was wrong, to be written anew.
    refused: BTreeSet<String>,
    /// Objects that were seen there, in the size that was asked for.
    there: BTreeSet<(Digest, u64)>,
    n_notes: usize,
    notes: Vec<Trouble>,
    traffic: Traffic,
}

/// What went between a cache and its second store.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Records that were taken.
    pub taken: usize,
    /// Objects that were copied from there.
    pub copied: usize,
    /// Records that were put there.
    pub put: usize,
}

impl Second {
    /// A store of which nothing is known but by name: for who needs only a few results.
    ///
    /// - `name`: what to call it in notes.
    #[must_use]
    pub fn unlisted(store: Box<dyn Store>, name: String, mode: Mode) -> Self {
        let (listed, state, large) = (BTreeMap::new(), Mutex::default(), Mutex::default());
        Self { store, name, mode, listed, state, large }
    }

    /// A store, to read or also to write.
    ///
    /// - `name`: what to call it in notes.
    ///
    /// # Errors
    /// If it can't say what it has.
    pub fn new(store: Box<dyn Store>, name: String, mode: Mode) -> Result<Self, StoreError> {
        let mut second = Self::unlisted(store, name, mode);
        let mut refused = |error: StoreError| second.note(&error);
        let names = second.store.shelves(RECORDS, N_RECORDS_MAX, &mut refused)?;
        for (key, platform) in names.iter().filter_map(|name| key_and_platform(name)) {
            second.listed.entry(key).or_default().push(platform);
        }
        Ok(second)
    }

    /// Of how many keys it has results.
    #[must_use]
    pub fn n_keys(&self) -> usize {
        self.listed.len()
    }

    /// What went on so far.
    #[must_use]
    pub fn traffic(&self) -> Traffic {
        self.state().traffic
    }

    /// Whether it had a record of a key when it was opened.
    pub(crate) fn lists(&self, key: &Digest) -> bool {
        self.listed.contains_key(key)
    }

    /// Whether it had a record of a key on a platform when it was opened.
    pub(crate) fn lists_on(&self, key: &Digest, platform: &str) -> bool {
        let mut listed = self.listed.get(key).into_iter().flatten();
        listed.any(|listed| listed == platform)
    }

    pub(crate) fn mode(&self) -> Mode {
        self.mode
    }

    /// How many threads may as well ask at once.
    pub(crate) fn n_at_once(&self) -> usize {
        self.store.n_at_once()
    }

    /// The records of keys, as far as it has them, asked for at once: see [`Self::record`].
    pub(crate) fn records(
        &self,
        keys: &[Digest],
        platform: &str,
        has: impl Fn(&Output) -> bool + Sync,
    ) -> Vec<Record> {
        let record = |key: &Digest| self.record(key, platform, &has);
        at_once(self.n_at_once(), keys, record).into_iter().flatten().collect()
    }

    /// The record of a key: of this platform, else of the platform whose name comes first.
    ///
    /// - `has`: whether the bytes of an output are in the cache.
    fn record(
        &self,
        key: &Digest,
        platform: &str,
        has: impl Fn(&Output) -> bool,
    ) -> Option<Record> {
        let listed = self.listed.get(key)?;
        let own = listed.iter().filter(|listed| *listed == platform);
        let others = listed.iter().filter(|listed| *listed != platform);
        let record = own.chain(others).find_map(|platform| {
            let record = self.record_of(key, platform)?;
            // One whose bytes are nowhere would only run later.
            (has(&record.output) || self.has(&record.output)).then_some(record)
        })?;
        self.state().traffic.taken += 1;
        Some(record)
    }

    /// What lies there now of a key on a platform, whatever was listed.
    pub(crate) fn fetch(&self, key: &Digest, platform: &str) -> Option<Record> {
        // What was wrong with it may have been mended.
        self.state().refused.remove(&record_name(key, platform)?);
        let record = self.record_of(key, platform)?;
        self.state().traffic.taken += 1;
        Some(record)
    }

    fn record_of(&self, key: &Digest, platform: &str) -> Option<Record> {
        let name = record_name(key, platform)?;
        self.read(&name, || {
            let Some(bytes) = self.store.get(&name, RECORD_MAX)? else { return Ok(None) };
            let records = whole(&bytes).and_then(|records| <[Record; 1]>::try_from(records).ok());
            let [record] = records.ok_or_else(|| refused(&name, "damaged"))?;
            match wrong(&record, key, platform) {
                Some(why) => Err(refused(&name, why)),
                None => Ok(Some(record)),
            }
        })
    }

    /// Whether the bytes of an output are there, as far as their number tells.
    pub fn has(&self, output: &Output) -> bool {
        let object = (output.digest, output.size);
        if self.state().there.contains(&object) {
            return true;
        }
        let name = object_name(&output.digest);
        let there = self.read(&name, || match self.store.size(&name)? {
            Some(size) if size != output.size => {
                Err(refused(&name, format!("{size} bytes in place of {}", output.size)))
            }
            size => Ok(size),
        });
        if there.is_some() {
            self.state().there.insert(object);
        }
        there.is_some()
    }

    /// The bytes of an output, which have its digest.
    pub(crate) fn object(&self, output: &Output) -> Option<Vec<u8>> {
        let name = object_name(&output.digest);
        let _alone = self.alone(output);
        let bytes = self.read(&name, || {
            let max = output.size.min(OBJECT_MAX);
            let Some(bytes) = self.store.get(&name, max)? else { return Ok(None) };
            if Digest::of(&bytes) != output.digest {
                return Err(refused(&name, "bytes of another digest"));
            }
            Ok(Some(bytes))
        });
        let mut state = self.state();
        if bytes.is_some() {
            state.traffic.copied += 1;
        } else {
            state.there.remove(&(output.digest, output.size));
        }
        bytes
    }

    /// Held by who has an object in memory that is large, as only one may at a time.
    pub(crate) fn alone(&self, output: &Output) -> Option<MutexGuard<'_, ()>> {
        let alone = || self.large.lock().unwrap_or_else(PoisonError::into_inner);
        (output.size > LARGE).then(alone)
    }

    /// The bytes under a name, which nothing here vouches for.
    pub(crate) fn get(&self, name: &str, max: u64) -> Option<Vec<u8>> {
        self.read(name, || self.store.get(name, max))
    }

    /// Puts bytes under a name, in the place of what was there; whether it could.
    pub(crate) fn put(&self, name: &str, bytes: &[u8]) -> bool {
        self.write(name, bytes, |_| false)
    }

    /// Puts an object there, if it is written to and has none.
    pub fn put_object(&self, digest: &Digest, bytes: &[u8]) {
        let name = object_name(digest);
        self.write(&name, bytes, |size| size == bytes.len() as u64);
    }

    /// Puts a record there, if it is written to and has none; its object comes first.
    pub(crate) fn put_record(&self, record: &Record) {
        let Some(name) = record_name(&record.key, &record.platform) else { return };
        // What would be refused is not put there.
        let Ok(bytes) = journal_of([record].into_iter()) else { return };
        if wrong(record, &record.key, &record.platform).is_none()
            && bytes.len() as u64 <= RECORD_MAX
            && self.write(&name, &bytes, |_| true)
        {
            self.state().traffic.put += 1;
        }
    }

    /// Takes nothing more from the store, which said what turned out to be wrong.
    pub(crate) fn distrust(&self, record: &Record) {
        let mut state = self.state();
        (state.reads_ended, state.writes_ended) = (true, true);
        let (key, node) = (record.key, &record.provenance.node);
        let what = format!("`{node}` (key {key}) gives something else here than it has on record");
        state.notes.push(self.trouble(&format!("{what}: nothing that it says is used")));
    }

    /// What was refused, and why, since the last call.
    pub(crate) fn notes(&self) -> Vec<Trouble> {
        let mut state = self.state();
        let mut notes = std::mem::take(&mut state.notes);
        let more = std::mem::take(&mut state.n_notes).saturating_sub(N_NOTES);
        if more > 0 {
            notes.push(self.trouble(&format!("{more} more are refused")));
        }
        notes
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn trouble(&self, what: &str) -> Trouble {
        Trouble::Store { store: self.name.clone(), what: what.to_owned() }
    }

    fn read<T>(
        &self,
        name: &str,
        read: impl FnOnce() -> Result<Option<T>, StoreError>,
    ) -> Option<T> {
        let state = self.state();
        // What was wrong once is not asked for twice.
        if state.reads_ended || state.refused.contains(name) {
            return None;
        }
        drop(state);
        read().unwrap_or_else(|error| {
            self.note(&error);
            None
        })
    }

    /// Whether the bytes were put under the name.
    ///
    /// - `holds`: whether so many bytes are what is to lie there.
    fn write(&self, name: &str, bytes: &[u8], holds: impl FnOnce(u64) -> bool) -> bool {
        let writes = self.mode == Mode::Write && !self.state().writes_ended;
        if !writes || bytes.len() as u64 > OBJECT_MAX {
            return false;
        }
        let anew = self.state().refused.remove(name);
        let put = || {
            if !anew {
                if self.store.add(name, bytes)? {
                    return Ok(true);
                }
                if self.store.size(name)?.is_some_and(holds) {
                    return Ok(false);
                }
            }
            self.store.put(name, bytes).map(|()| true)
        };
        put().unwrap_or_else(|error| {
            // A record whose object is missing would be of no use.
            let mut state = self.state();
            state.refused.insert(name.to_owned());
            if !std::mem::replace(&mut state.writes_ended, true) {
                state.notes.push(self.trouble(&format!("{error}: nothing more is written there")));
            }
            false
        })
    }

    fn note(&self, error: &StoreError) {
        let mut state = self.state();
        match error {
            StoreError::Refused { name, .. } => {
                state.refused.insert(name.clone());
                state.n_notes += 1;
                if state.n_notes <= N_NOTES {
                    state.notes.push(self.trouble(&error.to_string()));
                }
            }
            StoreError::Failed { .. } => {
                // Of many that asked at once, one tells.
                if !std::mem::replace(&mut state.reads_ended, true) {
                    state.notes.push(self.trouble(&format!("{error}: nothing more is read there")));
                }
            }
        }
    }
}

fn refused(name: &str, why: impl Into<String>) -> StoreError {
    StoreError::refused(name, why)
}

/// What keeps a record from being used as that of a key on a platform, if anything.
fn wrong(record: &Record, key: &Digest, platform: &str) -> Option<&'static str> {
    let inline = record.output.inline.as_ref().map_or(0, |bytes| bytes.len());
    if record.key != *key {
        return Some("the record of another key");
    }
    if record.platform != platform {
        return Some("the record of another platform");
    }
    if inline > INLINE_MAX {
        return Some("more bytes inside it than a record has");
    }
    if record.output.size > OBJECT_MAX {
        return Some("its object is too large");
    }
    let provenance = &record.provenance;
    let texts = [&provenance.op, &provenance.node, &provenance.library, &provenance.explanation];
    // They are shown to people, on terminals.
    let acts = |text: &&String| text.chars().any(|c| c.is_control() && c != '\n');
    texts.iter().any(acts).then_some("its texts have control characters")
}

fn object_name(digest: &Digest) -> String {
    let hex = digest.to_string();
    format!("objects/{}/{hex}", &hex[..2])
}

/// `None` if the platform can't be part of a name.
fn record_name(key: &Digest, platform: &str) -> Option<String> {
    let hex = key.to_string();
    is_plain(platform).then(|| format!("records/{}/{hex}-{platform}", &hex[..2]))
}

/// What the name of a record after its shelf says; `None` if it is none.
fn key_and_platform(name: &str) -> Option<(Digest, String)> {
    let (shelf, name) = name.split_once('/')?;
    let (key, platform) = name.split_once('-')?;
    let is_ours = key.get(..2) == Some(shelf) && is_plain(platform);
    Some((key.parse().ok().filter(|_| is_ours)?, platform.to_owned()))
}

fn is_plain(platform: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '+' | '.');
    (1..=100).contains(&platform.len()) && platform.chars().all(plain)
}
