//! Random specs that read as the language: one function a production.
//!
//! A new production is a function that returns its tokens, and a line where it is one of several.

use proptest::collection::vec;
use proptest::option;
use proptest::prelude::{BoxedStrategy, Just, Strategy, any, prop_oneof};
use proptest::sample::select;

use crate::parse::scan::{ITEM_WORDS, is_reserved};

/// A token, and what may stand behind it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Token {
    pub(super) text: String,
    pub(super) behind: Behind,
}

/// What may stand between a token and the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Behind {
    /// Blanks and comments.
    Anything,
    /// Blanks.
    Blanks,
    /// A line break and whatever else.
    Line,
}

type Tokens = BoxedStrategy<Vec<Token>>;

/// The tokens of a whole file.
pub(super) fn spec() -> Tokens {
    let top = prop_oneof![4 => documented(declaration()), 1 => uses(), 1 => include(), 2 => documented(experiment())];
    vec(top, 0..6).prop_map(|items| [of("edition \"2026\""), items.concat()].concat()).boxed()
}

fn declaration() -> Tokens {
    prop_oneof![
        param(),
        profile(),
        axis(),
        binding(),
        function(),
        measure(),
        titled("figure", "="),
        titled("table", "="),
        titled("claim", ":"),
        tolerant(),
        sure(),
        published(),
    ]
    .boxed()
}

fn uses() -> Tokens {
    let renamed = option::of(name().prop_map(|ours| [of("as"), ours].concat()));
    let taken =
        (name(), renamed).prop_map(|(name, ours)| [name, ours.unwrap_or_default()].concat());
    let names = option::of(bracketed("{", vec(taken, 1..4), "}"));
    let uses = (string(), names);
    uses.prop_map(|(path, names)| [of("use"), path, names.unwrap_or_default()].concat()).boxed()
}

fn include() -> Tokens {
    string().prop_map(|path| [of("include"), path].concat()).boxed()
}

fn experiment() -> Tokens {
    (name(), vec(documented(declaration()), 0..5))
        .prop_map(|(name, items)| {
            [of("experiment"), name, of("{"), items.concat(), of("}")].concat()
        })
        .boxed()
}

fn param() -> Tokens {
    (name(), ty(), expr())
        .prop_map(|(name, ty, value)| [of("param"), name, of(":"), ty, of("="), value].concat())
        .boxed()
}

fn profile() -> Tokens {
    let set = (name(), expr(), any::<bool>()).prop_map(|(name, value, comma)| {
        [name, of("="), value, of(if comma { "," } else { "" })].concat()
    });
    let base = option::of(name().prop_map(|base| [of(":"), base].concat()));
    (name(), base, vec(set, 0..4))
        .prop_map(|(name, base, sets)| {
            let base = base.unwrap_or_default();
            [of("profile"), name, base, of("{"), sets.concat(), of("}")].concat()
        })
        .boxed()
}

fn published() -> Tokens {
    (name(), string())
        .prop_map(|(name, path)| [of("published"), name, of("from"), path].concat())
        .boxed()
}

fn axis() -> Tokens {
    let label = (string(), expr()).prop_map(|(label, value)| [label, of(":"), value].concat());
    let range = (expr(), expr()).prop_map(|(low, high)| [low, of(".."), high].concat());
    let values = prop_oneof![bracketed("{", vec(label, 0..4), "}"), range, expr()];
    let fields = option::of(bracketed("(", vec(name(), 1..4), ")"));
    (name(), fields, values)
        .prop_map(|(name, fields, values)| {
            [of("axis"), name, fields.unwrap_or_default(), of("="), values].concat()
        })
        .boxed()
}

fn binding() -> Tokens {
    (name(), expr()).prop_map(|(name, value)| [of("let"), name, of("="), value].concat()).boxed()
}

fn function() -> Tokens {
    let default = option::of(expr().prop_map(|value| [of("="), value].concat()));
    let param = (name(), ty(), default)
        .prop_map(|(name, ty, default)| [name, of(":"), ty, default.unwrap_or_default()].concat());
    (name(), bracketed("(", vec(param, 0..4), ")"), expr())
        .prop_map(|(name, params, value)| [of("let"), name, params, of("="), value].concat())
        .boxed()
}

