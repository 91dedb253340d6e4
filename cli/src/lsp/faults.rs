//! What is wrong, as an editor shows it, and how it is mended.

use std::collections::BTreeMap;
use std::path::PathBuf;

use gen_lsp_types as lsp;
use ivx_grammar::{Code, Diagnostic, Severity, Span};

use super::seen::Seen;
use super::text::{Text, Units};

/// What is wrong with each file of a spec.
pub(super) fn faults(seen: &Seen, units: Units) -> BTreeMap<PathBuf, Vec<lsp::Diagnostic>> {
    let mut all: BTreeMap<PathBuf, Vec<lsp::Diagnostic>> =
        seen.paths.iter().map(|path| (path.clone(), Vec::new())).collect();
    for fault in &seen.faults {
        let file = fault.labels.first().map_or(0, |label| label.span.file as usize);
        let Some(path) = seen.paths.get(file) else { continue };
        all.entry(path.clone()).or_default().push(shown(seen, fault, units));
    }
    all
}

fn shown(seen: &Seen, fault: &Diagnostic, units: Units) -> lsp::Diagnostic {
    let place = |span: Span| {
        let text = &seen.texts[span.file as usize];
        lsp::Location::new(seen.uris[span.file as usize].clone(), text.range(span, units))
    };
    let mut labels = fault.labels.iter();
    let first = labels.next();
    let range = first.map_or_else(lsp::Range::default, |label| place(label.span).range);
    let others = labels
        .map(|label| lsp::DiagnosticRelatedInformation::new(place(label.span), label.text.clone()));
    let others: Vec<_> = others.collect();
    let label = first.map(|label| label.text.as_str()).filter(|label| !label.is_empty());
    let mut message = fault.message.clone();
    for more in label.into_iter().chain(fault.help.as_deref()) {
        message.push('\n');
        message += more;
    }
    let severity = match fault.code.severity() {
        Severity::Error => lsp::DiagnosticSeverity::Error,
        Severity::Warning => lsp::DiagnosticSeverity::Warning,
    };
    let unused = (fault.code == Code::Unused).then(|| vec![lsp::DiagnosticTag::Unnecessary]);
    lsp::Diagnostic {
        range,
        severity: Some(severity),
        code: Some(fault.code.to_string().into()),
        source: Some("ivx".to_owned()),
        message: message.into(),
        tags: unused,
        related_information: (!others.is_empty()).then_some(others),
        ..lsp::Diagnostic::default()
    }
}

/// What mends the faults that lie in a stretch of the spec's own text.
pub(super) fn actions(seen: &Seen, range: lsp::Range, units: Units) -> Vec<lsp::CodeAction> {
    let text = seen.text();
    let (start, end) = (text.offset(range.start, units), text.offset(range.end, units));
    let here = seen.faults.iter().filter(|fault| {
        fault.labels.first().is_some_and(|label| {
            let span = label.span;
            span.file == 0 && span.start as usize <= end && start <= span.end as usize
        })
    });
    here.filter_map(|fault| {
        let (span, with) = mended(text, fault)?;
        let edit = lsp::TextEdit::new(text.range(span, units), with);
        let changes = [(seen.uris[0].clone(), vec![edit])].into_iter().collect();
        Some(lsp::CodeAction {
            title: fault.help.clone().unwrap_or_else(|| fault.message.clone()),
            kind: Some(lsp::CodeActionKind::QuickFix),
            diagnostics: Some(vec![shown(seen, fault, units)]),
            is_preferred: Some(true),
            edit: Some(lsp::WorkspaceEdit::new(Some(changes), None, None)),
            ..lsp::CodeAction::default()
        })
    })
    .collect()
}

/// What to write where, if that is certain.
fn mended(text: &Text, fault: &Diagnostic) -> Option<(Span, String)> {
    let span = fault.labels.first()?.span;
    let said = text.of(span);
    if let Some((wrong, right)) = fault.instead.as_deref() {
        let at = word_in(said, wrong)?;
        let start = span.start + u32::try_from(at).ok()?;
        let end = start + u32::try_from(wrong.len()).ok()?;
        return Some((Span { start, end, ..span }, right.clone()));
    }
    match fault.code {
        Code::StrayDoc => Some((span, said.replace("///", "//"))),
        Code::Edition if said.is_empty() => {
            let first = fault.help.as_ref()?.split('`').nth(1)?;
            Some((span, format!("{first}\n")))
        }
        _ => None,
    }
}

/// Where a word stands in a text, if it does so once.
fn word_in(text: &str, word: &str) -> Option<usize> {
    let letter = |c: char| c.is_alphanumeric() || c == '_';
    let mut found = text.match_indices(word).map(|(at, _)| at).filter(|at| {
        !text[..*at].ends_with(letter) && !text[at + word.len()..].starts_with(letter)
    });
    found.next().filter(|_| found.next().is_none())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_is_mended_where_it_stands_once() {
        assert_eq!(word_in("seeed", "seeed"), Some(0));
        assert_eq!(word_in("\"WMC\"", "WMC"), Some(1));
        assert_eq!(word_in("ke + ke", "ke"), None);
        assert_eq!(word_in("kes + ke", "ke"), Some(6));
        assert_eq!(word_in("kes", "ke"), None);
    }
}
