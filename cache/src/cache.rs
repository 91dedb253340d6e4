//! The store of one project, as one process sees it.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use crate::actions::Actions;
use crate::error::At as _;
use crate::found::FOUND;
use crate::hints::{self, Hints};
use crate::in_use;
use crate::journal::{self, Journal, Seen};
use crate::writer::Writer;
use crate::{
    ActionLock, CacheError, Checkpoints, Conflict, Digest, Disk, Mode, Objects, Record, Second,
    Trouble, durable,
};

const VERSION: &str = "ivx cache 1\n";

/// The store of one project, open for one platform.
///
/// One thread looks up and commits; [`Objects`] are for the others. Dropping a cache without
/// [`Cache::close`] loses no record unless the machine stops, but the new hints.
#[derive(Debug)]
pub struct Cache {
    pub(crate) root: PathBuf,
    pub(crate) disk: Disk,
    platform: String,
    records: Records,
    /// What the second store said of keys that are not known here.
    borrowed: BTreeMap<Digest, Record>,
    seen: BTreeMap<OsString, Seen>,
    journal: Option<Journal>,
    pub(crate) objects: Objects,
    /// Puts what is committed into the second store, if that is written to.
    writer: Option<Writer>,
    /// What this process may execute, from the first time that it asks.
    actions: Option<Actions>,
    hints: Option<Hints>,
    pub(crate) troubles: Vec<Trouble>,
    // Held for its lock: shared by whoever uses the store, alone by whoever sweeps it. Who only
    // looks at a store without the file has none.
    _in_use: Option<File>,
}

/// Whether a commit added anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Committed {
    /// The record is new.
    New,
    /// The same result was known; the first record stays.
    Known,
    /// The record is new, and the second store had another result: nothing that it said is
    /// known any more, so that keys of what depends on it may be others.
    Against,
}

impl Cache {
    /// The store at `root`, made if it is not there, for results of `platform`.
    ///
    /// Waits while another process sweeps it. What is damaged is left out; [`Self::troubles`]
    /// tells.
    ///
    /// # Errors
    /// If the disk fails, or the store is of another format.
    pub fn open(root: &Path, platform: &str) -> Result<Self, CacheError> {
        Self::open_on(Disk::default(), root, platform)
    }

    /// [`Self::open`] on a disk that may have faults.
    ///
    /// # Errors
    /// If the disk fails, or the store is of another format.
    #[doc(hidden)]
    pub fn open_on(disk: Disk, root: &Path, platform: &str) -> Result<Self, CacheError> {
        let in_use = in_use::shared(prepare(&disk, root)?, root)?;
        Self::load(disk, root, platform, Some(in_use))
    }

    /// The store at `root` to look things up in: nothing is made there or changed, and a store
    /// that is not there is an empty one.
    ///
    /// # Errors
    /// If the disk fails, or the store is of another format.
    pub fn look(root: &Path, platform: &str) -> Result<Self, CacheError> {
        Self::load(Disk::default(), root, platform, look(root)?)
    }

    fn load(
        disk: Disk,
        root: &Path,
        platform: &str,
        in_use: Option<File>,
    ) -> Result<Self, CacheError> {
        let mut cache = Self {
            root: root.to_owned(),
            platform: platform.to_owned(),
            records: BTreeMap::new(),
            borrowed: BTreeMap::new(),
            seen: BTreeMap::new(),
            journal: None,
            objects: Objects::new(root, disk.clone()),
            writer: None,
            disk,
            actions: None,
            hints: None,
            troubles: Vec::new(),
            _in_use: in_use,
        };
        cache.refresh()?;
        Ok(cache)
    }

    /// The record of a key: of the own platform, else of the platform whose name comes first.
    #[must_use]
    pub fn lookup(&self, key: &Digest) -> Option<&Record> {
        let Some(records) = self.records.get(key) else { return self.borrowed.get(key) };
        records.iter().find(|record| record.platform == self.platform).or(records.first())
    }

