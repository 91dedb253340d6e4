//! The tokens of a text that parses, each with the comments about it.

use crate::Span;
use crate::ast::{Ast, Item, ItemKind, TyExpr};
use crate::parse::scan::{self, ITEM_WORDS};

/// A token, and the comments between the one before and the one after that are about it.
#[derive(Clone)]
pub(super) struct Token<'t> {
    pub(super) text: &'t str,
    pub(super) kind: Kind,
    /// The comments above it, each on a line of its own.
    pub(super) above: Vec<Comment<'t>>,
    /// Whether an empty line lies before it, behind the comments above.
    pub(super) blank: bool,
    /// The comment behind it, which ends the line.
    pub(super) behind: Option<&'t str>,
}

/// A comment, with its slashes.
#[derive(Clone)]
pub(super) struct Comment<'t> {
    pub(super) text: &'t str,
    /// Whether an empty line lies before it.
    pub(super) blank: bool,
}

/// What a token does, as far as layout minds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    /// The word that an item begins with.
    Item,
    /// A name, number or string.
    Operand,
    /// A bracket that opens.
    Open,
    /// A bracket that closes.
    Close,
    Comma,
    /// Between a name and what it names.
    Colon,
    /// Between what is claimed in words and in figures.
    ClaimColon,
    Equals,
    /// What joins its neighbours without blanks: `.` and `..`.
    Joint,
    /// `<` and `>` of a type.
    Angle,
    /// A minus with one operand.
    Minus,
    /// An operator between operands; the greater binds more tightly.
    Operator(u8),
    /// The word before the margin of a claim.
    Within,
    /// The end of the text.
    End,
}

/// A comma that nobody wrote.
pub(super) const COMMA: Token<'static> =
    Token { text: ",", kind: Kind::Comma, above: Vec::new(), blank: false, behind: None };

/// The tokens of the text, the end being the last.
pub(super) fn tokens<'t>(text: &'t str, ast: &Ast) -> Vec<Token<'t>> {
    let mut types = Vec::new();
    type_spans(&ast.items, &mut types);
    let inside = |at: usize| {
        // Types are in order and apart from each other.
        let next = types.partition_point(|span: &Span| span.end as usize <= at);
        types.get(next).filter(|span| span.start as usize <= at)
    };
    let mut tokens: Vec<Token> = Vec::new();
    let mut end = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
    loop {
        let gap = scan::gap(text, end);
        let mut above = Vec::new();
        for comment in &gap.comments {
            let words = &text[comment.start..comment.end];
            match tokens.last_mut() {
                Some(token) if comment.behind => token.behind = Some(words),
                _ => above.push(Comment { text: words, blank: comment.blank }),
            }
        }
        let start = gap.next;
        end = scan::token_end(text, start);
        let ty = inside(start);
        if let Some(span) = ty {
            // In `List<Float>=` the type ends before the equals sign.
            end = end.min(span.end as usize);
        }
        let word = &text[start..end];
        let called = text[scan::gap(text, end).next..].starts_with('(');
        let kind = kind(&tokens, word, ty.is_some(), called);
        tokens.push(Token { text: word, kind, above, blank: gap.blank, behind: None });
        settle_on_par(&mut tokens);
        if word.is_empty() {
            settle_commas(&mut tokens);
            return tokens;
        }
    }
}

/// The most tokens of a claim before its colon: `claim "c" at 0.99 by "t" family "F"`.
const MOST_IN_HEAD: usize = 8;

/// - `before`: the tokens before this one.
/// - `called`: whether a parenthesis follows.
fn kind(before: &[Token<'_>], word: &str, in_type: bool, called: bool) -> Kind {
    let last = before.last().map(|token| token.kind);
    match word {
        "" => Kind::End,
        "(" | "[" | "{" => Kind::Open,
        ")" | "]" | "}" => Kind::Close,
        "," => Kind::Comma,
        "=" => Kind::Equals,
        "." | ".." => Kind::Joint,
        ":" => {
            let head = before.iter().rev().take(MOST_IN_HEAD).take_while(|token| {
                !matches!(token.kind, Kind::ClaimColon | Kind::Open | Kind::Close | Kind::Equals)
            });
            let is_claim = |token: &Token<'_>| token.text == "claim" && token.kind == Kind::Item;
            if head.into_iter().any(is_claim) { Kind::ClaimColon } else { Kind::Colon }
        }
        "<" | ">" if in_type => Kind::Angle,
        "<" | ">" | "<=" | ">=" | "==" | "!=" => Kind::Operator(0),
        "-" if !matches!(last, Some(Kind::Operand | Kind::Close)) => Kind::Minus,
        "+" | "-" => Kind::Operator(1),
        "*" | "/" => Kind::Operator(2),
        "within" if called && matches!(last, Some(Kind::Operand | Kind::Close)) => Kind::Within,
        word if ITEM_WORDS.contains(&word) && !called => Kind::Item,
        _ => Kind::Operand,
    }
}

/// Where types stand that name others.
fn type_spans(items: &[Item], spans: &mut Vec<Span>) {
    for item in items {
        let types: Vec<&TyExpr> = match &item.kind {
            ItemKind::Param { ty, .. } => vec![ty],
            ItemKind::Let { params: Some(params), .. } => {
                params.iter().map(|param| &param.ty).collect()
            }
            ItemKind::Experiment { items, .. } => {
                type_spans(items, spans);
                Vec::new()
            }
            _ => Vec::new(),
        };
        spans.extend(types.iter().filter(|ty| !ty.args.is_empty()).map(|ty| ty.span));
    }
}

/// Makes operators of the words of `on par with` once the last has come: no other three names follow each other.
fn settle_on_par(tokens: &mut [Token<'_>]) {
    let from = tokens.len().saturating_sub(3);
    let words = &mut tokens[from..];
    if words.iter().map(|token| token.text).eq(["on", "par", "with"]) {
        for token in words {
            token.kind = Kind::Operator(0);
        }
    }
}

/// Gives commas no comments but the one behind, since a comma ends its line: others move behind
/// it, in their order.
fn settle_commas(tokens: &mut [Token<'_>]) {
    for comma in 1..tokens.len() {
        if tokens[comma].kind != Kind::Comma {
            continue;
        }
        let behind = tokens[comma - 1].behind.take();
        let mut moved = std::mem::take(&mut tokens[comma].above);
        if behind.is_some() || !moved.is_empty() {
            let last = tokens[comma].behind.take();
            moved.extend(last.map(|text| Comment { text, blank: false }));
            tokens[comma].behind = behind;
        }
        tokens[comma + 1].above.splice(0..0, moved);
    }
}

/// Whether a blank stands between two tokens on one line.
pub(super) fn spaced(before: (Kind, &str), after: (Kind, &str)) -> bool {
    match (before, after) {
        ((Kind::Open, "{"), (_, after)) => after != "}",
        (_, (Kind::Close, "}")) | ((Kind::Colon, _), (Kind::Joint, "..")) => true,
        (_, (Kind::Comma | Kind::Close | Kind::Joint | Kind::Angle | Kind::Colon, _))
        | ((Kind::Open | Kind::Joint | Kind::Minus | Kind::Angle, "(" | "[" | "." | ".." | "-" | "<"), _)
        // A call or a selection.
        | ((Kind::Operand | Kind::Close | Kind::Within, _), (Kind::Open, "(" | "[")) => false,
        _ => true,
    }
}
