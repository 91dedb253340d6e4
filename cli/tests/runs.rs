//! What is remembered of runs.

mod common;

use std::path::Path;
use std::process::{Command, Stdio};

use common::ivx;
use serde_json::{Value, json};

const SPEC: &str = r#"edition "2026"

experiment told {
    param points: Int = 5
    profile few { points = 3 }
    axis seed = 0..2
    let data = sample(sinusoids(), n: points)
    let model = train(map_estimate(net: mlp(hidden: [64, 64])), on: data, steps: 4_000)
    measure value = mean(predict(model, at: grid(-1.0, 1.0, points: 5)), over: x)
    claim "one is more than two" : 1.0 > 2.0
}
"#;

/// One problem can't be decided, since its probabilities do not sum to one.
const BROKEN: &str = r#"edition "2026"

experiment half {
    let white = belief([lottery([0.0], [1.0])])
    measure broken = decide(boxes(left: white, right: belief([lottery([-1.0, 1.0], [0.5, 0.4])])))
    measure sound  = decide(boxes(left: white, right: white))
}
"#;

const LONG: &str = r#"edition "2026"

experiment long {
    axis seed = 0..200
    let data = sample(sinusoids(), n: 20)
    let model = train(map_estimate(net: mlp(hidden: [64, 64])), on: data, steps: 20_000)
    measure value = mean(predict(model, at: grid(-1.0, 1.0, points: 5)), over: x)
}
"#;

fn project() -> tempfile::TempDir {
    common::project(&[("told.ivx", SPEC), ("half.ivx", BROKEN), ("long.ivx", LONG)])
}

/// What a command says, and to whom it complains.
#[track_caller]
fn said(folder: &Path, args: &[&str], code: i32) -> (String, String) {
    let output = ivx(folder, args).output().expect("the command runs");
    let text = |bytes| String::from_utf8(bytes).expect("the command speaks UTF-8");
    let (out, err) = (text(output.stdout), text(output.stderr));
    assert_eq!(output.status.code(), Some(code), "{args:?}: {out}{err}");
    (out, err)
}

fn runs(folder: &Path) -> Vec<Value> {
    let (out, _) = said(folder, &["runs", "--format", "json"], 0);
    serde_json::from_str(&out).expect("it is JSON")
}

#[track_caller]
fn name(run: &Value) -> &str {
    run["run"].as_str().expect("runs have names")
}

fn n_files(folder: &Path, cached: &str) -> usize {
    std::fs::read_dir(folder.join(".ivx/cache").join(cached)).expect("it is there").count()
}

#[test]
fn runs_are_remembered_with_what_they_did() {
    let folder = project();
    let folder = folder.path();
    assert_eq!(said(folder, &["runs", "--format", "json"], 0).0, "[]\n");
    said(folder, &["exec", "told.ivx"], 0);
    said(folder, &["exec", "told.ivx", "--jobs", "3"], 0);
    said(folder, &["exec", "told.ivx", "--profile", "few"], 0);
    said(folder, &["exec", "half.ivx"], 1);
    let all = runs(folder);
    let of = |field: &str| all.iter().map(|run| run[field].clone()).collect::<Vec<_>>();
    assert_eq!(of("spec"), ["told.ivx", "told.ivx", "told.ivx", "half.ivx"]);
    assert_eq!(of("status"), ["finished", "finished", "finished", "failed"]);
    assert_eq!(of("profile"), [json!(null), json!(null), json!("few"), json!(null)]);
    let points = [5, 5, 3].map(|points| json!({ "told.points": points }));
    assert_eq!(of("params"), [&points[..], &[json!({})]].concat());
    let verdicts = json!({ "told": { "one is more than two": "fails" } });
    assert_eq!(of("claims")[..3], [0; 3].map(|_| verdicts.clone()));
    assert_eq!(all[1]["jobs"], 3);
    for run in &all {
        assert_eq!(run["version"], env!("CARGO_PKG_VERSION"));
        assert!(run["platform"].is_string() && run["kept"] == false);
        assert_eq!(run["library"].as_str().map(str::len), Some(64));
        let moment = |field: &str| run[field].as_u64().expect("it is a number");
        assert!(moment("ended") >= moment("started") + moment("millis"));
    }
    let n = |run: usize, what: &str| all[run]["nodes"][what].as_u64().expect("it is a number");
    let nodes = n(0, "all");
    assert_eq!(
        [n(0, "executed"), n(0, "hit"), n(1, "executed"), n(1, "hit")],
        [nodes, 0, 0, nodes]
    );
    assert!(n(2, "executed") > 0 && n(2, "hit") > 0 && n(2, "executed") + n(2, "hit") == nodes);
    assert_eq!([n(3, "failed"), n(3, "skipped")], [1, 0]);
    assert_eq!(n(3, "executed") + n(3, "hit") + 1, n(3, "all"));
    assert_eq!(all[3]["failures"][0][0], "half/broken");
    assert!(all[3]["failures"][0][1].to_string().contains("0.9"), "{}", all[3]["failures"]);

    // The same files have the same digest, and the same keys one list.
    assert_eq!(all[0]["files"], all[2]["files"]);
    assert_ne!(all[0]["files"], all[3]["files"]);
    assert_eq!((n_files(folder, "runs"), n_files(folder, "keys")), (4, 3));
    std::fs::write(folder.join("told.ivx"), format!("{SPEC}// another text\n"))
        .expect("files can be written");
    said(folder, &["exec", "told.ivx"], 0);
    let last = runs(folder).pop().expect("it was remembered");
    assert_ne!(all[0]["files"], last["files"]);
    assert_eq!((n_files(folder, "runs"), n_files(folder, "keys")), (5, 3));
}

