//! Reads golden files and compares.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::{env, fs};

use serde_json::Value;

/// How far a value may lie from the expected one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tolerance {
    /// Relative to the expected value.
    pub(crate) rtol: f64,
    /// Added to that.
    pub(crate) atol: f64,
}

/// One case of a golden file.
pub(crate) struct Case {
    /// What failures are reported under.
    pub(crate) name: String,
    /// What is computed.
    pub(crate) kind: String,
    /// From what.
    pub(crate) inputs: Value,
    /// What comes out, by name.
    pub(crate) expected: Value,
}

/// The cases of a topic, from `IVX_GOLDEN_DIR` or the folder in the repository, and the
/// tolerance in double precision.
pub(crate) fn cases(topic: &str) -> (Tolerance, Vec<Case>) {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/golden");
    let folder =
        env::var_os("IVX_GOLDEN_DIR").map_or_else(|| PathBuf::from(default), PathBuf::from);
    let path = folder.join(topic).with_extension("json");
    let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let file: Value = serde_json::from_str(&text).unwrap();
    let tolerance = &file["tolerance"]["f64"];
    let tolerance = Tolerance {
        rtol: tolerance["rtol"].as_f64().unwrap(),
        atol: tolerance["atol"].as_f64().unwrap(),
    };
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    let case = |case: &Value| Case {
        name: text(&case["name"]),
        kind: text(&case["kind"]),
        inputs: case["inputs"].clone(),
        expected: case["expected"].clone(),
    };
    (
        tolerance,
        file["cases"].as_array().unwrap().iter().map(case).collect(),
    )
}

/// Fails unless `actual` has the expected keys, each with the expected numbers in the
/// expected arrangement.
pub(crate) fn compare(case: &Case, tolerance: Tolerance, actual: &Value) {
    let keys = |value: &Value| {
        value
            .as_object()
            .unwrap()
            .keys()
            .cloned()
            .collect::<BTreeSet<_>>()
    };
    assert_eq!(keys(actual), keys(&case.expected), "keys of {}", case.name);
    compare_at(&case.name, tolerance, actual, &case.expected);
}

fn compare_at(place: &str, tolerance: Tolerance, actual: &Value, expected: &Value) {
    match (actual, expected) {
        (Value::Array(actual), Value::Array(expected)) => {
            assert_eq!(actual.len(), expected.len(), "length of {place}");
            for (i, (a, e)) in actual.iter().zip(expected).enumerate() {
                compare_at(&format!("{place}[{i}]"), tolerance, a, e);
            }
        }
        (Value::Object(actual), Value::Object(expected)) => {
            for (key, e) in expected {
                compare_at(&format!("{place}.{key}"), tolerance, &actual[key], e);
            }
        }
        (Value::Number(actual), Value::Number(expected)) => {
            let (a, e) = (actual.as_f64().unwrap(), expected.as_f64().unwrap());
            let close = (a - e).abs() <= tolerance.atol + tolerance.rtol * e.abs();
            assert!(close, "{place} is {a}, expected {e}");
        }
        _ => assert_eq!(actual, expected, "{place}"),
    }
}
