//! Nodes that other machines run.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::time::{Duration, Instant};

use ivx_cache::{ActionLock, CacheError, Digest, Fetched, Output};
use ivx_op::{Content, Needs};
use petgraph::graph::NodeIndex;

use super::Run;
use crate::crew::{Crew, News, Word};
use crate::event::Event;
use crate::execute::Task;
use crate::outcome::Fate;
use crate::queue::Start;
use crate::ticket::Ticket;

/// Nodes are handed out together until they are expected to take so many milliseconds: what it takes to hand them out
/// is then little.
const WORTH: u64 = 1500;
/// So many nodes are handed out together at most.
const MOST: usize = 200;
/// Bytes.
const MB: u64 = 1_000_000;
/// How long what was cancelled may take to end.
const PATIENCE: Duration = Duration::from_secs(5);

/// The other machines, and what they run.
pub(super) struct Away<'a> {
    crew: &'a dyn Crew,
    n: u64,
    flights: BTreeMap<u64, Flight>,
    /// Objects that the second store has.
    there: BTreeSet<Digest>,
    cancelled: Option<Instant>,
}

/// Nodes that are run together.
struct Flight {
    nodes: Vec<(NodeIndex, Digest, ActionLock)>,
    needs: Needs,
}

impl<'a> Away<'a> {
    pub(super) fn new(crew: &'a dyn Crew) -> Self {
        let (flights, there) = (BTreeMap::new(), BTreeSet::new());
        Self { crew, n: 0, flights, there, cancelled: None }
    }

    /// What may be under way at once: as much again as runs, so that no machine waits for the next.
    pub(super) fn limits(&self) -> Needs {
        Needs { threads: 2 * self.crew.room().threads, memory: u64::MAX }
    }

    pub(super) fn begin(&self, tell: impl FnMut(News) + Send + 'static) -> io::Result<()> {
        self.crew.begin(Box::new(tell))
    }

    /// Whether no machine is there yet.
    pub(super) fn waits(&self) -> bool {
        self.crew.room().threads == 0
    }
}

