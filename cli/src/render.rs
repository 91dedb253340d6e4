//! Diagnostics as text for a person.

use std::fmt;

use ivx_grammar::{Diagnostic, Label, Severity, Span};
use miette::{
    GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteError, MietteSpanContents,
    SourceCode, SourceSpan, SpanContents,
};

/// The width that messages are wrapped to.
const WIDTH: usize = 100;

/// How many bytes of a line are shown on either side of a place.
const REACH: usize = 120;

/// Each diagnostic with its code, message, place, the lines it is about and its help.
///
/// - `sources`: the path shown and the text of each file, in the order of `Span::file`.
pub(crate) fn render(
    diagnostics: &[Diagnostic],
    sources: &[(String, String)],
    colour: bool,
) -> String {
    let theme = if colour { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
    let handler = GraphicalReportHandler::new_themed(theme)
        .with_width(WIDTH)
        .with_links(false)
        .without_syntax_highlighting();
    let sources: Vec<Source> = sources.iter().map(|(path, text)| Source::new(path, text)).collect();
    let mut out = String::new();
    for diagnostic in diagnostics {
        let report = Report::of(diagnostic, &sources);
        handler.render_report(&mut out, &report).expect("every span is cut to its text");
        out.push('\n');
    }
    out
}

/// The text, byte for byte in its place, without what would act on a terminal.
pub(crate) fn safe(text: &str) -> String {
    let mut safe = String::with_capacity(text.len() + 1);
    for c in text.chars() {
        if acts(c) {
            safe.extend(std::iter::repeat_n('?', c.len_utf8()));
        } else {
            safe.push(c);
        }
    }
    safe
}

/// The text on one line, with what would act on a terminal written as an escape.
pub(crate) fn visible(text: &str) -> String {
    let mut visible = String::with_capacity(text.len());
    for c in text.chars() {
        if acts(c) || c.is_control() {
            visible.extend(c.escape_default());
        } else {
            visible.push(c);
        }
    }
    visible
}

/// Whether a character acts on a terminal, breaks of words and lines aside. Controls of writing
/// direction make a line look like another.
fn acts(c: char) -> bool {
    c.is_control() && !matches!(c, '\n' | '\r' | '\t')
        || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// A file, made safe to show.
struct Source {
    path: String,
    /// Its safe text, ending with a line break, since miette shows no label behind the last
    /// character.
    text: String,
    /// Where each line begins.
    lines: Vec<usize>,
}

impl Source {
    fn new(path: &str, text: &str) -> Self {
        let mut text = safe(text);
        if !text.ends_with('\n') {
            text.push('\n');
        }
        let ends = text.match_indices('\n').map(|(end, _)| end + 1);
        let lines = std::iter::once(0).chain(ends).collect();
        Self { path: safe(path), text, lines }
    }

    /// The bytes of a span, cut to its first line and to what is shown of a long one.
    fn range(&self, span: Span) -> (usize, usize) {
        let start = self.text.floor_char_boundary(span.start as usize).min(self.text.len() - 1);
        let line = self.line(self.line_of(start)).trim_end_matches(['\r', '\n']);
        let line_end = self.lines[self.line_of(start)] + line.len();
        let line_end = line_end.min(self.text.floor_char_boundary(start + REACH));
        let end = self.text.ceil_char_boundary(span.end as usize).min(line_end);
        (start, end.max(start))
    }

    /// Which line a byte is on, from 0.
    fn line_of(&self, at: usize) -> usize {
        self.lines.partition_point(|start| *start <= at) - 1
    }

    /// A line with its end; empty beyond the last.
    fn line(&self, line: usize) -> &str {
        let start_of = |line| self.lines.get(line).copied().unwrap_or(self.text.len());
        &self.text[start_of(line)..start_of(line + 1)]
    }

    /// The column of a byte in characters, from 0.
    fn column_of(&self, at: usize) -> usize {
        let start = self.lines[self.line_of(at)];
        self.text[start..at].chars().filter(|c| *c != '\u{feff}').count()
    }

    /// - `primary`: whether it is the place named above the lines shown.
    fn labelled(&self, label: &Label, primary: bool) -> LabeledSpan {
        let (start, end) = self.range(label.span);
        let text = Some(safe(&label.text));
        if primary {
            LabeledSpan::new_primary_with_span(text, (start, end - start))
        } else {
            LabeledSpan::new(text, start, end - start)
        }
    }
}

impl SourceCode for Source {
    /// The lines asked for, without long neighbours and cut to `REACH` bytes around the span.
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        lines_before: usize,
        lines_after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let (start, end) = (span.offset(), span.offset() + span.len());
        // Of two labels on neighbouring lines miette asks for all between them; if that is
        // refused, for one after the other.
        if end > self.text.len() || end - start > 10 * REACH {
            return Err(MietteError::OutOfBounds);
        }
        let (first, last) = (self.line_of(start), self.line_of(end));
        let (mut from, mut to) = (self.lines[first], self.lines[last] + self.line(last).len());
        let short = |line: &usize| self.line(*line).len() <= 2 * REACH;
        if start - from > REACH {
            from = self.text.ceil_char_boundary(start - REACH);
        } else {
            let before = (first.saturating_sub(lines_before)..first).rev().take_while(short);
            from = before.last().map_or(from, |line| self.lines[line]);
        }
        if to - end > REACH {
            to = self.text.floor_char_boundary(end + REACH);
        } else {
            let after = (last + 1..=last + lines_after).take_while(short);
            to += after.map(|line| self.line(line).len()).sum::<usize>();
        }
        let shown = SourceSpan::new(from.into(), to - from);
        let data = &self.text.as_bytes()[from..to];
        let (line, column) = (self.line_of(from), self.column_of(start));
        let count = self.line_of(to) - line;
        let path = self.path.clone();
        Ok(Box::new(MietteSpanContents::new_named(path, data, shown, line, column, count)))
    }
}

impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.path)
    }
}

