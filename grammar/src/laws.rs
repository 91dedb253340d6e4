//! Laws of text and tree, tried on random specs.
//!
//! Every run tries the same specs; `PROPTEST_CASES=10000` tries more of them.

mod spec;

use proptest::collection::vec;
use proptest::prelude::{ProptestConfig, Strategy, any, prop_oneof, proptest};
use proptest::sample::{Index, select};
use proptest::test_runner::RngSeed;

use crate::format::tests::{lawful, tree};
use crate::{format, parse};
use spec::{Behind, Token, spec};

fn config() -> ProptestConfig {
    ProptestConfig { rng_seed: RngSeed::Fixed(0), failure_persistence: None, ..Default::default() }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn every_production_reads_and_is_laid_out_by_law(tokens in spec(), gaps in gaps(gap())) {
        let text = written(&tokens, &gaps);
        assert_eq!(parse(&text, 0).1, [], "{text}");
        lawful(&text, &format(&text).unwrap());
    }

    #[test]
    fn the_layout_depends_on_tokens_only(
        tokens in spec(),
        one in gaps(blanks()),
        other in gaps(blanks()),
    ) {
        // Where a doc comment stands, it stays.
        let tokens: Vec<_> = tokens.into_iter().filter(|t| t.behind != Behind::Line).collect();
        let texts = [one, other].map(|gaps| written(&tokens, &gaps));
        assert_eq!(tree(&texts[0]), tree(&texts[1]));
        assert_eq!(format(&texts[0]), format(&texts[1]), "{}\n---\n{}", texts[0], texts[1]);
    }

    #[test]
    fn a_mangled_spec_has_a_tree_with_spans_inside_it(
        tokens in spec(),
        gaps in gaps(gap()),
        changes in vec((select(&Change::ALL[..]), any::<Index>(), any::<Index>()), 1..4),
    ) {
        let mut tokens = tokens;
        for (change, at, other) in changes {
            if tokens.is_empty() {
                break;
            }
            let (at, other) = (at.index(tokens.len()), other.index(tokens.len()));
            match change {
                Change::Delete => drop(tokens.remove(at)),
                Change::Duplicate => tokens.insert(other, tokens[at].clone()),
                Change::Swap => tokens.swap(at, other),
            }
        }
        inside(&written(&tokens, &gaps));
    }

    #[test]
    fn a_cut_spec_has_a_tree_with_spans_inside_it(
        tokens in spec(),
        gaps in gaps(gap()),
        from in any::<Index>(),
        to in any::<Index>(),
    ) {
        let text = written(&tokens, &gaps);
        let place = |index: Index| text.floor_char_boundary(index.index(text.len() + 1));
        inside(&format!("{}{}", &text[..place(from)], &text[place(to)..]));
    }

    #[test]
    fn any_words_have_a_tree_with_spans_inside_it(
        words in vec(prop_oneof![select(WORDS).prop_map(str::to_owned), any::<String>()], 0..60),
        blank in select(&["", " "][..]),
        edition in select(&["", "edition \"2026\"\n"][..]),
    ) {
        inside(&format!("{edition}{}", words.join(blank)));
    }
}

#[derive(Clone, Copy, Debug)]
enum Change {
    Delete,
    Duplicate,
    Swap,
}

impl Change {
    const ALL: [Self; 3] = [Self::Delete, Self::Duplicate, Self::Swap];
}

const WORDS: &[&str] = &[
    "edition",
    "\"2026\"",
    "use",
    "include",
    "param",
    "profile",
    "axis",
    "let",
    "experiment",
    "measure",
    "figure",
    "table",
    "claim",
    "published",
    "match",
    "true",
    "as",
    "a",
    "b",
    "Int",
    "List",
    "<",
    ">",
    "<=",
    "==",
    "=",
    "=",
    ":",
    ",",
    ".",
    "..",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    "{",
    "}",
    "+",
    "-",
    "*",
    "/",
    "1",
    "2.5",
    "1e9",
    "99999999999999999999",
    "\"s\"",
    "\"\\q\"",
    "\"",
    "\\",
    "\n",
    "\n",
    "// c\n",
    "/// d\n",
    "/// d\n",
    "é",
    "\u{feff}",
    "\0",
    ";",
    "!",
];

/// What stands behind the tokens of a spec, one after another and from the beginning again.
fn gaps(gap: impl Strategy<Value = String>) -> impl Strategy<Value = Vec<String>> {
    vec(gap, 1..40)
}

/// Blanks; none for the most part.
fn blanks() -> impl Strategy<Value = String> {
    select(vec!["", "", "", " ", "  ", "\n", "\t", "\r\n "]).prop_map(str::to_owned)
}

/// Blanks, empty lines and comments.
fn gap() -> impl Strategy<Value = String> {
    let comment = "[ \n]{1,3}//(//)?[a-zé \"{}()/]{0,6} ?\n[ \n]{0,2}"
        .prop_filter("`///` would be a doc comment", |gap| {
            !gap.contains("///") || gap.contains("////")
        });
    prop_oneof![8 => blanks(), 1 => "\n[ \n]{1,3}", 1 => comment]
}

/// The tokens with gaps between, which are wider where tokens would run together.
fn written(tokens: &[Token], gaps: &[String]) -> String {
    let mut text = String::new();
    for (token, gap) in tokens.iter().zip(gaps.iter().cycle()) {
        let letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if text.ends_with(letter) && token.text.starts_with(letter)
            || text.ends_with('/') && token.text.starts_with('/')
        {
            text.push(' ');
        }
        text += &token.text;
        match token.behind {
            Behind::Blanks if gap.contains('/') => {}
            Behind::Anything | Behind::Blanks => text += gap,
            Behind::Line => {
                text.push('\n');
                text += gap;
            }
        }
    }
    text
}

/// Checks that diagnostics are in order and that each span of file 7 is a stretch of the text.
fn inside(text: &str) {
    let (ast, diagnostics) = parse(text, 7);
    assert!(diagnostics.is_sorted_by_key(|diagnostic| diagnostic.labels[0].span.start), "{text:?}");
    let shown = format!("{ast:?} {diagnostics:?}");
    for span in shown.split("Span { file: 7, start: ").skip(1) {
        let (start, rest) = span.split_once(", end: ").unwrap();
        let (end, _) = rest.split_once(' ').unwrap();
        let (start, end) = (start.parse().unwrap(), end.parse().unwrap());
        assert!(text.get(start..end).is_some(), "{start}..{end} in {text:?}");
    }
}
