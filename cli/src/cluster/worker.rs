//! `ivx worker`: pulls batches from a store and runs them.

use std::collections::BTreeMap;
use std::io::{self, Read, Write};
use std::os::unix::process::ExitStatusExt as _;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::{self, JoinHandle, sleep};
use std::time::{Duration, Instant};

use ivx_cache::{Store, StoreError};

use super::node::keep_log;
use super::queue::{
    Answer, BEATS, CANCELLED, CLAIMED, DONE, ENDED, Here, Laid, N_MAX, READY, WORKERS, get, put,
};
use super::{end_with_parent, store};
use crate::ending::{STOP, heeding};
use crate::machine::memory;
use crate::time::now_millis;
use crate::{BROKEN, OK, STOPPED, Trouble, args};

/// How often the store is looked at while something happens, and while nothing does.
const SOON: Duration = Duration::from_millis(10);
const LATER: Duration = Duration::from_millis(200);
/// How often a worker counts.
const BEAT: Duration = Duration::from_secs(1);
/// The most bytes of standard error that are told.
const TAIL: usize = 4000;

pub(crate) fn worker(
    args: &args::Worker,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    if args.with_parent {
        end_with_parent();
    }
    let broken = |err: &mut dyn Write, why: String| {
        writeln!(err, "error: the store {} cannot be used: {why}", args.store.display())
    };
    let store = match store(&args.store) {
        Ok(store) => store,
        Err(why) => {
            broken(err, why)?;
            return Ok(BROKEN);
        }
    };
    let mut worker = Worker::new(&*store, args);
    let (name, here) = (&worker.name, &worker.here);
    writeln!(
        out,
        "worker {name}: {} threads, {} MB of memory",
        here.cpus,
        here.memory / 1_000_000
    )?;
    out.flush()?;
    let worked = heeding(|| worker.work());
    store.remove(&format!("{WORKERS}/{}", worker.name)).ok();
    match worked {
        Ok(()) => Ok(if STOP.asked() { STOPPED } else { OK }),
        Err(error) => {
            broken(err, error.to_string())?;
            Ok(BROKEN)
        }
    }
}

struct Worker<'a> {
    store: &'a dyn Store,
    args: &'a args::Worker,
    name: String,
    here: Here,
    running: Vec<Running>,
    counted: Option<Instant>,
}

/// A batch that runs.
struct Running {
    name: String,
    cpus: usize,
    memory: u64,
    child: Child,
    said: JoinHandle<Vec<u8>>,
    log: JoinHandle<Vec<u8>>,
    ending: bool,
}

impl<'a> Worker<'a> {
    fn new(store: &'a dyn Store, args: &'a args::Worker) -> Self {
        let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        let plain = |c: &char| c.is_ascii_alphanumeric() || *c == '-';
        let host: String = host.trim().chars().filter(plain).take(60).collect();
        let name = format!("{host}-{}-{}", now_millis(), std::process::id());
        let cpus =
            args.cpus.unwrap_or_else(|| thread::available_parallelism().map_or(1, usize::from));
        let memory = args.memory.unwrap_or_else(memory);
        let here = Here { cpus, memory, machine: name.clone(), beat: 0 };
        Self { store, args, name, here, running: Vec::new(), counted: None }
    }

    fn work(&mut self) -> Result<(), StoreError> {
        let (mut wait, mut idle) = (SOON, Instant::now());
        loop {
            self.count()?;
            let happened = self.ended()? | (!STOP.asked() && self.claim()?);
            if happened || !self.running.is_empty() {
                idle = Instant::now();
            }
            if STOP.asked() {
                self.running.iter_mut().for_each(Running::end);
            }
            let over = STOP.asked() || idle.elapsed() >= self.args.idle.unwrap_or(Duration::MAX);
            if self.running.is_empty() && (over || self.is_last()?) {
                return Ok(());
            }
            wait = if happened { SOON } else { (wait * 2).min(LATER) };
            // What runs here is known to end as soon as it does.
            sleep(if self.running.is_empty() { wait } else { SOON });
        }
    }

    /// Whether the run has ended that this worker is for.
    fn is_last(&self) -> Result<bool, StoreError> {
        let Some(run) = &self.args.until else { return Ok(false) };
        Ok(self.store.size(&format!("{ENDED}/{run}"))?.is_some())
    }

    /// Says that it lives, and is told what nobody waits for any more.
    fn count(&mut self) -> Result<(), StoreError> {
        if self.counted.is_some_and(|counted| counted.elapsed() < BEAT) {
            return Ok(());
        }
        self.counted = Some(Instant::now());
        self.here.beat += 1;
        put(self.store, &format!("{WORKERS}/{}", self.name), &self.here)?;
        let beat = self.here.beat.to_string();
        for running in &mut self.running {
            self.store.put(&format!("{BEATS}/{}", running.name), beat.as_bytes())?;
            if self.store.size(&format!("{CANCELLED}/{}", running.name))?.is_some() {
                running.end();
            }
        }
        Ok(())
    }