/// A diagnostic as miette takes it: labels of one file, and those of other files as related.
#[derive(Debug)]
struct Report<'a> {
    code: Option<String>,
    message: String,
    severity: miette::Severity,
    help: Option<String>,
    source: Option<&'a Source>,
    labels: Vec<LabeledSpan>,
    elsewhere: Vec<Self>,
}

impl<'a> Report<'a> {
    fn of(diagnostic: &Diagnostic, sources: &'a [Source]) -> Self {
        let source_of = |span: Span| sources.get(span.file as usize);
        let source = diagnostic.labels.first().and_then(|label| source_of(label.span));
        let file = diagnostic.labels.first().map(|label| label.span.file);
        let (here, there): (Vec<&Label>, Vec<&Label>) =
            diagnostic.labels.iter().partition(|label| Some(label.span.file) == file);
        let labels = |labels: &[&Label], source: Option<&Source>| {
            source.map_or(Vec::new(), |source| {
                let labels = labels.iter().enumerate();
                labels.map(|(i, label)| source.labelled(label, i == 0)).collect()
            })
        };
        let elsewhere = there.iter().map(|label| Self {
            code: None,
            message: safe(&label.text),
            severity: miette::Severity::Advice,
            help: None,
            source: source_of(label.span),
            labels: labels(&[label], source_of(label.span)),
            elsewhere: Vec::new(),
        });
        Self {
            code: Some(diagnostic.code.to_string()),
            message: safe(&diagnostic.message),
            severity: match diagnostic.code.severity() {
                Severity::Error => miette::Severity::Error,
                Severity::Warning => miette::Severity::Warning,
            },
            help: diagnostic.help.as_deref().map(safe),
            source,
            labels: labels(&here, source),
            elsewhere: elsewhere.collect(),
        }
    }
}

impl fmt::Display for Report<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Report<'_> {}

