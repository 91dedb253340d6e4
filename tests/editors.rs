//! The grammar of editors knows the words of the language.

use std::collections::BTreeSet;

use serde_json::Value;

const GRAMMAR: &str = include_str!("../grammar/src/ivx.pest");
const EDITORS: &str = include_str!("../editors/ivx.tmLanguage.json");

#[test]
fn every_word_of_the_language_is_known() {
    let editors: Value = serde_json::from_str(EDITORS).expect("the grammar is JSON");
    let mut known = BTreeSet::new();
    words(&editors, &mut known);
    let rules = ["item_word", "reserved", "within_word", "from_word"];
    let expected: BTreeSet<&str> = rules.into_iter().flat_map(rule).collect();
    assert!(expected.len() >= 19, "{expected:?}");
    for word in expected {
        assert!(known.contains(word), "`{word}` is not coloured");
    }
}

#[test]
fn what_is_included_is_there() {
    let editors: Value = serde_json::from_str(EDITORS).expect("the grammar is JSON");
    for include in EDITORS.split("\"include\": \"#").skip(1) {
        let name = include.split('"').next().unwrap_or_default();
        assert!(editors["repository"].get(name).is_some(), "{name}");
    }
}

/// The words that a rule of the language's grammar quotes.
fn rule(name: &str) -> impl Iterator<Item = &'static str> {
    let start = GRAMMAR.find(&format!("\n{name} ")).expect("the rule is there");
    let rule = GRAMMAR[start..].split('}').next().unwrap_or_default();
    rule.split('"').skip(1).step_by(2)
}

/// The words among the alternatives of every pattern.
fn words(value: &Value, known: &mut BTreeSet<String>) {
    match value {
        Value::Object(fields) => {
            for (name, field) in fields {
                match (name.as_str(), field) {
                    ("match", Value::String(pattern)) => known.extend(alternatives(pattern)),
                    _ => words(field, known),
                }
            }
        }
        Value::Array(items) => items.iter().for_each(|item| words(item, known)),
        _ => {}
    }
}

/// `a` and `b` of `\b(a|b)\b`.
fn alternatives(pattern: &str) -> impl Iterator<Item = String> + '_ {
    let words = pattern.strip_prefix("\\b(").and_then(|rest| rest.split_once(')'));
    words.map_or("", |(words, _)| words).split('|').map(str::to_owned)
}
