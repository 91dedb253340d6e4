//! Where results are written: none takes the place of others unasked, and a set is whole.

mod common;

use std::fs;
use std::path::Path;

use ivx_cache::Digest;
use ivx_engine::Results;

const SPEC: &str = r#"edition "2026"

experiment told {
    param points: Int = 5
    axis seed = 0..3
    let data = sample(sinusoids(), n: points)
    let model = train(map_estimate(net: mlp(hidden: [4])), on: data, steps: 2)
    measure value = mean(predict(model, at: grid(-1.0, 1.0, points: 5)), over: x)
    figure "one" = bars(value, by: seed)
    table "two" = table(value, rows: seed)
}
"#;

/// What a command says, complaints last.
#[track_caller]
fn said(folder: &Path, args: &[&str], code: i32) -> String {
    let output = common::ivx(folder, args).output().expect("the command runs");
    let text = [output.stdout, output.stderr].concat();
    let text = String::from_utf8(text).expect("the command speaks UTF-8");
    assert_eq!(output.status.code(), Some(code), "{args:?}: {text}");
    text
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The results in a folder, of which every figure and table is.
#[track_caller]
fn whole(folder: &Path) -> String {
    let results = text(&folder.join("results.ron"));
    let files = Results::from_ron(&results).expect("results read").files();
    assert!(!files.is_empty());
    for (file, digest) in files {
        let own = fs::read(folder.join(&file)).expect("it is written");
        assert_eq!(Digest::of(&own).to_string(), digest, "{file}");
    }
    results
}

#[test]
fn specs_of_one_name_and_runs_with_other_parameters_leave_each_other() {
    let other = SPEC.replace("\"one\"", "\"other\"");
    let folder = common::project(&[("x/s.ivx", SPEC), ("y/s.ivx", &other)]);
    let folder = folder.path();
    said(folder, &["exec", "x/s.ivx"], 0);
    let first = whole(&folder.join("results/x/s"));
    fs::write(folder.join("results/x/s/mine.txt"), "mine").expect("files can be written");
    said(folder, &["exec", "y/s.ivx"], 0);
    let out = said(folder, &["exec", "x/s.ivx", "--set", "points=6"], 0);
    assert!(out.contains("results: results/x/s@points=6/results.ron"), "{out}");
    let out = said(&folder.join("x"), &["exec", "s.ivx"], 0);
    assert!(out.contains("results: ../results/x/s/results.ron"), "{out}");
    assert_eq!(whole(&folder.join("results/x/s")), first);
    assert_eq!(text(&folder.join("results/x/s/mine.txt")), "mine");
    assert!(folder.join("results/y/s/figures/other.svg").exists());
    assert_ne!(whole(&folder.join("results/x/s@points=6")), first);
    said(folder, &["exec", "x/s.ivx", "--out", "x"], 2);
}

#[test]
fn of_two_runs_at_once_into_one_folder_one_is_there_whole() {
    let folder = common::project(&[("s.ivx", SPEC)]);
    for _ in 0..5 {
        let children = ["points=6", "points=7"].map(|set| {
            let mut ivx =
                common::ivx(folder.path(), &["exec", "s.ivx", "--out", "out", "--set", set]);
            ivx.spawn().expect("the command runs")
        });
        for mut child in children {
            assert!(child.wait().expect("it ends").success());
        }
        whole(&folder.path().join("out"));
    }
}

#[test]
fn an_earlier_set_is_given_back() {
    let folder = common::project(&[("s.ivx", SPEC)]);
    let folder = folder.path();
    said(folder, &["exec", "s.ivx"], 0);
    let first = whole(&folder.join("results/s"));
    let page = text(&folder.join("results/s/report.md"));
    let runs = said(folder, &["runs", "--format", "json"], 0);
    let runs: serde_json::Value = serde_json::from_str(&runs).expect("it is JSON");
    let run = runs[0]["run"].as_str().expect("runs have names");
    fs::write(folder.join("s.ivx"), SPEC.replace("= 5", "= 6")).expect("files can be written");
    said(folder, &["exec", "s.ivx"], 0);
    assert_ne!(whole(&folder.join("results/s")), first);
    let out = said(folder, &["show", run, "--to", "before"], 0);
    assert!(out.contains("results: before/results.ron"), "{out}");
    assert!(out.contains("report.html"), "what is gone is told: {out}");
    assert_eq!(whole(&folder.join("before")), first);
    assert_eq!(text(&folder.join("before/report.md")), page);
}
