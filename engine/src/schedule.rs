//! Runs what is not known.
//!
//! This thread alone owns the state: it decides, looks up and commits. Workers read inputs,
//! compute, encode, hash and write, and send one message.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use ivx_cache::{
    ActionLock, Cache, CacheError, Digest, Fetched, Objects, Output, Provenance, Record,
};
use ivx_op::Registry;
use petgraph::Direction::Incoming;
use petgraph::graph::NodeIndex;

use crate::checkpoint::Checkpoint;
use crate::event::{Event, Listen};
use crate::execute::{Problem, execute};
use crate::key::{explain, key, number_digest};
use crate::outcome::{Fate, Node, Outcome};
use crate::plan::{Plan, Source, Step};
use crate::platform::platform;
use crate::stop::Stop;

/// How a run goes about its work; nothing here can change a result.
#[derive(Clone, Debug)]
pub struct Options {
    /// How many nodes run at once.
    pub jobs: usize,
    /// Whether the first failure ends the run.
    pub fail_fast: bool,
    /// The digest of the library's source, for provenance.
    pub library: String,
    /// How much time lies between two checkpoints of a node.
    pub checkpoint: Duration,
    /// Ends the run early: what runs is finished and kept, nothing more is started.
    pub stop: Stop,
}

/// How often a node that another process runs is looked at again.
const POLL: Duration = Duration::from_millis(50);
/// How often the journal is synced while a run goes on.
const SYNC: Duration = Duration::from_secs(1);

struct Message {
    node: NodeIndex,
    key: Digest,
    lock: ActionLock,
    result: Result<(Output, u64), Problem>,
}

/// Runs every node whose result is not known, and reads the results of `wanted`.
///
/// # Errors
/// If the cache fails. A failing operation is no error: it is that node's fate.
///
/// # Panics
/// If worker threads cannot be started.
pub fn schedule(
    plan: &Plan,
    registry: &Registry,
    cache: &mut Cache,
    options: &Options,
    wanted: &BTreeSet<NodeIndex>,
    listen: &mut dyn Listen,
) -> Result<Outcome, CacheError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.jobs.max(1)).build();
    let pool = pool.expect("the system starts threads");
    let (sender, receiver) = mpsc::channel();
    let mut run = Run::new(plan, registry, cache, options, listen);
    run.listen.event(Event::Planned { nodes: plan.graph.node_count() });
    pool.in_place_scope(|scope| {
        run.begin();
        loop {
            run.work(scope, &sender, &receiver)?;
            if !run.read(wanted)? {
                break;
            }
        }
        run.cache.sync()
    })?;
    Ok(Outcome { nodes: run.nodes, values: run.values })
}

struct Run<'a> {
    plan: &'a Plan,
    registry: &'a Registry,
    cache: &'a mut Cache,
    options: &'a Options,
    listen: &'a mut dyn Listen,
    objects: Objects,
    platform: String,
    nodes: Vec<Node>,
    values: BTreeMap<NodeIndex, Arc<[u8]>>,
    /// How many inputs of each node are not known yet.
    waiting: Vec<usize>,
    /// Nodes that must run though their record is known, since its bytes are gone; and the
    /// nodes that wait for each.
    forced: BTreeMap<NodeIndex, Vec<NodeIndex>>,
    /// How many nodes of each operation have not ended.
    left: BTreeMap<String, u64>,
    /// The longest path from each node to the end, in expected milliseconds.
    priority: Vec<u64>,
    runnable: BinaryHeap<(u64, Reverse<NodeIndex>)>,
    /// Nodes that another process runs.
    elsewhere: Vec<NodeIndex>,
    running: usize,
    stopped: bool,
    synced: Instant,
}

impl<'a> Run<'a> {
    fn new(
        plan: &'a Plan,
        registry: &'a Registry,
        cache: &'a mut Cache,
        options: &'a Options,
        listen: &'a mut dyn Listen,
    ) -> Self {
        let n = plan.graph.node_count();
        let waiting =
            plan.graph.node_indices().map(|i| plan.graph.neighbors_directed(i, Incoming).count());
        Self {
            plan,
            registry,
            objects: cache.objects(),
            platform: platform(),
            cache,
            options,
            listen,
            nodes: vec![Node::default(); n],
            values: BTreeMap::new(),
            waiting: waiting.collect(),
            forced: BTreeMap::new(),
            left: BTreeMap::new(),
            priority: Vec::new(),
            runnable: BinaryHeap::new(),
            elsewhere: Vec::new(),
            running: 0,
            stopped: false,
            synced: Instant::now(),
        }
    }

    fn begin(&mut self) {
        for step in self.plan.graph.node_weights() {
            *self.left.entry(self.versioned(step)).or_default() += 1;
        }
        for node in self.plan.graph.node_indices() {
            if self.plan.graph.neighbors_directed(node, Incoming).next().is_none() {
                self.resolve(node);
            }
        }
    }

