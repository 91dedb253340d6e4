//! What a worker does: read inputs, compute, encode, hash and write.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use ivx_cache::{
    ActionLock, CacheError, Checkpoints, Digest, Fetched, Objects, Output, Provenance,
};
use ivx_op::{Array, Artifact as _, Bytes, Call, Ctx, Gathered, Held, Lit, Needs, Registry};
use petgraph::graph::NodeIndex;

use crate::checkpoint::Checkpoint;
use crate::key::{explain, number_digest};
use crate::plan::{Draw, Fed, Source, Step};
use crate::stop::{Busy, Stop};

/// Why a node has no result.
pub(crate) enum Problem {
    /// These inputs have no bytes any more.
    Missing(Vec<NodeIndex>),
    /// The operation failed, or panicked.
    Failed(String),
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
    /// How much time lies between two checkpoints.
    pub(crate) every: Duration,
    /// Whether to begin nothing more.
    pub(crate) stop: &'a Stop,
}

/// A node to run.
pub(crate) struct Task<'a> {
    pub(crate) node: NodeIndex,
    pub(crate) step: &'a Step,
    /// The operation, `name@version`.
    pub(crate) op: String,
    pub(crate) key: Digest,
    pub(crate) lock: ActionLock,
    /// The results that it takes.
    pub(crate) outputs: BTreeMap<NodeIndex, Output>,
}

/// What a worker tells.
pub(crate) struct Message {
    pub(crate) done: Vec<Done>,
    /// What the worker does not need any more; nothing while it goes on.
    pub(crate) frees: Option<Needs>,
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
        if bench.stop.asked() {
            break;
        }
        let busy = bench.stop.busy();
        let result = execute(&task, bench);
        let Task { node, key, lock, .. } = task;
        done.push(Done { node, key, lock, result, busy });
        if told.elapsed() >= PROMPT {
            told = Instant::now();
            // The receiver is gone only when the run ended with an error.
            let _ = tell.send(Message { done: std::mem::take(&mut done), frees: None });
        }
    }
    let _ = tell.send(Message { done, frees: Some(needs) });
}

/// The result of a node and how it came about.
fn execute(task: &Task, bench: &Bench) -> Result<(Output, Provenance), Problem> {
    let &Task { step, key, ref op, ref outputs, .. } = task;
    let &Bench { registry, ref objects, ref checkpoints, platform, library, every, .. } = bench;
    let inputs = read(objects, outputs)?;
    let checkpoint = Checkpoint::new(checkpoints.clone(), key, (platform, library), every);
    let started = Instant::now();
    let bytes = compute(step, registry, &inputs, Some(&checkpoint)).map_err(Problem::Failed)?;
    let millis = u64::try_from(started.elapsed().as_millis()).unwrap_or(u64::MAX);
    let output = objects.put(&bytes).map_err(Problem::Cache)?;
    checkpoint.remove();
    let digest = |source: &Source| match source {
        Source::Number(x) => number_digest(*x),
        Source::Node(node) => outputs[node].digest,
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

/// Runs the operation of a step; a panic is a failure like any other.
pub(crate) fn compute(
    step: &Step,
    registry: &Registry,
    inputs: &Inputs,
    checkpoint: Option<&Checkpoint>,
) -> Result<Bytes, String> {
    let value = |source: &Source| match source {
        Source::Node(node) => Arc::clone(&inputs[node]),
        Source::Number(x) => Array::scalar(*x).encode().into(),
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
        Ok(Err(error)) => Err(error.to_string()),
        Err(panic) => Err(format!("panicked: {}", panic_text(&*panic))),
    }
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
