//! Habits of other languages, told in the words of this one.

mod token;

use super::scan;
pub(crate) use token::foreign;
use token::{closer, comment, groups, number, odd_character, power};

/// A habit that was seen.
pub(super) struct Habit {
    /// Where it shows.
    pub(super) start: usize,
    pub(super) end: usize,
    pub(super) message: String,
    pub(super) help: String,
    /// Where to read on, if that is not the next item.
    pub(super) resume: Option<usize>,
    /// Whether what stands before it is meant as it reads.
    pub(super) keeps: bool,
}

impl Habit {
    fn new(
        (start, end): (usize, usize),
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        let (message, help) = (message.into(), help.into());
        Self { start, end, message, help, resume: None, keeps: false }
    }

    fn keeping(self, resume: usize) -> Self {
        Self { resume: Some(resume), keeps: true, ..self }
    }
}

/// Where an item should begin and does not.
pub(super) fn item(text: &str, place: usize) -> Option<Habit> {
    let end = scan::token_end(text, place);
    let (word, rest) = (&text[place..end], &text[end..]);
    if let Some(habit) = comment(text, place).or_else(|| odd_character(text, place)) {
        return Some(habit);
    }
    let lower = word.to_ascii_lowercase();
    let habit = |message: &str, help: &str| Some(Habit::new((place, end), message, help));
    if word != lower && scan::ITEM_WORDS.contains(&lower.as_str()) {
        let help = format!("write `{lower}`");
        return habit("the words that begin items are in lower case", &help);
    }
    let after = rest.trim_start_matches([' ', '\t']);
    let sets = after.starts_with('=') && !after.starts_with("==") || after.starts_with(":=");
    if sets && matches!(word, "seed" | "seeds" | "random_state") {
        return habit("the seeds are an axis", "write `axis seed = 0..5`");
    }
    if sets && scan::is_word(word) {
        let help = format!("write `let {word} = ..`, or `measure {word} = ..` for a result");
        return habit(&format!("`{word}` is set without saying what it is"), &help);
    }
    let changes = ["+=", "-=", "*=", "/=", "++", "--"].iter().any(|op| after.starts_with(op));
    if changes && scan::is_word(word) {
        return habit(
            &format!("`{word}` cannot be changed: a name has one value"),
            "give the new value a name of its own with `let`",
        );
    }
    let (message, help) = match lower.as_str() {
        "import" | "from" | "require" | "using" | "library" | "package" | "module" => (
            "nothing is imported: all operations are at hand",
            "names of another spec come by `use \"file.ivx\"`",
        ),
        "const" | "var" | "val" | "auto" | "final" | "static" | "global" | "local" | "mut"
        | "set" | "define" | "constant" | "assign" => (
            "a name is given by `let`",
            "write `let x = ..`; what a profile sets is `param x: Int = 1`",
        ),
        "int" | "float" | "double" | "string" | "str" | "bool" | "boolean" | "number" | "list" => (
            "a declaration does not begin with a type",
            "write `param x: Int = 1` for what a profile or `--set` may change, else `let x = 1`",
        ),
        "def" | "fn" | "func" | "function" | "fun" | "proc" | "sub" => {
            ("a function is a `let` with parameters", "write `let f(x: Float) = x + 1`")
        }
        "for" | "foreach" | "while" | "loop" | "repeat" | "do" | "until" => foreign("for")?,
        "if" | "else" | "elif" | "elsif" | "switch" | "case" | "when" | "unless" | "try" => {
            foreign("if")?
        }
        "print" | "println" | "printf" | "echo" | "display" | "show" | "log" | "puts" | "plot"
        | "plt" => (
            "nothing is printed: what is to be seen has a name",
            "write `measure x = ..`, `figure \"name\" = lines(..)` or `table \"name\" = table(..)`",
        ),
        "return" | "yield" | "output" | "result" => {
            ("nothing is returned: a result has a name", "write `measure x = ..`")
        }
        "assert" | "expect" | "test" | "require_that" | "check" | "hypothesis" => {
            ("what should be true is a claim", "write `claim \"in words\" : left < right`")
        }
        "class" | "struct" | "type" | "enum" | "interface" | "object" | "record" | "data" => (
            "there are no types of one's own",
            "the fields of an axis make records: `axis task(scene, env) = [(\"a\", chain())]`",
        ),
        "config" | "setting" | "settings" | "option" | "options" | "parameter" | "arg"
        | "hyperparameter" => ("a setting is a parameter", "write `param members: Int = 8`"),
        "end" | "begin" | "then" | "done" | "pass" | "fi" => (
            "items stand one after the other, in the braces of their experiment",
            "take this word away",
        ),
        _ if scan::is_word(word) && after.starts_with('(') => {
            ("a value stands in an item", "give it a name: `measure x = ..`, or `let x = ..`")
        }
        _ if scan::is_word(word) && rest.starts_with('.') => (
            "nothing is changed or called at an item's place",
            "give a value a name: `let x = ..`; settings are arguments of calls",
        ),
        _ => return None,
    };
    // A block of another language goes as a whole.
    let line = place + text[place..].lines().next().map_or(0, str::len);
    let brace = text[place..line].find('{').map(|at| place + at);
    let resume = brace.map(|brace| scan::block_end(text, brace));
    habit(message, help).map(|habit| Habit { resume, ..habit })
}

