//! Runs a program to its end, or to that of its time.

use std::io::Read;
use std::os::fd::AsFd;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use ivx_foreign::{For, GRACE, Group, LOOK, TAIL, how, ready, stopping, tail};

/// Most bytes that a program may write to a stream which nobody keeps.
const MAX_LOG: usize = 64 << 20;

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
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let stopped = || Err(format!("`{name}` was stopped"));
    if stopping() {
        return stopped().map(|()| Vec::new());
    }
    let started = Instant::now();
    let group = Group::start(command);
    let mut group = group.map_err(|error| format!("`{name}` cannot be started: {error}"))?;
    let deadline = Duration::try_from_secs_f64(time_limit).ok();
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
        if asked.is_none() && stopping() {
            asked = Some(Instant::now());
            group.ask();
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
    let streams = [out.pipe.as_ref().map(AsFd::as_fd), err.pipe.as_ref().map(AsFd::as_fd)];
    let streams = streams.map(|stream| stream.map(|stream| (stream, For::Reading)));
    let [first, second] =
        ready(streams, wait).map_err(|error| format!("cannot be heard: {error}"))?;
    if first {
        out.read()?;
    }
    if second {
        err.read()?;
    }
    Ok(first || second)
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
