//! Diagnostics as people read them: the place, the line underlined, and what to do.

use std::fmt;
use std::iter;

use ivx_grammar::{Diagnostic, Label, Severity};
use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode};

/// The text of diagnostics, with the lines of `sources` (path shown, and text) that they are
/// about.
pub(crate) fn render(
    diagnostics: &[Diagnostic],
    sources: &[(String, String)],
    colour: bool,
) -> String {
    let theme = if colour { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
    let handler = GraphicalReportHandler::new_themed(theme)
        .with_width(100)
        .with_links(false)
        .with_context_lines(1);
    let mut text = String::new();
    for diagnostic in diagnostics {
        let shown = Shown::of(diagnostic, sources);
        handler.render_report(&mut text, &shown).expect("strings take everything");
        text.push('\n');
    }
    text
}

/// A diagnostic as miette takes it: labels of one file, and those of other files as related.
#[derive(Debug)]
struct Shown {
    code: Option<String>,
    message: String,
    severity: miette::Severity,
    help: Option<String>,
    source: Option<NamedSource<String>>,
    labels: Vec<LabeledSpan>,
    elsewhere: Vec<Self>,
}

impl Shown {
    fn of(diagnostic: &Diagnostic, sources: &[(String, String)]) -> Self {
        let file = diagnostic.labels.first().map(|label| label.span.file);
        let (here, there): (Vec<&Label>, Vec<&Label>) =
            diagnostic.labels.iter().partition(|label| Some(label.span.file) == file);
        let severity = match diagnostic.code.severity() {
            Severity::Error => miette::Severity::Error,
            Severity::Warning => miette::Severity::Warning,
        };
        let elsewhere = there.into_iter().map(|label| Self {
            code: None,
            message: label.text.clone(),
            severity: miette::Severity::Advice,
            help: None,
            source: source(sources, label.span.file),
            labels: vec![labelled(label)],
            elsewhere: Vec::new(),
        });
        Self {
            code: Some(diagnostic.code.to_string()),
            message: diagnostic.message.clone(),
            severity,
            help: diagnostic.help.clone(),
            source: file.and_then(|file| source(sources, file)),
            labels: here.into_iter().map(labelled).collect(),
            elsewhere: elsewhere.collect(),
        }
    }
}

fn source(sources: &[(String, String)], file: u32) -> Option<NamedSource<String>> {
    sources.get(file as usize).map(|(path, text)| NamedSource::new(path, text.clone()))
}

fn labelled(label: &Label) -> LabeledSpan {
    let (start, end) = (label.span.start as usize, label.span.end as usize);
    LabeledSpan::new(Some(label.text.clone()), start, end.saturating_sub(start))
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Shown {}

impl miette::Diagnostic for Shown {
    fn code(&self) -> Option<Box<dyn fmt::Display + '_>> {
        self.code.as_ref().map(|code| Box::new(code) as Box<dyn fmt::Display>)
    }

    fn severity(&self) -> Option<miette::Severity> {
        Some(self.severity)
    }

    fn help(&self) -> Option<Box<dyn fmt::Display + '_>> {
        self.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.source.as_ref().map(|source| source as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        Some(Box::new(self.labels.iter().cloned()))
    }

    fn related(&self) -> Option<Box<dyn Iterator<Item = &dyn miette::Diagnostic> + '_>> {
        if self.elsewhere.is_empty() {
            return Some(Box::new(iter::empty()));
        }
        Some(Box::new(self.elsewhere.iter().map(|shown| shown as &dyn miette::Diagnostic)))
    }
}

#[cfg(test)]
mod tests {
    use ivx_grammar::{Code, Span};

    use super::*;

    #[test]
    fn a_fault_shows_its_place_and_what_to_do() {
        let sources = [
            ("a.ivx".to_owned(), "let x = smaple(y)\n".to_owned()),
            ("b.ivx".to_owned(), "let y = 1\n".to_owned()),
        ];
        let span = |file, start, end| Span { file, start, end };
        let fault = Diagnostic::new(
            Code::UnknownCall,
            span(0, 8, 14),
            "no operation is called `smaple`",
            "not known",
        )
        .also(span(1, 4, 5), "declared here")
        .help("did you mean `sample`?");
        let text = render(&[fault], &sources, false);
        for part in [
            "IVX0302",
            "no operation is called `smaple`",
            "a.ivx:1:9",
            "let x = smaple(y)",
            "not known",
            "did you mean `sample`?",
            "b.ivx:1:5",
            "declared here",
        ] {
            assert!(text.contains(part), "{part} is missing:\n{text}");
        }
        assert!(!text.contains('\u{1b}'), "no colours where none are wanted");
    }
}