/// Where the item that begins at `start` stops being one, at `place`.
#[expect(clippy::too_many_lines, reason = "one list of habits, an arm each")]
pub(super) fn within(text: &str, start: usize, place: usize, open: Option<usize>) -> Option<Habit> {
    let end = scan::token_end(text, place);
    let found = &text[place..end];
    let tokens = scan::words(text, start, place);
    let before = tokens.last().copied().unwrap_or((start, start));
    let prev = &text[before.0..before.1];
    let bracket = open.map_or("", |open| &text[open..=open]);
    let rest = &text[end..];
    let here = (place, end);
    let word = tokens.first().map_or("", |(a, b)| &text[*a..*b]);
    let habit = |at, message: &str, help: &str| Some(Habit::new(at, message, help));
    if let Some(habit) = comment(text, place) {
        return Some(if open.is_some() {
            Habit { resume: None, keeps: false, ..habit }
        } else {
            habit
        });
    }
    // A comment of another language may have read as arithmetic up to here.
    let line = text[..place].rfind('\n').map_or(0, |at| at + 1).max(start);
    let dashes = text[line..place].find("--").filter(|_| open.is_none());
    if let Some(at) = dashes.map(|at| line + at)
        && text[at + 2..].starts_with([' ', '-'])
    {
        return comment(text, at);
    }
    if let Some(habit) = odd_character(text, place) {
        return Some(habit);
    }
    // Words that read as names until something follows them.
    for (i, (from, to)) in tokens.iter().enumerate() {
        let next = tokens.get(i + 1).map_or(found, |(a, b)| &text[*a..*b]);
        let last = i.checked_sub(1).map_or("", |i| &text[tokens[i].0..tokens[i].1]);
        if matches!(next, ":" | "=" | "," | ")" | "]") || scan::ITEM_WORDS.contains(&last) {
            continue;
        }
        if let Some((message, help)) = foreign(&text[*from..*to]) {
            return habit((*from, *to), message, help);
        }
    }
    let joins = matches!(found, "and" | "or" | "xor")
        || matches!(found, "&" | "|") && rest.starts_with(found) && prev != "=" && prev != "(";
    if joins {
        let help = if word == "claim" {
            "write a claim for each: each is judged by itself"
        } else {
            "conditions are 1 or 0: both are true where `(a < b) * (c < d)` is 1"
        };
        // `&&` and `||` are two tokens.
        let end = if found.len() == 1 { end + 1 } else { end };
        return habit((place, end), "conditions are not joined", help);
    }
    match found {
        "!" => return foreign("not").map(|(m, h)| Habit::new(here, m, h)),
        "|" => return foreign("lambda").map(|(m, h)| Habit::new(here, m, h)),
        "*" if prev == "*" && before.1 == place => {
            let base = power(text, &tokens[..tokens.len() - 1]);
            return habit((before.0, end), "there is no `**`", &format!("write `pow({base}, 2)`"));
        }
        "^" => {
            let base = power(text, &tokens);
            return habit(here, "there is no `^`", &format!("write `pow({base}, 2)`"));
        }
        "%" if prev.starts_with(|c: char| c.is_ascii_digit()) => {
            let share = prev.replace('_', "").parse::<f64>().unwrap_or(5.0) / 100.0;
            return habit(
                (before.0, end),
                "there is no `%`",
                &format!("write `{share}` for {prev} percent"),
            );
        }
        "for" => {
            return habit(
                here,
                "there are no comprehensions",
                "declare an axis, `axis x = [1, 2]`: what mentions `x` has a value for each of it",
            );
        }
        "?" | "then" | "else" | "elif" => {
            return foreign("if").map(|(m, h)| Habit::new(here, m, h));
        }
        "in" | "where" if open.is_none() => {
            return habit(
                here,
                "an item is one expression",
                "give the other value a `let` of its own",
            );
        }
        ";" => {
            return Some(
                Habit::new(here, "an item needs no `;`", "end it with its line").keeping(end),
            );
        }
        "," if prev.starts_with(|c: char| c.is_ascii_digit())
            && before.1 == place
            && groups(rest) =>
        {
            let whole: String =
                text[before.0..].chars().take_while(|c| c.is_ascii_digit() || *c == ',').collect();
            let help = format!("write `{}`", whole.trim_end_matches(',').replace(',', "_"));
            return habit((before.0, before.0 + whole.len()), "digits are grouped by `_`", &help);
        }
        "," if open.is_none() => {
            return Some(
                Habit::new(here, "an item needs no `,` behind it", "take it away").keeping(end),
            );
        }
        "=" if rest.starts_with('>') => {
            let help = match (word, bracket) {
                ("claim", "") => "write `>=` for at least",
                (_, "{") => "write `\"label\": value`",
                _ => "a function has a name: `let f(x: Float) = x + 1`",
            };
            return habit((place, end + 1), "there is no `=>`", help);
        }
        "=" if matches!(prev, "==" | "!=") => {
            return habit((before.0, end), "there is no such comparison", "write `==` or `!=`");
        }
        "=" if prev == ".." => {
            return habit((before.0, end), "a range leaves its end out", "write `0..6` for 0 to 5");
        }
        "=" if matches!(bracket, "[" | "(") && scan::is_word(prev) => {
            let value_at = scan::gap(text, end).next;
            let sign = usize::from(text[value_at..].starts_with('-'));
            let value_end = scan::token_end(text, (value_at + sign).min(text.len()));
            let value = &text[value_at..value_end];
            let simple = text[value_end..].trim_start().starts_with([',', ']', ')']);
            let value = if simple && !value.is_empty() { value } else { ".." };
            let help = format!("write `{prev}: {value}`");
            return habit(here, "what stands in brackets is named with `:`, not with `=`", &help);
        }
        "=" if bracket == "{" && prev.starts_with('"') => {
            return habit(here, "a label is followed by `:`", &format!("write `{prev}: ..`"));
        }
        "=" if matches!(word, "measure" | "let" | "param" | "axis") && tokens.len() == 1 => {
            return habit(
                here,
                &format!("this `{word}` has no name"),
                &format!("write `{word} x = ..`"),
            );
        }
        "=" if word == "profile" => {
            return habit(
                here,
                "a profile has no `=` before its braces",
                "write `profile quick { members = 8 }`",
            );
        }
        "=" if word == "edition" => {
            return habit(here, "the edition has no `=`", "write `edition \"2026\"`");
        }
        ":" if rest.starts_with('=') && open.is_none() => {
            return habit((place, end + 1), "there is no `:=`", "write `=`");
        }
        "<" if rest.starts_with('-')
            && matches!(word, "let" | "measure" | "param" | "axis")
            && tokens.len() == 2 =>
        {
            return habit((place, end + 1), "there is no `<-`", "write `=`");
        }
        ":" if word == "axis"
            && open.is_none()
            && prev.starts_with(|c: char| c.is_ascii_digit()) =>
        {
            return habit(
                here,
                "a range is written with `..`",
                &format!("write `{prev}..5`: its end is left out"),
            );
        }
        "." if prev == ".." => {
            return habit(
                (before.0, end),
                "a range is written with two points",
                "write `0..5`: its end is left out",
            );
        }
        ">" if prev == "<" => return habit((before.0, end), "there is no `<>`", "write `!=`"),
        "~" => {
            return habit(
                here,
                "there is no `~`",
                "nearly equal is written `a on par with b within(0.05, \"why so much\")`",
            );
        }
        "(" if tokens.len() > 3 && text[..before.0].ends_with('.') => {
            let owner = tokens[tokens.len() - 3];
            let owner = &text[owner.0..owner.1];
            let owner = if scan::is_word(owner) { owner } else { "x" };
            let help = format!("write `{prev}({owner}, ..)`; `ivx ops {prev}` says what it takes");
            return habit((before.0, before.1), "values have no methods", &help);
        }
        "(" if prev == "match" => {
            return habit(
                here,
                "the axis of a `match` stands without brackets",
                "write `match ke { \"a\": 1, \"b\": 2 }`",
            );
        }
        "(" if word == "measure" && tokens.len() == 2 => {
            return habit(
                (before.0, before.1),
                "this `measure` has no name",
                &format!("write `measure x = {prev}(..)`"),
            );
        }
        "(" if word == "experiment" => {
            return habit(
                here,
                "an experiment has no arguments",
                "write `experiment name {`; its settings are `param`",
            );
        }
        "{" if scan::is_word(prev) && !scan::ITEM_WORDS.contains(&prev) && word != "experiment" => {
            return habit(here, "arguments stand in `(..)`", &format!("write `{prev}(..)`"));
        }
        "{" if matches!(prev, "=" | "(" | ",") && word != "axis" => {
            return habit(
                here,
                "braces hold the labels of an `axis` or the arms of a `match`",
                "a value is one expression; what leads to it has a `let` of its own",
            );
        }
        ":" if word == "experiment" => {
            return habit(
                here,
                "an experiment stands in braces",
                "write `experiment name {` and `}` behind its last item",
            );
        }
        "-" | "."
            if tokens.len() == 2
                && scan::ITEM_WORDS.contains(&word)
                && !rest.starts_with([' ', '.']) =>
        {
            let tail = &text[end..scan::token_end(text, end)];
            return habit(
                (before.0, end + tail.len()),
                "a name is made of letters, digits and `_`",
                &format!("write `{prev}_{tail}`"),
            );
        }
        "[" if word == "param" => {
            return habit(
                here,
                "the type of a list is written `List<Int>`",
                "write it with `<` and `>`",
            );
        }
        ")" | ","
            if bracket == "(" && matches!(word, "let") && !text[start..place].contains('=') =>
        {
            return habit(
                here,
                "a parameter of a function names its type",
                &format!("write `{prev}: Float`"),
            );
        }
        "_" if bracket == "{" => {
            return habit(
                here,
                "a `match` has an arm for each label",
                "write one for each; several may have the same value",
            );
        }
        ".." if bracket == "[" => {
            let help =
                "list each: `[5, 10]`; in a selection a range stands alone, as in `x[n: 5..10]`";
            return habit(here, "a list has no ranges", help);
        }
        ".." => {
            return habit(
                here,
                "a range makes the labels of an axis and is no value",
                "declare `axis x = 0..5`",
            );
        }
        ":" if bracket == "[" => {
            return habit(
                here,
                "a range is written with two points",
                "write `x[n: 5..10]`, or list the labels that are meant: `x[n: [5, 10]]`",
            );
        }
        "\\" => {
            return habit(
                here,
                "a line goes on by itself where it is not ended",
                "take the `\\` away",
            );
        }
        "$" | "@" | "&" => {
            return habit(here, &format!("there is no `{found}`"), "names stand as they are");
        }
        ":" if word == "claim" && tokens.len() == 1 => {
            return habit(
                here,
                "what is claimed is said in words first",
                "write `claim \"in words\" : left < right`",
            );
        }
        "axis" if bracket == "(" && rest.trim_start().starts_with(':') => {
            return habit(here, "`axis` declares one, and names no argument", "write `over: seed`");
        }
        _ if found.starts_with('"') && before.1 == place && scan::is_word(prev) => {
            return habit(
                (before.0, before.1),
                "a string has no letter before it",
                "take it away: a string stands for itself",
            );
        }
        _ if found == "\"\"" || prev == "\"\"" && found.starts_with('"') => {
            return habit(
                here,
                "there are no strings of three quotes",
                "a comment begins with `//`, and what describes an item with `///`",
            );
        }
        _ if found.starts_with('"') && word == "profile" => {
            return habit(
                here,
                "a name stands without quotes",
                &format!("write `{}`", found.trim_matches('"')),
            );
        }
        _ if word == "claim"
            && tokens.len() == 2
            && prev.starts_with('"')
            && !matches!(found, "at" | "by" | "family")
            && found != "=" =>
        {
            return habit(
                here,
                "between the words of a claim and what it compares stands `:`",
                &format!("write `claim {prev} : ..`"),
            );
        }
        _ => {}
    }
    closer(text, place, open).or_else(|| number(text, place))
}

/// Whether what begins with a word of another language may declare any names.
pub(super) fn brings_names(word: &str) -> bool {
    !word.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_' || "}\"".contains(c))
        || matches!(word, "import" | "from" | "for" | "while" | "if" | "def" | "fn" | "class")
}
