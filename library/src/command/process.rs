//! Runs a program to its end, or to that of its time.

use std::collections::BTreeSet;
use std::io::Read;
use std::os::fd::AsFd;
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};

use super::watch;

/// Most bytes that a program may write to a stream which nobody keeps.
const MAX_LOG: usize = 64 << 20;
/// How much of the end of such a stream is shown when the program fails.
const TAIL: usize = 4096;
/// How many of its last lines.
const TAIL_LINES: usize = 20;
/// The longest time between two looks at a silent program.
const LOOK: Duration = Duration::from_millis(50);
/// How long a program that is asked to end may take to do so.
const GRACE: Duration = Duration::from_secs(1);

/// The process groups that run.
static RUNNING: Mutex<BTreeSet<u32>> = Mutex::new(BTreeSet::new());

/// Whether programs are to end, and none to be started.
static STOPPING: AtomicBool = AtomicBool::new(false);

/// Asks every program that runs to end, with what it started; who does not is killed a second later.
pub(super) fn stop_all() {
    STOPPING.store(true, Ordering::SeqCst);
}

/// Kills every program that runs, with what it started.
pub(super) fn kill_all() {
    let running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
    running.iter().for_each(|group| kill(*group, Signal::KILL));
}

/// What a program wrote to its standard output, where `keep` asks for at most so many bytes.
///
/// # Errors
/// How it failed, with the end of what it said.
pub(super) fn run(
    mut command: Command,
    name: &str,
    time_limit: f64,
    keep: Option<usize>,
) -> Result<Vec<u8>, String> {
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).process_group(0);
    let stopped = || Err(format!("`{name}` was stopped"));
    if STOPPING.load(Ordering::SeqCst) {
        return stopped().map(|()| Vec::new());
    }
    let started = Instant::now();
    watch::begin();
    let child = command.spawn().map_err(|error| format!("`{name}` cannot be started: {error}"))?;
    let deadline = Duration::try_from_secs_f64(time_limit).ok();
    let mut group = Group::of(child);
    let child = &mut group.child;
    let mut out = Stream::new(child.stdout.take().expect("it is piped"), "output", keep);
    let mut err = Stream::new(child.stderr.take().expect("it is piped"), "error", None);
    let mut nap = Duration::from_micros(20);
    let mut asked: Option<Instant> = None;
    let ended = loop {
        let left = deadline.and_then(|limit| limit.checked_sub(started.elapsed()));
        if deadline.is_some() && left.is_none() {
            break Err(format!("`{name}` was stopped after {time_limit} s, its time limit"));
        }
        if asked.is_none() && STOPPING.load(Ordering::SeqCst) {
            asked = Some(Instant::now());
            kill(group.id, Signal::TERM);
        }
        if asked.is_some_and(|asked| asked.elapsed() >= GRACE) {
            break stopped();
        }
        let mut look = LOOK;
        if out.pipe.is_none() && err.pipe.is_none() {
            // It closed its streams, which programs do when they end: it has not long to go.
            nap = (2 * nap).min(LOOK);
            look = nap;
        }
        let heard = hear(&mut out, &mut err, left.map_or(look, |left| left.min(look)));
        if let Err(why) = heard {
            break Err(format!("`{name}` {why}"));
        }
        match group.has_ended() {
            // What it leaves behind may be half of what it was to do.
            Ok(true) if asked.is_some() => break stopped(),
            Ok(true) => break Ok(()),
            Ok(false) => {}
            Err(error) => break Err(format!("`{name}` cannot be waited for: {error}")),
        }
    };
    let status = group.end();
    let status = ended.and_then(|()| {
        // What was still in the pipes; whoever escaped from the group is not waited for.
        while hear(&mut out, &mut err, Duration::ZERO).map_err(|why| format!("`{name}` {why}"))? {}
        status.map_err(|error| format!("`{name}` cannot be waited for: {error}"))
    });
    let failed = match status {
        Ok(status) if status.success() => return Ok(out.bytes),
        Ok(status) => format!("`{name}` {}", how(status)),
        Err(why) => why,
    };
    let (said, by) = match (&err.bytes[..], keep) {
        ([], None) => (&out.bytes, out.name),
        _ => (&err.bytes, err.name),
    };
    Err(match tail(said) {
        tail if tail.is_empty() => failed,
        tail => format!("{failed}; its standard {by} ends:\n{tail}"),
    })
}

/// A program and what it started; all of it is killed at the end.
struct Group {
    child: Child,
    id: u32,
    ended: bool,
}

impl Group {
    fn of(child: Child) -> Self {
        let id = child.id();
        RUNNING.lock().unwrap_or_else(PoisonError::into_inner).insert(id);
        watch::began(id);
        Self { child, id, ended: false }
    }

