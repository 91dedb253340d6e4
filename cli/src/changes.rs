//! Notices when files are no longer as they were read.
//!
//! The folders around them are watched, since editors put another file in the place of the one that they save. What the
//! system tells is only a reason to look: a file has changed where its bytes are others.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use ivx_cache::Digest;
use notify::event::{AccessKind, AccessMode};
use notify::{EventKind, RecommendedWatcher, RecursiveMode, Watcher as _};

/// What files held when they were read: the digest of each, or none where there was no file.
pub(crate) type Read = BTreeMap<PathBuf, Option<Digest>>;

/// A save is over when so long nothing more happens.
const QUIET: Duration = Duration::from_millis(50);
/// Files that are written to without end are looked at so often.
const LONGEST: Duration = Duration::from_secs(1);
/// So often folders are looked for that come and go.
const TRIES: usize = 3;

/// Looks after files until one of them changes.
pub(crate) struct Changes {
    noticed: Receiver<()>,
    is_noticed: bool,
}

impl Changes {
    /// Looks after these files, and calls `notice`, on another thread, once when one of them is no longer so.
    ///
    /// # Errors
    /// If the system can watch no more folders, or none at all.
    pub(crate) fn of(read: Read, notice: impl FnOnce() + Send + 'static) -> notify::Result<Self> {
        let (tell, told) = channel();
        let watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
            let touched = Touched::of(event);
            if !touched.is_nothing() {
                // Nobody may wait any more.
                let _ = tell.send(touched);
            }
        })?;
        let mut folders = Folders { watcher, watched: BTreeSet::new() };
        folders.watch(&read)?;
        let (notify, noticed) = channel();
        thread::spawn(move || follow(&read, folders, &told, notice, &notify));
        Ok(Self { noticed, is_noticed: false })
    }

    /// Whether a file has changed.
    pub(crate) fn is_noticed(&mut self) -> bool {
        self.is_noticed |= self.noticed.try_recv().is_ok();
        self.is_noticed
    }

    /// Waits until a file has changed. Whether one has: the system may end what watches.
    pub(crate) fn wait(mut self) -> bool {
        self.is_noticed() || self.noticed.recv().is_ok()
    }
}

/// What a path holds: the digest of the file; none where there is none that can be read.
pub(crate) fn look(path: &Path) -> Option<Digest> {
    let is_file = fs::metadata(path).is_ok_and(|found| found.is_file());
    // What is neither a file nor a folder may never end.
    if is_file { fs::read(path).ok().map(|bytes| Digest::of(&bytes)) } else { None }
}

/// The paths to which something happened.
enum Touched {
    These(Vec<PathBuf>),
    /// The system does not know.
    Any,
}

impl Touched {
    fn of(event: notify::Result<notify::Event>) -> Self {
        match event {
            Ok(event) if event.need_rescan() => Self::Any,
            Ok(event) => match event.kind {
                EventKind::Access(AccessKind::Close(AccessMode::Write)) => Self::These(event.paths),
                // Who looks opens.
                EventKind::Access(_) => Self::These(Vec::new()),
                _ => Self::These(event.paths),
            },
            Err(_) => Self::Any,
        }
    }

    fn is_nothing(&self) -> bool {
        matches!(self, Self::These(paths) if paths.is_empty())
    }

    /// Whether a path may be another now: a folder in which it lies may be new.
    fn touches(&self, path: &Path) -> bool {
        match self {
            Self::These(paths) => paths.iter().any(|own| path.starts_with(own)),
            Self::Any => true,
        }
    }
}

/// Waits for the first change and tells it.
fn follow(
    read: &Read,
    mut folders: Folders,
    told: &Receiver<Touched>,
    notice: impl FnOnce(),
    notify: &Sender<()>,
) {
    // Something may have changed before anybody watched.
    let mut suspect: Vec<&Path> = read.keys().map(PathBuf::as_path).collect();
    loop {
        if suspect.iter().any(|path| look(path) != read[*path]) {
            notice();
            let _ = notify.send(());
            return;
        }
        let Some(touched) = next(told) else { return };
        suspect = read.keys().map(PathBuf::as_path).filter(|path| touched.touches(path)).collect();
        let moved = folders.watched.iter().any(|folder| touched.touches(folder));
        if moved || suspect.iter().any(|path| !path.exists()) {
            folders.watch_anew(read);
            // Something may have changed while nobody watched.
            suspect = read.keys().map(PathBuf::as_path).collect();
        }
    }
}

/// The paths to which something happened until it is quiet; none if nobody watches.
fn next(told: &Receiver<Touched>) -> Option<Touched> {
    let mut all = told.recv().ok()?;
    let began = Instant::now();
    while began.elapsed() < LONGEST {
        match told.recv_timeout(QUIET) {
            Ok(Touched::These(more)) => match &mut all {
                Touched::These(all) => all.extend(more),
                Touched::Any => {}
            },
            Ok(Touched::Any) => all = Touched::Any,
            Err(RecvTimeoutError::Timeout) => break,
            Err(RecvTimeoutError::Disconnected) => return None,
        }
    }
    Some(all)
}

/// The folders around files.
struct Folders {
    watcher: RecommendedWatcher,
    watched: BTreeSet<PathBuf>,
}

impl Folders {
    /// Watches the folder of each file; of one that is not there, the nearest around it.
    fn watch(&mut self, read: &Read) -> notify::Result<()> {
        let around = |path: &PathBuf| {
            path.ancestors().skip(1).find(|above| above.is_dir()).map(Path::to_owned)
        };
        let wanted: BTreeSet<PathBuf> = read.keys().filter_map(around).collect();
        let mut failed = Ok(());
        for folder in wanted {
            match self.watcher.watch(&folder, RecursiveMode::NonRecursive) {
                Ok(()) => _ = self.watched.insert(folder),
                Err(error) => failed = Err(error),
            }
        }
        failed
    }

    /// Watches what lies there now, where folders came and went.
    fn watch_anew(&mut self, read: &Read) {
        for _ in 0..TRIES {
            for folder in std::mem::take(&mut self.watched) {
                // One that is gone is not watched any more.
                let _ = self.watcher.unwatch(&folder);
            }
            // One may go just now.
            if self.watch(read).is_ok() {
                return;
            }
        }
    }
}
