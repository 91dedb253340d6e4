//! What stands beside the text: axes and nodes of each name, verdicts of claims, and what can be done.

use gen_lsp_types as lsp;
use ivx_engine::{notes, verdict};
use ivx_grammar::ast::{Item, ItemKind};
use ivx_grammar::{Sort, declares};
use serde_json::json;

use super::known::{Known, Nodes};
use super::seen::Seen;
use super::text::Units;
use crate::command::{bracketed, difference};

/// What is told at the ends of lines.
pub(super) fn hints(seen: &Seen, known: &Known, units: Units) -> Vec<lsp::InlayHint> {
    let mut hints = Vec::new();
    let mut hint = |at: usize, words: String| {
        let end = seen.text().line_end(at);
        hints.push(lsp::InlayHint {
            position: seen.text().position(end, units),
            label: words.into(),
            kind: None,
            padding_left: Some(true),
            text_edits: None,
            tooltip: None,
            padding_right: None,
            data: None,
        });
    };
    for (experiment, item) in items(seen) {
        match (&item.kind, declares(item)) {
            (ItemKind::Claim { name, .. }, _) => {
                if let Some(words) = experiment.and_then(|own| judged(known, own, &name.value)) {
                    hint(name.span.start as usize, words);
                }
            }
            (_, Some((name, Sort::Value | Sort::Measure))) => {
                let Some(value) = seen.value(name.span) else { continue };
                let told = [Some(varies(&value.axes)), counted(known, &value.addresses)];
                let told: Vec<String> =
                    told.into_iter().flatten().filter(|words| !words.is_empty()).collect();
                if !told.is_empty() {
                    hint(name.span.start as usize, told.join(", "));
                }
            }
            _ => {}
        }
    }
    hints
}

/// What can be done: run the spec, and ask why a measure is what it is.
pub(super) fn lenses(seen: &Seen, units: Units) -> Vec<lsp::CodeLens> {
    let uri = &seen.uris[0].0;
    let lens = |item: &Item, title: &str, command: &str, arguments: Vec<serde_json::Value>| {
        let at = seen.text().position(item.span.start as usize, units);
        let command = lsp::Command {
            title: title.to_owned(),
            command: command.to_owned(),
            arguments: Some(arguments),
            tooltip: None,
        };
        lsp::CodeLens::new(lsp::Range::new(at, at), Some(command), None)
    };
    let mut lenses = Vec::new();
    for (experiment, item) in items(seen) {
        match (&item.kind, experiment) {
            (ItemKind::Experiment { .. }, _) => {
                lenses.push(lens(item, "run", "ivx.run", vec![json!(uri)]));
            }
            (ItemKind::Measure { name, .. }, Some(experiment)) => {
                let address = format!("{experiment}/{}", name.value);
                lenses.push(lens(item, "why", "ivx.why", vec![json!(uri), json!(address)]));
            }
            _ => {}
        }
    }
    lenses
}

/// The items of the spec's own text, each with the experiment around it.
fn items(seen: &Seen) -> impl Iterator<Item = (Option<&str>, &Item)> {
    seen.ast().items.iter().flat_map(|item| {
        let (name, inside) = match &item.kind {
            ItemKind::Experiment { name, items } => (Some(name.value.as_str()), &items[..]),
            _ => (None, &[][..]),
        };
        std::iter::once((None, item)).chain(inside.iter().map(move |item| (name, item)))
    })
}

/// `seed × ke`; nothing for what is one.
pub(super) fn varies(axes: &[String]) -> String {
    axes.join(" × ")
}

/// How many nodes some addresses are, and how many of them are known: `60 nodes, 20 known`.
pub(super) fn counted(known: &Known, addresses: &[String]) -> Option<String> {
    let found = addresses.iter().filter_map(|address| known.nodes.get(address));
    let Nodes { all, known } = found.fold(Nodes::default(), |sum, own| Nodes {
        all: sum.all + own.all,
        known: sum.known + own.known,
    });
    let nodes = if all == 1 { "node" } else { "nodes" };
    match known {
        _ if all == 0 => None,
        0 => Some(format!("{all} {nodes} to run")),
        known if known == all => Some(format!("{all} {nodes}, known")),
        known => Some(format!("{all} {nodes}, {known} known")),
    }
}

/// The verdict of a claim in the last run: `holds, difference -1.4 in [-1.8, -1.0], n = 20`.
pub(super) fn judged(known: &Known, experiment: &str, words: &str) -> Option<String> {
    let claim = known.results.as_ref()?.experiments.get(experiment)?.claims.get(words)?;
    let outcome = verdict(claim.outcome);
    let more = match &claim.findings[..] {
        [one] => difference(one).replacen("  ", ", ", 1),
        _ => String::new(),
    };
    Some(format!("{outcome}{more}{}", bracketed(&notes(claim))))
}
