//! What a worker does: read inputs, compute, encode, hash and write.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use ivx_cache::{
    ActionLock, CacheError, Checkpoints, Digest, Fetched, Objects, Output, Provenance,
};
use ivx_op::{
    Array, Artifact as _, Bytes, Call, Ctx, Gathered, Held, Lit, MISSING, Needs, OpError, Registry,
};
use petgraph::graph::NodeIndex;

use crate::checkpoint::{Checkpoint, Pace};
use crate::crew::News;
use crate::key::{explain, number_digest};
use crate::plan::{Draw, Fed, Source, Step};
use crate::stop::Busy;

/// Why a node has no result.
pub(crate) enum Problem {
    /// These inputs have no bytes any more.
    Missing(Vec<NodeIndex>),
    /// The operation failed, or panicked.
    Failed(String),
    /// The operation was told to end, and kept what it did.
    Stopped,
    /// The cache failed.
    Cache(CacheError),
}

/// The bytes of a step's inputs.
pub(crate) type Inputs = BTreeMap<NodeIndex, Arc<[u8]>>;

/// What a worker needs to know of a run.
#[derive(Clone)]
pub(crate) struct Bench<'a> {
    pub(crate) registry: &'a Registry,
    pub(crate) objects: Objects,
    pub(crate) checkpoints: Checkpoints,
    pub(crate) platform: &'a str,
    /// The digest of the library's source.
    pub(crate) library: &'a str,
    /// How nodes go about their progress.
    pub(crate) pace: Pace<'a>,
}

/// A node to run.
pub(crate) struct Task<'a> {
    pub(crate) node: NodeIndex,
    pub(crate) step: &'a Step,
    /// The operation, `name@version`.
    pub(crate) op: String,
    pub(crate) key: Digest,
    pub(crate) lock: ActionLock,
    /// The results that it takes, but those that could not be computed.
    pub(crate) outputs: BTreeMap<NodeIndex, Output>,
}

/// What a worker tells.
pub(crate) enum Message {
    /// Some nodes have ended.
    Done {
        /// These.
        done: Vec<Done>,
        /// What the worker does not need any more; nothing while it goes on.
        frees: Option<Needs>,
    },
    /// A node is under way.
    Told {
        /// This.
        node: NodeIndex,
        /// How many of its steps are done.
        done: u64,
        /// How many there are.
        of: u64,
        /// How it goes.
        words: String,
    },
    /// Something is heard of other machines.
    Heard(News),
}

/// What came of a node.
pub(crate) struct Done {
    pub(crate) node: NodeIndex,
    pub(crate) key: Digest,
    pub(crate) lock: ActionLock,
    pub(crate) result: Result<(Output, Provenance), Problem>,
    /// Until the result is committed.
    pub(crate) busy: Busy,
}

/// How long a worker keeps what is done to itself while it has more to do.
const PROMPT: Duration = Duration::from_millis(5);

/// Runs nodes one after another, and tells of them in as few messages as is prompt. Once the run is
/// asked to end, those that have not begun are left.
pub(crate) fn work(tasks: Vec<Task>, needs: Needs, bench: &Bench, tell: &Sender<Message>) {
    let (mut done, mut told) = (Vec::new(), Instant::now());
    for task in tasks {
        if bench.pace.stop.asked() {
            break;
        }
        let busy = bench.pace.stop.busy();
        let result = execute(&task, bench, tell);
        let Task { node, key, lock, .. } = task;
        done.push(Done { node, key, lock, result, busy });
        if told.elapsed() >= PROMPT {
            told = Instant::now();
            // The receiver is gone only when the run ended with an error.
            let _ = tell.send(Message::Done { done: std::mem::take(&mut done), frees: None });
        }
    }
    let _ = tell.send(Message::Done { done, frees: Some(needs) });
}

/// Why a node has no result that reached its limit.
const OVER: &str =
    "it took longer than it may; what it did is kept, and the next run goes on from there";

