//! What the command says to a command line that cannot be meant.

mod common;

use std::fs;
use std::path::Path;

const DEMO: &str = r#"edition "2026"

experiment demo {
    param noise: Float = 0.1
    param points: Int = 5
    profile quick { points = 4 }
    let white = belief([lottery([0.0], [1.0])])
    let choice = decide(boxes(left: white, right: white))
    measure level = choice * noise
    measure many = choice + points
}

experiment other {
    param points: Int = 3
    let white = belief([lottery([0.0], [1.0])])
    measure error = decide(boxes(left: white, right: white)) * 3.0
    measure level = error + points
}
"#;

fn project() -> tempfile::TempDir {
    common::project(&[("demo.ivx", DEMO), ("sub/x.ivx", DEMO)])
}

/// Runs the command, which ends with `code`, and returns all that it says.
#[track_caller]
fn said(folder: &Path, args: &[&str], code: i32) -> String {
    let output = common::ivx(folder, args).output().expect("the command runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let said = text(&output.stdout) + &text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
    said
}

#[test]
fn what_cannot_be_meant_leads_to_what_can() {
    let folder = project();
    let folder = folder.path();
    fs::write(folder.join("latin.ivx"), b"edition \"2026\"\n// caf\xE9\n").expect("written");
    fs::write(folder.join("wide.ivx"), b"\xFF\xFEe\0d\0").expect("written");
    fs::write(folder.join("uses.ivx"), "edition \"2026\"\ninclude \"latin.ivx\"\n")
        .expect("written");
    fs::write(folder.join("empty.ivx"), "").expect("written");
    for (line, expected) in [
        ("exec demo", "there is no such file: did you mean `demo.ivx`?"),
        ("exec dmeo.ivx", "did you mean `demo.ivx`?"),
        ("check sub", "it is a folder; name a spec: `sub/x.ivx`"),
        ("check no/demo.ivx", "there is no folder `no`"),
        ("fmt demo", "did you mean `demo.ivx`?"),
        ("exec demo.ivx sub/x.ivx", "one spec is named at a time"),
        ("run demo.ivx", "a spec is run by `ivx exec demo.ivx`"),
        ("exec", "specs here: `demo.ivx`"),
        ("exec demo.ivx noise=0.2", "`--set noise=0.2`"),
        ("exec demo.ivx --noise 0.2", "`--set noise=VALUE`"),
        ("exec demo.ivx --set noise 0.2", "one word: `--set noise=0.2`"),
        ("exec demo.ivx --set noise=abc", "wants a Float, and `abc` is none"),
        (
            "exec demo.ivx --set noise=abc",
            "`demo.noise` is declared at demo.ivx:4: `param noise: Float = 0.1`",
        ),
        ("exec demo.ivx --set nois=abc", "did you mean `noise`?"),
        ("exec demo.ivx --set nois=1.0", "did you mean `noise`?"),
        ("exec demo.ivx --set points=abc", "say which: demo.points, other.points"),
        ("exec demo.ivx --set points=3", "say which: demo.points, other.points"),
        (
            "exec demo.ivx --set demo.points=2.5",
            "`points` is Int, but its value by `--set` is Float",
        ),
        ("exec demo.ivx --profile quik", "did you mean `quick`?"),
        ("why demo.ivx levle", "did you mean `level`?"),
        (
            "why demo.ivx level",
            "several experiments have a `level`: say which: `demo/level`, `other/level`",
        ),
        ("why error demo.ivx", "the spec comes before the node: `ivx why demo.ivx error`"),
        ("check latin.ivx", "byte 0xE9 at line 2, column 7"),
        ("check wide.ivx", "it is UTF-16: save it as UTF-8"),
        ("fmt latin.ivx", "byte 0xE9 at line 2, column 7"),
        ("check uses.ivx", "byte 0xE9 at line 2, column 7"),
        ("check empty.ivx", "edition"),
        ("exec demo.ivx -j 0", "nothing would run: write at least 1"),
        ("exec demo.ivx --jobs two", "write a whole number of at least 1"),
        ("exec demo.ivx --memory 4", "it has no unit: write `4GiB`"),
        ("exec demo.ivx --checkpoint 5", "it has no unit: write `5s`"),
        ("exec demo.ivx --max-nodes 0", "write at least 1"),
        ("exec demo.ivx --store-mode write", "`--store-mode` is of no store"),
        ("verify demo.ivx --sample 5", "it has no unit: write `5%`"),
        ("cache gc --max-size 10", "it has no unit: write `10GiB`"),
        ("cache gc --older-than 30", "it has no unit: write `30d`"),
        ("cache gc --dry-run --yes", "cannot be used with"),
        ("diff --tolerance nan", "write a number of at least 0"),
        ("diff", "there are no runs to compare: `ivx exec SPEC` makes one"),
    ] {
        let args: Vec<&str> = line.split(' ').collect();
        let said = said(folder, &args, 2);
        assert!(said.contains(expected), "{line}: {said}");
    }
    assert!(said(folder, &["why", "demo.ivx", "error"], 0).contains("other/error"));
}

#[test]
fn without_names_the_last_two_runs_of_a_spec_are_compared() {
    let folder = project();
    let folder = folder.path();
    said(folder, &["exec", "demo.ivx"], 0);
    let alone = said(folder, &["diff"], 2);
    assert!(alone.contains("there is one run of demo.ivx, and two are compared"), "{alone}");
    said(folder, &["exec", "demo.ivx", "--set", "noise=0.2"], 0);
    said(folder, &["exec", "sub/x.ivx"], 0);
    assert!(said(folder, &["diff"], 2).contains("there is one run of sub/x.ivx"));
    let told = said(folder, &["diff", "demo.ivx"], 1);
    assert!(told.contains("of demo.ivx: the last run, "), "{told}");
    assert!(told.contains("~ param demo.noise: 0.1 -> 0.2"), "{told}");
    said(folder, &["exec", "sub/x.ivx"], 0);
    let same = said(folder, &["diff"], 0);
    assert!(
        same.contains("of sub/x.ivx: the last run, ") && same.contains("no differences"),
        "{same}"
    );
    let runs = said(folder, &["runs"], 0);
    assert_eq!(runs.matches("demo.ivx quick --set demo.noise=0.2").count(), 1, "{runs}");
    let runs: serde_json::Value =
        serde_json::from_str(&said(folder, &["runs", "--format", "json"], 0)).expect("it is JSON");
    assert_eq!(runs[1]["set"], serde_json::json!({ "demo.noise": 0.2 }));
    assert_eq!(runs[0]["set"], serde_json::json!({}));
}

#[test]
fn what_deletes_says_so_and_wants_consent() {
    let folder = project();
    let folder = folder.path();
    said(folder, &["exec", "demo.ivx"], 0);
    said(folder, &["exec", "demo.ivx", "--set", "noise=0.2"], 0);
    let gc = ["cache", "gc", "--max-size", "1B"];
    let refused = said(folder, &gc, 2);
    assert!(refused.contains("would remove") && refused.contains(" of demo\n"), "{refused}");
    assert!(
        refused.contains("nothing is removed: there is nobody to ask, and no `--yes`"),
        "{refused}"
    );
    assert!(said(folder, &["exec", "demo.ivx"], 0).contains("0 of "), "nothing was removed");
    let runs = said(folder, &["runs", "--format", "json"], 0);
    let runs: serde_json::Value = serde_json::from_str(&runs).expect("it is JSON");
    let name = runs[0]["run"].as_str().expect("runs have names");
    let refused = said(folder, &["runs", "drop", name], 2);
    assert!(refused.contains("would drop") && refused.contains("no `--yes`"), "{refused}");
    assert!(said(folder, &["runs"], 0).contains(name));
    said(folder, &["runs", "drop", name, "--yes"], 0);
    assert!(!said(folder, &["runs"], 0).contains(name));
    let removed = said(folder, &["cache", "gc", "--keep-runs", "1", "--yes"], 0);
    assert!(removed.contains("  1 run of demo.ivx: "), "{removed}");
}

#[test]
fn a_program_that_breaks_is_told_by_what_changed() {
    let spec = r#"edition "2026"
experiment lost {
    let run = command("sh", args: ["a.sh"], files: ["a.sh"], outputs: ["o.json"])
    measure a = read_scalar(run, "o.json")
    measure b = 1.0
}
"#;
    let folder = common::project(&[("lost.ivx", spec), ("a.sh", "echo 1 > o.json\n")]);
    let folder = folder.path();
    said(folder, &["exec", "lost.ivx"], 0);
    fs::write(folder.join("a.sh"), "exit 3\n").expect("files can be written");
    said(folder, &["exec", "lost.ivx"], 1);
    let told = said(folder, &["diff", "lost.ivx"], 1);
    assert!(told.contains("nodes: 1 failed, 1 skipped"), "{told}");
    assert!(told.contains("failed, re-keyed because `command.files[0]` was "), "{told}");
    assert!(told.contains("skipped because lost/run failed"), "{told}");
    assert!(!told.contains("the cache has lost"), "{told}");
    fs::write(folder.join("a.sh"), "echo 2 > o.json\n").expect("files can be written");
    said(folder, &["exec", "lost.ivx"], 0);
    let told = said(folder, &["diff", "lost.ivx"], 1);
    assert!(told.contains("with a result again because"), "{told}");
    assert!(!told.contains("the cache has lost"), "{told}");
}
