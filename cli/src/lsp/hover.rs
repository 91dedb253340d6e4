//! What is said of a name under the cursor.

use std::fmt::Write as _;

use gen_lsp_types as lsp;
use ivx_grammar::ast::{Item, ItemKind};
use ivx_grammar::{Means, Sort, Span};
use ivx_op::{Registry, shown};

use super::hints::{counted, judged};
use super::known::Known;
use super::seen::{Seen, holds};
use super::text::Units;
use crate::reference::{argument, body};

/// What is said of what stands at a byte of the spec's own text.
pub(super) fn hover(
    seen: &Seen,
    known: &Known,
    registry: &Registry,
    at: usize,
    units: Units,
) -> Option<lsp::Hover> {
    let (span, said) = match seen.mention(at) {
        Some(mention) => (mention.span, said(seen, known, registry, &mention.means)?),
        None => titled(seen, known, at)?,
    };
    let contents = lsp::MarkupContent::new(lsp::MarkupKind::Markdown, said);
    Some(lsp::Hover::new(contents.into(), Some(seen.text().range(span, units))))
}

fn said(seen: &Seen, known: &Known, registry: &Registry, means: &Means) -> Option<String> {
    match means {
        Means::Library(name) => {
            let decl = registry.decl(name)?;
            Some(format!("```ivx\n{decl}\n```\n\n{}", body(decl)))
        }
        Means::Argument(of, name) => {
            let arg = registry.decl(of)?.arg(name)?;
            Some(format!("{}\nof `{of}`", argument(arg)))
        }
        Means::Label(axis, label) => {
            let name = seen.texts.get(axis.file as usize)?.of(*axis);
            let n = seen.value(*axis).map_or(0, |value| value.labels.len());
            let among = if n > 0 { format!(", one of {n}") } else { String::new() };
            Some(format!("label `{label}` of the axis `{name}`{among}"))
        }
        Means::File(path) => Some(format!("the file `{path}`")),
        Means::Declared(span, sort) => declared(seen, known, *span, *sort),
    }
}

fn declared(seen: &Seen, known: &Known, span: Span, sort: Sort) -> Option<String> {
    let (item, experiment) = seen.item(span)?;
    let text = seen.texts.get(span.file as usize)?;
    let name = text.of(span);
    if matches!(sort, Sort::Local | Sort::Field | Sort::Profile) {
        let what = match sort {
            Sort::Local => "a parameter of the function around",
            Sort::Field => "a field of the axis",
            _ => "a profile",
        };
        return Some(format!("`{name}`: {what}\n\n```ivx\n{}\n```", head(text.of(item.span))));
    }
    let mut said = format!("```ivx\n{}\n```\n", head(text.of(item.span)));
    let paragraph = |said: &mut String, words: &str| {
        if !words.is_empty() {
            let _ = write!(said, "\n{words}\n");
        }
    };
    paragraph(&mut said, item.docs.trim());
    if let Some(value) = seen.value(span) {
        let over = if value.axes.is_empty() {
            String::new()
        } else {
            format!(", over {}", value.axes.join(", "))
        };
        paragraph(&mut said, &format!("`{}`{over}", value.ty));
        if !value.labels.is_empty() {
            const MOST: usize = 12;
            let some: Vec<String> =
                value.labels.iter().take(MOST).map(|label| format!("`{label}`")).collect();
            let more = if value.labels.len() > MOST { ", .." } else { "" };
            let n = value.labels.len();
            paragraph(&mut said, &format!("{n} coordinates: {}{more}", some.join(", ")));
        }
        if let Some(nodes) = counted(known, &value.addresses) {
            paragraph(&mut said, &nodes);
        }
    }
    if let (Sort::Measure, Some(experiment)) = (sort, experiment) {
        paragraph(&mut said, &measured(known, experiment, name).unwrap_or_default());
    }
    Some(said)
}

/// The item's text, but not more than its first lines.
fn head(text: &str) -> String {
    const MOST: usize = 8;
    let mut lines: Vec<&str> = text.lines().take(MOST).collect();
    if text.starts_with("experiment") {
        lines.truncate(1);
    }
    let more = if text.lines().count() > lines.len() { "\n.." } else { "" };
    lines.join("\n") + more
}

/// What a measure was in the last run: its mean, and from where to where it goes.
fn measured(known: &Known, experiment: &str, name: &str) -> Option<String> {
    let results = known.results.as_ref()?;
    let measure = results.experiments.get(experiment)?.measures.get(name)?;
    let numbers: Vec<f64> = measure.values.iter().copied().filter(|x| !x.is_nan()).collect();
    let (low, high) = measure.ends()?;
    let n = u32::try_from(numbers.len()).ok()?;
    let mean = numbers.iter().sum::<f64>() / f64::from(n);
    Some(if n == 1 {
        format!("in the last run: {}", shown(mean))
    } else {
        let [mean, low, high] = [mean, low, high].map(shown);
        format!("in the last run: {n} numbers from {low} to {high}, {mean} in the mean")
    })
}

/// What is said of a claim, figure or table whose title is at a byte.
fn titled(seen: &Seen, known: &Known, at: usize) -> Option<(Span, String)> {
    let items = seen.ast().items.iter().filter_map(|item| match &item.kind {
        ItemKind::Experiment { name, items } => Some((name, items)),
        _ => None,
    });
    for (experiment, items) in items {
        let own = items.iter().find(|item| title(item).is_some_and(|span| holds(span, at)));
        let Some(item) = own else { continue };
        let span = title(item)?;
        let docs = item.docs.trim();
        let found = match &item.kind {
            ItemKind::Claim { name, .. } => judged(known, &experiment.value, &name.value),
            _ => None,
        };
        let said: Vec<&str> = [docs, found.as_deref().unwrap_or_default()]
            .into_iter()
            .filter(|words| !words.is_empty())
            .collect();
        return (!said.is_empty()).then(|| (span, said.join("\n\n")));
    }
    None
}

/// Where the title of an item stands.
fn title(item: &Item) -> Option<Span> {
    match &item.kind {
        ItemKind::Figure { name, .. }
        | ItemKind::Table { name, .. }
        | ItemKind::Claim { name, .. } => Some(name.span),
        _ => None,
    }
}
