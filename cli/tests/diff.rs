//! `ivx diff` of runs, results and git revisions.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::{Value, json};

const SPEC: &str = r#"edition "2026"

experiment told {
    param points: Int = 5
    param level: Float = 1.0
    axis seed = 0..5
    axis ke = { "WCM": wcm(), "MA": ma() }
    let reward = sinusoids()
    let data = sample(reward, n: points)
    let model = train(ensemble(map_estimate(net: mlp(hidden: [4])), members: 2), on: data, steps: 2)
    let decision = argmax(model, ke: ke, among: grid(-1.0, 1.0, points: 3))
    measure gap = regret(decision, under: reward)
    measure twice = level * 2.0
    claim "the level is low" : level < 2.0
}
"#;

const TEXT: &str = "\
~ param told.level: 1.0 -> 3.0
~ param told.points: 5 -> 6
! claim told/\"the level is low\": holds -> fails
    holds, difference -1 -> fails, difference 1
~ measure told/twice: 1 of 1 moved, at most 2 -> 6 (+200 %)
nodes: 36 re-keyed (36 before, 36 after)
  re-keyed because param told.level: 1.0 -> 3.0 (`claim.left` in told/claim \"the level is low\")
    1 told/claim \"the level is low\"
  re-keyed because param told.points: 5 -> 6 (`sample.n` in told/data)
    5 told/data
    10 told/decision
    10 told/gap
    10 told/model/member
";

const MARKDOWN: &str = "
**1 claim flipped, 1 measure moved, 2 parameters changed**

- **claim** `told/\"the level is low\"`: `holds -> fails`
  - `holds, difference -1 -> fails, difference 1`
- **param** `told.level`: `1.0 -> 3.0`
- **param** `told.points`: `5 -> 6`
- **measure** `told/twice`: `1 of 1 moved, at most 2 -> 6 (+200 %)`

<details><summary>nodes: 36 re-keyed (36 before, 36 after)</summary>

- re-keyed because ``param told.level: 1.0 -> 3.0 (`claim.left` in told/claim \"the level is low\")``
  - `1 told/claim \"the level is low\"`
- re-keyed because ``param told.points: 5 -> 6 (`sample.n` in told/data)``
  - `5 told/data`
  - `10 told/decision`
  - `10 told/gap`
  - `10 told/model/member`

</details>
";

/// With other parameters, in the folder of the run by default.
const CHANGED: [&str; 8] =
    ["exec", "told.ivx", "--out", "results/told", "--set", "points=6", "--set", "level=3.0"];

fn project() -> tempfile::TempDir {
    common::project(&[("told.ivx", SPEC)])
}

fn ivx(folder: &Path, args: &[&str]) -> Output {
    common::ivx(folder, args).output().expect("the command runs")
}

/// What a command says, and to whom it complains.
#[track_caller]
fn said(folder: &Path, args: &[&str], code: i32) -> (String, String) {
    let output = ivx(folder, args);
    let text = |bytes| String::from_utf8(bytes).expect("the command speaks UTF-8");
    let (out, err) = (text(output.stdout), text(output.stderr));
    assert_eq!(output.status.code(), Some(code), "{args:?}: {out}{err}");
    (out, err)
}

#[track_caller]
fn diff(folder: &Path, args: &[&str], code: i32) -> String {
    let (out, err) = said(folder, &[&["diff"], args].concat(), code);
    assert_eq!(err, "", "{out}");
    out
}

#[track_caller]
fn refused(folder: &Path, args: &[&str], why: &str) {
    let (out, err) = said(folder, &[&["diff"], args].concat(), 2);
    assert!(out.is_empty() && err.starts_with("error: ") && err.contains(why), "{out}{err}");
}

/// The names of the runs, the first one first.
fn runs(folder: &Path) -> Vec<String> {
    let (out, _) = said(folder, &["runs", "--format", "json"], 0);
    let runs: Vec<Value> = serde_json::from_str(&out).expect("it is JSON");
    runs.iter().map(|run| run["run"].as_str().expect("runs have names").to_owned()).collect()
}

#[test]
fn a_change_of_parameters_is_told_with_all_that_moved_and_why() {
    let folder = project();
    let folder = folder.path();
    said(folder, &["exec", "told.ivx"], 0);
    said(folder, &CHANGED, 0);
    let runs = runs(folder);
    let [a, b] = &runs[..] else { panic!("{runs:?}") };
    assert_eq!(diff(folder, &[a, b], 1), format!("run {a} -> run {b}\n{TEXT}"));
    let markdown = format!("### `run {a}` → `run {b}`\n{MARKDOWN}");
    assert_eq!(diff(folder, &[&a[..7], &b[..7], "--format", "markdown"], 1), markdown);
    // The second is what lies in the folder.
    assert_eq!(diff(folder, &[a], 1), format!("run {a} -> results\n{TEXT}"));
    assert_eq!(diff(folder, &[a, "results/told"], 1), format!("run {a} -> results/told\n{TEXT}"));
    assert_eq!(diff(folder, &[b], 0), "no differences\n");
    assert!(diff(folder, &[b, b, "--format", "markdown"], 0).ends_with("\n\nNo differences.\n"));

    let json = |args: &[&str], code| -> Value {
        let args = [args, &["--format", "json"]].concat();
        serde_json::from_str(&diff(folder, &args, code)).expect("it is JSON")
    };
    let told = json(&[a, b], 1);
    assert_eq!((&told["same"], &told["before"]), (&json!(false), &json!(format!("run {a}"))));
    let told = &told["results"][0];
    assert_eq!(told["changes"][2]["flips"][0]["after"]["outcome"], "fails");
    assert_eq!(
        told["changes"][3],
        json!({
            "kind": "measure", "name": "told/twice", "what": "moved", "moved": 1, "of": 1,
            "added": 0, "gone": 0, "beyond_interval": null,
            "largest": { "at": "", "before": 2.0, "after": 6.0 },
        })
    );
    let because = json!([{
        "kind": "differs", "binding": "told/data", "part": "argument", "path": "sample.n",
        "before": "5", "after": "6", "parameter": "told.points",
    }]);
    let models = json!({
        "binding": "told/model/member", "what": "rekeyed", "n": 10, "because": because,
        "nodes": null,
    });
    assert_eq!(told["nodes"]["shifts"][4], models);
    assert_eq!(json(&[a, a], 0)["same"], true);
    let all = json(&[a, b, "--nodes"], 1);
    assert_eq!(all["results"][0]["nodes"]["shifts"][4]["nodes"][9], "told/model[seed=4]/member[1]");
    let named = diff(folder, &[a, b, "--nodes"], 1);
    assert!(named.contains("\n    5 told/data\n      told/data[seed=0]\n"), "{named}");
}

#[test]
fn reruns_share_what_they_found_and_other_seeds_are_new() {
    let folder = project();
    let folder = folder.path();
    said(folder, &["exec", "told.ivx"], 0);
    said(folder, &["exec", "told.ivx", "--jobs", "1"], 0);
    let found = || fs::read_dir(folder.join(".ivx/cache/found")).expect("it is there").count();
    assert_eq!(found(), 1);
    let text = SPEC.replace("0..5", "0..7");
    fs::write(folder.join("told.ivx"), text).expect("files can be written");
    said(folder, &["exec", "told.ivx"], 0);
    assert_eq!(found(), 2);
    let runs = runs(folder);
    assert_eq!(diff(folder, &[&runs[0], &runs[1]], 0), "no differences\n");
    let told = diff(folder, &[&runs[1], &runs[2]], 1);
    assert!(told.contains("~ measure told/gap: 4 new\n"), "{told}");
    assert!(told.contains("14 new (36 before, 50 after)"), "{told}");
    assert!(told.contains("\n  new\n    2 told/data (seed = 5, 6)\n"), "{told}");
    let store = ["--store", "shared", "--store-mode", "write"];
    said(folder, &[&["exec", "told.ivx"][..], &store].concat(), 0);
    // Without records there are no reasons, and the numbers are still told.
    fs::write(folder.join("told.ivx"), SPEC).expect("files can be written");
    said(folder, &CHANGED, 0);
    fs::remove_dir_all(folder.join(".ivx/cache/journal")).expect("it is there");
    let told = diff(folder, &[&runs[1]], 1);
    assert!(told.contains("re-keyed because the cache has lost what told/data was made"), "{told}");
    assert!(told.contains("~ measure told/twice: 1 of 1 moved"), "{told}");
}

#[test]
fn results_at_a_revision_are_compared() {
    let git = |folder: &Path, args: &[&str]| {
        let mut git = Command::new("git");
        git.args(["-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false"]);
        git.args(args).current_dir(folder).env("GIT_CONFIG_GLOBAL", "/dev/null");
        git.output().is_ok_and(|output| output.status.success())
    };
    let folder = project();
    let folder = folder.path();
    if !git(folder, &["init", "--initial-branch", "main"]) {
        let why = "git is missing: revisions are not tried\n";
        std::io::Write::write_all(&mut std::io::stdout(), why.as_bytes()).unwrap();
        return;
    }
    assert!(git(folder, &["add", "told.ivx"]) && git(folder, &["commit", "-m", "spec"]));
    said(folder, &["exec", "told.ivx"], 0);
    refused(folder, &["HEAD"], "no results are tracked at HEAD");
    refused(folder, &["HEAD"], "git add --force results/NAME/results.ron");
    assert!(git(folder, &["add", "--force", "results/told/results.ron", "results/told/run.ron"]));
    assert!(git(folder, &["commit", "-m", "results"]) && git(folder, &["tag", "v1"]));
    assert_eq!(diff(folder, &["main"], 0), "no differences\n");
    said(folder, &CHANGED, 0);
    let told = diff(folder, &["HEAD"], 1);
    let (title, rest) = told.split_once('\n').expect("there are lines");
    assert!(title.starts_with("HEAD (") && title.ends_with(") -> results"), "{title}");
    assert_eq!(rest, TEXT);
    let run = &runs(folder)[1];
    assert!(diff(folder, &["v1", run], 1).ends_with(TEXT));

    assert!(git(folder, &["commit", "--all", "-m", "more"]));
    let back = diff(folder, &["HEAD", "HEAD~1"], 1);
    assert!(back.contains("~ param told.points: 6 -> 5\n"), "{back}");
    // A path counts before a revision.
    fs::create_dir(folder.join("v1")).expect("it is not there");
    refused(folder, &["v1"], "no results are in v1");
    // Another spec has results on one side only.
    let other = SPEC.replace("experiment told", "experiment other");
    fs::write(folder.join("other.ivx"), other).expect("files can be written");
    said(folder, &["exec", "other.ivx"], 0);
    let told = diff(folder, &["HEAD"], 1);
    assert!(told.ends_with("\n+ results of other\n"), "{told}");
    refused(folder, &["HEAD", "results/other"], "has no results of `other`: it has told");
    // What looks like an option is none.
    refused(folder, &["--", "--output=stolen"], "no git revision");
    assert!(!folder.join("stolen").exists());
}

#[test]
fn what_is_not_there_is_told_with_what_is() {
    let folder = project();
    let folder = folder.path();
    refused(folder, &["results/told"], "is no path, no run and no git revision");
    said(folder, &["exec", "told.ivx"], 0);
    refused(folder, &["results/tod"], "did you mean `results/told`?");
    let run = &runs(folder)[0];
    refused(folder, &[run, "zzzzzzzz"], &format!("known here: `{run}`, `results/told`"));
    let found = folder.join(".ivx/cache/found");
    fs::remove_dir_all(&found).expect("it is there");
    refused(folder, &[run], "is damaged or gone from the cache");
    // A rerun mends it.
    said(folder, &["exec", "told.ivx"], 0);
    assert_eq!(diff(folder, &[run], 0), "no differences\n");
}

#[test]
fn nothing_in_results_acts_on_a_terminal_or_a_comment() {
    let folder = project();
    let folder = folder.path();
    said(folder, &["exec", "told.ivx"], 0);
    let results = folder.join("results/told/results.ron");
    let text = fs::read_to_string(&results).expect("it was written");
    let odd = text.replace("the level is low", "\\u{1b}[31m`@all` <b>\\n# x\\u{202e}");
    fs::write(folder.join("odd.ron"), odd).expect("files can be written");
    let told = diff(folder, &["odd.ron", "results/told"], 1);
    assert!(told.contains("- claim told/\"\\u{1b}[31m`@all` <b>\\n# x\\u{202e}\"\n"), "{told}");
    assert!(told.ends_with("nodes are not compared: one side has no run.ron\n"), "{told}");
    let told = diff(folder, &["odd.ron", "results/told", "--format", "markdown"], 1);
    let line = "- gone: **claim** ``told/\"\\u{1b}[31m`@all` <b>\\n# x\\u{202e}\"``\n";
    assert!(told.contains(line), "{told}");
}
