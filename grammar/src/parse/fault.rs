//! What pest could not read, in the user's words.

use super::habit::{self, Habit};
use super::{Rule, scan, span};
use crate::{Advice, Code, Diagnostic, suggest};
use pest::error::{Error, ErrorVariant, InputLocation};

/// A fault of syntax.
pub(super) struct Fault {
    /// Where.
    pub(super) place: usize,
    end: usize,
    message: String,
    label: String,
    help: Option<Advice>,
    /// A bracket on another line that is still open here.
    opened: Option<usize>,
    /// Where to read on, if that is not the next item.
    pub(super) resume: Option<usize>,
    /// Whether what stands before it is not meant as it reads.
    pub(super) spoils: bool,
}

impl Fault {
    /// A fault of the token at `place`.
    pub(super) fn plain(text: &str, place: usize, message: impl Into<String>) -> Self {
        let end = scan::token_end(text, place);
        let label = if end == place { "here" } else { "not understood" };
        Self {
            place,
            end,
            message: message.into(),
            label: label.to_owned(),
            help: None,
            opened: None,
            resume: None,
            spoils: false,
        }
    }

    /// A habit of other languages.
    fn habit(habit: Habit) -> Self {
        let Habit { start, end, message, help, resume, keeps } = habit;
        let (label, help) = ("not written so here".to_owned(), Some(help.into()));
        Self { place: start, end, message, label, help, opened: None, resume, spoils: !keeps }
    }

    /// Why the item that begins at `start` with `word` does not parse.
    pub(super) fn of(text: &str, start: usize, word: &str, error: &Error<Rule>) -> Self {
        let place = start + place(error);
        let ErrorVariant::ParsingError { positives, .. } = &error.variant else {
            // pest saw the stack run out.
            return Self::plain(text, place, format!("this `{word}` is nested too deeply"));
        };
        let open = scan::unclosed(text, start, place).unwrap_or_default().last().copied();
        let context = Context { text, word, place, found: token(text, place), positives, open };
        if let Some(fault) = context.string_fault() {
            return fault;
        }
        match habit::within(text, start, place, open)
            .filter(|_| !scan::is_word(context.found) || !context.begins_item())
        {
            Some(habit) => Self::habit(habit),
            None => context.explain(),
        }
    }

    /// Why no item begins at `place`.
    pub(super) fn no_item(text: &str, place: usize) -> Self {
        let found = token(text, place);
        let plain = |message: String| Self::plain(text, place, message);
        if found == "}" {
            return plain("this `}` closes nothing".to_owned()).label("no block is open");
        }
        let word = found.starts_with(|c: char| c.is_ascii_alphabetic());
        let near = suggest(found, scan::ITEM_WORDS).filter(Advice::is_near);
        let declares = scan::names_something(text, place + found.len());
        if let Some(habit) = habit::item(text, place).filter(|_| near.is_none() || !declares) {
            return Self { spoils: true, ..Self::habit(habit) };
        }
        let help = if word {
            suggest(found, scan::ITEM_WORDS)
        } else {
            foreign_character(found).map(Advice::from)
        };
        plain(format!("expected an item, found {}", shown(found)))
            .label("no item begins so")
            .help(help)
    }

    pub(super) fn diagnostic(&self, text: &str, file: u32) -> Diagnostic {
        // What is missing at the end of the file is missing behind its last line.
        let end = text.trim_end().len();
        let place = if self.place == text.len() { (end, end) } else { (self.place, self.end) };
        let place = span(file, place.0, place.1);
        let diagnostic = Diagnostic::new(Code::Syntax, place, &self.message, &self.label)
            .maybe_help(self.help.clone());
        match self.opened {
            Some(open) => {
                let label = format!("this `{}` is still open", &text[open..=open]);
                diagnostic.also(span(file, open, open + 1), label)
            }
            None => diagnostic,
        }
    }

    fn label(self, label: impl Into<String>) -> Self {
        Self { label: label.into(), ..self }
    }

    fn help(self, help: Option<impl Into<Advice>>) -> Self {
        Self { help: help.map(Into::into), ..self }
    }
}

/// Brackets that are nested too deeply at `place`.
pub(super) fn nesting(file: u32, place: usize) -> Diagnostic {
    let message = format!("brackets are nested more deeply than {}", scan::DEEPEST);
    Diagnostic::new(Code::Nesting, span(file, place, place + 1), message, "one too many")
        .help("give the inner parts names with `let`")
}

/// The byte of the slice given to pest at which it failed.
pub(super) fn place(error: &Error<Rule>) -> usize {
    match error.location {
        InputLocation::Pos(place) | InputLocation::Span((place, _)) => place,
    }
}

struct Context<'a> {
    text: &'a str,
    /// The item's first word.
    word: &'a str,
    place: usize,
    found: &'a str,
    positives: &'a [Rule],
    /// The innermost bracket that is open at the place.
    open: Option<usize>,
}

