//! Text to syntax tree. Total: what does not read becomes junk with its own diagnostic.

mod again;
mod build;
mod claim;
mod fault;
pub(crate) mod habit;
mod parts;
pub(crate) mod scan;
pub use scan::is_name;
#[cfg(test)]
pub(crate) mod tests;

use crate::ast::{Ast, Item, ItemKind, Name};
use crate::{Code, Diagnostic, Label, Span, Spanned};
use again::Again;
use build::{Build, Built};
use fault::Fault;
use pest::Parser as _;

#[derive(pest_derive::Parser)]
#[grammar = "ivx.pest"]
struct Ivx;

/// The edition that this version reads.
const EDITION: &str = "2026";

/// The longest item, in bytes: pest keeps some hundred bytes for each.
const LONGEST: usize = 1 << 18;

/// So many more places are told of a habit of the whole file.
const MOST_ALIKE: usize = 4;

/// After so many faults the rest of a file is not read.
const MOST_FAULTS: usize = 100;

/// The syntax tree of one file, and what is wrong with its text in order of place.
///
/// An item that does not parse is [`ItemKind::Junk`] with the names that can be seen, or keeps its name with
/// [`ExprKind::Junk`](crate::ast::ExprKind::Junk) for a value if it reads as far as that. Brackets
/// nested more deeply than 256 give an empty tree. No expression is deeper than 1000.
///
/// - `file`: goes into the spans.
#[must_use]
pub fn parse(text: &str, file: u32) -> (Ast, Vec<Diagnostic>) {
    parsed(text, file, None)
}

/// The same of a text that was edited, faster: what the edit did not touch is taken over.
///
/// - `before`: a text that parsed without a fault, and its tree.
#[must_use]
pub fn parse_again(text: &str, file: u32, before: (&str, &Ast)) -> (Ast, Vec<Diagnostic>) {
    parsed(text, file, Some(Again::new(before.0, before.1, text)))
}

fn parsed(text: &str, file: u32, again: Option<Again<'_>>) -> (Ast, Vec<Diagnostic>) {
    let whole = Span { file, start: 0, end: 0 };
    if u32::try_from(text.len()).is_err() {
        let message = "the file is larger than 4 GiB";
        return (Ast::default(), vec![Diagnostic::new(Code::Syntax, whole, message, "")]);
    }
    let unclosed = match scan::unclosed(text, 0, text.len()) {
        Ok(unclosed) => unclosed,
        Err(place) => return (Ast::default(), vec![fault::nesting(file, place)]),
    };
    let pos = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
    let (edition, diagnostics) = (Edition::Absent, Vec::new());
    let mut reader = Reader { text, file, pos, unclosed, again, edition, diagnostics };
    let items = reader.items(None);
    let edition = match reader.edition {
        Edition::Read(edition) => Some(edition),
        Edition::Broken => None,
        Edition::Absent => {
            let message = "the file does not begin with its edition";
            let missing = Diagnostic::new(Code::Edition, whole, message, "expected here")
                .help(format!("write `edition \"{EDITION}\"` at the top"));
            reader.diagnostics.push(missing);
            None
        }
    };
    reader.diagnostics.sort_by_key(|diagnostic| diagnostic.labels[0].span.start);
    (Ast { edition, items }, reader.diagnostics)
}

struct Reader<'t> {
    text: &'t str,
    file: u32,
    /// What lies before is read.
    pos: usize,
    /// The brackets that nothing closes.
    unclosed: Vec<usize>,
    again: Option<Again<'t>>,
    edition: Edition,
    diagnostics: Vec<Diagnostic>,
}

enum Edition {
    Absent,
    /// Something stands there that was meant for one.
    Broken,
    Read(Spanned<String>),
}

/// The block that is being read.
#[derive(Clone, Copy)]
struct Block {
    /// Its `{`.
    open: usize,
    /// The `experiment` before it.
    start: usize,
}

