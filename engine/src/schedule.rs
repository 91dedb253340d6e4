//! Runs what is not known.
//!
//! This thread alone owns the state: it decides, looks up and commits. Workers read inputs,
//! compute, encode, hash and write, and send messages.

mod away;
mod ended;
mod failures;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use ivx_cache::{Cache, CacheError, Digest, Objects, Output};
use ivx_op::{MISSING, Needs, Registry};
use petgraph::Direction::Incoming;
use petgraph::graph::NodeIndex;

use away::Away;

use crate::checkpoint::Pace;
use crate::crew::Crew;
use crate::durations::Durations;
use crate::event::{Event, Listen};
use crate::execute::{Bench, Message, Task, work};
use crate::key::{key, number_digest};
use crate::options::Options;
use crate::outcome::{Fate, Node, Outcome};
use crate::plan::{Plan, Source, Step};
use crate::platform::platform;
use crate::pool::pool;
use crate::queue::{Queue, Start};

/// How often a node that another process runs is looked at again.
const POLL: Duration = Duration::from_millis(50);
/// How often the journal is synced while a run goes on.
const SYNC: Duration = Duration::from_secs(1);
/// So many nodes are looked up at once, and then it is seen whether the run was asked to end.
const WAVE: usize = 1024;
/// So many nodes of operations that take less than a millisecond are handed to a worker at once.
const BATCH: usize = 32;

/// Runs every node whose result is not known, and reads the results of `wanted`.
///
/// # Errors
/// If the cache fails. A failing operation is no error: it is that node's fate.
///
/// # Panics
/// If not one worker thread can be started.
pub fn schedule(
    plan: &Plan,
    registry: &Registry,
    cache: &mut Cache,
    options: &Options,
    wanted: &BTreeSet<NodeIndex>,
    listen: &mut dyn Listen,
) -> Result<Outcome, CacheError> {
    schedule_on(None, (plan, registry), cache, options, wanted, listen)
}

/// The same on other machines, which share the second store of the cache.
///
/// # Errors
/// As [`schedule`].
///
/// # Panics
/// As [`schedule`].
pub fn schedule_on(
    crew: Option<&dyn Crew>,
    (plan, registry): (&Plan, &Registry),
    cache: &mut Cache,
    options: &Options,
    wanted: &BTreeSet<NodeIndex>,
    listen: &mut dyn Listen,
) -> Result<Outcome, CacheError> {
    loop {
        let away = crew.map(Away::new);
        let of = (plan, registry);
        if let Some(outcome) = look_up_and_run(away, of, cache, options, wanted, listen)? {
            return Ok(outcome);
        }
    }
}

/// The outcome; `None` if the second store said what turned out to be wrong.
fn look_up_and_run(
    away: Option<Away<'_>>,
    (plan, registry): (&Plan, &Registry),
    cache: &mut Cache,
    options: &Options,
    wanted: &BTreeSet<NodeIndex>,
    listen: &mut dyn Listen,
) -> Result<Option<Outcome>, CacheError> {
    let platform = platform();
    let mut run = Run::new(away, (plan, registry), cache, options, listen, &platform);
    run.listen.event(Event::Planned { nodes: plan.graph.node_count() });
    run.begin();
    if run.queue.len() == 0 && !run.read(wanted)? {
        return Ok(Some(Outcome { nodes: run.nodes, values: run.values }));
    }
    let pool = pool(options.jobs.min(run.n_left()));
    let (sender, receiver) = mpsc::channel();
    if let Some(away) = &run.away {
        let tell = sender.clone();
        // Who listens is gone only when the run ended.
        let begun = away.begin(move |news| _ = tell.send(Message::Heard(news)));
        if let Err(error) = begun {
            run.gone(&error.to_string());
        }
    }
    pool.in_place_scope(|scope| {
        loop {
            run.work(scope, &sender, &receiver)?;
            if !run.read(wanted)? {
                break;
            }
        }
        run.cache.sync()
    })?;
    Ok((!run.misled).then_some(Outcome { nodes: run.nodes, values: run.values }))
}

struct Run<'a> {
    /// Other machines.
    away: Option<Away<'a>>,
    plan: &'a Plan,
    registry: &'a Registry,
    cache: &'a mut Cache,
    options: &'a Options,
    listen: &'a mut dyn Listen,
    bench: Bench<'a>,
    objects: Objects,
    nodes: Vec<Node>,
    values: BTreeMap<NodeIndex, Arc<[u8]>>,
    /// How many inputs of each node are not known yet.
    waiting: Vec<usize>,
    /// Nodes that must run though their record is known, since its bytes are gone; and the
    /// nodes that wait for each.
    forced: BTreeMap<NodeIndex, Vec<NodeIndex>>,
    durations: Durations,
    /// The longest path from each node to the end, in expected milliseconds; nothing before
    /// the first that runs.
    priority: Vec<u64>,
    queue: Queue,
    /// Nodes that another process runs.
    elsewhere: Vec<NodeIndex>,
    stopped: bool,
    /// Whether the second store said what turned out to be wrong: all is looked up again.
    misled: bool,
    synced: Instant,
}