    /// Puts a second store behind this one, before anything is looked up.
    pub fn attach(&mut self, second: Second) {
        let second = Arc::new(second);
        let writes = second.mode() == Mode::Write;
        self.writer = writes.then(|| Writer::new(Arc::clone(&second), self.objects.clone()));
        self.objects.second = Some(second);
    }

    /// The second store, if there is one.
    #[must_use]
    pub fn second(&self) -> Option<&Second> {
        self.objects.second.as_deref()
    }

    /// As [`Self::lookup`], but what is not known here is asked for in the second store.
    pub fn find(&mut self, key: &Digest) -> Option<&Record> {
        self.seek(&[*key]);
        self.lookup(key)
    }

    /// Asks the second store for what is not known here of some keys, of all at once, so that
    /// [`Self::lookup`] knows it; and lets what it lacks be put there.
    ///
    /// Its records are written here when the cache is closed, as far as their bytes are here.
    pub fn seek(&mut self, keys: &[Digest]) {
        let Some(second) = self.objects.second.clone() else { return };
        if let Some(writer) = &mut self.writer {
            let own = |record: &&Record| record.platform == self.platform;
            let known = keys.iter().filter_map(|key| self.records.get(key)?.iter().find(own));
            for record in known.filter(|known| !second.lists_on(&known.key, &self.platform)) {
                writer.put(record.clone());
            }
        }
        let mut unknown = keys.to_vec();
        unknown.retain(|key| second.lists(key) && self.lookup(key).is_none());
        unknown.sort_unstable();
        unknown.dedup();
        let has = |output: &_| self.objects.has_here(output);
        let found = second.records(&unknown, &self.platform, has);
        self.borrowed.extend(found.into_iter().map(|record| (record.key, record)));
    }

    /// Waits until what was committed is in the second store, but not longer than so; how many
    /// results are left.
    pub fn wait_for_second(&mut self, patience: Duration) -> usize {
        self.writer.as_ref().map_or(0, |writer| writer.wait(patience))
    }

    /// Puts nothing more into the second store; the next run that writes there does.
    pub fn leave_second(&mut self) {
        self.writer = None;
    }

    /// Takes what the second store said.
    pub(crate) fn borrow(&mut self, record: Record) {
        self.borrowed.insert(record.key, record);
    }

    /// Every record, by key and then platform.
    pub fn records(&self) -> impl Iterator<Item = &Record> {
        self.records.values().flatten()
    }

    /// The bytes of outputs: a cheap handle to give to worker threads.
    #[must_use]
    pub fn objects(&self) -> Objects {
        self.objects.clone()
    }

    /// What long computations keep of their progress: a cheap handle, as [`Self::objects`].
    #[must_use]
    pub fn checkpoints(&self) -> Checkpoints {
        Checkpoints::new(&self.root, self.disk.clone())
    }

    /// Adds a record. The first result of a key on a platform stays.
    ///
    /// From here on the record outlives this process, and after [`Self::sync`] a loss of
    /// power; [`Objects::put`] its output first.
    ///
    /// # Errors
    /// [`CacheError::Conflict`] if another result is known; otherwise, if the disk fails.
    pub fn commit(&mut self, record: Record) -> Result<Committed, CacheError> {
        let Some(second) = &self.objects.second else { return self.add(record) };
        let second = Arc::clone(second);
        let committed = self.add(record.clone())?;
        let differs = |borrowed: &Record| {
            borrowed.platform == record.platform && borrowed.output.digest != record.output.digest
        };
        if let Some(borrowed) = self.borrowed.remove(&record.key).filter(differs) {
            second.distrust(&borrowed);
            self.borrowed.clear();
            return Ok(Committed::Against);
        }
        if let Some(writer) = &mut self.writer {
            writer.put(record);
        }
        Ok(committed)
    }

    fn add(&mut self, record: Record) -> Result<Committed, CacheError> {
        match find(&self.records, &record) {
            Err(conflict) => Err(CacheError::Conflict(conflict)),
            Ok(Some(_)) => Ok(Committed::Known),
            Ok(None) => {
                self.journal()?.append(&record)?;
                insert(&mut self.records, record);
                Ok(Committed::New)
            }
        }
    }