/// The result of a node and how it came about.
pub(crate) fn execute(
    task: &Task,
    bench: &Bench,
    tell: &Sender<Message>,
) -> Result<(Output, Provenance), Problem> {
    let &Task { step, key, ref op, ref outputs, .. } = task;
    let &Bench { registry, ref objects, ref checkpoints, platform, library, pace } = bench;
    let inputs = read(objects, outputs)?;
    let told = |done, of, words: &str| {
        // The receiver is gone only when the run ended with an error.
        let _ = tell.send(Message::Told { node: task.node, done, of, words: words.to_owned() });
    };
    let checkpoint = Checkpoint::new(checkpoints.clone(), key, (platform, library), pace, &told);
    let bytes = compute(step, registry, &inputs, Some(&checkpoint)).map_err(|why| match why {
        Failure::Stopped if checkpoint.is_over() && !pace.stop.asked() => {
            Problem::Failed(OVER.to_owned())
        }
        Failure::Stopped => Problem::Stopped,
        Failure::Failed(why) => Problem::Failed(why),
    })?;
    let millis = u64::try_from(checkpoint.elapsed().as_millis()).unwrap_or(u64::MAX);
    let output = objects.put(&bytes).map_err(Problem::Cache)?;
    checkpoint.remove();
    let digest = |source: &Source| match source {
        Source::Number(x) => number_digest(*x),
        Source::Node(node) => {
            outputs.get(node).map_or_else(|| number_digest(MISSING), |own| own.digest)
        }
    };
    let provenance = Provenance {
        op: op.clone(),
        node: step.address.clone(),
        inputs: step.sources().map(|source| digest(&source)).collect(),
        explanation: explain(step, registry, digest),
        library: library.to_owned(),
        millis,
    };
    Ok((output, provenance))
}

/// The bytes of some outputs.
pub(crate) fn read(
    objects: &Objects,
    outputs: &BTreeMap<NodeIndex, Output>,
) -> Result<Inputs, Problem> {
    let mut inputs = Inputs::new();
    let mut missing = Vec::new();
    objects.bring(outputs.values()).map_err(Problem::Cache)?;
    for (node, output) in outputs {
        match objects.read(output).map_err(Problem::Cache)? {
            Fetched::Bytes(read) => {
                inputs.insert(*node, read);
            }
            Fetched::Missing | Fetched::Corrupt { .. } => missing.push(*node),
        }
    }
    if missing.is_empty() { Ok(inputs) } else { Err(Problem::Missing(missing)) }
}

/// Why an operation has no result.
pub(crate) enum Failure {
    /// It was told to end.
    Stopped,
    /// It has none.
    Failed(String),
}

/// Runs the operation of a step; a panic is a failure like any other.
pub(crate) fn compute(
    step: &Step,
    registry: &Registry,
    inputs: &Inputs,
    checkpoint: Option<&Checkpoint>,
) -> Result<Bytes, Failure> {
    let value = |source: &Source| match source {
        // What has no bytes here could not be computed.
        Source::Node(node) => inputs.get(node).map_or_else(|| number(MISSING), Arc::clone),
        Source::Number(x) => number(*x),
    };
    let gathered = |fed: &Fed| Gathered {
        dims: fed.dims.clone(),
        values: fed.sources.iter().map(value).collect(),
        name: fed.name.clone(),
    };
    let mut call = Call { args: step.args.clone(), ports: BTreeMap::new() };
    for (name, feds) in &step.ports {
        call.ports.insert(name.clone(), feds.iter().map(gathered).collect());
    }
    let held: Vec<_> = step.held.iter().map(gathered).collect();
    call.args.values_mut().for_each(|arg| fill(arg, &held));
    let decl = registry.decl(&step.op).expect("checked programs name known operations");
    let draw = step.draw.unwrap_or(Draw { seed: 0, member: None });
    let ctx = Ctx::new(decl.name, draw.seed, draw.member);
    let ctx = checkpoint.map_or(ctx, |checkpoint| ctx.keeping(checkpoint));
    match catch_unwind(AssertUnwindSafe(|| registry.run(&step.op, &call, &ctx))) {
        Ok(Ok(bytes)) => Ok(bytes),
        Ok(Err(OpError::Stopped)) => Err(Failure::Stopped),
        Ok(Err(error)) => Err(Failure::Failed(error.to_string())),
        Err(panic) => Err(Failure::Failed(format!("panicked: {}", panic_text(&*panic)))),
    }
}

/// A number as what ports take.
fn number(x: f64) -> Bytes {
    Array::scalar(x).encode().into()
}

/// Puts what the parts in a description hold in the place of its slots.
fn fill(lit: &mut Lit, held: &[Gathered<Arc<[u8]>>]) {
    match lit {
        Lit::Held(Held::Slot(slot)) => *lit = Lit::Held(Held::Value(held[*slot].clone())),
        Lit::List(items) => items.iter_mut().for_each(|item| fill(item, held)),
        Lit::Part(part) => part.args.values_mut().for_each(|arg| fill(arg, held)),
        _ => {}
    }
}

fn panic_text(panic: &(dyn std::any::Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("without a message")
}