    /// Whether the program has ended. It is not reaped, so that its number stays its own.
    fn has_ended(&self) -> std::io::Result<bool> {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOWAIT | WaitIdOptions::NOHANG;
        let pid = pid(self.id).expect("processes have numbers above 0");
        match waitid(WaitId::Pid(pid), options) {
            Ok(status) => Ok(status.is_some()),
            Err(rustix::io::Errno::INTR) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// Kills what is left.
    fn end(&mut self) -> std::io::Result<ExitStatus> {
        {
            let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
            kill(self.id, Signal::KILL);
            running.remove(&self.id);
        }
        watch::ended(self.id);
        self.ended = true;
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

/// One stream of a program.
struct Stream<R> {
    pipe: Option<R>,
    name: &'static str,
    /// Most bytes to keep, where all are; otherwise the last ones are.
    keep: Option<usize>,
    bytes: Vec<u8>,
    seen: usize,
}

impl<R: Read> Stream<R> {
    fn new(pipe: R, name: &'static str, keep: Option<usize>) -> Self {
        Self { pipe: Some(pipe), name, keep, bytes: Vec::new(), seen: 0 }
    }

    /// Reads what is there; to be called when something is.
    fn read(&mut self) -> Result<(), String> {
        let Some(pipe) = &mut self.pipe else { return Ok(()) };
        let mut chunk = [0; 1 << 14];
        match pipe.read(&mut chunk) {
            Ok(0) => self.pipe = None,
            Ok(n) => {
                self.seen += n;
                self.bytes.extend_from_slice(&chunk[..n]);
            }
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(format!("cannot be heard: {error}")),
        }
        let most = self.keep.unwrap_or(MAX_LOG);
        if self.seen > most {
            let size = if most >> 20 > 0 {
                format!("{} MiB", most >> 20)
            } else {
                format!("{most} bytes")
            };
            self.bytes.clear();
            return Err(format!("wrote more than {size} to its standard {}", self.name));
        }
        if self.keep.is_none() && self.bytes.len() > 4 * TAIL {
            self.bytes.drain(..self.bytes.len() - TAIL);
        }
        Ok(())
    }
}

/// Waits until something was said, and keeps it; whether there was something.
fn hear(
    out: &mut Stream<impl Read + AsFd>,
    err: &mut Stream<impl Read + AsFd>,
    wait: Duration,
) -> Result<bool, String> {
    if out.pipe.is_none() && err.pipe.is_none() {
        thread::sleep(wait);
        return Ok(false);
    }
    let (first, second) = {
        let streams = [out.pipe.as_ref().map(AsFd::as_fd), err.pipe.as_ref().map(AsFd::as_fd)];
        let open: Vec<_> = streams.iter().flatten().copied().collect();
        let mut fds: Vec<_> =
            open.iter().map(|fd| PollFd::from_borrowed_fd(*fd, PollFlags::IN)).collect();
        let wait = Timespec::try_from(wait).expect("the wait is short");
        match poll(&mut fds, Some(&wait)) {
            Ok(_) => {}
            Err(rustix::io::Errno::INTR) => return Ok(false),
            Err(error) => return Err(format!("cannot be heard: {error}")),
        }
        let mut ready = fds.iter().map(|fd| !fd.revents().is_empty());
        let mut next = |open: bool| open && ready.next().unwrap_or_default();
        (next(streams[0].is_some()), next(streams[1].is_some()))
    };
    if first {
        out.read()?;
    }
    if second {
        err.read()?;
    }
    Ok(first || second)
}

fn how(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("ended with exit code {code}"),
        (_, Some(signal)) => format!("was killed by signal {signal}{}", signal_name(signal)),
        _ => "ended in an unknown way".to_owned(),
    }
}

fn signal_name(signal: i32) -> String {
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

/// The last lines of what was said, as a terminal shows them.
fn tail(said: &[u8]) -> String {
    let text = String::from_utf8_lossy(&said[said.len().saturating_sub(TAIL)..]);
    let lines: Vec<String> = text.trim_end().split('\n').map(played).collect();
    let lines = if lines.iter().all(String::is_empty) { &[] } else { &lines[..] };
    let last = &lines[lines.len().saturating_sub(TAIL_LINES)..];
    last.iter().map(|line| format!("    {line}")).collect::<Vec<_>>().join("\n")
}

/// A line as it looks in the end: bars of progress write over what they wrote. What steers terminals otherwise
/// is left out.
fn played(line: &str) -> String {
    let mut shown: Vec<char> = Vec::new();
    let mut at = 0_usize;
    let mut chars = line.chars().peekable();
    while let Some(c) = chars.next() {
        match c {
            '\r' => at = 0,
            '\u{8}' => at = at.saturating_sub(1),
            '\u{1b}' => match chars.next() {
                Some('[') => {
                    let is_inside = |c: &char| !('@'..='~').contains(c);
                    let of: String = std::iter::from_fn(|| chars.next_if(is_inside)).collect();
                    match (chars.next(), &*of) {
                        (Some('K'), "" | "0") => shown.truncate(at),
                        (Some('K'), "2") => shown.clear(),
                        _ => {}
                    }
                }
                // A title of the window, until a bell or another escape.
                Some(']') => while chars.next_if(|c| !matches!(c, '\u{7}' | '\u{1b}')).is_some() {},
                _ => {}
            },
            c if c.is_control() && c != '\t' => {}
            c => {
                shown.resize(shown.len().max(at + 1), ' ');
                shown[at] = c;
                at += 1;
            }
        }
    }
    shown.into_iter().collect::<String>().trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_shown_as_terminals_show_them() {
        let check = |line: &str, expected: &str| assert_eq!(played(line), expected, "{line:?}");
        check("10 %\r20 %\rdone", "done");
        check("long line\rno", "nong line");
        check("windows\r", "windows");
        check("half\r\u{1b}[Kall", "all");
        check("ab\u{8}c", "ac");
        check("\u{1b}[1;31mred\u{1b}[0m \u{1b}]0;title\u{7}x\u{1b}", "red x");
        check("a\u{1b}[2Kb", " b");
        check("a\tb\u{0}", "a\tb");
    }

    fn shell(script: &str, time_limit: f64, keep: Option<usize>) -> Result<String, String> {
        let mut command = Command::new("/bin/sh");
        command.args(["-c", script]);
        run(command, "sh", time_limit, keep).map(|out| String::from_utf8(out).unwrap())
    }

    #[test]
    fn a_program_says_how_it_went() {
        assert_eq!(shell("echo a; echo b >&2; echo c", 60.0, Some(100)).as_deref(), Ok("a\nc\n"));
        let why = shell("echo one >&2; printf 'two\\033[2J\\n' >&2; exit 3", 60.0, None);
        let expected = "`sh` ended with exit code 3; its standard error ends:\n    one\n    two";
        assert_eq!(why.unwrap_err(), expected);
        let why = shell("kill -9 $$", 60.0, None).unwrap_err();
        assert_eq!(why, "`sh` was killed by signal 9 (SIGKILL)");
        let why = shell("echo only here; exit 1", 60.0, None).unwrap_err();
        assert_eq!(why, "`sh` ended with exit code 1; its standard output ends:\n    only here");
        assert!(shell("cat", 60.0, None).is_ok(), "its input is empty");
    }

    #[test]
    fn what_it_says_is_bounded() {
        let why = shell("cat /dev/zero", 600.0, None).unwrap_err();
        assert_eq!(why, "`sh` wrote more than 64 MiB to its standard output");
        let why = shell("cat /dev/zero >&2", 600.0, Some(10)).unwrap_err();
        assert_eq!(why, "`sh` wrote more than 64 MiB to its standard error");
        let why = shell("echo 0123456789", 600.0, Some(10)).unwrap_err();
        assert_eq!(why, "`sh` wrote more than 10 bytes to its standard output");
    }

    #[test]
    fn whatever_it_started_ends_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pid");
        // The child holds the streams open.
        let script = |rest: &str| format!("sleep 1000 & echo $! > {}; {rest}", path.display());
        let gone = || {
            let id = std::fs::read_to_string(&path).unwrap();
            let stat = std::fs::read_to_string(format!("/proc/{}/stat", id.trim()));
            // Dead, or dead and not reaped by whoever is to.
            stat.map_or(true, |stat| stat.contains(") Z "))
        };
        let is_gone = || {
            (0..1000).any(|_| {
                gone() || {
                    thread::sleep(LOOK / 10);
                    false
                }
            })
        };
        assert_eq!(shell(&script("echo done"), 600.0, Some(100)).as_deref(), Ok("done\n"));
        assert!(is_gone());
        let why = shell(&script("wait"), 0.5, None).unwrap_err();
        assert_eq!(why, "`sh` was stopped after 0.5 s, its time limit");
        assert!(is_gone());
    }

    #[test]
    fn no_more_than_the_end_is_shown() {
        let said: Vec<String> = (0..1000).map(|i| format!("line {i}")).collect();
        let shown = tail(said.join("\n").as_bytes());
        assert_eq!(shown.lines().count(), TAIL_LINES);
        assert!(shown.starts_with("    line 980\n") && shown.ends_with("line 999"));
    }
}