    /// Whether a record with the same result is known, or why it cannot be added.
    pub(crate) fn knows(&self, record: &Record) -> Result<bool, Box<Conflict>> {
        find(&self.records, record).map(|known| known.is_some())
    }

    /// Writes what was borrowed, as far as its bytes are here.
    fn keep_borrowed(&mut self) -> Result<(), CacheError> {
        for record in std::mem::take(&mut self.borrowed).into_values() {
            if !self.objects.has_here(&record.output) {
                continue;
            }
            match self.add(record) {
                // Another process found something else.
                Err(CacheError::Conflict(conflict)) => {
                    self.troubles.push(Trouble::Conflict(conflict));
                }
                Err(error) => return Err(error),
                Ok(_) => {}
            }
        }
        Ok(())
    }

    /// The journal of this process, begun with the first commit.
    fn journal(&mut self) -> Result<&mut Journal, CacheError> {
        let journal = match self.journal.take() {
            Some(journal) if journal.is_whole() => journal,
            torn => {
                torn.map_or(Ok(()), |mut torn| torn.sync())?;
                let journal = Journal::create(&self.disk, &self.root.join("journal"))?;
                let name = journal.path().file_name().expect("a journal is a file");
                self.seen.insert(name.to_owned(), Seen::END);
                journal
            }
        };
        Ok(self.journal.insert(journal))
    }

    /// Makes what was committed survive a loss of power.
    ///
    /// # Errors
    /// If the disk fails.
    pub fn sync(&mut self) -> Result<(), CacheError> {
        self.journal.as_mut().map_or(Ok(()), Journal::sync)
    }

    /// Reads what other processes committed since.
    ///
    /// # Errors
    /// If the disk fails. Damage is no error; [`Self::troubles`] tells.
    pub fn refresh(&mut self) -> Result<(), CacheError> {
        let folder = self.root.join("journal");
        // By name, hence by age: the first writer's record is the first read.
        for name in names_if_any(&folder)? {
            let path = folder.join(&name);
            if path.extension().is_none_or(|extension| extension != "log") {
                continue;
            }
            let seen = self.seen.entry(name).or_default();
            let (records, mut conflicts) = (&mut self.records, Vec::new());
            journal::read(&path, seen, &mut self.troubles, |record| {
                match find(records, &record) {
                    Ok(Some(_)) => {}
                    Ok(None) => insert(records, record),
                    Err(conflict) => conflicts.push(Trouble::Conflict(conflict)),
                }
            })?;
            self.troubles.append(&mut conflicts);
        }
        Ok(())
    }

    /// The right to execute the action of `key`, or `None` while another handle has it.
    ///
    /// After acquiring it, look up again: another may have committed, which this has read.
    ///
    /// # Errors
    /// If the disk fails.
    pub fn try_lock(&mut self, key: &Digest) -> Result<Option<ActionLock>, CacheError> {
        let actions = match &mut self.actions {
            Some(actions) => actions,
            none => {
                none.insert(Actions::open(&self.disk, &self.root.join("locks").join("actions"))?)
            }
        };
        let Some(lock) = actions.try_lock(key)? else { return Ok(None) };
        if actions.others_came()? {
            self.refresh()?;
        }
        Ok(Some(lock))
    }

    /// Durations. The first call reads them, so that a run with nothing to execute need not.
    pub fn hints(&mut self) -> &mut Hints {
        self.hints.get_or_insert_with(|| {
            let mut hints = hints::load(&self.root, &self.disk, &mut self.troubles);
            let records = self.records.values().flatten();
            hints.guess_millis(records.map(|r| (r.provenance.op.as_str(), r.provenance.millis)));
            hints
        })
    }

    /// What was found damaged since the last call.
    pub fn troubles(&mut self) -> Vec<Trouble> {
        self.troubles.extend(self.objects.second.iter().flat_map(|second| second.notes()));
        std::mem::take(&mut self.troubles)
    }

    /// Waits for the second store, syncs, and writes the hints if there are new ones; what went
    /// wrong with those is among the troubles returned.
    ///
    /// # Errors
    /// If the disk fails.
    pub fn close(mut self) -> Result<Vec<Trouble>, CacheError> {
        self.keep_borrowed()?;
        self.sync()?;
        self.wait_for_second(Duration::MAX);
        self.save_hints();
        Ok(self.troubles())
    }