fn measure() -> Tokens {
    (name(), expr())
        .prop_map(|(name, value)| [of("measure"), name, of("="), value].concat())
        .boxed()
}

fn titled(word: &'static str, sign: &'static str) -> Tokens {
    (string(), expr())
        .prop_map(|(title, value)| [of(word), title, of(sign), value].concat())
        .boxed()
}

/// A claim of equality within a tolerance.
fn tolerant() -> Tokens {
    (string(), expr(), expr(), expr())
        .prop_map(|(title, left, right, within)| {
            let sides = [of("("), left, of(")"), of("=="), of("("), right, of(")")].concat();
            let within = [of("within"), of("("), within, of(","), title.clone(), of(")")].concat();
            [of("claim"), title, of(":"), sides, within].concat()
        })
        .boxed()
}

/// A claim of a confidence of its own.
fn sure() -> Tokens {
    (string(), prop_oneof![number(), name()], expr())
        .prop_map(|(title, at, value)| {
            let asked =
                [of("at"), at, of("by"), title.clone(), of("family"), title.clone()].concat();
            let other = [of("on"), of("par"), of("with"), of("("), value.clone(), of(")")].concat();
            [of("claim"), title, asked, of(":"), of("("), value, of(")"), other].concat()
        })
        .boxed()
}

/// An item, with doc comments before it or without.
fn documented(item: impl Strategy<Value = Vec<Token>> + 'static) -> Tokens {
    let doc = "///( [a-zé\"{(/]{0,6}){0,3}"
        .prop_map(|text| Token { text: text.trim_end().to_owned(), behind: Behind::Line });
    (vec(doc, 0..3), item).prop_map(|(docs, item)| [docs, item].concat()).boxed()
}

fn ty() -> Tokens {
    name()
        .prop_recursive(3, 8, 2, |inner| {
            (name(), vec(inner, 1..3)).prop_map(|(name, args)| {
                [name, of("<"), args.join(of(",").as_slice()), of(">")].concat()
            })
        })
        .boxed()
}

fn expr() -> Tokens {
    let leaf = prop_oneof![number(), string(), boolean(), name()];
    leaf.prop_recursive(4, 24, 4, |inner| {
        prop_oneof![
            list(inner.clone()),
            call(inner.clone()),
            selected(inner.clone()),
            field(inner.clone()),
            negated(inner.clone()),
            sum(inner.clone()),
            record(inner.clone()),
            tuple(inner.clone()),
            matching(inner.clone()),
            comparison(inner),
        ]
    })
    .boxed()
}

fn list(inner: Tokens) -> Tokens {
    bracketed("[", vec(inner, 0..4), "]")
}

fn call(inner: Tokens) -> Tokens {
    // An operation may bear the name of an item's keyword.
    let keyword = select(&ITEM_WORDS[..])
        .prop_map(|word| vec![Token { text: word.to_owned(), behind: Behind::Blanks }]);
    let named = (option::of(name()), inner).prop_map(|(name, value)| match name {
        Some(name) => [name, of(":"), value].concat(),
        None => value,
    });
    (prop_oneof![4 => name(), 1 => keyword], bracketed("(", vec(named, 0..5), ")"))
        .prop_map(|(name, args)| [name, args].concat())
        .boxed()
}

fn record(inner: Tokens) -> Tokens {
    let field = (name(), inner).prop_map(|(name, value)| [name, of(":"), value].concat());
    bracketed("(", vec(field, 1..4), ")")
}

fn tuple(inner: Tokens) -> Tokens {
    bracketed("(", vec(inner, 2..4), ")")
}

fn matching(inner: Tokens) -> Tokens {
    let minus = prop_oneof![Just(of("")), Just(of("-"))];
    let number = (minus, number()).prop_map(|(minus, number)| [minus, number].concat());
    let arm = (prop_oneof![string(), number], inner)
        .prop_map(|(label, value)| [label, of(":"), value].concat());
    let field = vec(name().prop_map(|name| [of("."), name].concat()), 0..2);
    (name(), field, bracketed("{", vec(arm, 0..4), "}"))
        .prop_map(|(name, fields, arms)| [of("match"), name, fields.concat(), arms].concat())
        .boxed()
}

