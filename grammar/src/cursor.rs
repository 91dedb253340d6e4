//! Where in a text that is being written a place lies: for completion.

use crate::parse::scan::{ITEM_WORDS, Token, is_word, names_something, tokens};

/// What stands before a place of a text, whether or not the text reads.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cursor {
    /// Where the word or string begins that the place is in or behind; the place itself if there is none.
    pub start: usize,
    /// Whether the place is inside of quotes, and `start` is the byte behind the first.
    pub quoted: bool,
    /// Whether the place is inside of a comment.
    pub comment: bool,
    /// The token before the word.
    pub before: String,
    /// The name whose field the word is: of `task.en`, `task`.
    pub of: Option<String>,
    /// The word that begins the item around; empty where a new one could begin.
    pub item: String,
    /// The brackets that are open, outermost first.
    pub around: Vec<Around>,
}

/// An open bracket.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Around {
    /// `(`, `[` or `{`.
    pub bracket: char,
    /// The word before it: what is called, selected from or, in a `match`, matched.
    pub head: String,
    /// Whether it is the `{` of a `match`.
    pub is_match: bool,
    /// The names before a `:` and the labels in quotes there, but for the last.
    pub given: Vec<String>,
    /// The name before the last `:`, if no comma follows it.
    pub name: Option<String>,
    /// How many commas there are.
    pub index: usize,
    /// Whether nothing stands between the bracket or the last comma and the word.
    pub fresh: bool,
}

/// What stands before the byte `at`.
#[must_use]
pub fn cursor(text: &str, at: usize) -> Cursor {
    let at = text.floor_char_boundary(at);
    let mut cursor = Cursor { start: at, ..Cursor::default() };
    // The two tokens before.
    let (mut last, mut older) = (String::new(), String::new());
    let mut end = 0;
    for Token { start, text: token, first } in tokens(text, 0) {
        if start >= at {
            break;
        }
        end = start + token.len();
        let touches = end >= at && !(token.starts_with('"') && end == at && closed(token));
        if touches && (is_word(token) || token.starts_with('"')) {
            cursor.quoted = token.starts_with('"');
            cursor.start = start + usize::from(cursor.quoted);
            end = at;
            break;
        }
        if (first || last.is_empty()) && ITEM_WORDS.contains(&token) && names_something(text, end) {
            let block = cursor.around.first().filter(|open| open.bracket == '{');
            let block = block.filter(|_| token != "experiment").cloned();
            cursor.around = block.into_iter().collect();
            token.clone_into(&mut cursor.item);
        }
        step(&mut cursor, token, &last, &older);
        older = std::mem::replace(&mut last, token.to_owned());
    }
    let line = text[..at].rfind('\n').map_or(0, |line| line + 1);
    cursor.comment = text[end.min(at).max(line)..at].contains("//");
    if last == "." {
        cursor.of = Some(older);
    }
    // At the start of a line outside of brackets another item begins.
    let new_line = text[line..cursor.start].trim().is_empty();
    let outside = cursor.around.iter().all(|open| open.bracket == '{' && open.head == "experiment");
    if new_line && outside && !continues(&last) {
        cursor.item.clear();
    }
    cursor.before = last;
    cursor
}

/// Goes over one token.
fn step(cursor: &mut Cursor, token: &str, last: &str, older: &str) {
    let name = |token: &str| token.trim_matches('"').to_owned();
    match token {
        "(" | "[" | "{" => {
            let in_experiment = token == "{" && older == "experiment";
            let head = if in_experiment { "experiment" } else { last };
            let head = if is_word(head) { head.to_owned() } else { String::new() };
            if let Some(open) = cursor.around.last_mut() {
                open.fresh = false;
            }
            cursor.around.push(Around {
                bracket: token.chars().next().unwrap_or_default(),
                head,
                is_match: token == "{" && older == "match",
                fresh: true,
                ..Around::default()
            });
        }
        ")" | "]" | "}" => {
            cursor.around.pop();
            if cursor.around.len() <= usize::from(token == "}") && token == "}" {
                cursor.item.clear();
            }
        }
        _ => {
            let Some(open) = cursor.around.last_mut() else { return };
            match token {
                "," => {
                    open.given.extend(open.name.take());
                    open.index += 1;
                    open.fresh = true;
                }
                ":" => open.name = Some(name(last)),
                _ => open.fresh = false,
            }
        }
    }
}

/// Whether an expression goes on behind a token.
fn continues(token: &str) -> bool {
    matches!(
        token,
        "=" | ":" | "+" | "-" | "*" | "/" | "<" | "<=" | ">" | ">=" | "==" | "!=" | "," | "."
    )
}

/// Whether a string has its second quote.
fn closed(token: &str) -> bool {
    token.len() > 1 && token.ends_with('"')
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cursor at `|`.
    fn at(text: &str) -> Cursor {
        let place = text.find('|').expect("the text says where");
        cursor(&text.replace('|', ""), place)
    }

    /// An open bracket: what it is, its head, the name of the argument, how many commas, and what was named before.
    type Open = (char, String, Option<String>, usize, Vec<String>);

    fn open(text: &str) -> Vec<Open> {
        let around = at(text).around.into_iter();
        around.map(|open| (open.bracket, open.head, open.name, open.index, open.given)).collect()
    }

    #[test]
    fn arguments_and_labels_are_told_apart() {
        let call = |name: Option<&str>, index, given: &[&str]| {
            let given = given.iter().map(ToString::to_string).collect();
            ('(', "f".to_owned(), name.map(str::to_owned), index, given)
        };
        assert_eq!(open("let a = f(|"), [call(None, 0, &[])]);
        assert_eq!(open("let a = f(x, ke|"), [call(None, 1, &[])]);
        assert_eq!(open("let a = f(x, ke: m|"), [call(Some("ke"), 1, &[])]);
        assert_eq!(open("let a = f(x, ke: g(1, 2), n|"), [call(None, 2, &["ke"])]);
        assert!(at("let a = f(x, ke|").around[0].fresh);
        assert!(!at("let a = f(x, 1 + m|").around[0].fresh);
        let label = at("measure m = gap[ke: \"WC|");
        assert!(label.quoted);
        assert_eq!(
            (label.around[0].head.as_str(), label.around[0].name.as_deref()),
            ("gap", Some("ke"))
        );
        let arm = at("let a = match method { \"A\": 1, \"|");
        assert!(arm.quoted && arm.around[0].is_match);
        assert_eq!(
            (arm.around[0].head.as_str(), &arm.around[0].given[..]),
            ("method", &["A".to_owned()][..])
        );
    }

    #[test]
    fn an_item_begins_on_a_line_of_its_own() {
        assert_eq!(at("edition \"2026\"\nme|").item, "");
        assert_eq!(at("experiment e {\n    me|").item, "");
        assert_eq!(at("experiment e {\n    let a =\n  b|").item, "let");
        assert_eq!(at("experiment e {\n    let a = f(\n  b|").item, "let");
        assert_eq!(
            at("experiment e {\n  let a = f(\n  measure b = c|").around.len(),
            1,
            "the bracket is not closed"
        );
        assert_eq!(at("use \"dri|").item, "use");
        assert!(at("let a = 1 // of b|").comment);
        assert!(!at("// of\nlet a = b|").comment);
        assert_eq!(at("let a = task.en|").of.as_deref(), Some("task"));
        assert_eq!(at("let a = task.|").of.as_deref(), Some("task"));
        assert_eq!(at("let é = \"x\" + y|").start, "let é = \"x\" + ".len());
    }
}