impl<'a> Run<'a> {
    /// Hands a node to another machine, with others that are short; what can't travel is returned.
    pub(super) fn launch_away(&mut self, start: Start) -> Result<Vec<Task<'a>>, CacheError> {
        let Start { node, needs, .. } = start;
        let Some(away) = &self.away else { return Ok(Vec::new()) };
        let room = away.crew.room();
        if needs.memory > room.largest.memory {
            let (needed, there) = (needs.memory.div_ceil(MB), room.largest.memory / MB);
            let why =
                format!("it needs {needed} MB of memory, and the largest machine has {there} MB");
            self.fail(node, &why);
            self.queue.end(needs);
            return Ok(Vec::new());
        }
        let mut tasks: Vec<Task<'a>> = self.task(node)?.into_iter().collect();
        let mut worth = self.durations.expected_millis(node);
        let fair = self.queue.len() / room.threads.max(1);
        while let Some(millis) = worth.filter(|millis| *millis < WORTH)
            && tasks.len() < fair.min(MOST)
            && needs == Needs::default()
        {
            let durations = &self.durations;
            let short = |next| durations.expected_millis(next).is_some_and(|millis| millis < WORTH);
            let Some(next) = self.queue.another(short) else { break };
            worth = self.durations.expected_millis(next).map(|own| millis + own);
            tasks.extend(self.task(next)?);
        }
        let (mut nodes, mut here) = (Vec::new(), Vec::new());
        for task in tasks {
            match self.write_down(&task)? {
                Down::Written => nodes.push((task.node, task.key, task.lock)),
                Down::Stays => here.push(task),
                Down::Lacks(inputs) => self.lacks(task.node, inputs),
            }
        }
        if nodes.is_empty() {
            if here.is_empty() {
                self.queue.end(needs);
            }
            return Ok(here);
        }
        if !here.is_empty() {
            // What stays is a start of its own.
            self.queue.also(needs);
        }
        let keys: Vec<Digest> = nodes.iter().map(|(_, key, _)| *key).collect();
        let Some(away) = &mut self.away else { return Ok(here) };
        let batch = away.n;
        away.n += 1;
        away.flights.insert(batch, Flight { nodes, needs });
        let threads = needs.threads.min(room.largest.threads);
        if let Err(error) = away.crew.run(batch, &keys, Needs { threads, ..needs }) {
            self.gone(&error.to_string());
        }
        Ok(here)
    }

    /// Puts into the second store what another machine needs to know of a node.
    fn write_down(&mut self, task: &Task) -> Result<Down, CacheError> {
        let output = |node: NodeIndex| task.outputs.get(&node).cloned();
        let made = Ticket::new(task.step, task.key, &self.options.library, output);
        let Some((ticket, outside)) = made else { return Ok(Down::Stays) };
        let mut lacking = Vec::new();
        for (node, output) in &task.outputs {
            if output.inline.is_none() && !self.share(output)? {
                lacking.push(*node);
            }
        }
        if !lacking.is_empty() {
            return Ok(Down::Lacks(lacking));
        }
        let (Some(second), Some(away)) = (self.cache.second(), &mut self.away) else {
            return Ok(Down::Stays);
        };
        for found in outside {
            if let Content::File { bytes, .. } = &found.content
                && away.there.insert(Digest(found.digest))
            {
                second.put_object(&Digest(found.digest), bytes);
            }
        }
        let text = ticket.write();
        Ok(if text.is_ok_and(|text| second.put_ticket(&task.key, &text)) {
            Down::Written
        } else {
            Down::Stays
        })
    }

    /// Whether the second store has an object, which is put there if it is here.
    fn share(&mut self, output: &Output) -> Result<bool, CacheError> {
        let (Some(second), Some(away)) = (self.cache.second(), &mut self.away) else {
            return Ok(false);
        };
        if !away.there.contains(&output.digest) && !second.has(output) {
            let Fetched::Bytes(bytes) = self.objects.read(output)? else { return Ok(false) };
            second.put_object(&output.digest, &bytes);
        }
        away.there.insert(output.digest);
        Ok(true)
    }

    /// Commits what came of nodes elsewhere.
    pub(super) fn hear(&mut self, news: News) {
        match news {
            News::Done { batch, words, why } => self.landed(batch, &words, &why),
            News::Lost { batch, why } => {
                let flight = self.away.as_ref().and_then(|away| away.flights.get(&batch));
                let first = flight.and_then(|flight| flight.nodes.first());
                if let Some((node, ..)) = first {
                    let address = &self.step(*node).address;
                    let what =
                        format!("a machine was lost under {address}, which runs again: {why}");
                    self.listen.event(Event::Noted { what });
                }
            }
            News::Noted { what } => {
                self.listen.event(Event::Noted { what });
                let threads = self.away.as_ref().map_or(0, |away| away.crew.room().threads);
                self.listen.event(Event::Room { threads });
            }
            News::Gone { why } => self.gone(&why),
        }
    }

    fn landed(&mut self, batch: u64, words: &[(Digest, Word)], why: &str) {
        let flight = self.away.as_mut().and_then(|away| away.flights.remove(&batch));
        // What was given up may still land.
        let Some(Flight { nodes, needs }) = flight else { return };
        for (node, key, lock) in nodes {
            let word = words.iter().find(|(own, _)| *own == key).map(|(_, word)| word);
            let platform = match word {
                Some(Word::Done(platform)) => platform.as_str(),
                _ => self.bench.platform,
            };
            let found = self.cache.fetch(&key, platform);
            let found = found.map(|record| (record.output.clone(), record.provenance.millis));
            drop(lock);
            match (found, word) {
                (Some((output, millis)), _) => self.came(node, output, millis),
                (None, _) if self.options.stop.asked() => {}
                (None, Some(Word::Missing(digest))) => {
                    let is_it = |node: &NodeIndex| {
                        let output = self.nodes[node.index()].output.as_ref();
                        output.is_some_and(|output| output.digest == *digest)
                    };
                    let sources = self.step(node).sources().filter_map(|source| source.node());
                    let inputs: BTreeSet<NodeIndex> = sources.filter(is_it).collect();
                    self.lacks(node, inputs.into_iter().collect());
                }
                (None, Some(Word::Failed(why))) => self.fail(node, why),
                (None, Some(Word::Refused(why))) => {
                    self.stopped = true;
                    self.fail(node, why);
                }
                (None, Some(Word::Done(_)) | None) => {
                    let said = if why.is_empty() { "nothing is said of it" } else { why };
                    self.fail(node, &format!("it came back without a result: {said}"));
                }
            }
        }
        self.queue.end(needs);
    }

    /// Notes the result of a node that another machine ran.
    fn came(&mut self, node: NodeIndex, output: Output, millis: u64) {
        if let Some(away) = &mut self.away {
            away.there.insert(output.digest);
        }
        self.durations.note(node, self.step(node), millis, self.cache.hints());
        let next = self.done(node, output, Fate::Ran { millis });
        self.resolve(next);
        let left_millis = self.durations.left_millis();
        let address = &self.step(node).address;
        self.listen.event(Event::Finished { address, millis, left_millis });
    }

    /// Nobody runs anything any more: what is under way and what waits has failed, and nothing more begins.
    pub(super) fn gone(&mut self, why: &str) {
        self.stopped = true;
        for node in self.queue.drain() {
            self.fail(node, &format!("nobody runs it: {why}"));
        }
        let flights = self.away.as_mut().map(|away| std::mem::take(&mut away.flights));
        for Flight { nodes, needs } in flights.into_iter().flatten().map(|(_, flight)| flight) {
            for (node, ..) in nodes {
                self.fail(node, &format!("nobody runs it any more: {why}"));
            }
            self.queue.end(needs);
        }
    }

    /// Has what is under way ended, once the run is to end, and gives up what does not.
    pub(super) fn call_back(&mut self) {
        let is_over = self.is_over();
        let Some(away) = &mut self.away else { return };
        if !is_over || away.flights.is_empty() {
            return;
        }
        match away.cancelled {
            None => {
                for batch in away.flights.keys() {
                    // Nobody hears it who is gone.
                    let _ = away.crew.cancel(*batch);
                }
                away.cancelled = Some(Instant::now());
            }
            Some(since) if since.elapsed() > PATIENCE => {
                for Flight { needs, .. } in std::mem::take(&mut away.flights).into_values() {
                    self.queue.end(needs);
                }
            }
            Some(_) => {}
        }
    }
}

/// What came of writing a node down.
enum Down {
    Written,
    /// It runs here: it takes what only this machine has.
    Stays,
    /// The bytes of these inputs are gone.
    Lacks(Vec<NodeIndex>),
}
