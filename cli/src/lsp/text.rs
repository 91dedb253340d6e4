//! Texts by lines, and places in them as editors count them.

use gen_lsp_types::{Position, PositionEncodingKind, Range};
use ivx_grammar::Span;
use serde_json::Value;

/// In what units an editor counts along a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Units {
    /// Bytes of UTF-8.
    Utf8,
    /// Units of UTF-16, which editors count in unless agreed otherwise.
    #[default]
    Utf16,
}

impl Units {
    /// What both sides know best.
    pub(super) fn agreed(offered: Option<&Value>) -> Self {
        let mut offered = offered.and_then(Value::as_array).into_iter().flatten();
        if offered.any(|known| known == "utf-8") { Self::Utf8 } else { Self::Utf16 }
    }

    /// What the editor is told.
    pub(super) fn kind(self) -> PositionEncodingKind {
        match self {
            Self::Utf8 => PositionEncodingKind::UTF8,
            Self::Utf16 => PositionEncodingKind::UTF16,
        }
    }

    /// How long a stretch of a line is.
    fn length(self, text: &str) -> u32 {
        let length = match self {
            Self::Utf8 => text.len(),
            // Most is, and lines can be long.
            Self::Utf16 if text.is_ascii() => text.len(),
            Self::Utf16 => text.encode_utf16().count(),
        };
        u32::try_from(length).unwrap_or(u32::MAX)
    }

    /// How many bytes so many units at the start of a line are; all of it where there are fewer.
    fn bytes(self, line: &str, units: u32) -> usize {
        let mut left = units as usize;
        for (at, c) in line.char_indices() {
            if left == 0 {
                return at;
            }
            let own = match self {
                Self::Utf8 => c.len_utf8(),
                Self::Utf16 => c.len_utf16(),
            };
            left = left.saturating_sub(own);
        }
        line.len()
    }
}

/// A text, and where its lines begin.
#[derive(Clone, Debug, Default)]
pub(super) struct Text {
    pub(super) text: String,
    starts: Vec<usize>,
}

impl Text {
    pub(super) fn new(text: String) -> Self {
        let ends = text.match_indices('\n').map(|(end, _)| end + 1);
        let starts = std::iter::once(0).chain(ends).collect();
        Self { text, starts }
    }

    /// The byte that a place means: no place lies outside of the text.
    pub(super) fn offset(&self, place: Position, units: Units) -> usize {
        let Some(start) = self.starts.get(place.line as usize) else { return self.text.len() };
        let line = self.line(place.line as usize);
        start + units.bytes(line, place.character)
    }

    /// The place of a byte.
    pub(super) fn position(&self, at: usize, units: Units) -> Position {
        let at = self.text.floor_char_boundary(at);
        let line = self.starts.partition_point(|start| *start <= at) - 1;
        let column = units.length(&self.text[self.starts[line]..at]);
        Position::new(u32::try_from(line).unwrap_or(u32::MAX), column)
    }

    /// The places of a stretch.
    pub(super) fn range(&self, span: Span, units: Units) -> Range {
        let end = span.end.max(span.start) as usize;
        Range::new(self.position(span.start as usize, units), self.position(end, units))
    }

    /// What a stretch says; nothing where it is of another text.
    pub(super) fn of(&self, span: Span) -> &str {
        self.text.get(span.start as usize..span.end as usize).unwrap_or_default()
    }

    /// A line without its end.
    fn line(&self, line: usize) -> &str {
        let start = self.starts.get(line).copied().unwrap_or(self.text.len());
        let end = self.starts.get(line + 1).copied().unwrap_or(self.text.len());
        self.text[start..end].trim_end_matches(['\n', '\r'])
    }

    /// Where the line ends that a byte is on.
    pub(super) fn line_end(&self, at: usize) -> usize {
        let line = self.starts.partition_point(|start| *start <= at) - 1;
        self.starts[line] + self.line(line).len()
    }

    /// The text with another in place of what lies between two places, or of all.
    pub(super) fn edited(self, range: Option<Range>, with: &str, units: Units) -> Self {
        let Some(range) = range else { return Self::new(with.to_owned()) };
        let (start, end) = (self.offset(range.start, units), self.offset(range.end, units));
        let mut text = self.text;
        text.replace_range(start..end.max(start), with);
        Self::new(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_counted_in_units_of_the_editor() {
        let text = Text::new("é😀b\r\nc".to_owned());
        let check = |at: usize, utf8: (u32, u32), utf16: (u32, u32)| {
            for (units, (line, column)) in [(Units::Utf8, utf8), (Units::Utf16, utf16)] {
                assert_eq!(text.position(at, units), Position::new(line, column), "{at}");
                assert_eq!(text.offset(Position::new(line, column), units), at);
            }
        };
        check(0, (0, 0), (0, 0));
        check(2, (0, 2), (0, 1));
        check(6, (0, 6), (0, 3));
        check(7, (0, 7), (0, 4));
        check(9, (1, 0), (1, 0));
        check(10, (1, 1), (1, 1));
        // Beyond the end of a line is its end, and beyond the last the end of the text.
        assert_eq!(text.offset(Position::new(0, 99), Units::Utf16), 7);
        assert_eq!(text.offset(Position::new(9, 0), Units::Utf16), 10);
        // In the midst of a character is behind it.
        assert_eq!(text.offset(Position::new(0, 2), Units::Utf16), 6);
    }

    #[test]
    fn edits_are_made_where_the_editor_makes_them() {
        let text = Text::new("let a = 1\nlet b = 2\n".to_owned());
        let range = Range::new(Position::new(0, 8), Position::new(1, 4));
        let text = text.edited(Some(range), "3\nlet ", Units::Utf16);
        assert_eq!(text.text, "let a = 3\nlet b = 2\n");
        assert_eq!(text.edited(None, "x", Units::Utf16).text, "x");
        let back = Range::new(Position::new(1, 0), Position::new(0, 0));
        assert_eq!(Text::new("a\nb".into()).edited(Some(back), "x", Units::Utf8).text, "a\nxb");
    }
}
