//! Compares every expected number of a golden file with ours.
//!
//! A file has cases; a case has a kind, inputs and a tree of expected values. The harness walks
//! the tree and asks a `compute` function for each leaf by its path, so that an expectation
//! nobody computes is an error and not a gap. Leaves are numbers, truth values, strings and
//! lists of these.

use std::path::PathBuf;

use serde_json::Value;

/// One case of a golden file.
pub(crate) struct Case {
    /// What failures are reported under.
    pub(crate) name: String,
    /// What is computed.
    pub(crate) kind: String,
    /// From what.
    pub(crate) inputs: Value,
    /// What should come out.
    pub(crate) expected: Value,
}

/// Checks every case of the file `topic`.
///
/// `compute` is given a case and the path of a leaf in `expected`, and returns our value;
/// `None` if it does not know the kind or the path.
pub(crate) fn check(topic: &str, compute: impl Fn(&Case, &[&str]) -> Option<Value>) {
    check_where(topic, |_| true, compute);
}

/// Checks the cases of one kind, of a file whose other kinds are not this crate's.
pub(crate) fn check_kind(
    topic: &str,
    kind: &str,
    compute: impl Fn(&Case, &[&str]) -> Option<Value>,
) {
    check_where(topic, |case| case.kind == kind, compute);
}

/// Checks that a wrong formula is told from the right one in every case of a kind: that something differs.
pub(crate) fn check_wrong(
    topic: &str,
    kind: &str,
    compute: impl Fn(&Case, &[&str]) -> Option<Value>,
) {
    let Some(cases) = compare(topic, |case| case.kind == kind, compute) else { return };
    assert!(!cases.is_empty() || elsewhere().is_some(), "{topic} has no case of `{kind}`");
    let passed: Vec<String> =
        cases.into_iter().filter(|(_, errors)| errors.is_empty()).map(|(name, _)| name).collect();
    assert!(passed.is_empty(), "{topic}: a wrong formula passes in {}", passed.join(", "));
}

/// Checks some cases of a file.
pub(crate) fn check_where(
    topic: &str,
    ours: impl Fn(&Case) -> bool,
    compute: impl Fn(&Case, &[&str]) -> Option<Value>,
) {
    let Some(cases) = compare(topic, ours, compute) else { return };
    assert!(!cases.is_empty() || elsewhere().is_some(), "{topic} has no case to check");
    let errors: Vec<String> = cases.into_iter().flat_map(|(_, errors)| errors).collect();
    assert!(errors.is_empty(), "{} differ:\n{}", errors.len(), errors.join("\n"));
}

/// Some cases by name, with what differs in each; `None` if there is no such file.
fn compare(
    topic: &str,
    ours: impl Fn(&Case) -> bool,
    compute: impl Fn(&Case, &[&str]) -> Option<Value>,
) -> Option<Vec<(String, Vec<String>)>> {
    let file = read(topic)?;
    let tolerance = &file["tolerance"]["f64"];
    let rtol = tolerance["rtol"].as_f64().expect("a relative tolerance");
    let atol = tolerance["atol"].as_f64().expect("an absolute tolerance");

    let mut cases = Vec::new();
    for entry in file["cases"].as_array().expect("a list of cases") {
        let case = Case {
            name: text(&entry["name"]).to_owned(),
            kind: text(&entry["kind"]).to_owned(),
            inputs: entry["inputs"].clone(),
            expected: entry["expected"].clone(),
        };
        if !ours(&case) {
            continue;
        }
        let mut errors = Vec::new();
        for (path, expected) in leaves(&case.expected) {
            let keys: Vec<&str> = path.iter().map(String::as_str).collect();
            let error = match compute(&case, &keys) {
                None => Some("nothing computes this".to_owned()),
                Some(found) => difference(expected, &found, rtol, atol),
            };
            let place = format!("{topic}, {}, {}", entry["name"], path.join("."));
            errors.extend(error.map(|error| format!("{place}: {error}")));
        }
        cases.push((case.name, errors));
    }
    Some(cases)
}

/// Another folder to read from, in the same format.
fn elsewhere() -> Option<PathBuf> {
    std::env::var_os("IVX_GOLDEN_DIR").map(PathBuf::from)
}

