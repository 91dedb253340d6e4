//! Measures of forecasts, as the devkit of nuScenes has them.
//!
//! Another folder in the same format is read where `IVX_WORLDS_DIR` names one.

use std::path::PathBuf;

use ivx_math::trajectory::{Displacement, displacements, is_miss, min_ade, min_fde};
use serde_json::Value;

const TOLERANCE: f64 = 1e-9;

/// The bound of a miss, in metres.
const BOUND: f64 = 2.0;

/// A measure at `k`, by its name without it.
type Measure<'a> = &'a dyn Fn(&str, &[Displacement], usize) -> f64;

#[test]
fn golden_forecasts_are_measured_as_by_nuscenes() {
    let Some(cases) = cases() else { return };
    for (i, case) in cases.iter().enumerate() {
        let errors = differences(case, &|case| forecast(case, &probabilities(case)), &measure);
        assert!(errors.is_empty(), "case {i}: {}", errors.join("; "));
    }
}

#[test]
fn golden_forecasts_tell_wrong_measures() {
    let Some(cases) = cases() else { return };
    let told = |prepare: &dyn Fn(&Value) -> Vec<Displacement>, measure: Measure<'_>| {
        cases.iter().filter(|case| !differences(case, prepare, measure).is_empty()).count()
    };
    let right = |case: &Value| forecast(case, &probabilities(case));
    // The order in which modes are given, and the least probable first.
    let given = |case: &Value| forecast(case, &vec![1.0; probabilities(case).len()]);
    let reversed = |case: &Value| {
        let less: Vec<f64> = probabilities(case).iter().map(|p| 1.0 - p).collect();
        forecast(case, &less)
    };
    assert!(told(&given, &measure) > 6 && told(&reversed, &measure) > 6);
    // One mode more than `k`, the end in the place of the average, and a miss that looks at the end alone.
    let more = |name: &str, modes: &[Displacement], k| measure(name, modes, k + 1);
    let end = |name: &str, modes: &[Displacement], k| match name {
        "minADE" => min_fde(modes, k),
        name => measure(name, modes, k),
    };
    let missed = |name: &str, modes: &[Displacement], k| match name {
        "MissRate" => f64::from(u8::from(min_fde(modes, k) >= BOUND)),
        name => measure(name, modes, k),
    };
    assert!(told(&right, &more) > 6 && told(&right, &end) == cases.len());
    assert!(told(&right, &missed) > 2);
}

/// The measures of a case that are other than ours.
fn differences(
    case: &Value,
    prepare: &dyn Fn(&Value) -> Vec<Displacement>,
    measure: Measure<'_>,
) -> Vec<String> {
    let modes = prepare(case);
    let fields = case.as_object().expect("a case");
    let differ = fields.iter().filter_map(|(field, expected)| {
        let (name, k) = field.trim_end_matches("_2m").split_once('_')?;
        let (expected, k) = (number(expected), k.parse().expect("a number of modes"));
        let found = measure(name, &modes, k);
        let is_near = (found - expected).abs() <= TOLERANCE;
        (!is_near).then(|| format!("{field}: expected {expected}, found {found}"))
    });
    differ.collect()
}

fn measure(name: &str, modes: &[Displacement], k: usize) -> f64 {
    match name {
        "minADE" => min_ade(modes, k),
        "minFDE" => min_fde(modes, k),
        "MissRate" => f64::from(u8::from(is_miss(modes, k, BOUND))),
        name => panic!("nothing measures `{name}`"),
    }
}

fn forecast(case: &Value, probabilities: &[f64]) -> Vec<Displacement> {
    let modes: Vec<[f64; 2]> = list(&case["pred"]).iter().flat_map(points).collect();
    displacements(&modes, probabilities, &points(&case["gt"])).expect("a forecast")
}

fn probabilities(case: &Value) -> Vec<f64> {
    list(&case["prob"]).iter().map(number).collect()
}

/// The cases. Another folder need not have any; the checked-in one must.
fn cases() -> Option<Vec<Value>> {
    let elsewhere = std::env::var_os("IVX_WORLDS_DIR").map(PathBuf::from);
    let checked_in = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/golden");
    let folder = elsewhere.clone().unwrap_or_else(|| checked_in.into());
    let path = folder.join("metrics/nuscenes_prediction.json");
    if elsewhere.is_some() && !path.exists() {
        return None;
    }
    let text = std::fs::read_to_string(&path);
    let text = text.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let file: Value = serde_json::from_str(&text).expect("a file of cases");
    assert_eq!(file["format"], "ivx-nuscenes-metrics-golden-1");
    let cases = list(&file["cases"]).to_vec();
    assert!(!cases.is_empty(), "{} has no case to check", path.display());
    Some(cases)
}

fn points(path: &Value) -> Vec<[f64; 2]> {
    list(path).iter().map(|point| [number(&point[0]), number(&point[1])]).collect()
}

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap_or_else(|| panic!("expected a list, found {value}"))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("expected a number, found {value}"))
}
