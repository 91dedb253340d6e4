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
}
"#;

/// Reads everything that was exported, and prints what a test wants to know of it.
const SCRIPT: &str = r#"
import json
import numpy as np
import pandas as pd
from safetensors.numpy import load_file

table = pd.read_csv("all.csv")
records = json.load(open("error.json"))
model, same = dict(np.load("model.npz")), load_file("model.safetensors")
data = dict(np.load("data.npz"))
print(json.dumps({
    "columns": list(table.columns),
    "rows": table.groupby("measure").size().to_dict(),
    "error": table[table.measure == "error"].value.tolist(),
    "json": [row["value"] for row in records],
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
    assert_eq!(told["same"], true);
    assert_eq!(told["data"], json(r#"{"x": [6], "y": [6]}"#));
    let layers = r#"{"0.bias": ["float32", [3]], "0.weight": ["float32", [1, 3]],
                     "1.bias": ["float32", [1]], "1.weight": ["float32", [3, 1]]}"#;
    assert_eq!(told["model"], json(layers));
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