/// The file of a topic. Another folder need not have every topic; the checked-in one must.
fn read(topic: &str) -> Option<Value> {
    let checked_in = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/golden");
    let folder = elsewhere().unwrap_or_else(|| PathBuf::from(checked_in));
    let path = folder.join(format!("{topic}.json"));
    if elsewhere().is_some() && !path.exists() {
        return None;
    }
    let text = std::fs::read_to_string(&path);
    let text = text.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Some(serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
}

/// The leaves of a tree with their paths. Lists are leaves unless they hold objects.
fn leaves(tree: &Value) -> Vec<(Vec<String>, &Value)> {
    let children: Vec<(String, &Value)> = match tree {
        Value::Object(fields) => fields.iter().map(|(key, value)| (key.clone(), value)).collect(),
        Value::Array(items) if items.iter().any(Value::is_object) => {
            items.iter().enumerate().map(|(i, item)| (i.to_string(), item)).collect()
        }
        leaf => return vec![(vec![], leaf)],
    };
    let below = children.into_iter().flat_map(|(key, child)| {
        leaves(child)
            .into_iter()
            .map(move |(path, leaf)| ([vec![key.clone()], path].concat(), leaf))
    });
    below.collect()
}

/// How the values differ; `None` if they do not.
fn difference(expected: &Value, found: &Value, rtol: f64, atol: f64) -> Option<String> {
    let differ = || Some(format!("expected {expected}, found {found}"));
    match (expected, found) {
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let items = a.iter().zip(b).enumerate();
            let mut errors = items.filter_map(|(i, (a, b))| {
                difference(a, b, rtol, atol).map(|e| format!("[{i}] {e}"))
            });
            errors.next()
        }
        (Value::Number(_), Value::Number(_)) => {
            let (a, b) = (number(expected), number(found));
            if (a - b).abs() <= atol + rtol * a.abs() { None } else { differ() }
        }
        _ => {
            if expected == found {
                None
            } else {
                differ()
            }
        }
    }
}

/// A JSON number.
pub(crate) fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("expected a number, found {value}"))
}

/// A JSON list of numbers.
pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    let items = value.as_array().unwrap_or_else(|| panic!("expected a list, found {value}"));
    items.iter().map(number).collect()
}

/// A JSON list of lists of numbers.
pub(crate) fn rows(value: &Value) -> Vec<Vec<f64>> {
    let items = value.as_array().unwrap_or_else(|| panic!("expected a list, found {value}"));
    items.iter().map(numbers).collect()
}

/// A JSON string.
pub(crate) fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("expected a string, found {value}"))
}

/// The parameter of a key such as `mvu_-0.3`: what follows `name` and an underscore.
pub(crate) fn parameter(key: &str, name: &str) -> Option<f64> {
    key.strip_prefix(name)?.strip_prefix('_')?.parse().ok()
}

mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_leaf_is_found_by_its_path() {
        let tree = json!({"a": {"b": [1, 2]}, "c": [{"d": true}]});
        let paths: Vec<String> = leaves(&tree).iter().map(|(path, _)| path.join(".")).collect();
        assert_eq!(paths, ["a.b", "c.0.d"]);
    }

    #[test]
    fn differences_are_seen_at_any_depth() {
        let differ = |a, b| difference(&a, &b, 1e-3, 0.0).is_some();
        assert!(!differ(json!([[1.0, 2]]), json!([[1.0005, 2.0]])));
        assert!(differ(json!([[1.0, 2]]), json!([[1.002, 2.0]])));
        assert!(differ(json!([1.0]), json!([1.0, 2.0])));
        assert!(differ(json!(true), json!(1.0)));
        // What is not a number is null in JSON.
        assert!(differ(json!(1.0), json!(f64::NAN)));
    }

    #[test]
    fn a_key_carries_its_parameter() {
        assert_eq!(parameter("mvu_-0.3", "mvu"), Some(-0.3));
        assert_eq!(parameter("mvm_1.0", "mvu"), None);
        assert_eq!(parameter("mvu", "mvu"), None);
    }
}
