//! Archives, as the command takes them in where it is called.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const SPEC: &str = r#"edition "2026"

experiment packed {
    param steps: Int = 2
    axis seed = 0..2
    let data = sample(sinusoids(), n: 10)
    let model = train(ensemble(map_estimate(net: mlp(hidden: [40, 40])), members: 2), on: data, steps: steps)
    measure spread = mean(std(predict(model, at: grid(-1.0, 1.0, points: 11)), over: member), over: x)
}
"#;

fn project() -> tempfile::TempDir {
    common::project(&[("packed.ivx", SPEC)])
}

fn ivx(folder: &Path, args: &[&str]) -> Output {
    common::ivx(folder, args).output().expect("the command runs")
}

#[track_caller]
fn said(folder: &Path, args: &[&str]) -> String {
    let output = ivx(folder, args);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("the command speaks UTF-8")
}

#[test]
fn an_archive_is_taken_in_or_refused() {
    let (from, to) = (project(), project());
    let nothing = ivx(from.path(), &["cache", "export", "all.ivxa"]);
    assert_eq!(nothing.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&nothing.stderr).contains("there is no cache"));
    said(from.path(), &["exec", "packed.ivx"]);
    let out = said(from.path(), &["cache", "export", "all.ivxa"]);
    let file = to.path().join("all.ivxa");
    fs::copy(from.path().join("all.ivxa"), &file).expect("files can be copied");
    let taken = said(to.path(), &["cache", "import", "all.ivxa"]);
    let (records, objects) = out.trim_end().split_once(", ").expect("records, then objects");
    let n = records.trim_start_matches("all.ivxa: ").trim_end_matches(" records");
    assert_eq!(taken, format!("{records}, {n} of them new, {objects}\n"));
    let planned = said(to.path(), &["plan", "packed.ivx"]);
    assert!(planned.contains(&format!("{n} nodes: {n} hit, 0 run")), "{planned}");
    let taken = said(to.path(), &["cache", "import", "all.ivxa"]);
    assert_eq!(taken, format!("{records}, 0 of them new, {objects}\n"));

    let mut bytes = fs::read(&file).expect("the file is there");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&file, bytes).expect("files can be written");
    let refused = ivx(to.path(), &["cache", "import", "all.ivxa"]);
    assert_eq!(refused.status.code(), Some(3));
    let why = String::from_utf8_lossy(&refused.stderr);
    assert!(why.starts_with("error: all.ivxa: the archive is refused: "), "{why}");
}

#[test]
fn an_archive_is_taken_in_beside_a_run() {
    let (from, to) = (project(), project());
    said(from.path(), &["exec", "packed.ivx"]);
    said(from.path(), &["cache", "export", "all.ivxa"]);
    fs::copy(from.path().join("all.ivxa"), to.path().join("all.ivxa"))
        .expect("files can be copied");
    let mut run = Command::new(env!("CARGO_BIN_EXE_ivx"));
    let run = run.args(["exec", "packed.ivx", "--set", "steps=400"]).current_dir(to.path());
    let run = run.env_remove("IVX_CACHE").stdout(Stdio::piped()).stderr(Stdio::piped());
    let run = run.spawn().expect("the command starts");
    for _ in 0..3 {
        said(to.path(), &["cache", "import", "all.ivxa"]);
    }
    let ended = run.wait_with_output().expect("the command ends");
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    for steps in ["steps=2", "steps=400"] {
        let planned = said(to.path(), &["plan", "packed.ivx", "--set", steps]);
        assert!(planned.contains(" hit, 0 run, 0 unknown"), "{planned}");
    }
}
