//! Tokens, roughly: enough to find where items begin and end in text that does not parse.

/// The deepest nesting of brackets: pest recurses over them.
pub(super) const DEEPEST: usize = 256;

/// The words that begin an item.
pub(crate) const ITEM_WORDS: [&str; 13] = [
    "axis",
    "claim",
    "edition",
    "experiment",
    "figure",
    "include",
    "let",
    "measure",
    "param",
    "profile",
    "published",
    "table",
    "use",
];

/// Whether a text can be the name of something.
#[must_use]
pub fn is_name(text: &str) -> bool {
    let begins = text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    begins && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') && !is_reserved(text)
}

/// Whether `word` cannot be a name.
pub(crate) fn is_reserved(word: &str) -> bool {
    ITEM_WORDS.contains(&word) || ["as", "false", "match", "true"].contains(&word)
}

/// Blanks and comments between two tokens.
pub(crate) struct Gap {
    /// Where the next token begins, or the text ends.
    pub(crate) next: usize,
    /// Whether the next token stands on another line.
    pub(crate) newline: bool,
    /// Whether an empty line lies before the next token, behind the last comment.
    pub(crate) blank: bool,
    /// The comments.
    pub(crate) comments: Vec<Comment>,
}

/// One comment, which ends with its line.
pub(crate) struct Comment {
    /// Its first byte.
    pub(crate) start: usize,
    /// The byte after its last that is no blank.
    pub(crate) end: usize,
    /// Whether it stands on the line on which the gap begins.
    pub(crate) behind: bool,
    /// Whether an empty line lies before it.
    pub(crate) blank: bool,
    /// Whether it documents an item: `///`.
    pub(super) doc: bool,
}

impl Comment {
    /// What a doc comment says.
    pub(super) fn words<'t>(&self, text: &'t str) -> &'t str {
        let line = &text[self.start + "///".len()..self.end];
        line.strip_prefix(' ').unwrap_or(line)
    }
}

/// The gap that begins at `from`.
pub(crate) fn gap(text: &str, from: usize) -> Gap {
    let bytes = text.as_bytes();
    let mut gap = Gap { next: from, newline: false, blank: false, comments: Vec::new() };
    // Line breaks since the last token or comment.
    let mut breaks = 0_usize;
    loop {
        let rest = &bytes[gap.next..];
        if rest.starts_with(b"//") {
            let length = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
            let (start, behind, blank) = (gap.next, !gap.newline, breaks > 1);
            let end = start + text[start..start + length].trim_end().len();
            let doc = rest.starts_with(b"///") && rest.get(3) != Some(&b'/');
            gap.comments.push(Comment { start, end, behind, blank, doc });
            gap.next += length;
            breaks = 0;
        } else if let Some(b' ' | b'\t' | b'\r' | b'\n') = rest.first() {
            breaks += usize::from(rest[0] == b'\n');
            gap.newline |= breaks > 0;
            gap.next += 1;
        } else {
            gap.blank = breaks > 1;
            return gap;
        }
    }
}

/// The byte after the token at `start`: a string, word, number, operator or single character.
pub(crate) fn token_end(text: &str, start: usize) -> usize {
    let rest = &text.as_bytes()[start..];
    let run = |from: usize| {
        let letter = |b: &u8| b.is_ascii_alphanumeric() || *b == b'_';
        from + rest[from..].iter().take_while(|b| letter(b)).count()
    };
    let digit = |at: usize| rest.get(at).is_some_and(u8::is_ascii_digit);
    let length = match rest {
        [] => 0,
        [b'"', ..] => string_length(rest),
        [b'a'..=b'z' | b'A'..=b'Z' | b'_', ..] => run(0),
        [b'0'..=b'9', ..] => {
            let mut end = run(0);
            if rest.get(end) == Some(&b'.') && digit(end + 1) {
                end = run(end + 1);
            }
            let exponent = matches!(rest[end - 1], b'e' | b'E');
            if exponent && matches!(rest.get(end), Some(b'+' | b'-')) && digit(end + 1) {
                end = run(end + 1);
            }
            end
        }
        [b'=' | b'<' | b'>' | b'!', b'=', ..] | [b'.', b'.', ..] => 2,
        _ => text[start..].chars().next().map_or(0, char::len_utf8),
    };
    start + length
}

/// The length of the string that `rest` begins with, with its quotes; to the end of the line if it
/// is not closed.
fn string_length(rest: &[u8]) -> usize {
    let mut at = 1;
    while let Some(byte) = rest.get(at) {
        match byte {
            b'\n' | b'\r' => break,
            b'"' => return at + 1,
            // What follows a backslash never closes the string; it may end the line.
            b'\\' if matches!(rest.get(at + 1), Some(b'"' | b'\\')) => at += 2,
            _ => at += 1,
        }
    }
    at
}

