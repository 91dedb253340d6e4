//! Single words, numbers and characters of other languages.

use super::super::scan;
use super::Habit;

/// A closing bracket of another kind than the one that is open.
pub(super) fn closer(text: &str, place: usize, open: Option<usize>) -> Option<Habit> {
    let open = open?;
    let wanted = match &text[open..=open] {
        "(" => ")",
        "[" => "]",
        _ => "}",
    };
    let end = scan::token_end(text, place);
    let found = &text[place..end];
    let same_line = !text[open..place].contains('\n');
    if !matches!(found, ")" | "]" | "}") || found == wanted || !same_line {
        return None;
    }
    let message = format!("`{}` is closed by `{wanted}`, not by `{found}`", &text[open..=open]);
    Some(Habit::new((place, end), message, format!("write `{wanted}`")))
}

/// A number that other languages write.
pub(super) fn number(text: &str, place: usize) -> Option<Habit> {
    let end = scan::token_end(text, place);
    let found = &text[place..end];
    let digits = found.bytes().take_while(|b| b.is_ascii_digit() || *b == b'_').count();
    let (whole, letters) = found.split_at(digits);
    let habit = |at, message: &str, help: String| Some(Habit::new(at, message, help));
    if found == "." {
        let before = text[..place].bytes().rev().take_while(u8::is_ascii_digit).count();
        let after = text[end..].bytes().take_while(u8::is_ascii_digit).count();
        let pair = (&text[place - before..place], &text[end..end + after]);
        let (whole, part) = match pair {
            ("", "") => return None,
            (whole, part) => (
                if whole.is_empty() { "0" } else { whole },
                if part.is_empty() { "0" } else { part },
            ),
        };
        let message = "a number has digits on both sides of its point";
        return habit((place - before, end + after), message, format!("write `{whole}.{part}`"));
    }
    if whole.is_empty() || letters.is_empty() {
        return None;
    }
    let radix = match letters.get(..1) {
        Some("x" | "X") => 16,
        Some("b" | "B") => 2,
        Some("o" | "O") => 8,
        _ => 10,
    };
    if whole == "0" && radix != 10 {
        let value = i64::from_str_radix(&letters[1..].replace('_', ""), radix).ok();
        let help =
            value.map_or("write it in decimal digits".to_owned(), |n| format!("write `{n}`"));
        return habit((place, end), "numbers are decimal", help);
    }
    let zeros = match letters {
        "k" | "K" => "_000",
        "m" | "M" => "_000_000",
        "g" | "G" | "b" | "B" => "_000_000_000",
        _ => return None,
    };
    habit((place, end), "a number has no unit", format!("write `{whole}{zeros}`"))
}

/// Whether the digits behind a comma are a group of three, as in `1,000`.
pub(super) fn groups(rest: &str) -> bool {
    rest.bytes().take_while(u8::is_ascii_digit).count() == 3
}

/// What is raised to a power, where that is a name or a number.
pub(super) fn power<'t>(text: &'t str, tokens: &[(usize, usize)]) -> &'t str {
    let base = tokens.last().map_or("x", |(a, b)| &text[*a..*b]);
    if scan::is_word(base) { base } else { "x" }
}

/// Words of other languages that read as names here.
pub(crate) fn foreign(word: &str) -> Option<(&'static str, &'static str)> {
    Some(match word {
        "if" | "when" | "unless" | "switch" | "case" | "cond" | "ifelse" => (
            "there is no `if`",
            "write `where(condition, a, b)`, or choose along an axis: `match method { \"a\": 1, \"b\": 2 }`",
        ),
        "not" => ("there is no `not`", "turn the comparison round: `a >= b` for not `a < b`"),
        "lambda" | "fn" | "function" | "func" | "def" => {
            ("there are no functions without a name", "write `let f(x: Float) = x + 1`")
        }
        "for" | "while" | "foreach" => (
            "there are no loops",
            "declare an axis, `axis x = 0..5`: what mentions `x` has a value for each of it",
        ),
        "new" => ("nothing is made by `new`", "a part is called: `wcm()`"),
        "return" => ("nothing is returned", "the expression itself is the value"),
        "await" | "async" | "yield" => {
            ("nothing is waited for", "the expression itself is the value")
        }
        _ => return None,
    })
}

/// A comment of another language.
pub(super) fn comment(text: &str, place: usize) -> Option<Habit> {
    let rest = &text[place..];
    let line = place + rest.lines().next().map_or(0, str::len);
    let (end, resume) = if rest.starts_with('#') {
        (place + 1, line)
    } else if rest.starts_with("--") {
        (place + 2, line)
    } else if rest.starts_with("/*") || rest.starts_with('*') && text[..place].ends_with('/') {
        let close = rest.find("*/").map_or(line, |at| place + at + 2);
        let start = place - usize::from(!rest.starts_with("/*"));
        return Some(
            Habit::new(
                (start, start + 2),
                "a comment begins with `//`",
                "write `//` on each line of it",
            )
            .keeping(close),
        );
    } else {
        return None;
    };
    Some(Habit::new((place, end), "a comment begins with `//`", "write `//`").keeping(resume))
}

/// A character that looks like another.
pub(super) fn odd_character(text: &str, place: usize) -> Option<Habit> {
    let c = text[place..].chars().next()?;
    let end = place + c.len_utf8();
    let code = format!("U+{:04X}", u32::from(c));
    let (name, plain) = match c {
        '“' | '”' | '„' | '«' | '»' | '‟' | '″' => ("a typographic quote", "\""),
        '‘' | '’' | '‚' | '\'' | '`' => {
            let message = "strings stand in plain double quotes";
            return Some(Habit::new((place, end), message, "write `\"`"));
        }
        '−' | '–' | '—' | '‐' | '‑' | '‒' | '－' => {
            ("not the minus of the keyboard", "-")
        }
        '×' | '·' | '⋅' | '∗' | '＊' => ("not the sign for products", "*"),
        '÷' | '∕' | '⁄' => ("not the sign for quotients", "/"),
        '≤' | '⩽' => ("not read", "<="),
        '≥' | '⩾' => ("not read", ">="),
        '≠' => ("not read", "!="),
        '≈' | '≃' | '±' => ("not read", "== .. within(0.05)"),
        '…' => ("not read", ".."),
        '＝' | '⇒' | '→' | '←' => ("not read", "="),
        '：' => ("not read", ":"),
        '，' | '、' => ("not read", ","),
        '（' => ("not read", "("),
        '）' => ("not read", ")"),
        '²' => {
            let base = scan::words(text, text[..place].rfind('\n').map_or(0, |at| at + 1), place);
            let base = power(text, &base);
            return Some(Habit::new(
                (place, end),
                "there is no `²`",
                format!("write `{base} * {base}`"),
            ));
        }
        '\u{ad}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}' | '\u{feff}' => {
            let message = format!("an invisible character stands here ({code})");
            return Some(Habit::new((place, end), message, "take it away"));
        }
        c if c.is_whitespace() && !matches!(c, ' ' | '\t' | '\r' | '\n') => {
            let message = format!("this blank is {code}, which is not read as one");
            return Some(Habit::new((place, end), message, "write a plain blank"));
        }
        _ => return None,
    };
    Some(Habit::new((place, end), format!("`{c}` ({code}) is {name}"), format!("write `{plain}`")))
}