#[test]
fn a_run_is_shown_by_the_beginning_of_its_name() {
    let folder = project();
    let folder = folder.path();
    said(folder, &["exec", "told.ivx"], 0);
    said(folder, &["exec", "half.ivx"], 1);
    let all = runs(folder);
    let (out, _) = said(folder, &["show", &name(&all[0])[..7]], 0);
    for part in [
        &format!("run {} of told.ivx: finished", name(&all[0])),
        "told.points = 5",
        "fails     told: one is more than two",
        "told/model[seed=0]",
    ] {
        assert!(out.contains(part), "{part}: {out}");
    }
    let (last, _) = said(folder, &["show"], 0);
    assert!(last.contains("of half.ivx: failed") && last.contains("half/broken: "), "{last}");
    assert!(last.contains("1 failed, 0 skipped"), "{last}");
    let (json, _) = said(folder, &["show", "--format", "json", name(&all[0])], 0);
    assert_eq!(serde_json::from_str::<Value>(&json).expect("it is JSON"), all[0]);
    let (list, _) = said(folder, &["runs"], 0);
    let lines: Vec<&str> = list.lines().collect();
    assert!(
        lines[0].starts_with(name(&all[0])) && lines[0].ends_with("told.ivx, 1 fails"),
        "{list}"
    );
    assert!(lines[1].contains("  failed ") && lines[1].ends_with("half.ivx"), "{list}");
    for wrong in ["", "none"] {
        let (_, err) = said(folder, &["show", wrong], 2);
        assert!(err.contains("could be") || err.contains("no run is called `none`"), "{err}");
    }
}

#[test]
fn runs_are_kept_and_dropped() {
    let folder = project();
    let folder = folder.path();
    said(folder, &["exec", "told.ivx"], 0);
    said(folder, &["exec", "told.ivx", "--profile", "few"], 0);
    let names: Vec<String> = runs(folder).iter().map(|run| name(run).to_owned()).collect();
    let (out, _) = said(folder, &["runs", "keep", &names[0]], 0);
    assert_eq!(out, format!("kept run {}\n", names[0]));
    assert_eq!(
        runs(folder).iter().map(|run| run["kept"] == true).collect::<Vec<_>>(),
        [true, false]
    );
    assert!(
        said(folder, &["runs"], 0).0.lines().next().is_some_and(|line| line.ends_with(", kept"))
    );
    // Kept ones stay, whatever a sweep is told.
    said(folder, &["cache", "gc", "--keep-runs", "0", "--yes"], 0);
    assert_eq!(runs(folder).iter().map(name).collect::<Vec<_>>(), names[..1]);
    let (out, _) = said(folder, &["exec", "told.ivx"], 0);
    assert!(out.contains("0 of "), "{out}");
    // None is dropped if one is not there.
    said(folder, &["runs", "drop", "--yes", &names[0], &names[1]], 2);
    assert_eq!(runs(folder).len(), 2);
    said(folder, &["runs", "drop", "--yes", &names[0]], 0);
    assert_eq!(runs(folder).iter().filter(|run| name(run) == names[0]).count(), 0);
}

#[test]
fn a_run_that_was_stopped_is_remembered_as_that() {
    let folder = project();
    let folder = folder.path();
    let mut command = ivx(folder, &["exec", "long.ivx", "--jobs", "1"]);
    let mut child =
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the command starts");
    let journal = folder.join(".ivx/cache/journal");
    while std::fs::read_dir(&journal).map_or(0, Iterator::count) == 0 {
        assert!(child.try_wait().expect("the child can be asked").is_none(), "it was too fast");
        std::thread::yield_now();
    }
    let asked = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(asked.expect("`kill` is there").success());
    assert_eq!(child.wait().expect("the child ends").code(), Some(130));
    let run = runs(folder).pop().expect("it was remembered");
    assert_eq!((&run["status"], &run["claims"]), (&json!("stopped"), &json!({})));
    let n = |what: &str| run["nodes"][what].as_u64().expect("it is a number");
    assert!(n("executed") > 0 && n("executed") < n("all"), "{run}");
}

#[test]
fn a_run_with_nothing_to_do_does_not_look_at_the_durations() {
    let folder = project();
    let folder = folder.path();
    said(folder, &["exec", "told.ivx"], 0);
    let current = folder.join(".ivx/cache/hints.sled/current");
    std::fs::remove_file(&current).expect("durations were learned");
    std::fs::write(&current, "damaged").expect("files can be written");
    let (_, err) = said(folder, &["exec", "told.ivx"], 0);
    assert_eq!((err.as_str(), std::fs::read(&current).ok()), ("", Some(b"damaged".to_vec())));
    // One that has something to do notices.
    let (_, err) = said(folder, &["exec", "told.ivx", "--profile", "few"], 0);
    assert!(err.contains("hints were damaged"), "{err}");
}
