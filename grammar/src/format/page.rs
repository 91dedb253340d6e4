//! Lines being written.

use super::token::{Comment, Kind, Token, spaced};

/// The blanks between a line and the comment behind it.
const BEFORE_COMMENT: usize = 3;

/// What is written so far.
#[derive(Default)]
pub(super) struct Page<'t> {
    lines: Vec<Line<'t>>,
    line: Line<'t>,
    last: Option<(Kind, &'t str)>,
}

#[derive(Default)]
struct Line<'t> {
    /// Whether an empty line lies before it.
    blank: bool,
    indent: usize,
    text: String,
    /// The comment behind it.
    comment: Option<&'t str>,
}

impl<'t> Page<'t> {
    /// Goes to the beginning of a line.
    pub(super) fn newline(&mut self, indent: usize) {
        if !self.at_start() {
            self.lines.push(std::mem::take(&mut self.line));
        }
        self.line.indent = indent;
    }

    /// Goes to the beginning of a line, with an empty line before it if `blank` says so.
    pub(super) fn paragraph(&mut self, indent: usize, blank: bool) {
        self.newline(indent);
        self.line.blank = blank;
    }

    /// Whether nothing stands on the line yet.
    pub(super) fn at_start(&self) -> bool {
        self.line.text.is_empty()
    }

    /// Whether a comment ends the line.
    pub(super) fn ended(&self) -> bool {
        self.line.comment.is_some()
    }

    /// The characters on the line.
    pub(super) fn column(&self) -> usize {
        self.line.indent + self.line.text.chars().count()
    }

    /// How far the line goes when `tokens` go on with it.
    pub(super) fn reach(&self) -> Reach<'t> {
        let last = if self.at_start() { None } else { self.last };
        Reach { column: self.column(), last }
    }

    /// Writes comments on lines of their own, where the page is at the beginning of one.
    pub(super) fn comments(&mut self, comments: &[Comment<'t>]) {
        let indent = self.line.indent;
        for comment in comments {
            comment.text.clone_into(&mut self.line.text);
            self.newline(indent);
        }
    }

    /// Writes a token and the comments about it.
    ///
    /// - `indent`: of the line that it begins if a comment keeps it from going on with this one.
    pub(super) fn token(&mut self, token: &Token<'t>, indent: usize) {
        if !self.at_start() && (self.ended() || !token.above.is_empty()) {
            self.newline(indent);
        }
        self.comments(&token.above);
        let this = (token.kind, token.text);
        if !self.at_start() && self.last.is_some_and(|last| spaced(last, this)) {
            self.line.text.push(' ');
        }
        self.line.text.push_str(token.text);
        self.line.comment = token.behind;
        self.last = Some(this);
    }

    /// Ends the line with a comment if there is one.
    pub(super) fn behind(&mut self, comment: Option<&'t str>) {
        self.line.comment = comment.or(self.line.comment);
    }

    /// The text. Comments behind adjacent lines are aligned.
    pub(super) fn text(mut self) -> String {
        self.newline(0);
        let mut text = String::new();
        for run in self.lines.chunk_by(|a, b| a.comment.is_some() && b.aligned()) {
            let widest = run.iter().map(Line::width).max().unwrap_or(0);
            for line in run {
                if line.blank {
                    text.push('\n');
                }
                text.extend(std::iter::repeat_n(' ', line.indent));
                text.push_str(&line.text);
                if let Some(comment) = line.comment {
                    let gap = widest - line.width() + BEFORE_COMMENT;
                    text.extend(std::iter::repeat_n(' ', gap));
                    text.push_str(comment);
                }
                text.push('\n');
            }
        }
        text
    }
}

impl Line<'_> {
    fn width(&self) -> usize {
        self.indent + self.text.chars().count()
    }

    fn aligned(&self) -> bool {
        self.comment.is_some() && !self.blank
    }
}

/// A line with tokens that are not written yet.
#[derive(Default)]
pub(super) struct Reach<'t> {
    /// The characters on the line.
    pub(super) column: usize,
    last: Option<(Kind, &'t str)>,
}

impl<'t> Reach<'t> {
    /// Adds a token.
    pub(super) fn add(&mut self, token: &Token<'t>) {
        let this = (token.kind, token.text);
        let blank = self.last.is_some_and(|last| spaced(last, this));
        self.column += usize::from(blank) + token.text.chars().count();
        self.last = Some(this);
    }
}