impl Context<'_> {
    fn explain(&self) -> Fault {
        let phrases = phrases(self.positives);
        let wants = |phrase: &str| phrases.contains(&phrase);
        let plain = |message: String| Fault::plain(self.text, self.place, message);
        let names = wants("a name") || wants("an expression");
        if scan::is_reserved(self.found) && names && !self.begins_item() {
            let message = format!("`{}` is a reserved word and cannot be a name", self.found);
            return plain(message).label("reserved");
        }
        let compares = matches!(self.found, "<" | "<=" | ">" | ">=" | "==" | "!=");
        let arith_only =
            self.positives.contains(&Rule::arith) && !self.positives.contains(&Rule::compare);
        if compares && arith_only {
            let help = "write two comparisons, each with its own two sides";
            return plain("comparisons do not chain".to_owned())
                .label("a second comparison")
                .help(Some(help.to_owned()));
        }
        let expected = listed(&phrases);
        let mut fault = plain(format!("expected {expected}, found {}", shown(self.found)))
            .label(format!("expected {expected}"))
            .help(self.advice(&wants).or_else(|| foreign_character(self.found)));
        let closes = wants("`)`") || wants("`]`") || wants("`}`");
        fault.opened =
            self.open.filter(|open| closes && self.text[*open..self.place].contains('\n'));
        fault
    }

    /// A string that is not closed, or holds an escape that is none.
    fn string_fault(&self) -> Option<Fault> {
        let string = self.found.strip_prefix('"')?;
        let mut inner = string.char_indices();
        while let Some((at, c)) = inner.next() {
            match c {
                '"' => return None,
                '\\' => {
                    let escaped = inner.next().map_or(' ', |(_, escaped)| escaped);
                    if !matches!(escaped, '"' | '\\' | 'n' | 't') {
                        let place = self.place + 1 + at;
                        let help = "known are `\\\"`, `\\\\`, `\\n` and `\\t`";
                        let fault =
                            Fault::plain(self.text, place, format!("unknown escape `\\{escaped}`"))
                                .label("no such escape")
                                .help(Some(help.to_owned()));
                        let end = (place + 1 + escaped.len_utf8()).min(self.text.len());
                        return Some(Fault { end, ..fault });
                    }
                }
                _ => {}
            }
        }
        let help = "end it with `\"` on the same line; a line break within is written `\\n`";
        let fault = Fault::plain(self.text, self.place, "this string is not closed".to_owned())
            .label("begins here")
            .help(Some(help.to_owned()));
        Some(fault)
    }

    /// How to mend a common mistake.
    fn advice(&self, wants: &impl Fn(&str) -> bool) -> Option<String> {
        let before = self.text[..self.place].trim_end();
        let quotable = self.found.starts_with(|c: char| c.is_ascii_alphanumeric());
        let bracket = self.open.map(|open| &self.text[open..=open]);
        let advice = match (self.word, self.found) {
            ("claim", "=") if wants("`:`") => "write `claim \"in words\" : left < right`",
            ("param", "=") if wants("`:`") => {
                "a parameter names its type: `param members: Int = 32`"
            }
            ("claim", "=") if self.positives.contains(&Rule::compare) => {
                "write `==` to claim that two values are equal"
            }
            (_, "=") if matches!(bracket, Some("(" | "[")) => {
                "what stands in brackets is named with `:`, as in `f(steps: 100)`"
            }
            ("let", ":") if wants("`=`") => "a `let` names no type: write `let x = 1`",
            (_, ":" | "==") if wants("`=`") => "write `=`",
            ("claim", _) if before.ends_with("within") => "write `within(0.05)`",
            (_, "within") => "`within(..)` ends a claim, behind the right side of its comparison",
            ("claim", _) if quotable && wants("a string") => {
                "what is claimed stands in quotes: `claim \"in words\" : left < right`"
            }
            ("edition", _) if wants("a string") => "write `edition \"2026\"`",
            ("published", _) if wants("`from`") => "write `published t33 from \"file.ron\"`",
            ("use" | "include" | "published", _) if quotable && wants("a string") => {
                "the path stands in quotes: `\"file.ivx\"`"
            }
            ("axis", _) if quotable && wants("a string") => "a label stands in quotes",
            (_, _) if quotable && wants("a string") => "its name stands in quotes",
            (_, ")" | "]" | "}") if self.open.is_none() => "it closes nothing",
            (_, found) if found.starts_with('"') && wants("a name") => {
                if before.ends_with('[') {
                    "name the axis too: `x[ke: \"WCM\"]`"
                } else {
                    "a name stands without quotes"
                }
            }
            (_, ".") if before.ends_with(|c: char| c.is_ascii_digit()) => {
                "a number has digits on both sides of its point: `1.0`"
            }
            (_, ".") if wants("an expression") => {
                "a number has digits on both sides of its point: `0.5`"
            }
            (_, found) if found.len() > 1 && found.starts_with(|c: char| c.is_ascii_digit()) => {
                "a name begins with a letter, and a number holds none but an exponent's `e`"
            }
            _ => return None,
        };
        Some(advice.to_owned())
    }

    /// Whether what was found seems to be the next item: it is on a new line, and in brackets it
    /// names something as an item would.
    fn begins_item(&self) -> bool {
        let before = &self.text[..self.place];
        before[before.trim_end().len()..].contains('\n')
            && (self.open.is_none()
                || scan::names_something(self.text, self.place + self.found.len()))
    }
}

