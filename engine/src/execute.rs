//! What a worker does: read inputs, compute, encode, hash and write.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Instant;

use ivx_cache::{CacheError, Fetched, Objects, Output};
use ivx_op::{Array, Artifact as _, Bytes, Call, Ctx, Gathered, Held, Lit, Registry};
use petgraph::graph::NodeIndex;

use crate::checkpoint::Checkpoint;
use crate::plan::{Draw, Fed, Source, Step};

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

/// The result of one node and how many milliseconds it took.
pub(crate) fn execute(
    step: &Step,
    registry: &Registry,
    objects: &Objects,
    outputs: &BTreeMap<NodeIndex, Output>,
    checkpoint: &Checkpoint,
) -> Result<(Output, u64), Problem> {
    let inputs = read(objects, outputs)?;
    let started = Instant::now();
    let bytes = compute(step, registry, &inputs, Some(checkpoint)).map_err(Problem::Failed)?;
    let millis = u64::try_from(started.elapsed().as_millis()).unwrap_or(u64::MAX);
    let output = objects.put(&bytes).map_err(Problem::Cache)?;
    checkpoint.remove();
    Ok((output, millis))
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
