//! Programs that run: each ends with what it started, at the latest when this process does.

use std::collections::BTreeSet;
use std::io;
use std::os::fd::BorrowedFd;
use std::os::unix::process::CommandExt as _;
use std::process::{Child, Command, ExitStatus};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};

use crate::watch;

/// The longest time between two looks at a silent program.
pub const LOOK: Duration = Duration::from_millis(50);
/// How long a program that is asked to end may take to do so.
pub const GRACE: Duration = Duration::from_secs(1);

/// The process groups that run.
static RUNNING: Mutex<BTreeSet<u32>> = Mutex::new(BTreeSet::new());

/// Whether programs are to end.
static STOPPING: AtomicBool = AtomicBool::new(false);

/// Asks every program that runs to end, with what it started; who does not is killed a second later.
pub fn stop_all() {
    STOPPING.store(true, Ordering::SeqCst);
}

/// Lets programs run again, once all that were asked to end have.
pub fn go_on() {
    STOPPING.store(false, Ordering::SeqCst);
}

/// Whether programs are to end.
#[must_use]
pub fn stopping() -> bool {
    STOPPING.load(Ordering::SeqCst)
}

/// Kills every program that runs, with what it started.
pub fn kill_all() {
    let running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
    running.iter().for_each(|group| kill(*group, Signal::KILL));
}

/// A program and what it started; all of it is killed at the end.
#[derive(Debug)]
pub struct Group {
    /// The program.
    pub child: Child,
    id: u32,
    ended: bool,
}

impl Group {
    /// Starts a program.
    ///
    /// # Errors
    /// If it cannot be started.
    pub fn start(mut command: Command) -> io::Result<Self> {
        watch::begin();
        let child = command.process_group(0).spawn()?;
        let id = child.id();
        RUNNING.lock().unwrap_or_else(PoisonError::into_inner).insert(id);
        watch::began(id);
        Ok(Self { child, id, ended: false })
    }

    /// Asks all of it to end.
    pub fn ask(&self) {
        kill(self.id, Signal::TERM);
    }

    /// Whether the program has ended. It is not reaped, so that its number stays its own.
    ///
    /// # Errors
    /// If it cannot be waited for.
    ///
    /// # Panics
    /// If its number is 0, which no process has.
    pub fn has_ended(&self) -> io::Result<bool> {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOWAIT | WaitIdOptions::NOHANG;
        let pid = pid(self.id).expect("processes have numbers above 0");
        match waitid(WaitId::Pid(pid), options) {
            Ok(status) => Ok(status.is_some()),
            Err(rustix::io::Errno::INTR) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// Kills what is left.
    ///
    /// # Errors
    /// If it cannot be waited for.
    pub fn end(&mut self) -> io::Result<ExitStatus> {
        if !self.ended {
            {
                let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
                kill(self.id, Signal::KILL);
                running.remove(&self.id);
            }
            watch::ended(self.id);
            self.ended = true;
        }
        self.child.wait()
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        if !self.ended {
            drop(self.end());
        }
    }
}

fn pid(id: u32) -> Option<Pid> {
    i32::try_from(id).ok().and_then(Pid::from_raw)
}

fn kill(group: u32, signal: Signal) {
    if let Some(pid) = pid(group) {
        // There may be nobody left.
        let _ = kill_process_group(pid, signal);
    }
}

/// What a stream is waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum For {
    /// That there is something to read, or its end.
    Reading,
    /// That there is room to write.
    Writing,
}

/// Waits until something can be done with one of some streams: with which.
///
/// # Errors
/// If they cannot be waited for.
pub fn ready<const N: usize>(
    streams: [Option<(BorrowedFd<'_>, For)>; N],
    wait: Duration,
) -> io::Result<[bool; N]> {
    let flags = |what| if what == For::Reading { PollFlags::IN } else { PollFlags::OUT };
    let open = streams.iter().flatten();
    let mut fds: Vec<_> =
        open.map(|(fd, what)| PollFd::from_borrowed_fd(*fd, flags(*what))).collect();
    let wait = Timespec::try_from(wait).map_err(io::Error::other)?;
    match poll(&mut fds, Some(&wait)) {
        Ok(_) => {}
        Err(rustix::io::Errno::INTR) => return Ok([false; N]),
        Err(error) => return Err(error.into()),
    }
    let mut ready = fds.iter().map(|fd| !fd.revents().is_empty());
    Ok(streams.map(|stream| stream.is_some() && ready.next().unwrap_or_default()))
}

/// The name of a signal, in brackets; nothing for one that has no name here.
pub(crate) fn signal_name(signal: i32) -> String {
    let names = [
        (Signal::ABORT, "SIGABRT"),
        (Signal::BUS, "SIGBUS"),
        (Signal::FPE, "SIGFPE"),
        (Signal::ILL, "SIGILL"),
        (Signal::KILL, "SIGKILL"),
        (Signal::SEGV, "SIGSEGV"),
        (Signal::TERM, "SIGTERM"),
    ];
    let name = names.iter().find(|(known, _)| known.as_raw() == signal);
    name.map(|(_, name)| format!(" ({name})")).unwrap_or_default()
}

/// Makes reading from a stream and writing to it return at once.
pub(crate) fn at_once(stream: BorrowedFd<'_>) -> io::Result<()> {
    Ok(rustix::io::ioctl_fionbio(stream, true)?)
}
