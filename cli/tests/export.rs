//! `ivx export`, and Python's own readers of what it writes.

mod common;

use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const SPEC: &str = r#"edition "2026"

experiment small {
    axis seed = 0..2
    axis degree = [1, 2]
    let data = sample(sinusoids(), n: 6)
    let line = train(linear_map(features: polynomial(degree: degree)), on: data)
    let model = train(map_estimate(net: mlp(hidden: [3])), on: data, steps: 2)
    measure error = rmse(line, on: data)
    measure curve = predict(model, at: grid(-1.0, 1.0, points: 3))
    claim "a parabola errs less" : error[degree: 2] < error[degree: 1]
    claim "it errs little" : error < 100.0
}
"#;

/// Reads everything that was exported, and prints what a test wants to know of it.
const SCRIPT: &str = r#"
import json
import numpy as np
import pandas as pd
from safetensors.numpy import load_file

table = pd.read_csv("all.csv")
records = json.load(open("error.json"))["measures"]
whole = json.load(open("all.json"))
claims = pd.DataFrame(whole["claims"])
model, same = dict(np.load("model.npz")), load_file("model.safetensors")
data = dict(np.load("data.npz"))
print(json.dumps({
    "columns": list(table.columns),
    "rows": table.groupby("measure").size().to_dict(),
    "error": table[table.measure == "error"].value.tolist(),
    "json": [row["value"] for row in records],
    "same rows": len(pd.DataFrame(whole["measures"])) == len(table),
    "claims": claims[["claim", "verdict", "n"]].fillna(0).values.tolist(),
    "coordinates": pd.json_normalize(whole["claims"], "findings", ["claim"])["at.degree"].dropna().tolist(),
    "model": {name: [str(a.dtype), list(a.shape)] for name, a in sorted(model.items())},
    "same": all((model[name] == same[name]).all() for name in same) and model.keys() == same.keys(),
    "data": {name: list(a.shape) for name, a in sorted(data.items())},
}))
"#;

/// Compares the columns of `all.parquet` and `all.csv`.
#[cfg(feature = "parquet")]
const COLUMNS: &str = r#"
import pandas as pd
columns, lines = pd.read_parquet("all.parquet"), pd.read_csv("all.csv")
pd.testing.assert_frame_equal(columns, lines, check_exact=True, check_dtype=False)
print(*columns.degree.isna().map(int), columns.dtypes["seed"], columns.dtypes["value"])
"#;

fn project() -> tempfile::TempDir {
    common::project(&[("small.ivx", SPEC)])
}

fn ivx(folder: &Path, args: &[&str]) -> Output {
    common::ivx(folder, args).output().expect("the command runs")
}