fn selected(inner: Tokens) -> Tokens {
    let at = (name(), inner.clone()).prop_map(|(name, at)| [name, of(":"), at].concat());
    (operand(inner), bracketed("[", vec(at, 1..3), "]"))
        .prop_map(|(base, at)| [base, at].concat())
        .boxed()
}

fn field(inner: Tokens) -> Tokens {
    (operand(inner), name()).prop_map(|(base, name)| [base, of("."), name].concat()).boxed()
}

fn negated(inner: Tokens) -> Tokens {
    (select(vec!["-", "- -"]), prop_oneof![operand(inner), number()])
        .prop_map(|(minus, value)| [of(minus), value].concat())
        .boxed()
}

fn sum(inner: Tokens) -> Tokens {
    let term = prop_oneof![operand(inner.clone()), number(), negated(inner)];
    let more = (select(vec!["+", "-", "*", "/"]), term.clone())
        .prop_map(|(op, term)| [of(op), term].concat());
    (term, vec(more, 1..4)).prop_map(|(term, more)| [term, more.concat()].concat()).boxed()
}

fn comparison(inner: Tokens) -> Tokens {
    let op = select(vec!["<", "<=", ">", ">=", "==", "!="]);
    let side = prop_oneof![operand(inner.clone()), sum(inner)];
    (side.clone(), op, side).prop_map(|(left, op, right)| [left, of(op), right].concat()).boxed()
}

/// What binds as tightly as anything.
fn operand(inner: Tokens) -> Tokens {
    let parens = inner.clone().prop_map(|value| [of("("), value, of(")")].concat());
    prop_oneof![
        parens,
        name(),
        string(),
        boolean(),
        call(inner.clone()),
        list(inner.clone()),
        record(inner.clone()),
        tuple(inner.clone()),
        matching(inner),
    ]
    .boxed()
}

fn number() -> Tokens {
    let int = "0|[1-9](_?[0-9]){0,16}";
    let point = "(0|[1-9](_?[0-9]){0,4})\\.[0-9](_?[0-9]){0,4}([eE][+-]?[0-9](_?[0-9])?)?";
    let exponent = "(0|[1-9](_?[0-9]){0,4})[eE][+-]?[0-9]{1,2}";
    prop_oneof![int, point, exponent].prop_map(|text| vec![token(&text)]).boxed()
}

fn string() -> Tokens {
    let any = "\"([^\"\\\\\n\r]|\\\\[\"\\\\nt]){0,6}\"";
    let long = "\"[a-z ]{20,40}\"";
    prop_oneof![4 => any, 1 => long].prop_map(|text| vec![token(&text)]).boxed()
}

fn boolean() -> Tokens {
    select(vec!["true", "false"]).prop_map(of).boxed()
}

fn name() -> Tokens {
    let like = select(vec!["a", "_", "letter", "truer", "as_", "e1", "Match"]).prop_map(of);
    let any = "[a-zA-Z_][a-zA-Z0-9_]{0,16}"
        .prop_filter("reserved words are no names", |name| !is_reserved(name))
        .prop_map(|name| of(&name));
    prop_oneof![like, any].boxed()
}

/// Entries parted by commas, and maybe ended by one.
fn bracketed(
    open: &'static str,
    entries: impl Strategy<Value = Vec<Vec<Token>>> + 'static,
    close: &'static str,
) -> Tokens {
    (entries, prop_oneof![3 => Just(false), 1 => Just(true)])
        .prop_map(move |(entries, comma)| {
            let comma = if comma && !entries.is_empty() { "," } else { "" };
            [of(open), entries.join(of(",").as_slice()), of(comma), of(close)].concat()
        })
        .boxed()
}

/// The tokens of a text that parts them by blanks.
fn of(text: &str) -> Vec<Token> {
    text.split_whitespace().map(token).collect()
}

fn token(text: &str) -> Token {
    Token { text: text.to_owned(), behind: Behind::Anything }
}