/// A token and whether it is the first on its line.
pub(crate) struct Token<'t> {
    pub(crate) start: usize,
    pub(crate) text: &'t str,
    pub(crate) first: bool,
}

/// The tokens from `from` on.
pub(crate) fn tokens(text: &str, from: usize) -> impl Iterator<Item = Token<'_>> {
    let mut at = from;
    std::iter::from_fn(move || {
        let Gap { next: start, newline: first, .. } = gap(text, at);
        at = token_end(text, start);
        (at > start).then(|| Token { start, text: &text[start..at], first })
    })
}

/// Where the tokens from `from` to `to` begin and end.
pub(super) fn words(text: &str, from: usize, to: usize) -> Vec<(usize, usize)> {
    tokens(&text[..to], from).map(|token| (token.start, token.start + token.text.len())).collect()
}

/// Where the token begins that ends at `cut` or goes across it.
pub(super) fn token_across(text: &str, from: usize, cut: usize) -> Option<usize> {
    let last = tokens(text, from).take_while(|token| token.start < cut).last()?;
    (last.start + last.text.len() >= cut).then_some(last.start)
}

/// The opening brackets among the tokens from `from` to `to` that nothing closes.
///
/// # Errors
/// Where brackets, or the `<` of types, are nested too deeply.
pub(super) fn unclosed(text: &str, from: usize, to: usize) -> Result<Vec<usize>, usize> {
    let mut open: Vec<(u8, usize)> = Vec::new();
    let mut angles = 0_usize;
    for token in tokens(&text[..to], from) {
        let byte = token.text.as_bytes()[0];
        let opener = match byte {
            b')' => b'(',
            b']' => b'[',
            b'}' => b'{',
            _ => 0,
        };
        match byte {
            b'(' | b'[' | b'{' => open.push((byte, token.start)),
            b')' | b']' | b'}' => {
                if let Some(at) = open.iter().rposition(|(byte, _)| *byte == opener) {
                    open.truncate(at);
                }
            }
            _ => {}
        }
        // Between the `<` of nested types stand only names and commas.
        angles = match token.text {
            "<" => angles + 1,
            ">" => angles.saturating_sub(1),
            word if word == "," || is_word(word) => angles,
            _ => 0,
        };
        if open.len().max(angles) > DEEPEST {
            return Err(token.start);
        }
    }
    Ok(open.into_iter().map(|(_, start)| start).collect())
}

/// Whether a token is a word or a number.
pub(crate) fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_')
}

/// Where the stretch that begins at `start` with something broken ends: before the next item word
/// that begins a line, or before the `}` of the block it is `inside` of.
///
/// Within brackets an item word counts only if a name or a string follows it, as it would in an
/// item: an item never goes on in an argument, but an unclosed bracket must not swallow the file.
pub(super) fn stretch_end(text: &str, start: usize, inside: bool) -> usize {
    let mut end = token_end(text, start);
    let (mut braces, mut others) = (0_usize, 0_usize);
    count(&text[start..end], &mut braces, &mut others);
    for token in tokens(text, end) {
        let after = token.start + token.text.len();
        if token.first && ITEM_WORDS.contains(&token.text) {
            let calls = next_byte(text, after) == Some(b'(');
            if names_something(text, after) || braces + others == 0 && !calls {
                break;
            }
        }
        if inside && braces == 0 && token.text == "}" {
            break;
        }
        count(token.text, &mut braces, &mut others);
        end = after;
    }
    end
}

/// Whether a name or a string comes next.
pub(crate) fn names_something(text: &str, from: usize) -> bool {
    let begins = |next: u8| next.is_ascii_alphabetic() || next == b'_' || next == b'"';
    next_byte(text, from).is_some_and(begins)
}

fn next_byte(text: &str, from: usize) -> Option<u8> {
    text.as_bytes().get(gap(text, from).next).copied()
}

fn count(token: &str, braces: &mut usize, others: &mut usize) {
    match token {
        "{" => *braces += 1,
        "}" => (*braces, *others) = (braces.saturating_sub(1), 0),
        "(" | "[" => *others += 1,
        ")" | "]" => *others = others.saturating_sub(1),
        _ => {}
    }
}

/// Where the first block that opens behind `start` is closed, or the text ends.
pub(super) fn block_end(text: &str, start: usize) -> usize {
    let (mut braces, mut others) = (0, 0);
    for token in tokens(text, start) {
        count(token.text, &mut braces, &mut others);
        if braces == 0 && token.text == "}" {
            return token.start + 1;
        }
    }
    text.trim_end().len()
}