impl<'a> Run<'a> {
    fn new(
        away: Option<Away<'a>>,
        (plan, registry): (&'a Plan, &'a Registry),
        cache: &'a mut Cache,
        options: &'a Options,
        listen: &'a mut dyn Listen,
        platform: &'a str,
    ) -> Self {
        let n = plan.graph.node_count();
        let waiting =
            plan.graph.node_indices().map(|i| plan.graph.neighbors_directed(i, Incoming).count());
        let bench = Bench {
            registry,
            objects: cache.objects(),
            checkpoints: cache.checkpoints(),
            platform,
            library: &options.library,
            pace: Pace { every: options.checkpoint, limit: options.limit, stop: &options.stop },
        };
        let limits = Needs { threads: options.jobs.max(1), memory: options.memory };
        let limits = away.as_ref().map_or(limits, Away::limits);
        Self {
            away,
            plan,
            registry,
            objects: cache.objects(),
            bench,
            cache,
            options,
            listen,
            nodes: vec![Node::default(); n],
            values: BTreeMap::new(),
            waiting: waiting.collect(),
            forced: BTreeMap::new(),
            durations: Durations::new(plan, registry),
            priority: Vec::new(),
            queue: Queue::new(limits),
            elsewhere: Vec::new(),
            stopped: false,
            misled: false,
            synced: Instant::now(),
        }
    }

    fn begin(&mut self) {
        self.resolve(self.plan.graph.externals(Incoming).collect());
    }

