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
