//! A program that is asked and answers, within its time.

use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::AsFd as _;
use std::process::{ChildStderr, ChildStdin, ChildStdout, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::group::{For, GRACE, Group, LOOK, at_once, ready, stopping};
use crate::words::{TAIL, how, tail};

/// A program at the other end of a pipe. It is killed when this is dropped.
pub(crate) struct Pipe {
    name: String,
    group: Group,
    to: ChildStdin,
    from: ChildStdout,
    /// Its standard error, and the end of what it said there.
    err: Option<ChildStderr>,
    said: Vec<u8>,
    time_limit: f64,
}

/// What one call waits for at most.
struct Wait {
    since: Instant,
    /// When programs were first seen to be asked to end.
    stopping: Option<Instant>,
}

impl Pipe {
    /// Starts a program, of which each answer may take `time_limit` seconds.
    pub(crate) fn start(mut command: Command, name: &str, time_limit: f64) -> Result<Self, String> {
        let about = |error: io::Error| format!("`{name}` cannot be started: {error}");
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut group = Group::start(command).map_err(about)?;
        let to = group.child.stdin.take().expect("it is piped");
        let from = group.child.stdout.take().expect("it is piped");
        let err = group.child.stderr.take();
        for stream in [to.as_fd(), from.as_fd()] {
            at_once(stream).map_err(about)?;
        }
        Ok(Self { name: name.to_owned(), group, to, from, err, said: Vec::new(), time_limit })
    }

    /// The one line of at most so many bytes that it says.
    pub(crate) fn line(&mut self, most: usize) -> Result<Vec<u8>, String> {
        let (mut wait, mut line, mut chunk) = (Wait::new(), Vec::new(), [0; 1 << 12]);
        while line.len() < most {
            match self.from.read(&mut chunk) {
                Ok(0) => return Err(self.ended()),
                Ok(n) => line.extend_from_slice(&chunk[..n]),
                Err(error) => self.again(&error, For::Reading, &mut wait)?,
            }
            if let Some(end) = line.iter().position(|byte| *byte == b'\n') {
                if end + 1 < line.len() {
                    break;
                }
                line.truncate(end);
                return Ok(line);
            }
        }
        Err(self.failed("said more than was asked for"))
    }

    /// Sends all bytes.
    pub(crate) fn send(&mut self, mut bytes: &[u8]) -> Result<(), String> {
        let mut wait = Wait::new();
        while !bytes.is_empty() {
            match self.to.write(bytes) {
                Ok(n) => bytes = &bytes[n..],
                Err(error) if error.kind() == ErrorKind::BrokenPipe => return Err(self.ended()),
                Err(error) => self.again(&error, For::Writing, &mut wait)?,
            }
        }
        Ok(())
    }

    /// Fills `answer` by what it says.
    pub(crate) fn receive(&mut self, answer: &mut [u8]) -> Result<(), String> {
        let (mut wait, mut at) = (Wait::new(), 0);
        while at < answer.len() {
            // It has hardly answered yet when this is asked first.
            self.wait(For::Reading, &mut wait)?;
            match self.from.read(&mut answer[at..]) {
                Ok(0) => return Err(self.ended()),
                Ok(n) => at += n,
                Err(error) => self.again(&error, For::Reading, &mut wait)?,
            }
        }
        Ok(())
    }

    fn again(&mut self, error: &io::Error, what: For, wait: &mut Wait) -> Result<(), String> {
        match error.kind() {
            ErrorKind::WouldBlock => self.wait(what, wait),
            ErrorKind::Interrupted => Ok(()),
            _ => Err(self.failed(&format!("cannot be heard: {error}"))),
        }
    }

    /// Waits until something can be read or written, and keeps what is said meanwhile.
    fn wait(&mut self, what: For, wait: &mut Wait) -> Result<(), String> {
        loop {
            let stream = if what == For::Reading { self.from.as_fd() } else { self.to.as_fd() };
            let err = self.err.as_ref().map(|err| (err.as_fd(), For::Reading));
            match ready([Some((stream, what)), err], LOOK) {
                Ok([is_ready, says]) => {
                    if says {
                        self.hear();
                    }
                    if is_ready {
                        return Ok(());
                    }
                }
                Err(error) => return Err(self.failed(&format!("cannot be heard: {error}"))),
            }
            if wait.since.elapsed().as_secs_f64() > self.time_limit {
                let why = format!("did not answer within {} s, its time limit", self.time_limit);
                return Err(self.failed(&why));
            }
            if stopping() && wait.stopping.get_or_insert_with(Instant::now).elapsed() > GRACE {
                return Err(self.failed("was stopped"));
            }
        }
    }

    /// Keeps the end of what it says on its standard error.
    fn hear(&mut self) {
        let mut chunk = [0; 1 << 12];
        match self.err.as_mut().map(|err| err.read(&mut chunk)) {
            Some(Ok(n)) if n > 0 => self.said.extend_from_slice(&chunk[..n]),
            Some(Err(error)) if error.kind() == ErrorKind::Interrupted => {}
            _ => self.err = None,
        }
        if self.said.len() > 4 * TAIL {
            self.said.drain(..self.said.len() - TAIL);
        }
    }

    /// Why it says no more: it ended, or is about to.
    fn ended(&mut self) -> String {
        let since = Instant::now();
        while !self.group.has_ended().unwrap_or(true) {
            if since.elapsed() > GRACE {
                return self.failed("closed its pipe");
            }
            thread::sleep(Duration::from_millis(1));
        }
        match self.group.end() {
            Ok(status) => self.failed(&how(status)),
            Err(error) => self.failed(&format!("cannot be waited for: {error}")),
        }
    }

    /// Ends it: why, with the last words of it.
    pub(crate) fn failed(&mut self, why: &str) -> String {
        // What it left behind may still hold the stream.
        let _ = self.group.end();
        while let Some(err) = &self.err {
            match ready([Some((err.as_fd(), For::Reading))], Duration::ZERO) {
                Ok([true]) => self.hear(),
                _ => break,
            }
        }
        let why = format!("`{}` {why}", self.name);
        match tail(&self.said) {
            tail if tail.is_empty() => why,
            tail => format!("{why}; its standard error ends:\n{tail}"),
        }
    }
}

impl Wait {
    fn new() -> Self {
        Self { since: Instant::now(), stopping: None }
    }
}