    fn step(&self, node: NodeIndex) -> &'a Step {
        &self.plan.graph[node]
    }

    /// How many nodes may still run: more threads would have nothing to do.
    fn n_left(&self) -> usize {
        self.nodes.iter().filter(|node| node.output.is_none()).count() + self.forced.len()
    }

    /// Whether to begin nothing more.
    fn is_over(&self) -> bool {
        self.stopped || self.options.stop.asked()
    }

    fn digest(&self, source: &Source) -> Digest {
        match source {
            Source::Number(x) => number_digest(*x),
            Source::Node(node) => {
                let output = self.nodes[node.index()].output.as_ref();
                output.map_or_else(|| number_digest(MISSING), |output| output.digest)
            }
        }
    }

    /// Looks nodes up whose inputs are known, and all that follows from hits.
    fn resolve(&mut self, mut todo: Vec<NodeIndex>) {
        while !todo.is_empty() && !self.is_over() {
            let wave: Vec<_> = todo.drain(..todo.len().min(WAVE)).collect();
            let key = |node| key(self.step(node), self.registry, |source| self.digest(source));
            let keys: Vec<_> = wave.iter().map(|node| key(*node)).collect();
            self.cache.seek(&keys);
            for (node, key) in wave.into_iter().zip(keys) {
                self.nodes[node.index()].key = Some(key);
                match self.cache.lookup(&key).map(|record| record.output.clone()) {
                    Some(output) if !self.forced.contains_key(&node) => {
                        self.listen.event(Event::Hit { address: &self.step(node).address });
                        todo.extend(self.done(node, output, Fate::Hit));
                    }
                    _ => self.enqueue(node),
                }
            }
        }
    }

    fn enqueue(&mut self, node: NodeIndex) {
        if self.priority.is_empty() {
            self.durations.learn(self.plan, self.cache.hints());
            self.priority = self.durations.longest_paths(self.plan);
        }
        let needs = self.needs(node);
        self.queue.push(node, self.priority[node.index()], needs);
    }

    fn needs(&self, node: NodeIndex) -> Needs {
        let step = self.step(node);
        let size = |source: Source| {
            let output = source.node().and_then(|node| self.nodes[node.index()].output.as_ref());
            output.map_or(0, |output| output.size)
        };
        step.needs(self.plan, self.registry, step.sources().map(size).sum())
    }

    /// Notes a result, and returns the nodes that are ready by it.
    fn done(&mut self, node: NodeIndex, output: Output, fate: Fate) -> Vec<NodeIndex> {
        let slot = &mut self.nodes[node.index()];
        let first = slot.output.is_none();
        slot.output = Some(output);
        self.end(node, fate);
        let mut ready = Vec::new();
        let waiters = self.forced.remove(&node).unwrap_or_default();
        let next: Vec<_> =
            if first { self.plan.graph.neighbors(node).collect() } else { Vec::new() };
        for next in next.into_iter().chain(waiters) {
            let waiting = &mut self.waiting[next.index()];
            *waiting -= 1;
            if *waiting == 0 {
                ready.push(next);
            }
        }
        ready.sort_unstable();
        ready
    }

    /// Runs until nothing is left that can run.
    fn work<'s>(
        &mut self,
        scope: &rayon::Scope<'s>,
        sender: &Sender<Message>,
        receiver: &Receiver<Message>,
    ) -> Result<(), CacheError>
    where
        'a: 's,
    {
        loop {
            if let Some(away) = &self.away {
                self.queue.limit(away.limits());
            }
            while !self.is_over()
                && let Some(start) = self.queue.next()
            {
                self.launch(start, scope, sender)?;
            }
            let waits = self.away.as_ref().is_some_and(|away| away.waits() && self.queue.len() > 0);
            let waits = waits || !self.elsewhere.is_empty();
            if self.queue.running() == 0 && (!waits || self.is_over()) {
                return Ok(());
            }
            let soon = !self.elsewhere.is_empty() || self.away.is_some();
            match receiver.recv_timeout(if soon { POLL } else { SYNC }) {
                Ok(message) => self.receive(message)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => unreachable!("a sender lives here"),
            }
            for node in std::mem::take(&mut self.elsewhere) {
                self.enqueue(node);
            }
            self.call_back();
            if self.synced.elapsed() >= SYNC {
                self.cache.sync()?;
                self.synced = Instant::now();
            }
        }
    }

    /// Hands a node to a worker; of short ones, several.
    fn launch<'s>(
        &mut self,
        start: Start,
        scope: &rayon::Scope<'s>,
        sender: &Sender<Message>,
    ) -> Result<(), CacheError>
    where
        'a: 's,
    {
        let Start { node, needs, alone } = start;
        if self.away.is_some() {
            let tasks = self.launch_away(start)?;
            self.spawn(tasks, needs, scope, sender);
            return Ok(());
        }
        if alone {
            let what = if needs.threads > self.options.jobs.max(1) {
                format!("{} threads", needs.threads)
            } else {
                format!("{} MB of memory", needs.memory.div_ceil(1_000_000))
            };
            let address = &self.step(node).address;
            let what = format!("{address} needs {what}, more than it may have: it runs alone");
            self.listen.event(Event::Noted { what });
        }
        let mut tasks: Vec<Task<'a>> = self.task(node)?.into_iter().collect();
        let fair = self.queue.len() / self.options.jobs.max(1);
        while tasks.len() < fair.min(BATCH) && needs == Needs::default() {
            let short = |node| self.durations.expected_millis(node) == Some(0);
            let Some(next) = self.queue.another(|next| short(node) && short(next)) else { break };
            tasks.extend(self.task(next)?);
        }
        if tasks.is_empty() {
            self.queue.end(needs);
        }
        self.spawn(tasks, needs, scope, sender);
        Ok(())
    }

    /// Hands nodes to a worker, if there are any.
    fn spawn<'s>(
        &self,
        tasks: Vec<Task<'a>>,
        needs: Needs,
        scope: &rayon::Scope<'s>,
        sender: &Sender<Message>,
    ) where
        'a: 's,
    {
        if !tasks.is_empty() {
            let (sender, bench) = (sender.clone(), self.bench.clone());
            scope.spawn(move |_| work(tasks, needs, &bench, &sender));
        }
    }

    /// A node as a worker takes it; nothing if another process runs it or has just done so,
    /// or an input was lost since it was queued and could not be made again.
    fn task(&mut self, node: NodeIndex) -> Result<Option<Task<'a>>, CacheError> {
        if self.lost(node).is_some() {
            return Ok(None);
        }
        let step = self.step(node);
        let key = self.nodes[node.index()].key.expect("what is queued has a key");
        let Some(lock) = self.cache.try_lock(&key)? else {
            self.elsewhere.push(node);
            return Ok(None);
        };
        let known = self.cache.lookup(&key).map(|record| record.output.clone());
        if let (Some(output), false) = (known, self.forced.contains_key(&node)) {
            drop(lock);
            self.listen.event(Event::Hit { address: &step.address });
            let next = self.done(node, output, Fate::Hit);
            self.resolve(next);
            return Ok(None);
        }
        let expected_millis = self.durations.expected_millis(node);
        self.listen.event(Event::Started { address: &step.address, expected_millis });
        let output = |node: NodeIndex| Some((node, self.nodes[node.index()].output.clone()?));
        let outputs = step.sources().filter_map(|source| output(source.node()?)).collect();
        let op = self.durations.op(node).to_owned();
        Ok(Some(Task { node, step, op, key, lock, outputs }))
    }
}