impl Reader<'_> {
    /// The items up to the end of the block, or of the file.
    fn items(&mut self, block: Option<Block>) -> Vec<Item> {
        let mut items: Vec<Item> = Vec::new();
        loop {
            let before = self.pos;
            let docs = self.docs(items.last_mut());
            let next = scan::token_end(self.text, self.pos);
            let token = &self.text[self.pos..next];
            let ends = match (token, block) {
                ("", Some(_)) if self.diagnostics.len() > MOST_FAULTS => true,
                ("", Some(block)) => self.not_closed(block, None),
                ("", None) => true,
                ("}", Some(_)) => {
                    self.pos = next;
                    true
                }
                ("experiment", Some(block)) if self.unclosed.contains(&block.open) => {
                    self.not_closed(block, Some(next))
                }
                _ => false,
            };
            if ends {
                if token == "experiment" {
                    // The docs are of the experiment that comes next, which begins on a new line.
                    let line =
                        docs.and_then(|docs| self.text[..docs.span.start as usize].rfind('\n'));
                    self.pos = line.map_or(self.pos, |line| line.max(before));
                } else {
                    self.diagnostics.extend(docs.map(|docs| stray_doc(docs.span)));
                }
                return items;
            }
            let faults = self.diagnostics.len();
            let mut item = self.item(token, block, items.is_empty());
            if let Some(docs) = docs {
                match &mut item {
                    Some(item) => item.docs = docs.value,
                    None => self.diagnostics.push(stray_doc(docs.span)),
                }
            }
            items.extend(item);
            let more = self.diagnostics.len() > faults && self.pos < self.text.len();
            if more && self.diagnostics.len() >= MOST_FAULTS {
                self.give_up();
            }
        }
    }

    /// Goes on to the next token and returns the doc comment before it. One that stands behind the
    /// last item is added to that.
    fn docs(&mut self, last: Option<&mut Item>) -> Option<Spanned<String>> {
        let gap = scan::gap(self.text, self.pos);
        let docs: Vec<_> = gap.comments.iter().filter(|comment| comment.doc).collect();
        let mut docs = docs.as_slice();
        if let (Some(item), Some((doc, rest))) = (last, docs.split_first())
            && doc.behind
        {
            let line = if item.docs.is_empty() { "" } else { "\n" };
            item.docs += line;
            item.docs += doc.words(self.text);
            docs = rest;
        }
        self.pos = gap.next;
        let span = self.span(docs.first()?.start, docs.last()?.end);
        let lines: Vec<_> = docs.iter().map(|doc| doc.words(self.text)).collect();
        Some(Spanned { value: lines.join("\n"), span })
    }

    /// The item that begins here with `word`; nothing if it is the edition.
    fn item(&mut self, word: &str, block: Option<Block>, first: bool) -> Option<Item> {
        let start = self.pos;
        if !scan::ITEM_WORDS.contains(&word) {
            // A misspelt `edition` is not a missing one too.
            let maybe_edition = first && block.is_none() && word.starts_with(char::is_alphabetic);
            if maybe_edition && matches!(self.edition, Edition::Absent) {
                self.edition = Edition::Broken;
            }
            return Some(self.junk(start, block.is_some(), &Fault::no_item(self.text, start)));
        }
        if word == "experiment" {
            return Some(self.experiment(block));
        }
        if let Some((item, end)) = self.again.as_ref().and_then(|own| own.item(start, self.file)) {
            self.pos = end;
            return Some(item);
        }
        let slice = floor(&self.text[start..], LONGEST);
        let parsed = Ivx::parse(Rule::whole, slice).map(only);
        let cut = start + slice.len();
        let reaches_cut = || match &parsed {
            Ok(pair) => parts::end(pair) == slice.len(),
            // A token that was cut through is a fault where it begins.
            Err(error) => {
                let place = start + fault::place(error);
                place == cut
                    || scan::token_across(self.text, start, cut).is_some_and(|at| place >= at)
            }
        };
        if cut < self.text.len() && reaches_cut() {
            let message = format!("this `{word}` is longer than 256 KiB");
            let fault = Fault::plain(self.text, start, message);
            return Some(self.junk(start, block.is_some(), &fault));
        }
        match parsed {
            Ok(pair) => self.built(pair, block, first),
            Err(error) => self.broken(word, &error, slice, block, first),
        }
    }

    /// The tree of a parsed item; nothing if it is the edition.
    fn built(&mut self, pair: parts::Pair<'_>, block: Option<Block>, first: bool) -> Option<Item> {
        let start = self.pos;
        self.pos += parts::end(&pair);
        self.stray_docs(start, self.pos);
        let span = self.span(start, self.pos);
        let built = Build::new(self.file, start, &mut self.diagnostics).item(pair);
        let kind = match built {
            Built::Item(kind) => kind,
            Built::Edition(edition) => {
                self.set_edition(edition, first && block.is_none(), span);
                return None;
            }
        };
        if block.is_some() && matches!(kind, ItemKind::Use { .. } | ItemKind::Include { .. }) {
            let message = "`use` and `include` stand outside of experiments";
            let fault = Diagnostic::new(Code::Syntax, span, message, "inside an experiment")
                .help("move it to the top of the file");
            self.diagnostics.push(fault);
        }
        Some(Item { docs: String::new(), kind, span })
    }

    /// What can be kept of an item that does not parse.
    fn broken(
        &mut self,
        word: &str,
        error: &pest::error::Error<Rule>,
        slice: &str,
        block: Option<Block>,
        first: bool,
    ) -> Option<Item> {
        let (start, inside) = (self.pos, block.is_some());
        let fault = Fault::of(self.text, start, word, error);
        let good = &self.text[start..fault.place];
        if fault.spoils {
            let mut item = self.junk(start, inside, &fault);
            if let Ok(pairs) = Ivx::parse(Rule::begun, good) {
                let mut build = Build::new(self.file, start, &mut self.diagnostics);
                item.kind = build.begun(only(pairs), item.span);
            }
            if word == "edition" {
                self.edition = Edition::Broken;
            }
            return Some(item);
        }
        // The item may be whole, and what stands behind it wrong.
        if let Ok(pairs) = Ivx::parse(Rule::alone, good) {
            let pair = only(pairs);
            let gap = scan::gap(self.text, start + parts::end(&pair));
            if gap.next > start + slice.len() {
                // The slice ends in comments.
                return self.built(pair, block, first);
            }
            // What stands before `=` was not meant for a value.
            if gap.next == fault.place && !self.text[gap.next..].starts_with('=') {
                let item = self.built(pair, block, first);
                // A word on a new line is a misspelt item, which is not this one's fault.
                if !gap.newline || !self.text[gap.next..].starts_with(char::is_alphabetic) {
                    self.junk(fault.place, inside, &fault);
                }
                return item;
            }
        }
        if word == "edition" {
            self.edition = Edition::Broken;
        }
        let mut item = self.junk(start, inside, &fault);
        if let Ok(pairs) = Ivx::parse(Rule::begun, good) {
            let mut build = Build::new(self.file, start, &mut self.diagnostics);
            item.kind = build.begun(only(pairs), item.span);
        }
        Some(item)
    }

    /// The experiment that begins here, with its items.
    fn experiment(&mut self, outer: Option<Block>) -> Item {
        let start = self.pos;
        if let Some(outer) = outer {
            let message = "an experiment stands inside another";
            let word = self.span(start, scan::token_end(self.text, start));
            let begin = self.span(outer.start, outer.open);
            let fault = Diagnostic::new(Code::Syntax, word, message, "begins inside it")
                .also(begin, "the other begins here")
                .help("move it behind the `}` of the other");
            self.diagnostics.push(fault);
            self.pos = match self.brace() {
                Some(brace) => scan::block_end(self.text, brace),
                None => scan::stretch_end(self.text, start, true),
            };
            return self.junk_item(start);
        }
        let parsed = Ivx::parse(Rule::alone, floor(&self.text[start..], LONGEST));
        let (name, head) = match parsed {
            Ok(pairs) => {
                let pair = only(pairs);
                let head = start + parts::end(&pair);
                let name = Build::new(self.file, start, &mut self.diagnostics).only_name(pair);
                (Some(name), head)
            }
            Err(error) => {
                let fault = Fault::of(self.text, start, "experiment", &error);
                let Some(brace) = self.brace() else {
                    return self.junk(start, false, &fault);
                };
                self.diagnostics.push(fault.diagnostic(self.text, self.file));
                (None, brace + 1)
            }
        };
        self.stray_docs(start, head);
        self.pos = head;
        let items = self.items(Some(Block { open: head - 1, start }));
        let Some(name) = name else {
            return self.junk_item(start);
        };
        let kind = ItemKind::Experiment { name, items };
        Item { docs: String::new(), kind, span: self.span(start, self.pos) }
    }

    /// The first `{` on this line.
    fn brace(&self) -> Option<usize> {
        let line = self.text[self.pos..].lines().next()?;
        Some(self.pos + line.find('{')?)
    }

    /// Reports `fault` and passes over the stretch that begins at `start`.
    fn junk(&mut self, start: usize, inside: bool, fault: &Fault) -> Item {
        self.report(fault);
        self.pos = fault.resume.unwrap_or_else(|| scan::stretch_end(self.text, start, inside));
        self.junk_item(start)
    }

    /// Adds a fault; one that is the habit of the whole file is told once, with its other places.
    fn report(&mut self, fault: &Fault) {
        let diagnostic = fault.diagnostic(self.text, self.file);
        let told = self
            .diagnostics
            .iter_mut()
            .find(|told| fault.resume.is_some() && told.message == diagnostic.message);
        match told {
            Some(told) if told.labels.len() <= MOST_ALIKE => {
                told.labels
                    .push(Label { span: diagnostic.labels[0].span, text: "and here".into() });
            }
            Some(_) => {}
            None => self.diagnostics.push(diagnostic),
        }
    }

    fn junk_item(&self, start: usize) -> Item {
        let kind = ItemKind::Junk { names: self.declared(start) };
        Item { docs: String::new(), kind, span: self.span(start, self.pos) }
    }

    /// The names that the item at `start` seems to declare, though it does not parse; `None` if it
    /// may be any.
    fn declared(&self, start: usize) -> Option<Vec<Name>> {
        let end = scan::token_end(self.text, start);
        let declares = match &self.text[start..end] {
            "use" => return None,
            "axis" | "let" | "measure" | "param" => true,
            // It may be one of these misspelt.
            word => scan::is_word(word) && !scan::ITEM_WORDS.contains(&word),
        };
        let (first, first_end) = (start, end);
        let start = scan::gap(self.text, end).next;
        let end = scan::token_end(self.text, start);
        let name = &self.text[start..end];
        let rest = &self.text[start..];
        let sets = rest.starts_with('=') || rest.starts_with(":=");
        if declares && sets && !scan::ITEM_WORDS.contains(&&self.text[first..first_end]) {
            let (start, end) = (first, first_end);
            let name = self.text[start..end].to_owned();
            return Some(vec![Name { value: name, span: self.span(start, end) }]);
        }
        if habit::brings_names(&self.text[first..first_end]) {
            return None;
        }
        let declares = declares && scan::is_word(name) && !scan::is_reserved(name);
        let name = Name { value: name.to_owned(), span: self.span(start, end) };
        Some(Vec::from_iter(declares.then_some(name)))
    }

    /// Reports that the block has no `}`, where the text ends or the next experiment begins.
    fn not_closed(&mut self, block: Block, next: Option<usize>) -> bool {
        let span = self.span(block.open, block.open + 1);
        let mut fault =
            Diagnostic::new(Code::Syntax, span, "this `{` is never closed", "opened here")
                .help("add `}` after the last item of the experiment");
        if let Some(end) = next {
            fault = fault.also(self.span(self.pos, end), "the next experiment begins here");
        }
        self.diagnostics.push(fault);
        true
    }

    fn set_edition(&mut self, edition: Spanned<String>, allowed: bool, span: Span) {
        let code = Code::Edition;
        if !allowed || !matches!(self.edition, Edition::Absent) {
            let message = "the edition is not the first item of the file";
            let fault =
                Diagnostic::new(code, span, message, "here").help("write it once, at the top");
            self.diagnostics.push(fault);
            if matches!(self.edition, Edition::Absent) {
                self.edition = Edition::Broken;
            }
            return;
        }
        if edition.value != EDITION {
            let message = format!("this version does not know the edition `{}`", edition.value);
            let fault = Diagnostic::new(code, edition.span, message, "unknown edition")
                .help(format!("write `edition \"{EDITION}\"`"));
            self.diagnostics.push(fault);
        }
        self.edition = Edition::Read(edition);
    }

    /// Reports doc comments in the midst of an item.
    fn stray_docs(&mut self, start: usize, end: usize) {
        if !self.text[start..end].contains("///") {
            return;
        }
        let mut pos = start;
        while pos < end {
            let gap = scan::gap(self.text, scan::token_end(self.text, pos));
            for doc in gap.comments.iter().filter(|comment| comment.doc && comment.end <= end) {
                self.diagnostics.push(stray_doc(self.span(doc.start, doc.end)));
            }
            pos = gap.next;
        }
    }

    /// Passes over the rest of the file.
    fn give_up(&mut self) {
        let message = format!("after {MOST_FAULTS} faults the rest is not read");
        let span = self.span(self.pos, self.pos);
        self.diagnostics.push(Diagnostic::new(Code::Syntax, span, message, "not read from here"));
        self.pos = self.text.len();
    }

    fn span(&self, start: usize, end: usize) -> Span {
        span(self.file, start, end)
    }
}

fn span(file: u32, start: usize, end: usize) -> Span {
    let narrow = |at| u32::try_from(at).expect("a file is no larger than 4 GiB");
    Span { file, start: narrow(start), end: narrow(end) }
}

/// The item or head within `whole`, `alone` or `begun`.
fn only(mut pairs: pest::iterators::Pairs<'_, Rule>) -> parts::Pair<'_> {
    let inner = pairs.next().and_then(|outer| outer.into_inner().next());
    inner.expect("the rule holds an item")
}

/// The start of `text`, of at most `longest` bytes.
fn floor(text: &str, longest: usize) -> &str {
    &text[..text.floor_char_boundary(longest)]
}

fn stray_doc(span: Span) -> Diagnostic {
    let message = "a doc comment stands before nothing";
    Diagnostic::new(Code::StrayDoc, span, message, "there is no item that it could describe")
        .help("write `//` for a plain comment")
}
