//! Ctrl-C and TERM are heeded whatever goes on, and nothing that was done is lost.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// So long a stopped command may take on a busy machine; what it is stopped in would take minutes.
const BOUND: Duration = Duration::from_secs(20);

/// Programs that run until they may go on, which is nothing that they are given.
fn spec(n: usize, script: &str) -> String {
    format!(
        r#"edition "2026"
experiment e {{
    axis i = 0..{n}
    let run = command("sh", args: ["-c", "{script}", "sh", i], stdout: "o.json")
    measure x = read_scalar(run, "o.json")
}}
"#
    )
}

const PATIENT: &str = "echo $$ > ../../began.$$; [ -e ../../go ] || sleep 600; echo $1";

fn project(spec: &str) -> tempfile::TempDir {
    let folder = common::project(&[("e.ivx", spec)]);
    fs::create_dir(folder.path().join("tmp")).expect("the folder is there");
    folder
}

fn ivx(folder: &Path, args: &[&str]) -> Command {
    let mut ivx = common::ivx(folder, args);
    ivx.env("TMPDIR", folder.join("tmp"));
    ivx
}

fn start(folder: &Path, args: &[&str]) -> Child {
    let mut ivx = ivx(folder, args);
    ivx.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the command starts")
}

/// The programs that said that they began.
fn began(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("it is there").flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.filter_map(|name| Some(name.strip_prefix("began.")?.to_owned())).collect()
}

fn wait_for(what: impl Fn() -> bool) {
    let start = Instant::now();
    while !what() {
        assert!(start.elapsed() < 3 * BOUND, "it does not come to that");
        sleep(Duration::from_millis(10));
    }
}

