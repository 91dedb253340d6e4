//! What becomes of the command at Ctrl-C or TERM: a run keeps what it did, everything else ends at
//! once, and nothing takes longer than two seconds but an operation that computes in this process and cannot keep
//! what it did so far.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::exit;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{LazyLock, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use ivx_engine::Stop;
use ivx_library::command;

use crate::STOPPED;

/// How long a run may take to end when nothing computes.
const PATIENCE: Duration = Duration::from_millis(1800);
/// How long it may take to keep what was computed.
const KEEP: Duration = Duration::from_millis(500);
/// How often it is looked at.
const LOOK: Duration = Duration::from_millis(20);

/// Asks the run of this process to stop.
pub(crate) static STOP: LazyLock<Stop> = LazyLock::new(Stop::default);
/// Whether the command is to end.
static ENDING: AtomicBool = AtomicBool::new(false);
/// Whether somebody looks at `STOP`.
static HEEDED: AtomicBool = AtomicBool::new(false);
/// Files that are worth nothing before they are whole.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// What the command does at a signal that asks it to end. A second one does not wait for anything.
pub fn interrupt() {
    if ENDING.swap(true, Ordering::SeqCst) || !HEEDED.load(Ordering::SeqCst) {
        end();
    }
    STOP.ask();
    command::stop_all();
    // Before anything is said, which may block for ever.
    thread::spawn(see_to_the_end);
    let what = "stopping: what computes is kept, programs are ended; once more to stop at once";
    let _ = writeln!(std::io::stderr(), "{what}");
}

/// Whether the command is to end.
pub(crate) fn is_ending() -> bool {
    ENDING.load(Ordering::SeqCst)
}

/// Ends the run, if there is one, as a signal would, but not the command.
pub(crate) fn stop_run() {
    STOP.ask();
    command::stop_all();
    if HEEDED.load(Ordering::SeqCst) {
        let what = "stopping, since a file has changed: what computes is kept, programs are ended";
        let _ = writeln!(std::io::stderr(), "{what}");
    }
}

/// Lets another run begin after one that was stopped.
pub(crate) fn begin_anew() {
    STOP.take_back();
    command::go_on();
}

/// Does `work`, which looks at `STOP` and keeps what it did.
pub(crate) fn heeding<T>(work: impl FnOnce() -> T) -> T {
    HEEDED.store(true, Ordering::SeqCst);
    let done = work();
    HEEDED.store(false, Ordering::SeqCst);
    done
}

/// Writes a file that is removed if the command is ended before that is done.
pub(crate) fn unfinished<T>(path: &Path, work: impl FnOnce() -> T) -> T {
    let files = || UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
    files().push(path.to_owned());
    let done = work();
    files().retain(|file| file != path);
    done
}

/// Ends the process when the run should have ended.
fn see_to_the_end() {
    let asked = Instant::now();
    let mut idle = asked;
    loop {
        thread::sleep(LOOK);
        if STOP.is_busy() {
            idle = Instant::now();
        }
        if asked.elapsed() >= PATIENCE && idle.elapsed() >= KEEP {
            end();
        }
    }
}

/// Ends the process, with all that it started.
fn end() -> ! {
    command::abandon_all();
    for file in UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).iter() {
        // It may be finished, and is then called otherwise.
        let _ = fs::remove_file(file);
    }
    exit(STOPPED.into())
}
