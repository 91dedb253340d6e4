//! `ivx plan`

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;

use ivx_cache::Cache;
use ivx_engine::{Foreseen, Plan, Step, consult, expand, foresee, gone, platform};
use ivx_op::Lit;
use petgraph::visit::EdgeRef as _;
use serde_json::{Value, json};

use super::{power, ready};
use crate::args::StoreMode;
use crate::render::visible;
use crate::{OK, Trouble, WRONG, args, project, store};

pub(crate) fn plan(
    args: &args::Plan,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let Some(ready) = ready(&args.spec, err)? else { return Ok(WRONG) };
    let plan = expand(&ready.spec, &ready.registry);
    let mut cache = Cache::look(&project::cache(&ready.loaded.root), &platform())?;
    store::attach(&args.store, StoreMode::Read, &mut cache, err)?;
    consult(&plan, &ready.registry, &mut cache);
    store::notes(&mut cache, err)?;
    if args.power {
        power::write(&ready.spec, &plan, &ready.registry, &cache, out)?;
        return Ok(OK);
    }
    let foreseen = foresee(&plan, &ready.registry, &cache);
    let gone = gone(&plan, &ready.registry, &cache);
    if args.format == args::Format::Json {
        writeln!(out, "{:#}", as_json(&plan, &foreseen, &gone))?;
        return Ok(OK);
    }
    if args.dot {
        dot(&plan, &foreseen, out)?;
        return Ok(OK);
    }
    if args.nodes {
        for (step, foreseen) in plan.graph.node_weights().zip(&foreseen) {
            writeln!(out, "{:<8} {}", word(*foreseen), visible(&step.address))?;
        }
    } else {
        let mut groups: BTreeMap<(&str, &str), [usize; 3]> = BTreeMap::new();
        for (step, foreseen) in plan.graph.node_weights().zip(&foreseen) {
            let stem = step.address.split('[').next().unwrap_or(&step.address);
            let stem = stem.split("/member").next().unwrap_or(stem);
            groups.entry((stem, &step.op)).or_default()[*foreseen as usize] += 1;
        }
        for ((stem, op), [hit, run, unknown]) in groups {
            let counts = [(hit, "hit"), (run, "run"), (unknown, "unknown")];
            let counts: Vec<_> = counts
                .iter()
                .filter(|(n, _)| *n > 0)
                .map(|(n, word)| format!("{n} {word}"))
                .collect();
            writeln!(out, "{stem:<56} {op:<18} {}", counts.join(", "))?;
        }
    }
    let count = |wanted| foreseen.iter().filter(|foreseen| **foreseen == wanted).count();
    let (hit, run, unknown) =
        (count(Foreseen::Hit), count(Foreseen::Run), count(Foreseen::Unknown));
    writeln!(
        out,
        "{} nodes: {hit} hit, {run} run, {unknown} unknown until their inputs have run",
        foreseen.len()
    )?;
    let gone = gone.iter().filter(|gone| **gone).count();
    if gone > 0 {
        writeln!(
            out,
            "the bytes of {gone} hits are gone: where one is needed, its node runs again"
        )?;
    }
    Ok(OK)
}

/// What a run would do with a node, in a word.
pub(super) fn word(foreseen: Foreseen) -> &'static str {
    match foreseen {
        Foreseen::Hit => "hit",
        Foreseen::Run => "run",
        Foreseen::Unknown => "unknown",
    }
}

fn as_json(plan: &Plan, foreseen: &[Foreseen], gone: &[bool]) -> Value {
    let node = |((step, foreseen), gone): ((&Step, &Foreseen), &bool)| {
        let state = word(*foreseen);
        let mut parts = BTreeSet::new();
        step.args.values().for_each(|lit| named(lit, &mut parts));
        json!({
            "address": step.address, "operation": step.op, "parts": parts, "state": state,
            "gone": gone,
        })
    };
    let nodes: Vec<Value> = plan.graph.node_weights().zip(foreseen).zip(gone).map(node).collect();
    json!({ "nodes": nodes })
}

/// The parts in a description, by name.
fn named<'a>(lit: &'a Lit, parts: &mut BTreeSet<&'a str>) {
    match lit {
        Lit::List(items) => items.iter().for_each(|item| named(item, parts)),
        Lit::Part(part) => {
            // A record has no name.
            parts.extend(Some(part.name.as_str()).filter(|name| !name.is_empty()));
            part.args.values().for_each(|arg| named(arg, parts));
        }
        _ => {}
    }
}

fn dot(plan: &Plan, foreseen: &[Foreseen], out: &mut dyn Write) -> std::io::Result<()> {
    writeln!(
        out,
        "digraph ivx {{\n  rankdir=LR;\n  node [shape=box, fontname=\"sans-serif\", style=filled];"
    )?;
    for (i, (step, foreseen)) in plan.graph.node_weights().zip(foreseen).enumerate() {
        let colour = match foreseen {
            Foreseen::Hit => "palegreen",
            Foreseen::Run => "khaki",
            Foreseen::Unknown => "lightgrey",
        };
        let label = step.address.replace('\\', "\\\\").replace('"', "\\\"");
        writeln!(out, "  n{i} [label=\"{label}\\n{}\", fillcolor={colour}];", step.op)?;
    }
    for edge in plan.graph.edge_references() {
        writeln!(out, "  n{} -> n{};", edge.source().index(), edge.target().index())?;
    }
    writeln!(out, "}}")
}