#[track_caller]
fn exported(folder: &Path, of: &str, name: &[&str], to: &str) -> Vec<u8> {
    let output = ivx(folder, &[&["export", of], name, &["--to", to]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    fs::read(folder.join(to)).expect("it is written")
}

#[track_caller]
fn refused(folder: &Path, args: &[&str], why: &str) {
    let output = ivx(folder, &[&["export"], args].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains(why), "{said}");
}

/// A Python with these modules: that of the variable `PYTHON`, or `python3`.
fn python(modules: &str) -> Option<OsString> {
    let python = std::env::var_os("PYTHON").unwrap_or_else(|| OsString::from("python3"));
    let needs = ["-c", &format!("import {modules}")];
    if Command::new(&python).args(needs).output().is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    let why = format!("skipped: Python has not all of {modules}, so what it reads is not tried\n");
    std::io::Write::write_all(&mut std::io::stdout(), why.as_bytes()).expect("tests can speak");
    None
}

#[test]
fn measures_and_nodes_are_exported_and_python_reads_them() {
    let folder = project();
    let folder = folder.path();
    let node = "small/model[seed=1]";
    refused(folder, &["small.ivx", node, "--to", "m.npz"], "is not known: `ivx exec` computes it");
    assert!(ivx(folder, &["exec", "small.ivx"]).status.success());

    let csv = String::from_utf8(exported(folder, "results/small", &[], "all.csv")).unwrap();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines[0], "experiment,measure,degree,seed,x,value");
    // Two seeds of three places, then two degrees of two seeds.
    assert!(lines[1].starts_with("small,curve,,0,-1,") && lines.len() == 1 + 6 + 4, "{csv}");
    assert!(lines[7].starts_with("small,error,1,0,,"), "{csv}");
    exported(folder, "results/small/results.ron", &["small/error"], "error.json");
    exported(folder, "results/small", &[], "all.json");
    exported(folder, "small.ivx", &[node], "model.npz");
    let model = exported(folder, "small.ivx", &[node], "model.safetensors");
    exported(folder, "small.ivx", &["small/data[seed=0]"], "data.npz");
    // What is exported is the artifact itself.
    let (tensors, _) = ivx_op::read_tensors(&model).unwrap();
    assert_eq!(
        tensors.arrays.keys().collect::<Vec<_>>(),
        ["0.bias", "0.weight", "1.bias", "1.weight"]
    );

    refused(folder, &["small.ivx", "small/modl[seed=0]", "--to", "m.npz"], "small/model");
    refused(folder, &["small.ivx", "small/model", "--to", "m.npz"], "is several nodes");
    refused(folder, &["small.ivx", "--to", "m.npz"], "name the node");
    refused(folder, &["small.ivx", "--to", "m.csv"], "measures are exported from results");
    refused(folder, &["results/small", "small/eror", "--to", "m.csv"], "small/error");
    refused(folder, &["results/small", "--to", "m.txt"], "says nothing of its format");

    let Some(python) = python("numpy, pandas, safetensors.numpy") else { return };
    let output = Command::new(&python).args(["-c", SCRIPT]).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let json = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
    assert_eq!(
        told["columns"],
        json(r#"["experiment", "measure", "degree", "seed", "x", "value"]"#)
    );
    assert_eq!(told["rows"], json(r#"{"curve": 6, "error": 4}"#));
    assert_eq!(told["error"], told["json"]);
    assert_eq!(told["same rows"], true);
    let claims = json(
        r#"[["a parabola errs less", "undecided", 2.0], ["it errs little", "undecided", 0.0]]"#,
    );
    assert_eq!((&told["claims"], &told["coordinates"]), (&claims, &json(r#"["1", "2"]"#)));
    assert_eq!(told["same"], true);
    assert_eq!(told["data"], json(r#"{"x": [6], "y": [6]}"#));
    let layers = r#"{"0.bias": ["float32", [3]], "0.weight": ["float32", [1, 3]],
                     "1.bias": ["float32", [1]], "1.weight": ["float32", [3, 1]]}"#;
    assert_eq!(told["model"], json(layers));
}

#[test]
fn json_has_the_claims_beside_the_measures_unless_one_is_asked_for() {
    let folder = project();
    let folder = folder.path();
    assert!(ivx(folder, &["exec", "small.ivx"]).status.success());
    let read = |name: &[&str]| -> serde_json::Value {
        serde_json::from_slice(&exported(folder, "results/small", name, "m.json"))
            .expect("it is JSON")
    };
    let all = read(&[]);
    assert_eq!(all["measures"].as_array().map(Vec::len), Some(10));
    let claim = &all["claims"][0];
    assert_eq!(claim["experiment"], "small");
    assert_eq!(claim["claim"], "a parabola errs less");
    assert_eq!(claim["comparison"], "error[degree: 2] < error[degree: 1]");
    // Two seeds decide nothing, alone or among two claims.
    assert_eq!(
        (&claim["verdict"], &claim["family"]["verdict"]),
        (&"undecided".into(), &"undecided".into())
    );
    assert_eq!(
        (&claim["n"], &claim["confidence"], &claim["family"]["of"]),
        (&2.into(), &0.95.into(), &2.into())
    );
    assert!(claim["difference"].as_f64().is_some_and(f64::is_finite), "{claim}");
    assert_eq!(all["claims"][1]["findings"][1]["at"], serde_json::json!({ "degree": "2" }));

    let one = read(&["small/error"]);
    assert_eq!(one["measures"].as_array().map(Vec::len), Some(4));
    assert_eq!(one.as_object().map(serde_json::Map::len), Some(1));
}

#[test]
#[cfg(feature = "parquet")]
fn pandas_reads_the_same_from_parquet_as_from_csv() {
    let folder = project();
    let folder = folder.path();
    assert!(ivx(folder, &["exec", "small.ivx"]).status.success());
    exported(folder, "results/small", &[], "all.csv");
    let bytes = exported(folder, "results/small", &[], "all.parquet");
    assert_eq!(bytes, exported(folder, "results/small", &[], "again.parquet"));
    assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"));

    if let Some(python) = python("pandas, pyarrow") {
        let read =
            Command::new(&python).args(["-c", COLUMNS]).current_dir(folder).output().unwrap();
        let said = String::from_utf8_lossy(&read.stderr);
        assert_eq!(
            String::from_utf8_lossy(&read.stdout),
            "1 1 1 1 1 1 0 0 0 0 float64 float64\n",
            "{said}"
        );
    }
}

#[test]
#[cfg(not(feature = "parquet"))]
fn who_wants_parquet_is_told_how_to_get_it() {
    let folder = project();
    assert!(ivx(folder.path(), &["exec", "small.ivx"]).status.success());
    refused(folder.path(), &["results/small", "--to", "m.parquet"], "--features parquet");
}
