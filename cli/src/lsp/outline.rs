//! How a text is made: its items, what folds, and what each name is.

use gen_lsp_types as lsp;
use ivx_grammar::ast::{Item, ItemKind};
use ivx_grammar::{Means, Sort, Span, declares};

use super::seen::Seen;
use super::text::Units;

/// The kinds of names that editors colour, in the order of [`kind`].
pub(super) const KINDS: [&str; 7] =
    ["namespace", "enum", "enumMember", "property", "parameter", "variable", "function"];

/// What is said of a name beside its kind: that it is declared there, and that it is the library's.
pub(super) const MODIFIERS: [&str; 2] = ["declaration", "defaultLibrary"];

/// The items of the text, those of experiments inside of them.
pub(super) fn symbols(seen: &Seen, units: Units) -> Vec<lsp::DocumentSymbol> {
    seen.ast().items.iter().filter_map(|item| symbol(seen, item, units)).collect()
}

fn symbol(seen: &Seen, item: &Item, units: Units) -> Option<lsp::DocumentSymbol> {
    let (name, span, detail, kind) = match &item.kind {
        ItemKind::Figure { name, .. } => {
            (&name.value, name.span, "figure", lsp::SymbolKind::Object)
        }
        ItemKind::Table { name, .. } => (&name.value, name.span, "table", lsp::SymbolKind::Object),
        ItemKind::Claim { name, .. } => (&name.value, name.span, "claim", lsp::SymbolKind::Boolean),
        ItemKind::Profile { name, .. } => {
            (&name.value, name.span, "profile", lsp::SymbolKind::Package)
        }
        _ => {
            let (name, sort) = declares(item)?;
            let (detail, kind) = match sort {
                Sort::Param => ("param", lsp::SymbolKind::Constant),
                Sort::Axis => ("axis", lsp::SymbolKind::Enum),
                Sort::Function => ("function", lsp::SymbolKind::Function),
                Sort::Measure => ("measure", lsp::SymbolKind::Number),
                Sort::Published => ("published", lsp::SymbolKind::File),
                Sort::Experiment => ("experiment", lsp::SymbolKind::Namespace),
                _ => ("let", lsp::SymbolKind::Variable),
            };
            (&name.value, name.span, detail, kind)
        }
    };
    let children = match &item.kind {
        ItemKind::Experiment { items, .. } => {
            Some(items.iter().filter_map(|item| symbol(seen, item, units)).collect())
        }
        _ => None,
    };
    let name = if name.is_empty() { "\"\"".to_owned() } else { name.clone() };
    #[expect(deprecated, reason = "the field has no default")]
    let symbol = lsp::DocumentSymbol {
        name,
        detail: Some(detail.to_owned()),
        kind,
        tags: None,
        deprecated: None,
        range: seen.text().range(item.span, units),
        selection_range: seen.text().range(span, units),
        children,
    };
    Some(symbol)
}

/// What folds: items of more than one line, and runs of comments.
pub(super) fn folds(seen: &Seen, units: Units) -> Vec<lsp::FoldingRange> {
    let mut folds = Vec::new();
    let mut items: Vec<&Item> = seen.ast().items.iter().collect();
    while let Some(item) = items.pop() {
        let range = seen.text().range(item.span, units);
        // The line of the last bracket stays in sight.
        let last = u32::from(seen.text().of(item.span).ends_with(['}', ')', ']']));
        let end = range.end.line.saturating_sub(last);
        folds.extend(fold(range.start.line, end, None));
        if let ItemKind::Experiment { items: inside, .. } = &item.kind {
            items.extend(inside);
        }
    }
    let mut run: Option<u32> = None;
    let lines = seen.text().text.lines().map(|line| line.trim_start().starts_with("//"));
    for (line, comment) in (0..).zip(lines.chain([false])) {
        match (run, comment) {
            (None, true) => run = Some(line),
            (Some(start), false) => {
                folds.extend(fold(start, line - 1, Some(lsp::FoldingRangeKind::Comment)));
                run = None;
            }
            _ => {}
        }
    }
    folds.sort_by_key(|fold| fold.start_line);
    folds
}

fn fold(start: u32, end: u32, kind: Option<lsp::FoldingRangeKind>) -> Option<lsp::FoldingRange> {
    (end > start).then(|| lsp::FoldingRange::new(start, None, end, None, kind, None))
}

/// What each name of the text is, as places from the one before.
pub(super) fn tokens(seen: &Seen, units: Units) -> lsp::SemanticTokens {
    let mut last = lsp::Position::new(0, 0);
    let mut data = Vec::new();
    for mention in seen.mentions().iter().filter(|mention| mention.span.file == 0) {
        let Some((kind, modifiers)) = kind(&mention.means, mention.span) else { continue };
        let range = seen.text().range(mention.span, units);
        // A name stands on one line; what stands where another does is of a fault.
        let length = range.end.character.saturating_sub(range.start.character);
        if range.end.line != range.start.line || length == 0 || range.start < last {
            continue;
        }
        let delta_line = range.start.line - last.line;
        let from = if delta_line == 0 { last.character } else { 0 };
        data.push(lsp::SemanticToken {
            delta_line,
            delta_start: range.start.character - from,
            length,
            token_type: kind,
            token_modifiers_bitset: modifiers,
        });
        last = range.start;
    }
    lsp::SemanticTokens { result_id: None, data }
}

/// Which of [`KINDS`] a name is, and which of [`MODIFIERS`] go with it.
fn kind(means: &Means, at: Span) -> Option<(u32, u32)> {
    Some(match means {
        Means::Declared(span, sort) => {
            let kind = match sort {
                Sort::Experiment | Sort::Profile => 0,
                Sort::Axis => 1,
                Sort::Field => 3,
                Sort::Param | Sort::Local => 4,
                Sort::Value | Sort::Measure | Sort::Published => 5,
                Sort::Function => 6,
            };
            (kind, u32::from(*span == at))
        }
        Means::Label(..) => (2, 0),
        Means::Library(_) => (6, 2),
        Means::Argument(..) => (3, 2),
        Means::File(_) => return None,
    })
}