    pub(crate) fn save_hints(&mut self) {
        if let Some(hints) = &mut self.hints {
            hints::save(hints, &self.root, &self.disk, &mut self.troubles);
        }
    }
}

/// Records by key, then sorted by platform.
pub(crate) type Records = BTreeMap<Digest, Vec<Record>>;

/// The record that stands in the way of this one, if any.
pub(crate) fn find<'a>(
    records: &'a Records,
    new: &Record,
) -> Result<Option<&'a Record>, Box<Conflict>> {
    let mut known = records.get(&new.key).into_iter().flatten();
    match known.find(|record| record.platform == new.platform) {
        Some(known) if known.output.digest != new.output.digest => Err(Box::new(Conflict {
            op: new.provenance.op.clone(),
            node: new.provenance.node.clone(),
            key: new.key,
            platform: new.platform.clone(),
            first: known.output.digest,
            second: new.output.digest,
        })),
        known => Ok(known),
    }
}

pub(crate) fn insert(records: &mut Records, new: Record) {
    // Almost every key has one record, so room is made for one.
    let known = records.entry(new.key).or_insert_with(|| Vec::with_capacity(1));
    let place = known.partition_point(|record| record.platform < new.platform);
    known.insert(place, new);
}

/// Whether there is no store yet; one of another format is an error.
fn is_new(root: &Path) -> Result<bool, CacheError> {
    let version = root.join("version");
    match fs::read(&version) {
        Ok(found) if found == VERSION.as_bytes() => Ok(false),
        Ok(found) => {
            let found = String::from_utf8_lossy(&found).trim_end().to_owned();
            Err(CacheError::Version { path: version, found, expected: VERSION.trim_end() })
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(true),
        Err(source) => Err(CacheError::Io { path: version, source }),
    }
}

/// The lock of one who changes nothing; none where nobody has opened a store yet, so that nobody
/// can sweep it.
pub(crate) fn look(root: &Path) -> Result<Option<File>, CacheError> {
    is_new(root)?;
    let gate = root.join("in-use");
    match File::open(&gate) {
        Ok(file) => in_use::shared(file, root).map(Some),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(CacheError::Io { path: gate, source }),
    }
}

/// Checks or makes the folders, and returns the file whose lock says who uses the store.
pub(crate) fn prepare(disk: &Disk, root: &Path) -> Result<File, CacheError> {
    let version = root.join("version");
    let is_new = is_new(root)?;
    for folder in
        ["objects", "journal", "locks", "tmp", "corrupt", "checkpoints", "runs", "keys", FOUND]
    {
        let folder = root.join(folder);
        disk.create_folder(&folder).at(&folder)?;
    }
    if is_new {
        let temporary = root.join("tmp").join(durable::unique_name());
        durable::publish(disk, &temporary, &version, VERSION.as_bytes())?;
    }
    let gate = root.join("in-use");
    disk.open(&gate).at(&gate)
}

/// The sorted names in a folder.
pub(crate) fn names(folder: &Path) -> Result<Vec<OsString>, CacheError> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).at(folder)? {
        names.push(entry.at(folder)?.file_name());
    }
    names.sort();
    Ok(names)
}

/// The sorted names in a folder; none if it is not there.
pub(crate) fn names_if_any(folder: &Path) -> Result<Vec<OsString>, CacheError> {
    match names(folder) {
        Err(CacheError::Io { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
            Ok(Vec::new())
        }
        names => names,
    }
}

/// The sorted names in a folder, with sizes; files that vanish meanwhile are left out.
pub(crate) fn sizes(folder: &Path) -> Result<Vec<(OsString, u64)>, CacheError> {
    let mut sizes = Vec::new();
    for name in names_if_any(folder)? {
        let path = folder.join(&name);
        match fs::metadata(&path) {
            Ok(file) => sizes.push((name, file.len())),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(source) => return Err(CacheError::Io { path, source }),
        }
    }
    Ok(sizes)
}
