//! What `ivx why` says to a person.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::time::Duration;

use ivx_engine::{
    Cause, Changed, Difference, Earlier, Foreseen, InputChange, NodeIndex, Reason, Why,
};

use super::Told;
use crate::command::plan::word;
use crate::date::spell_moment;
use crate::progress::spell;

/// How many nodes and causes are listed before the rest is counted.
const MOST: usize = 8;

/// Says why one node is known, or not.
pub(super) fn one(told: &Told<'_>, why: &Why<'_>, out: &mut dyn Write) -> io::Result<()> {
    let step = &told.plan.graph[why.node];
    writeln!(out, "{:<8} {}  ({})", word(why.foreseen), step.address, step.op)?;
    match &why.record {
        None => writeln!(out, "the cache has no record of `{}`", step.op)?,
        Some(earlier) if why.foreseen == Foreseen::Hit => hit(earlier, &step.address, out)?,
        Some(earlier) => nearest(earlier, &step.address, out)?,
    }
    for line in lines(told, why) {
        writeln!(out, "- {line}")?;
    }
    Ok(())
}

/// Says once what is common to several nodes.
pub(super) fn several(
    told: &Told<'_>,
    name: &str,
    all: &[Why<'_>],
    out: &mut dyn Write,
) -> io::Result<()> {
    let count = |wanted| all.iter().filter(|why| why.foreseen == wanted).count();
    let (hit, run, unknown) =
        (count(Foreseen::Hit), count(Foreseen::Run), count(Foreseen::Unknown));
    writeln!(
        out,
        "{} nodes begin with {name}: {hit} hit, {run} run, {unknown} unknown",
        all.len()
    )?;
    let mut groups: BTreeMap<(Foreseen, Vec<String>), Vec<NodeIndex>> = BTreeMap::new();
    for why in all.iter().filter(|why| why.foreseen != Foreseen::Hit) {
        groups.entry((why.foreseen, reasons(told, why))).or_default().push(why.node);
    }
    let shared = groups.keys().map(|(_, reasons)| reasons);
    let common: Vec<String> = match shared.clone().next() {
        Some(first) if groups.len() > 1 => first
            .iter()
            .filter(|own| shared.clone().all(|all| all.contains(own)))
            .cloned()
            .collect(),
        _ => Vec::new(),
    };
    if !common.is_empty() {
        writeln!(out, "all that are no hits:")?;
        for reason in &common {
            writeln!(out, "- {reason}")?;
        }
    }
    let mut groups: Vec<_> = groups.into_iter().collect();
    groups.sort_by_key(|(_, nodes)| std::cmp::Reverse(nodes.len()));
    for ((foreseen, reasons), nodes) in groups.iter().take(MOST) {
        let first = &told.plan.graph[nodes[0]].address;
        writeln!(out, "{:<8} {first}{}", word(*foreseen), and_more(nodes.len()))?;
        for reason in reasons.iter().filter(|reason| !common.contains(reason)) {
            writeln!(out, "- {reason}")?;
        }
    }
    if groups.len() > MOST {
        let nodes: usize = groups[MOST..].iter().map(|(_, nodes)| nodes.len()).sum();
        writeln!(out, "and {nodes} nodes for {} other reasons", groups.len() - MOST)?;
    }
    Ok(())
}

fn hit(earlier: &Earlier<'_>, address: &str, out: &mut dyn Write) -> io::Result<()> {
    let record = earlier.record;
    writeln!(out, "its result is known:\n  {}", made(earlier))?;
    if record.provenance.node != address {
        writeln!(out, "  as {}, which computes the same", record.provenance.node)?;
    }
    let build = another_build(earlier).unwrap_or_else(|| "this build of the library".to_owned());
    writeln!(out, "  by {build}, on {}", record.platform)?;
    let (key, output) = (record.key, record.output.digest);
    writeln!(out, "  key {key}\n  output {output}, {} bytes", record.output.size)?;
    if earlier.gone {
        writeln!(out, "its bytes are gone: where they are needed, it runs again")?;
    }
    Ok(())
}

/// Says of which node the nearest record is, and what else made it otherwise, though that is no
/// part of the key.
fn nearest(earlier: &Earlier<'_>, address: &str, out: &mut dyn Write) -> io::Result<()> {
    let own = earlier.record.provenance.node == address;
    let which = if own { "of this node" } else { "is of another node" };
    writeln!(out, "the nearest earlier record {which}:\n  {}", made(earlier))?;
    if let Some(build) = another_build(earlier) {
        writeln!(out, "  by {build}")?;
    }
    let platform = &earlier.record.platform;
    if *platform == ivx_engine::platform() { Ok(()) } else { writeln!(out, "  on {platform}") }
}

/// The build that made a record, if it is another than this.
fn another_build(earlier: &Earlier<'_>) -> Option<String> {
    let library = &earlier.record.provenance.library;
    let short = library.get(..8).unwrap_or(library);
    (library != ivx_library::SOURCE_DIGEST)
        .then(|| format!("another build of the library ({short})"))
}

/// `e/data[seed=0], sample@1, made in 3 ms, in a journal begun 2026-11-25 01:51:24 UTC`.
fn made(earlier: &Earlier<'_>) -> String {
    let provenance = &earlier.record.provenance;
    let took = spell(Duration::from_millis(provenance.millis));
    let when = earlier.begun.map(|begun| format!(", in a journal begun {}", spell_moment(begun)));
    let when = when.unwrap_or_default();
    format!("{}, {}, made in {took}{when}", provenance.node, provenance.op)
}

/// What differs, a line each; alike inputs of a port are one.
fn lines(told: &Told<'_>, why: &Why<'_>) -> Vec<String> {
    let own = why.differences.iter().map(|difference| differs(told, why.node, difference));
    let mut lines: Vec<String> = own.collect();
    let mut groups: BTreeMap<(&str, InputChange, Vec<String>), Vec<&Changed>> = BTreeMap::new();
    for input in &why.inputs {
        let causes = input.causes.iter().map(|cause| cause_of(told, cause)).collect();
        groups.entry((&input.port, input.change, causes)).or_default().push(input);
    }
    for ((port, change, causes), inputs) in groups {
        let what = what_changed(port, change, inputs.len());
        let mut told_of = match &causes[..] {
            [] => vec![what],
            [one] => vec![format!("{what} because {one}")],
            more => {
                let shown = more.iter().take(MOST).map(|cause| format!("  - {cause}"));
                let mut told_of: Vec<String> =
                    [format!("{what} because")].into_iter().chain(shown).collect();
                if more.len() > MOST {
                    told_of.push(format!("  - and {} other reasons", more.len() - MOST));
                }
                told_of
            }
        };
        let address = |node: NodeIndex| told.plan.graph[node].address.as_str();
        let first = inputs[0].node.map(address).or(inputs[0].before.as_deref());
        let first = first.unwrap_or("what is not known any more");
        told_of.push(format!("    {first}{}", and_more(inputs.len())));
        let path = inputs[0].causes.first().map(|cause| &cause.path[..]).unwrap_or_default();
        told_of.extend(path.iter().skip(1).map(|node| format!("    <- {}", address(*node))));
        lines.push(told_of.join("\n"));
    }
    lines
}

/// How many there are beside the first.
fn and_more(n: usize) -> String {
    if n > 1 { format!(" and {} more", n - 1) } else { String::new() }
}

/// The reasons of a node, each once and without where.
fn reasons(told: &Told<'_>, why: &Why<'_>) -> Vec<String> {
    let mut reasons: Vec<String> =
        why.differences.iter().map(|difference| differs(told, why.node, difference)).collect();
    if why.record.is_none() {
        reasons.push(format!("the cache has no record of `{}`", told.plan.graph[why.node].op));
    }
    for input in &why.inputs {
        let what = what_changed(&input.port, input.change, 1);
        if input.causes.is_empty() {
            reasons.push(what.clone());
        }
        for cause in &input.causes {
            reasons.push(format!("{what} because {}", cause_of(told, cause)));
        }
    }
    reasons.sort();
    reasons.dedup();
    reasons
}

fn what_changed(port: &str, change: InputChange, n: usize) -> String {
    let (inputs, are, have) = if n == 1 {
        ("input".to_owned(), "is", "was")
    } else {
        (format!("{n} inputs"), "are", "were")
    };
    match change {
        InputChange::Changed => format!("{inputs} `{port}` changed"),
        InputChange::Unknown => format!("{inputs} `{port}` {are} not known yet"),
        InputChange::Added => format!("{inputs} `{port}` {have} added"),
        InputChange::Removed => format!("{inputs} `{port}` {have} taken away"),
    }
}

fn cause_of(told: &Told<'_>, cause: &Cause) -> String {
    let node = *cause.path.last().expect("a cause lies somewhere");
    match &cause.reason {
        Reason::Differs(difference) => differs(told, node, difference),
        Reason::New => format!("the cache has no record of `{}`", told.plan.graph[node].op),
        Reason::Lost => "the cache does not know any more what it was made from".to_owned(),
    }
}

/// A difference, and the parameter that made it.
fn differs(told: &Told<'_>, node: NodeIndex, difference: &Difference) -> String {
    match told.setter(node, &difference.part) {
        None => difference.to_string(),
        Some(setter) if setter.by == "default" => {
            format!("{difference} (`{}`, its default)", setter.parameter)
        }
        Some(setter) => format!("{difference} (`{}`, by {})", setter.parameter, setter.by),
    }
}
