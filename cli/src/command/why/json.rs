//! What `ivx why` says to a program.

use std::io::{self, Write};
use std::time::UNIX_EPOCH;

use ivx_engine::{Cause, Changed, Difference, Earlier, InputChange, NodeIndex, Part, Reason, Why};
use serde_json::{Value, json};

use super::Told;
use crate::command::plan::word;

/// Writes why each node is known, or not.
pub(super) fn write(told: &Told<'_>, all: &[Why<'_>], out: &mut dyn Write) -> io::Result<()> {
    let nodes: Vec<Value> = all.iter().map(|why| node(told, why)).collect();
    writeln!(out, "{:#}", json!({ "nodes": nodes }))
}

fn node(told: &Told<'_>, why: &Why<'_>) -> Value {
    let step = &told.plan.graph[why.node];
    let differences = why.differences.iter().map(|d| difference(told, why.node, d));
    json!({
        "address": step.address,
        "operation": step.op,
        "state": word(why.foreseen),
        "key": why.key.map(|key| key.to_string()),
        "record": why.record.as_ref().map(record),
        "differences": differences.collect::<Vec<_>>(),
        "inputs": why.inputs.iter().map(|input| changed(told, input)).collect::<Vec<_>>(),
    })
}

fn record(earlier: &Earlier<'_>) -> Value {
    let (record, provenance) = (earlier.record, &earlier.record.provenance);
    let begun = earlier
        .begun
        .map(|begun| begun.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs()));
    json!({
        "address": provenance.node,
        "operation": provenance.op,
        "platform": record.platform,
        "library": provenance.library,
        "this_library": provenance.library == ivx_library::SOURCE_DIGEST,
        "millis": provenance.millis,
        "journal_begun": begun,
        "key": record.key.to_string(),
        "output": record.output.digest.to_string(),
        "bytes": record.output.size,
        "gone": earlier.gone,
    })
}

/// The kind of a part of a key, and its path.
pub(in crate::command) fn part(part: &Part) -> (&'static str, Option<&String>) {
    match part {
        Part::Format => ("format", None),
        Part::Operation => ("operation", None),
        Part::Argument(path) => ("argument", Some(path)),
        Part::Version(path) => ("version", Some(path)),
        Part::Count(path) => ("count", Some(path)),
        Part::Axes(path) => ("axes", Some(path)),
        Part::Name(path) => ("name", Some(path)),
        Part::Input(path) => ("input", Some(path)),
        Part::Seed => ("seed", None),
        Part::Member => ("member", None),
        Part::Platform => ("platform", None),
    }
}

fn difference(told: &Told<'_>, node: NodeIndex, difference: &Difference) -> Value {
    let (kind, path) = part(&difference.part);
    let setter = told.setter(node, &difference.part);
    json!({
        "kind": kind,
        "path": path,
        "before": difference.before,
        "after": difference.after,
        "parameter": setter.as_ref().map(|setter| &setter.parameter),
        "set_by": setter.as_ref().map(|setter| setter.by.replace('`', "")),
    })
}

fn changed(told: &Told<'_>, input: &Changed) -> Value {
    let change = match input.change {
        InputChange::Changed => "changed",
        InputChange::Unknown => "unknown",
        InputChange::Added => "added",
        InputChange::Removed => "removed",
    };
    json!({
        "port": input.port,
        "address": input.node.map(|node| &told.plan.graph[node].address),
        "before": input.before,
        "change": change,
        "causes": input.causes.iter().map(|c| cause(told, c)).collect::<Vec<_>>(),
    })
}

fn cause(told: &Told<'_>, cause: &Cause) -> Value {
    let node = *cause.path.last().expect("a cause lies somewhere");
    let path: Vec<&str> =
        cause.path.iter().map(|node| told.plan.graph[*node].address.as_str()).collect();
    let (kind, differs) = match &cause.reason {
        Reason::Differs(found) => ("differs", Some(difference(told, node, found))),
        Reason::New => ("new", None),
        Reason::Lost => ("lost", None),
    };
    json!({ "kind": kind, "path": path, "difference": differs })
}
