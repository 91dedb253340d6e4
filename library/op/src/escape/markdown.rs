//! Text inside Markdown, as GitHub reads it.

use super::on_one_line;

/// Text in a line of Markdown that means itself, at its start too. Only what would act is escaped, so that names
/// stay as they are written.
#[must_use]
pub fn markdown(text: &str) -> String {
    escaped(text, false)
}

/// Text in a cell of a table.
#[must_use]
pub fn markdown_cell(text: &str) -> String {
    escaped(text, true)
}

fn escaped(text: &str, in_cell: bool) -> String {
    let chars = on_one_line(text);
    let mut safe = String::new();
    let mut start = if in_cell { None } else { opens(&chars) };
    for (i, &c) in chars.iter().enumerate() {
        let rest = &chars[i + 1..];
        let (before, after) = (i.checked_sub(1).map(|i| chars[i]), rest.first().copied());
        let follows = |word: &str| word.chars().eq(rest.iter().copied().take(word.len()));
        let acts = match c {
            '\\' | '`' | '*' | '[' | '<' | '~' | '|' | '$' => true,
            '_' => !inside_a_word(&chars, i),
            '&' => after.is_some_and(|c| c.is_ascii_alphanumeric() || c == '#'),
            // What GitHub makes links of.
            ':' => follows("//"),
            '@' => before.is_some_and(|c| c != ' ') && after.is_some_and(|c| c != ' '),
            '.' => i >= 3 && chars[i - 3..i].iter().all(|c| c.eq_ignore_ascii_case(&'w')),
            _ => false,
        };
        let opens = start == Some(i);
        if c == ' ' && (before.is_none() || after.is_none()) {
            // Readers trim blanks at the ends.
            safe.push_str("&#32;");
            continue;
        }
        if opens {
            start = None;
        }
        if acts || opens {
            safe.push('\\');
        }
        safe.push(c);
    }
    safe
}

/// Which character would make a paragraph a list, a heading, a quotation or a rule.
fn opens(chars: &[char]) -> Option<usize> {
    let ends = |i: usize| chars.get(i).is_none_or(|c| *c == ' ');
    let n = |of: fn(&char) -> bool| chars.iter().take_while(|c| of(c)).count();
    let digits = n(char::is_ascii_digit);
    let hashes = n(|c| *c == '#');
    match chars.first()? {
        '>' | '=' => Some(0),
        '+' if ends(1) => Some(0),
        '-' if ends(1) || chars.iter().all(|c| matches!(c, '-' | ' ')) => Some(0),
        '#' if ends(hashes) => Some(0),
        '0'..='9' if matches!(chars.get(digits), Some('.' | ')')) && ends(digits + 1) => {
            Some(digits)
        }
        _ => None,
    }
}

/// Whether a `_` lies between letters or digits, where it means itself.
fn inside_a_word(chars: &[char], i: usize) -> bool {
    let letter = |c: Option<&char>| c.is_some_and(|c| c.is_alphanumeric());
    letter(chars[..i].iter().rev().find(|c| **c != '_'))
        && letter(chars[i..].iter().find(|c| **c != '_'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_acts_is_escaped() {
        let check = |text: &str, expected: &str| assert_eq!(markdown(text), expected, "{text}");
        check("<b>x</b>", "\\<b>x\\</b>");
        check("<64,64>", "\\<64,64>");
        check("*star*", "\\*star\\*");
        check("a_b_c _d_", "a_b_c \\_d\\_");
        check("&lt; a & b", "\\&lt; a & b");
        check("`c`", "\\`c\\`");
        check("[l](u)", "\\[l](u)");
        check("a\\|b", "a\\\\\\|b");
        check("http://a.b www.c.d", "http\\://a.b www\\.c.d");
        check("1. a", "1\\. a");
        check("1.5", "1.5");
        check("-1", "-1");
        check("- a", "\\- a");
        check("---", "\\---");
        check("# a", "\\# a");
        check("a\nb\u{1b}", "a b\\\\u{1b}");
        check(" a ", "&#32;a&#32;");
        assert_eq!(markdown_cell("1. a | b"), "1. a \\| b");
    }
}