    fn step(&self, node: NodeIndex) -> &'a Step {
        &self.plan.graph[node]
    }

    fn versioned(&self, step: &Step) -> String {
        format!("{}@{}", step.op, self.registry.decl(&step.op).map_or(0, |decl| decl.version))
    }

    fn digest(&self, source: &Source) -> Digest {
        match source {
            Source::Number(x) => number_digest(*x),
            Source::Node(node) => {
                self.nodes[node.index()].output.as_ref().expect("inputs come first").digest
            }
        }
    }

    /// Looks a node up whose inputs are known, and all that follows from hits.
    fn resolve(&mut self, node: NodeIndex) {
        let mut todo = vec![node];
        while let Some(node) = todo.pop() {
            let key = key(self.step(node), self.registry, |source| self.digest(source));
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

    fn enqueue(&mut self, node: NodeIndex) {
        if self.priority.is_empty() {
            self.priority = self.priorities();
        }
        self.runnable.push((self.priority[node.index()], Reverse(node)));
    }

    /// Longest paths to the end, with durations learned from earlier runs.
    fn priorities(&mut self) -> Vec<u64> {
        let mut longest = vec![0; self.nodes.len()];
        for node in self.plan.graph.node_indices().rev() {
            let after = self
                .plan
                .graph
                .neighbors(node)
                .map(|next| longest[next.index()])
                .max()
                .unwrap_or(0);
            let op = self.versioned(self.step(node));
            longest[node.index()] =
                after + self.cache.hints().expected_millis(&op).unwrap_or(1).max(1);
        }
        longest
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
        ready.sort_unstable_by(|a, b| b.cmp(a));
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
            self.stopped |= self.options.stop.asked();
            while self.running < self.options.jobs.max(1) && !self.stopped {
                let Some((_, Reverse(node))) = self.runnable.pop() else {
                    break;
                };
                // An input that was lost since it was queued may have failed to run again.
                if self.lost(node).is_none() {
                    self.launch(node, scope, sender)?;
                }
            }
            if self.running == 0 && (self.elsewhere.is_empty() || self.stopped) {
                return Ok(());
            }
            match receiver.recv_timeout(if self.elsewhere.is_empty() { SYNC } else { POLL }) {
                Ok(message) => self.receive(message)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => unreachable!("a sender lives here"),
            }
            for node in std::mem::take(&mut self.elsewhere) {
                self.enqueue(node);
            }
            if self.synced.elapsed() >= SYNC {
                self.cache.sync()?;
                self.synced = Instant::now();
            }
        }
    }

    /// Starts a node, unless another process runs it or has just done so.
    fn launch<'s>(
        &mut self,
        node: NodeIndex,
        scope: &rayon::Scope<'s>,
        sender: &Sender<Message>,
    ) -> Result<(), CacheError>
    where
        'a: 's,
    {
        let step = self.step(node);
        let key = key(step, self.registry, |source| self.digest(source));
        let Some(lock) = self.cache.try_lock(&key)? else {
            self.elsewhere.push(node);
            return Ok(());
        };
        self.cache.refresh()?;
        let known = self.cache.lookup(&key).map(|record| record.output.clone());
        if let (Some(output), false) = (known, self.forced.contains_key(&node)) {
            drop(lock);
            self.listen.event(Event::Hit { address: &step.address });
            for next in self.done(node, output, Fate::Hit) {
                self.resolve(next);
            }
            return Ok(());
        }
        let op = self.versioned(step);
        let expected_millis = self.cache.hints().expected_millis(&op);
        self.listen.event(Event::Started { address: &step.address, expected_millis });
        self.running += 1;
        let output = |node: NodeIndex| {
            (node, self.nodes[node.index()].output.clone().expect("inputs come first"))
        };
        let outputs: BTreeMap<NodeIndex, Output> =
            step.sources().filter_map(|source| source.node()).map(output).collect();
        let checkpoint = Checkpoint::new(
            self.cache.checkpoints(),
            &key,
            (&self.platform, &self.options.library),
            self.options.checkpoint,
        );
        let (sender, objects, registry) = (sender.clone(), self.objects.clone(), self.registry);
        scope.spawn(move |_| {
            let result = execute(step, registry, &objects, &outputs, &checkpoint);
            // The receiver is gone only when the run ended with an error.
            let _ = sender.send(Message { node, key, lock, result });
        });
        Ok(())
    }

    fn receive(&mut self, message: Message) -> Result<(), CacheError> {
        let Message { node, key, lock, result } = message;
        self.running -= 1;
        let step = self.step(node);
        match result {
            Ok((output, millis)) => {
                let op = self.versioned(step);
                let inputs = step.sources().map(|source| self.digest(&source)).collect();
                let explanation = explain(step, self.registry, |source| self.digest(source));
                let library = self.options.library.clone();
                let provenance = Provenance {
                    op: op.clone(),
                    node: step.address.clone(),
                    inputs,
                    explanation,
                    library,
                    millis,
                };
                let platform = self.platform.clone();
                match self.cache.commit(Record {
                    key,
                    platform,
                    output: output.clone(),
                    provenance,
                }) {
                    Ok(_) => {}
                    Err(CacheError::Conflict(conflict)) => {
                        drop(lock);
                        self.fail(node, &conflict.to_string());
                        return Ok(());
                    }
                    Err(error) => return Err(error),
                }
                drop(lock);
                self.cache.hints().note_millis(&op, millis);
                for next in self.done(node, output, Fate::Ran { millis }) {
                    self.resolve(next);
                }
                let left_millis = self.left_millis();
                self.listen.event(Event::Finished { address: &step.address, millis, left_millis });
            }
            Err(Problem::Missing(inputs)) => {
                if let Some(cause) = inputs.iter().find_map(|input| self.lost(*input)) {
                    self.skip(vec![node], cause);
                    return Ok(());
                }
                self.waiting[node.index()] += inputs.len();
                for input in inputs {
                    self.force(input, Some(node));
                }
            }
            Err(Problem::Failed(why)) => self.fail(node, &why),
            Err(Problem::Cache(error)) => return Err(error),
        }
        Ok(())
    }

    /// Runs a known node again, since its bytes are gone.
    fn force(&mut self, node: NodeIndex, waiter: Option<NodeIndex>) {
        let what = format!("the bytes of {} are gone: it runs again", self.step(node).address);
        let waiters = self.forced.entry(node).or_insert_with(|| {
            self.listen.event(Event::Noted { what });
            self.runnable.push((u64::MAX, Reverse(node)));
            Vec::new()
        });
        waiters.extend(waiter);
    }

    /// Expected milliseconds of what is left, not counting operations that were never seen;
    /// `None` if that is all of them.
    fn left_millis(&mut self) -> Option<u64> {
        let hints = self.cache.hints();
        let expected = self.left.iter().filter_map(|(op, n)| Some(hints.expected_millis(op)? * n));
        expected.reduce(u64::saturating_add)
    }

    /// Notes how a node ended.
    fn end(&mut self, node: NodeIndex, fate: Fate) {
        if self.nodes[node.index()].fate == Fate::Waiting {
            let op = self.versioned(self.step(node));
            let left = self.left.get_mut(&op).expect("every operation was counted");
            *left -= 1;
            if *left == 0 {
                self.left.remove(&op);
            }
        }
        self.nodes[node.index()].fate = fate;
    }

    /// The node that failed, if this one has no bytes because of it.
    fn lost(&self, node: NodeIndex) -> Option<NodeIndex> {
        match self.nodes[node.index()].fate {
            Fate::Failed { .. } => Some(node),
            Fate::Skipped { cause } => Some(cause),
            Fate::Waiting | Fate::Hit | Fate::Ran { .. } => None,
        }
    }

    /// Notes a failure, and skips what depends on it.
    fn fail(&mut self, node: NodeIndex, why: &str) {
        self.listen.event(Event::Failed { address: &self.step(node).address, why });
        self.end(node, Fate::Failed { why: why.to_owned() });
        self.stopped |= self.options.fail_fast;
        let stranded = self.stranded(node);
        self.skip(stranded, node);
    }

    /// Skips some nodes, and what needs them.
    fn skip(&mut self, mut todo: Vec<NodeIndex>, cause: NodeIndex) {
        while let Some(node) = todo.pop() {
            // A known node whose bytes are gone is as good as one that never ran.
            let known = matches!(self.nodes[node.index()].fate, Fate::Hit | Fate::Ran { .. });
            if self.lost(node).is_none() && (!known || self.forced.contains_key(&node)) {
                self.end(node, Fate::Skipped { cause });
                let (address, cause) = (&self.step(node).address, &self.step(cause).address);
                self.listen.event(Event::Skipped { address, cause });
                todo.extend(self.stranded(node));
            }
        }
    }

    /// Those that wait for a node which will not end.
    fn stranded(&mut self, node: NodeIndex) -> Vec<NodeIndex> {
        let waiters = self.forced.remove(&node).unwrap_or_default();
        self.plan.graph.neighbors(node).chain(waiters).collect()
    }

    /// Reads the results asked for. Returns whether some must run again for it.
    fn read(&mut self, wanted: &BTreeSet<NodeIndex>) -> Result<bool, CacheError> {
        let mut again = false;
        for &node in wanted {
            let Some(output) = &self.nodes[node.index()].output else {
                continue;
            };
            if self.values.contains_key(&node) || self.lost(node).is_some() {
                continue;
            }
            if let Fetched::Bytes(bytes) = self.objects.read(output)? {
                self.values.insert(node, bytes);
            } else {
                self.force(node, None);
                again = true;
            }
        }
        Ok(again && !self.stopped)
    }
}