impl miette::Diagnostic for Report<'_> {
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
        self.source.map(|source| source as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        Some(Box::new(self.labels.iter().cloned()))
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn miette::Diagnostic> + 'a>> {
        Some(Box::new(self.elsewhere.iter().map(|report| report as &dyn miette::Diagnostic)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_grammar::{Code, parse};

    /// Checks what is said of a text behind the line `edition "2026"`, without colours.
    #[track_caller]
    fn check(text: &str, expected: &str) {
        let text = format!("edition \"2026\"\n{text}");
        let (_, diagnostics) = parse(&text, 0);
        let said = render(&diagnostics, &[("a.ivx".to_owned(), text)], false);
        assert_eq!(said, expected, "\n{said}");
    }

    #[test]
    fn a_fault_is_shown_in_its_line() {
        check(
            "let a == 1\nlet b = 2\n",
            r#"IVX0101

  × expected `=`, found `==`
   ╭─[a.ivx:2:7]
 1 │ edition "2026"
 2 │ let a == 1
   ·       ─┬
   ·        ╰── expected `=`
 3 │ let b = 2
   ╰────
  help: write `=`

"#,
        );
        check(
            "\tlet é = \"日本\"\r\nlet b = \"日本\" 2\r\n",
            r#"IVX0101

  × expected a name, found `é`
   ╭─[a.ivx:2:6]
 1 │ edition "2026"
 2 │     let é = "日本"
   ·         ┬
   ·         ╰── expected a name
 3 │ let b = "日本" 2
   ╰────
  help: a name is made of `A` to `z`, digits and `_`

IVX0101

  × expected an operator or the next item, found `2`
   ╭─[a.ivx:3:14]
 2 │     let é = "日本"
 3 │ let b = "日本" 2
   ·                ┬
   ·                ╰── expected an operator or the next item
   ╰────

"#,
        );
    }

    #[test]
    fn a_second_place_is_shown_too() {
        check(
            "let a = f(\n  x,\n  y,\n  z,\n  w,\nlet b = 2\n",
            r#"IVX0101

  × expected an expression or `)`, found `let`
   ╭─[a.ivx:2:10]
 1 │ edition "2026"
 2 │ let a = f(
   ·          ┬
   ·          ╰── this `(` is still open
 3 │   x,
   ╰────
   ╭─[a.ivx:7:1]
 6 │   w,
 7 │ let b = 2
   · ─┬─
   ·  ╰── expected an expression or `)`
   ╰────

"#,
        );
    }

    #[test]
    fn a_span_of_lines_is_cut_to_its_first() {
        check(
            "let a = 1\n/// nothing\n/// more\n",
            r"IVX0105

  ⚠ a doc comment stands before nothing
   ╭─[a.ivx:3:1]
 2 │ let a = 1
 3 │ /// nothing
   · ─────┬─────
   ·      ╰── there is no item that it could describe
 4 │ /// more
   ╰────
  help: write `//` for a plain comment

",
        );
    }

    #[test]
    fn nothing_acts_on_the_terminal() {
        let known = "edition \"\u{1b}\"";
        let (_, diagnostics) = parse(known, 0);
        let said = render(&diagnostics, &[("\u{7}".to_owned(), known.to_owned())], false);
        assert!(said.contains("edition `?`") && !said.contains(['\u{1b}', '\u{7}']), "{said}");
        check(
            "let a = \u{1b}[31m \u{202e}",
            r#"IVX0101

  × expected an expression, found U+001B
   ╭─[a.ivx:2:9]
 1 │ edition "2026"
 2 │ let a = ?[31m ???
   ·         ┬
   ·         ╰── expected an expression
   ╰────

"#,
        );
    }

    #[test]
    fn a_long_line_is_cut() {
        let long = format!("{}let b == 1{}", "let a = 1 ".repeat(1000), " let a = 1".repeat(1000));
        let (_, diagnostics) = parse(&long, 0);
        let said = render(&diagnostics[1..], &[("a.ivx".to_owned(), long)], false);
        assert!(said.contains("[a.ivx:1:10007]"), "{said}");
        assert!(said.contains("= 1 let b == 1 let a"), "{said}");
        assert!(said.lines().all(|line| line.chars().count() < 2 * REACH + 20), "{said}");
    }

    #[test]
    fn a_long_stretch_of_one_line_is_cut() {
        let text = format!("let a = [{}]", "1, ".repeat(1000));
        let span = Span { file: 0, start: 8, end: u32::try_from(text.len()).expect("it is short") };
        let fault = Diagnostic::new(Code::Type, span, "said", "here");
        let said = render(&[fault], &[("a.ivx".to_owned(), text)], false);
        assert!(said.contains("[a.ivx:1:9]") && said.contains("here"), "{said}");
    }

    #[test]
    fn an_empty_file_and_another_file_are_named() {
        let place = |file, start, end| Span { file, start, end };
        let diagnostic = Diagnostic::new(Code::Shadowing, place(1, 0, 0), "said", "here")
            .also(place(0, 4, 5), "there")
            .also(place(2, 0, 1), "nowhere")
            .help("do so");
        let sources =
            [("a.ivx".to_owned(), "a\nb c".to_owned()), ("b.ivx".to_owned(), String::new())];
        let said = render(&[diagnostic], &sources, false);
        let lines: Vec<_> = said.trim_end().lines().map(str::trim_end).collect();
        let expected = [
            "IVX0309",
            "",
            "  × said",
            "   ╭─[b.ivx:1:1]",
            " 1 │",
            "   · ▲",
            "   · ╰── here",
            "   ╰────",
            "  help: do so",
            "",
            "Advice:",
            "  ☞ there",
            "   ╭─[a.ivx:2:3]",
            " 1 │ a",
            " 2 │ b c",
            "   ·   ┬",
            "   ·   ╰── there",
            "   ╰────",
            "",
            "Advice:",
            "  ☞ nowhere",
        ];
        assert_eq!(lines, expected, "\n{said}");
    }

    #[test]
    fn only_colour_brings_escapes() {
        let diagnostic = Diagnostic::new(Code::Type, Span { file: 0, start: 0, end: 1 }, "m", "l");
        let said = |colour| {
            let sources = [("a.ivx".to_owned(), "a".to_owned())];
            render(std::slice::from_ref(&diagnostic), &sources, colour)
        };
        assert!(said(true).contains("\u{1b}["));
        assert!(!said(false).contains('\u{1b}'));
    }

    #[test]
    fn no_span_is_refused() {
        let text = "é\r\n\n日本 a\n\u{feff}b";
        let sources = [("a.ivx".to_owned(), text.to_owned())];
        for start in 0..20 {
            for end in 0..20 {
                let span = Span { file: 0, start, end };
                let other = Span { file: 0, start: end, end: start };
                let diagnostic = Diagnostic::new(Code::Type, span, "m", "one").also(other, "two");
                let said = render(&[diagnostic], &sources, false);
                assert!(said.contains("one") && said.contains("two"), "{start}..{end}\n{said}");
            }
        }
    }
}
