//! What `ivx diff` says to a program.

use std::io::{self, Write};

use ivx_engine::{Change, Move, Moved, Root, Shift};
use ivx_op::Finding;
use serde_json::{Value, json};

use super::because::parameter;
use super::{Nodes, Pair, Told};
use crate::command::why::part;

pub(super) fn write(told: &Told, out: &mut dyn Write) -> io::Result<()> {
    let results: Vec<Value> = told.pairs.iter().map(|p| pair(p, told.names_nodes)).collect();
    let value = json!({
        "before": told.before,
        "after": told.after,
        "same": told.is_same(),
        "results": results,
    });
    writeln!(out, "{value:#}")
}

fn pair(pair: &Pair, names_nodes: bool) -> Value {
    let only = pair.only.map(|new| if new { "after" } else { "before" });
    json!({
        "name": pair.name,
        "only": only,
        "changes": pair.changes.iter().map(change).collect::<Vec<_>>(),
        "nodes": pair.nodes.as_ref().map(|n| nodes(n, &pair.changes, names_nodes)),
    })
}

/// Of each the kind, the name and what happened, and then what is its own.
fn change(change: &Change) -> Value {
    let (kind, name) = change.subject();
    let mut value = match change {
        Change::Only { .. } | Change::File { .. } => json!({}),
        Change::Param { before, after, .. } => json!({ "before": before, "after": after }),
        Change::Measure { moved, .. } => measure(moved),
        Change::Claim { before, after, flips, .. } => {
            let flips = flips.iter().map(|flip| {
                let at: serde_json::Map<String, Value> = flip
                    .after
                    .at
                    .iter()
                    .map(|(axis, label)| (axis.clone(), label.clone().into()))
                    .collect();
                json!({ "at": at, "before": finding(&flip.before), "after": finding(&flip.after) })
            });
            json!({ "before": before, "after": after, "flips": flips.collect::<Vec<_>>() })
        }
        Change::Failure { why, .. } => json!({ "why": why }),
    };
    let what = match change {
        Change::Only { new: true, .. } => "added",
        Change::Only { new: false, .. } => "gone",
        Change::Param { .. } | Change::File { .. } => "changed",
        Change::Measure { .. } => "moved",
        Change::Claim { .. } => "flipped",
        Change::Failure { why: Some(_), .. } => "fails",
        Change::Failure { why: None, .. } => "mended",
    };
    value["kind"] = kind.into();
    value["name"] = name.into();
    value["what"] = what.into();
    value
}

fn measure(moved: &Move) -> Value {
    let largest = moved.largest.as_ref().map(
        |largest| json!({ "at": largest.at, "before": largest.before, "after": largest.after }),
    );
    let beyond = moved.beyond.as_ref().map(|beyond| {
        let worst = beyond
            .worst
            .as_ref()
            .map(|worst| json!({ "at": worst.at, "interval": worst.interval, "mean": worst.mean }));
        json!({ "n": beyond.n, "of": beyond.of, "worst": worst })
    });
    json!({
        "moved": moved.moved,
        "of": moved.of,
        "added": moved.added,
        "gone": moved.gone,
        "largest": largest,
        "beyond_interval": beyond,
    })
}

fn finding(Finding { outcome, estimate, interval, n, .. }: &Finding) -> Value {
    json!({ "outcome": outcome, "estimate": estimate, "interval": interval, "n": n })
}

fn nodes(nodes: &Nodes, changes: &[Change], names_nodes: bool) -> Value {
    let shifts = nodes.blocks.iter().flat_map(|block| &block.shifts);
    let shifts: Vec<Value> = shifts.map(|s| shift(s, changes, names_nodes)).collect();
    json!({ "before": nodes.before, "after": nodes.after, "shifts": shifts })
}

fn shift(shift: &Shift, changes: &[Change], names_nodes: bool) -> Value {
    let how = match shift.how {
        Moved::Rekeyed => "rekeyed",
        Moved::Remade => "remade",
        Moved::Failed => "failed",
        Moved::Skipped => "skipped",
        Moved::NotRun => "not run",
        Moved::Mended => "mended",
        Moved::Renamed => "renamed",
        Moved::Added => "added",
        Moved::Gone => "gone",
    };
    json!({
        "binding": shift.binding,
        "what": how,
        "n": shift.nodes.len(),
        "because": shift.roots.iter().map(|r| root(r, changes)).collect::<Vec<_>>(),
        "nodes": names_nodes.then_some(&shift.nodes),
    })
}

fn root(root: &Root, changes: &[Change]) -> Value {
    match root {
        Root::Differs { binding, difference } => {
            let (part, path) = part(&difference.part);
            json!({
                "kind": "differs",
                "binding": binding,
                "part": part,
                "path": path,
                "before": difference.before,
                "after": difference.after,
                "parameter": parameter(root, changes).map(|(name, ..)| name),
            })
        }
        Root::Remade { binding } => json!({ "kind": "remade", "binding": binding }),
        Root::Failed { binding } => json!({ "kind": "failed", "binding": binding }),
        Root::Mended { binding } => json!({ "kind": "mended", "binding": binding }),
        Root::Lost { binding } => json!({ "kind": "lost", "binding": binding }),
        Root::Axis { name, labels } => json!({ "kind": "axis", "axis": name, "labels": labels }),
        Root::Was { binding } => json!({ "kind": "was", "binding": binding }),
    }
}