/// What names are made of, where one begins with a letter of another alphabet.
fn foreign_character(found: &str) -> Option<String> {
    let is_letter = found.starts_with(|c: char| c.is_alphabetic() && !c.is_ascii());
    is_letter.then(|| "a name is made of `A` to `z`, digits and `_`".to_owned())
}

fn token(text: &str, place: usize) -> &str {
    &text[place..scan::token_end(text, place)]
}

/// A token as it stands in a message.
fn shown(token: &str) -> String {
    const LONGEST: usize = 24;
    match token.chars().next() {
        None => "the end of the file".to_owned(),
        Some(c) if c.is_control() || (c.is_whitespace()) => format!("U+{:04X}", u32::from(c)),
        Some(_) if token.chars().nth(LONGEST).is_some() => {
            let start: String = token.chars().take(LONGEST).collect();
            format!("`{start}…`")
        }
        Some('`') => "a backquote".to_owned(),
        Some(_) => format!("`{token}`"),
    }
}

/// `a`, `a or b`, `a, b or c`.
fn listed(phrases: &[&str]) -> String {
    match phrases {
        [] => "something else".to_owned(),
        [one] => (*one).to_owned(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}

/// What the rules tried ask for, the most useful first, and operators only where nothing else is
/// asked for.
fn phrases(rules: &[Rule]) -> Vec<&'static str> {
    let mut ranked: Vec<(u8, &str)> = rules.iter().filter_map(|rule| phrase(*rule)).collect();
    ranked.sort_unstable();
    ranked.dedup();
    let expression = ranked.iter().any(|(_, phrase)| *phrase == "an expression");
    let best = ranked.first().map_or(0, |(rank, _)| rank / 10);
    let told = |(rank, phrase): &(u8, &str)| {
        rank / 10 == best && !(expression && matches!(*phrase, "a name" | "a string"))
    };
    ranked.retain(told);
    ranked.truncate(4);
    ranked.into_iter().map(|(_, phrase)| phrase).collect()
}

/// The rank and name of what a rule asks for. Ranks below 10 shut the others out.
fn phrase(rule: Rule) -> Option<(u8, &'static str)> {
    Some(match rule {
        Rule::equals => (0, "`=`"),
        Rule::name | Rule::set | Rule::at | Rule::taken | Rule::let_param | Rule::axis_name => {
            (1, "a name")
        }
        Rule::arm => (1, "a label"),
        Rule::string | Rule::label => (1, "a string"),
        Rule::ty | Rule::ty_name => (1, "a type"),
        Rule::expr
        | Rule::term
        | Rule::operand
        | Rule::minus
        | Rule::number
        | Rule::bool
        | Rule::list
        | Rule::parens
        | Rule::matching
        | Rule::match_word
        | Rule::named
        | Rule::callee
        | Rule::arg
        | Rule::axis_values
        | Rule::digits
        | Rule::exponent => (1, "an expression"),
        Rule::comma => (2, "`,`"),
        Rule::rparen => (3, "`)`"),
        Rule::rbracket => (3, "`]`"),
        Rule::rbrace => (3, "`}`"),
        Rule::rangle => (3, "`>`"),
        Rule::colon => (4, "`:`"),
        Rule::from_word => (4, "`from`"),
        Rule::lbrace | Rule::labelled => (5, "`{`"),
        Rule::dots | Rule::between => (10, "`..`"),
        Rule::operator | Rule::arith | Rule::compare => (11, "an operator"),
        Rule::as_word => (11, "`as`"),
        Rule::within | Rule::within_word => (11, "`within`"),
        Rule::on_par | Rule::on_word => (11, "`on par with`"),
        Rule::par_word => (11, "`par with`"),
        Rule::with_word => (11, "`with`"),
        Rule::at_word | Rule::claim_at => (11, "`at`"),
        Rule::by_word | Rule::claim_by => (11, "`by`"),
        Rule::family_word | Rule::claim_family => (11, "`family`"),
        Rule::langle => (11, "`<`"),
        Rule::end | Rule::EOI | Rule::item_word => (12, "the next item"),
        Rule::edition
        | Rule::uses
        | Rule::include
        | Rule::profile
        | Rule::published
        | Rule::experiment
        | Rule::axis
        | Rule::valued
        | Rule::whole
        | Rule::alone
        | Rule::begun
        | Rule::item
        | Rule::head
        | Rule::param_head
        | Rule::axis_head
        | Rule::let_head
        | Rule::measure_head
        | Rule::figure_head
        | Rule::table_head
        | Rule::claim_head => (12, "an item"),
        // Nearly always one of several ways on; the others say more.
        Rule::lparen => (20, "`(`"),
        Rule::lbracket
        | Rule::dot
        | Rule::params
        | Rule::postfix
        | Rule::fields
        | Rule::select
        | Rule::field
        | Rule::letter
        | Rule::reserved
        | Rule::unreserved
        | Rule::plain
        | Rule::gap
        | Rule::line => return None,
    })
}