    /// Takes what there is room for; whether it took anything.
    fn claim(&mut self) -> Result<bool, StoreError> {
        let mut took = false;
        if self.free().0 == 0 {
            return Ok(false);
        }
        for name in self.store.list(READY, N_MAX)? {
            let (cpus, memory) = self.free();
            if cpus == 0 {
                break;
            }
            let ready = format!("{READY}/{name}");
            let Some(laid) = get::<Laid>(self.store, &ready)? else { continue };
            if laid.batch.cpus.min(self.here.cpus) > cpus || laid.batch.memory > memory {
                continue;
            }
            if !self.store.create(&format!("{CLAIMED}/{name}"), self.name.as_bytes())? {
                continue;
            }
            self.store.remove(&ready)?;
            took = true;
            match self.begin(&name, &laid) {
                Ok(running) => self.running.push(running),
                Err(error) => self.answer(&name, -1, &[], error.to_string().as_bytes())?,
            }
        }
        Ok(took)
    }

    /// The threads and the memory that nothing takes.
    fn free(&self) -> (usize, u64) {
        let cpus: usize = self.running.iter().map(|running| running.cpus).sum();
        let memory: u64 = self.running.iter().map(|running| running.memory).sum();
        (self.here.cpus.saturating_sub(cpus), self.here.memory.saturating_sub(memory))
    }

    fn begin(&self, name: &str, laid: &Laid) -> io::Result<Running> {
        let Laid { batch, library } = laid;
        let cpus = batch.cpus.clamp(1, self.here.cpus);
        let mut command = Command::new(std::env::current_exe()?);
        command.args(["node", "exec", "--library", library, "--threads", &cpus.to_string()]);
        command.arg("--store").arg(&self.args.store);
        if let Some(cache) = &self.args.cache {
            command.arg("--cache").arg(cache);
        }
        command.args(batch.keys.iter().map(ToString::to_string));
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn()?;
        let said = child.stdout.take().map(read);
        let log = child.stderr.take().map(read);
        let (Some(said), Some(log)) = (said, log) else {
            return Err(io::Error::other("its pipes are not there"));
        };
        let (name, memory) = (name.to_owned(), batch.memory);
        Ok(Running { name, cpus, memory, child, said, log, ending: false })
    }

    /// Answers for what has ended; whether anything has.
    fn ended(&mut self) -> Result<bool, StoreError> {
        let mut ended = BTreeMap::new();
        let mut left = Vec::new();
        for mut running in std::mem::take(&mut self.running) {
            match running.child.try_wait() {
                Ok(None) => left.push(running),
                Ok(Some(status)) => _ = ended.insert(running.name.clone(), (running, code(status))),
                Err(_) => _ = ended.insert(running.name.clone(), (running, -1)),
            }
        }
        self.running = left;
        let some = !ended.is_empty();
        for (name, (running, code)) in ended {
            let said = running.said.join().unwrap_or_default();
            let log = running.log.join().unwrap_or_default();
            self.answer(&name, code, &said, &log)?;
        }
        Ok(some)
    }

    fn answer(&self, name: &str, code: i64, said: &[u8], log: &[u8]) -> Result<(), StoreError> {
        let mut err = String::from_utf8_lossy(&log[log.len().saturating_sub(TAIL)..]).into_owned();
        if !log.is_empty() && keep_log(self.store, name, log).is_ok() {
            err = format!("{}\n(all of it is logs/{name} in the store)", err.trim_end());
        }
        let said = String::from_utf8_lossy(said).into_owned();
        let answer = Answer { code, said, err, machine: self.here.machine.clone() };
        put(self.store, &format!("{DONE}/{name}"), &answer)
    }
}

impl Running {
    /// Asks it to keep what it did, and end.
    fn end(&mut self) {
        if !std::mem::replace(&mut self.ending, true) {
            use rustix::process::{Pid, Signal, kill_process};
            let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
            // It may have ended by itself.
            pid.map(|pid| kill_process(pid, Signal::TERM));
        }
    }
}

/// The exit code, or the signal below 0.
fn code(status: ExitStatus) -> i64 {
    let signal = status.signal().map(|signal| -i64::from(signal));
    signal.or(status.code().map(i64::from)).unwrap_or(-1)
}

fn read(mut from: impl Read + Send + 'static) -> JoinHandle<Vec<u8>> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        // What was read counts.
        let _ = from.read_to_end(&mut bytes);
        bytes
    })
}
