//! `ivx node serve`: a driver that lays batches into the store for workers to pull.

use std::collections::BTreeMap;
use std::io::{self, BufRead as _, Write};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use ivx_cache::{Store, StoreError};

use super::queue::{
    Answer, BEATS, CANCELLED, CLAIMED, DONE, ENDED, Here, Laid, N_MAX, READY, WORKERS, get, put,
};
use super::words::{Ask, Batch, Tell};
use super::{end_with_parent, store};
use crate::time::now_millis;
use crate::{BROKEN, OK, STOPPED, Trouble, args};

/// How often the store is looked at while something happens, and while nothing does.
const SOON: Duration = Duration::from_millis(10);
const LATER: Duration = Duration::from_millis(100);
/// How often workers are looked at.
const ROUND: Duration = Duration::from_secs(1);
/// How often a batch is begun.
const TRIES: u32 = 4;

pub(crate) fn serve(
    args: &args::NodeServe,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    end_with_parent();
    let store = match store(&args.store) {
        Ok(store) => store,
        Err(why) => {
            tell(
                out,
                &Tell {
                    failed: Some(format!("the store cannot be used: {why}")),
                    ..Tell::default()
                },
            )?;
            return Ok(BROKEN);
        }
    };
    let run =
        args.run.clone().unwrap_or_else(|| format!("{}-{}", now_millis(), std::process::id()));
    let asks = listen();
    let mut server = Server {
        store: &*store,
        args,
        run,
        out,
        flights: BTreeMap::new(),
        workers: BTreeMap::new(),
        looked: None,
        told: (0, 0, 0),
    };
    let served = server.serve(&asks);
    let name = format!("{ENDED}/{}", server.run);
    // Workers that were begun for this run end.
    store.put(&name, b"").ok();
    match served {
        Ok(()) => Ok(OK),
        Err(Broken::Output(error)) => Err(error.into()),
        Err(Broken::Store(error)) => {
            let failed = Some(format!("the store fails: {error}"));
            tell(out, &Tell { failed, ..Tell::default() })?;
            writeln!(err, "error: the store fails: {error}")?;
            Ok(BROKEN)
        }
    }
}

/// What keeps a server from going on.
enum Broken {
    Store(StoreError),
    Output(io::Error),
}

impl From<StoreError> for Broken {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

impl From<io::Error> for Broken {
    fn from(error: io::Error) -> Self {
        Self::Output(error)
    }
}

struct Server<'a> {
    store: &'a dyn Store,
    args: &'a args::NodeServe,
    run: String,
    out: &'a mut dyn Write,
    flights: BTreeMap<u64, Flight>,
    workers: BTreeMap<String, Alive>,
    /// When workers were looked at.
    looked: Option<Instant>,
    /// What was told of them: all threads, and the threads and memory of the largest.
    told: (usize, usize, u64),
}

/// A batch that has not ended.
struct Flight {
    batch: Batch,
    tries: u32,
    name: String,
    /// What its worker counted last, and since when; none while nobody has it.
    beat: Option<(Vec<u8>, Instant)>,
}

/// A worker.
struct Alive {
    here: Here,
    since: Instant,
}