/// Sends a signal and waits for the end. Returns the exit code and what was said.
#[track_caller]
fn stopped(mut child: Child, signal: &str) -> (Option<i32>, String) {
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status();
    assert!(sent.expect("`kill` is there").success());
    let asked = Instant::now();
    while child.try_wait().expect("it can be asked").is_none() {
        if asked.elapsed() > BOUND {
            child.kill().expect("it can be killed");
            panic!("it goes on");
        }
        sleep(Duration::from_millis(10));
    }
    let output = child.wait_with_output().expect("it has ended");
    (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
}

#[track_caller]
fn said(folder: &Path, args: &[&str]) -> String {
    let output = ivx(folder, args).output().expect("the command runs");
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{err}");
    format!("{}{err}", String::from_utf8_lossy(&output.stdout))
}

fn go(folder: &Path) {
    fs::write(folder.join("go"), "").expect("files can be written");
}

/// Whether none of these processes is left; one that nobody reaped is none.
fn are_gone(pids: &[String]) -> bool {
    pids.iter().all(|pid| {
        let stat = fs::read_to_string(format!("/proc/{pid}/stat"));
        stat.map_or(true, |stat| stat.contains(") Z "))
    })
}

#[test]
fn any_number_of_jobs_is_stopped_and_goes_on() {
    let folder = project(&spec(200, PATIENT));
    let folder = folder.path();
    for (jobs, signal) in [("16000", "-TERM"), ("1", "-INT")] {
        let run = start(folder, &["exec", "e.ivx", "--jobs", jobs]);
        wait_for(|| !began(folder).is_empty());
        let (code, out) = stopped(run, signal);
        assert_eq!(code, Some(130), "{out}");
        assert!(out.contains("stopped: what was executed is kept"), "{out}");
        assert!(!out.contains("failed"), "what was ended has not failed: {out}");
        assert!(are_gone(&began(folder)));
        assert_eq!(fs::read_dir(folder.join("tmp")).expect("it is there").count(), 0);
        for pid in began(folder) {
            fs::remove_file(folder.join(format!("began.{pid}"))).expect("it is there");
        }
    }
    go(folder);
    let told = said(folder, &["exec", "e.ivx", "--jobs", "16000"]);
    assert!(told.contains("400 of 400 nodes executed"), "{told}");
    assert!(told.contains("jobs instead of 16000: more do not help on"), "{told}");
}

#[test]
fn programs_are_asked_first_and_then_killed_and_leave_no_half_result() {
    let deaf = "trap '' TERM; ";
    // This one ends well, but early.
    let half = "trap 'echo 99; exit 0' TERM; ";
    for before in [deaf, half] {
        let script = format!(
            "{before} echo $$ > ../../began.$$; [ -e ../../go ] || {{ sleep 600 & wait; wait; }}; echo $1"
        );
        let folder = project(&spec(1, &script));
        let folder = folder.path();
        let run = start(folder, &["exec", "e.ivx"]);
        wait_for(|| !began(folder).is_empty());
        // Until the trap is set, which it is before it says that it began.
        let (code, out) = stopped(run, "-TERM");
        assert_eq!(code, Some(130), "{out}");
        assert!(are_gone(&began(folder)));
        go(folder);
        assert!(said(folder, &["exec", "e.ivx"]).contains("2 of 2 nodes executed"));
        let results = fs::read_to_string(folder.join("results/e/results.ron"));
        assert!(!results.expect("results are written").contains("99"));
    }
}

#[test]
fn what_keeps_nothing_ends_at_once() {
    let folder = project(&spec(2, PATIENT));
    let folder = folder.path();
    go(folder);
    said(folder, &["exec", "e.ivx"]);
    fs::remove_file(folder.join("go")).expect("it is there");
    for pid in began(folder) {
        fs::remove_file(folder.join(format!("began.{pid}"))).expect("it is there");
    }
    let verify = start(folder, &["verify", "e.ivx"]);
    wait_for(|| !began(folder).is_empty());
    assert_eq!(stopped(verify, "-TERM").0, Some(130));
    wait_for(|| are_gone(&began(folder)));
    // The archive is written to a pipe that nobody reads.
    let part = folder.join("all.ivxa.part");
    assert!(Command::new("mkfifo").arg(&part).status().expect("`mkfifo` is there").success());
    let export = start(folder, &["cache", "export", "all.ivxa"]);
    sleep(Duration::from_millis(300));
    assert_eq!(stopped(export, "-INT").0, Some(130));
    assert!(!part.exists() && !folder.join("all.ivxa").exists());
    assert!(said(folder, &["cache", "verify"]).contains("nothing is damaged"));
    assert!(said(folder, &["exec", "e.ivx"]).contains("0 of 4 nodes executed"));
}

#[test]
fn a_large_plan_is_not_waited_for() {
    let text = r#"edition "2026"
experiment e {
    axis i = 0..300
    axis j = 0..1000
    let white = belief([lottery([0.0], [1.0])])
    let choice = decide(boxes(left: white, right: white))
    measure x = mean(choice * (i + 1.0 * j), over: j)
}
"#;
    let folder = project(text);
    let folder = folder.path();
    for command in ["plan", "exec"] {
        let run = start(folder, &[command, "e.ivx"]);
        sleep(Duration::from_millis(300));
        let (code, out) = stopped(run, "-TERM");
        assert_eq!(code, Some(130), "{command}: {out}");
    }
}

/// Trainings of a second at the least.
const TRAINING: &str = r#"edition "2026"
experiment e {
    param steps: Int = 60_000
    axis seed = 0..2
    let data = sample(sinusoids(), n: 30)
    let model = train(map_estimate(net: mlp(hidden: [64, 64])), on: data, steps: steps)
    measure curve = predict(model, at: grid(-1.0, 1.0, points: 11))
}
"#;

/// The measures of a run.
fn measures(folder: &Path) -> String {
    let results = fs::read_to_string(folder.join("results/e/results.ron"));
    results.expect("results are written")
}

fn checkpoints(folder: &Path) -> usize {
    fs::read_dir(folder.join(".ivx/cache/checkpoints")).map_or(0, Iterator::count)
}

#[test]
fn a_training_is_stopped_in_its_midst_and_goes_on_to_the_same_bytes() {
    let (whole, broken) = (project(TRAINING), project(TRAINING));
    let (whole, broken) = (whole.path(), broken.path());
    said(whole, &["exec", "e.ivx"]);
    let mut stops = 0;
    for signal in ["-INT", "-TERM", "-INT"] {
        let run = start(broken, &["exec", "e.ivx", "--checkpoint", "1h"]);
        // Both members are under way, or what is left of them.
        sleep(Duration::from_millis(400));
        let (code, out) = stopped(run, signal);
        if code == Some(0) {
            break;
        }
        assert_eq!(code, Some(130), "{out}");
        stops += usize::from(checkpoints(broken) > 0);
    }
    assert!(stops > 0, "none was stopped in its midst");
    said(broken, &["exec", "e.ivx"]);
    assert_eq!((measures(broken), checkpoints(broken)), (measures(whole), 0));
}

#[test]
fn a_node_that_takes_longer_than_it_may_goes_on_in_the_next_run() {
    let folder = project(TRAINING);
    let folder = folder.path();
    let limited = || {
        let args = ["exec", "e.ivx", "--node-limit", "0.2s"];
        let output = ivx(folder, &args).output().expect("the command runs");
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), err)
    };
    let (code, err) = limited();
    assert_eq!(code, Some(1), "{err}");
    assert!(
        err.contains("failed: e/model[seed=") && err.contains(": it took longer than it may"),
        "{err}"
    );
    assert_eq!(checkpoints(folder), 2);
    said(folder, &["exec", "e.ivx"]);
    assert_eq!(checkpoints(folder), 0);
}

#[test]
fn what_happens_is_told_to_programs() {
    let folder = project(TRAINING);
    let folder = folder.path();
    let run = ivx(folder, &["exec", "e.ivx", "--format", "json"]).output().expect("it runs");
    let out = String::from_utf8_lossy(&run.stdout).into_owned();
    let event = |line: &str| -> serde_json::Value { serde_json::from_str(line).expect(line) };
    let events: Vec<serde_json::Value> = out.lines().map(event).collect();
    let of = |kind: &str| events.iter().filter(|event| event["event"] == kind).count();
    assert_eq!((of("planned"), of("finished"), of("ended")), (1, 6, 1), "{out}");
    assert_eq!(events.last().expect("there are some")["executed"], 6);
    let told = events.iter().find(|event| event["event"] == "told").expect("trainings tell");
    assert_eq!(told["of"], 60_000);
    assert!(told["words"].as_str().is_some_and(|words| words.starts_with("loss ")), "{told}");
    assert!(run.stderr.is_empty(), "{}", String::from_utf8_lossy(&run.stderr));
}