impl Server<'_> {
    fn serve(&mut self, asks: &Receiver<Ask>) -> Result<(), Broken> {
        self.workers()?;
        if self.told.0 == 0 {
            let what = format!("waiting for workers: `ivx worker {}`", self.args.store.display());
            tell(self.out, &Tell { note: Some(what), ..Tell::default() })?;
        }
        let mut wait = SOON;
        loop {
            match asks.recv_timeout(wait) {
                Ok(ask) => {
                    self.asked(ask)?;
                    while let Ok(ask) = asks.try_recv() {
                        self.asked(ask)?;
                    }
                    wait = SOON;
                }
                Err(RecvTimeoutError::Timeout) => wait = (wait * 2).min(LATER),
                // Nobody waits for anything any more; what runs goes on record.
                Err(RecvTimeoutError::Disconnected) => {
                    for flight in self.flights.values().filter(|flight| flight.beat.is_none()) {
                        self.store.remove(&format!("{READY}/{}", flight.name))?;
                    }
                    return Ok(());
                }
            }
            if self.done()? {
                wait = SOON;
            }
            if self.looked.is_none_or(|looked| looked.elapsed() >= ROUND) {
                self.workers()?;
                self.beats()?;
            }
        }
    }

    fn asked(&mut self, ask: Ask) -> Result<(), Broken> {
        match ask {
            Ask::Run(batch) => self.lay(batch, 1),
            Ask::Cancel { cancel } => {
                let Some(flight) = self.flights.get(&cancel) else { return Ok(()) };
                let name = flight.name.clone();
                self.store.put(&format!("{CANCELLED}/{name}"), b"")?;
                self.store.remove(&format!("{READY}/{name}"))?;
                // It belongs to nobody, or to who will hear of it.
                if self.store.create(&format!("{CLAIMED}/{name}"), b"cancelled")? {
                    self.ends(cancel, -2, Answer::none(), "it was cancelled")?;
                }
                Ok(())
            }
        }
    }

    fn lay(&mut self, batch: Batch, tries: u32) -> Result<(), Broken> {
        let name = format!("{}.{:08}.{tries}", self.run, batch.run);
        let laid = Laid { batch: batch.clone(), library: self.args.library.clone() };
        put(self.store, &format!("{READY}/{name}"), &laid)?;
        self.flights.insert(batch.run, Flight { batch, tries, name, beat: None });
        Ok(())
    }

    /// Tells of batches that have ended; whether there were any.
    fn done(&mut self) -> Result<bool, Broken> {
        if self.flights.is_empty() {
            return Ok(false);
        }
        let done = self.store.list(DONE, N_MAX)?;
        let flights =
            self.flights.values().filter(|flight| done.binary_search(&flight.name).is_ok());
        let ended: Vec<(u64, String)> =
            flights.map(|flight| (flight.batch.run, flight.name.clone())).collect();
        for (batch, name) in &ended {
            let answer = get::<Answer>(self.store, &format!("{DONE}/{name}"))?;
            self.forget(name)?;
            let answer = answer.unwrap_or_else(Answer::none);
            match answer.code {
                // Killed: by the system, most likely, for the memory that it took.
                -9 => self.killed(*batch, answer)?,
                // Its machine was taken from it, or could not reach the store.
                code if code < 0 || [i64::from(STOPPED), i64::from(BROKEN)].contains(&code) => {
                    let why = format!("it ended with {code} on {}", answer.machine);
                    self.again(*batch, &why, answer)?;
                }
                code => self.ends(*batch, code, answer, "")?,
            }
        }
        Ok(!ended.is_empty())
    }

    /// Runs a batch again with twice the memory, if there is a machine that has it.
    fn killed(&mut self, batch: u64, answer: Answer) -> Result<(), Broken> {
        let largest = self.workers.values().map(|alive| alive.here.memory).max().unwrap_or(0);
        let Some(flight) = self.flights.get_mut(&batch) else { return Ok(()) };
        let had = flight.batch.memory;
        let memory = if had == 0 { largest / 2 } else { had.saturating_mul(2) };
        if memory > largest || memory == had {
            let mb = had / 1_000_000;
            let why = format!(
                "it was killed on {}, where it had {mb} MB of memory, and no machine has twice as much",
                answer.machine
            );
            return self.ends(batch, -1, answer, &why);
        }
        flight.batch.memory = memory;
        let why = format!(
            "it was killed on {}; it gets {} MB of memory",
            answer.machine,
            memory / 1_000_000
        );
        self.again(batch, &why, answer)
    }

    fn again(&mut self, batch: u64, why: &str, answer: Answer) -> Result<(), Broken> {
        let Some(flight) = self.flights.get(&batch) else { return Ok(()) };
        if flight.tries >= TRIES {
            let why = format!("it was begun {TRIES} times: {why}");
            return self.ends(batch, -1, answer, &why);
        }
        let (own, tries) = (flight.batch.clone(), flight.tries + 1);
        tell(self.out, &Tell { lost: Some(batch), why: why.to_owned(), ..Tell::default() })?;
        self.lay(own, tries)
    }

    fn ends(&mut self, batch: u64, code: i64, answer: Answer, why: &str) -> Result<(), Broken> {
        self.flights.remove(&batch);
        let (said, err, why) = (answer.said, answer.err, why.to_owned());
        tell(self.out, &Tell { done: Some(batch), code, said, err, why, ..Tell::default() })?;
        Ok(())
    }

    /// Removes what was said of a batch.
    fn forget(&self, name: &str) -> Result<(), Broken> {
        for folder in [READY, BEATS, CANCELLED, CLAIMED, DONE] {
            self.store.remove(&format!("{folder}/{name}"))?;
        }
        Ok(())
    }

    /// Gives batches to others whose workers count no more.
    fn beats(&mut self) -> Result<(), Broken> {
        let claimed = self.store.list(CLAIMED, N_MAX)?;
        let mut dead = Vec::new();
        for (batch, flight) in &mut self.flights {
            if claimed.binary_search(&flight.name).is_err() {
                continue;
            }
            let beat = self.store.get(&format!("{BEATS}/{}", flight.name), 100)?;
            let beat = beat.unwrap_or_default();
            match &flight.beat {
                Some((last, since)) if *last == beat => {
                    if since.elapsed() > self.args.dead {
                        dead.push((*batch, flight.name.clone(), since.elapsed()));
                    }
                }
                _ => flight.beat = Some((beat, Instant::now())),
            }
        }
        for (batch, name, silent) in dead {
            // Should it live, it hears that nobody waits for it.
            self.store.put(&format!("{CANCELLED}/{name}"), b"")?;
            let why = format!("nothing was heard of its worker for {} s", silent.as_secs());
            self.again(batch, &why, Answer::none())?;
        }
        Ok(())
    }

    /// Looks who there is, and tells what there is to run on if that has changed.
    fn workers(&mut self) -> Result<(), Broken> {
        self.looked = Some(Instant::now());
        let names = self.store.list(WORKERS, N_MAX)?;
        self.workers.retain(|name, _| names.binary_search(name).is_ok());
        for name in names {
            let Some(here) = get::<Here>(self.store, &format!("{WORKERS}/{name}"))? else {
                continue;
            };
            match self.workers.get_mut(&name) {
                Some(alive) if alive.here.beat == here.beat => {}
                Some(alive) => *alive = Alive { here, since: Instant::now() },
                // What is left of one that died long ago counts no more.
                None => _ = self.workers.insert(name, Alive { here, since: Instant::now() }),
            }
        }
        let dead = self.args.dead;
        let alive = self.workers.values().filter(|alive| alive.since.elapsed() <= dead);
        let alive: Vec<&Here> = alive.map(|alive| &alive.here).collect();
        let cpus = alive.iter().map(|here| here.cpus).sum();
        let largest_cpus = alive.iter().map(|here| here.cpus).max().unwrap_or(0);
        let largest_memory = alive.iter().map(|here| here.memory).max().unwrap_or(0);
        if (cpus, largest_cpus, largest_memory) != self.told {
            self.told = (cpus, largest_cpus, largest_memory);
            let n = alive.len();
            let workers = if n == 1 { "worker" } else { "workers" };
            let threads = if cpus == 1 { "thread" } else { "threads" };
            let ready = Some(format!("{n} {workers} with {cpus} {threads}"));
            let told = Tell { ready, cpus, largest_cpus, largest_memory, ..Tell::default() };
            tell(self.out, &told)?;
        }
        Ok(())
    }
}

impl Answer {
    fn none() -> Self {
        let (said, err, machine) = (String::new(), String::new(), "an unknown machine".to_owned());
        Self { code: -1, said, err, machine }
    }
}

fn tell(out: &mut dyn Write, what: &Tell) -> io::Result<()> {
    writeln!(out, "{}", serde_json::to_string(what)?)?;
    out.flush()
}

/// What is asked, until nobody asks any more.
fn listen() -> Receiver<Ask> {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        for line in io::stdin().lock().lines().map_while(Result::ok) {
            if let Ok(ask) = serde_json::from_str(&line)
                && sender.send(ask).is_err()
            {
                return;
            }
        }
    });
    receiver
}
