//! `ivx exec --watch`: what is edited runs again, whoever saves it and however.

#![cfg(unix)]

mod common;
#[path = "common/appears.rs"]
mod wait;

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;

use serde_json::{Value, json};
use wait::{BOUND, appears};

/// A spec of one claim.
fn spec(level: &str) -> String {
    format!(
        "edition \"2026\"\nexperiment e {{\n    param level: Float = {level}\n    claim \"low\" : level < 2.0\n}}\n"
    )
}

/// A command that watches, and the lines it says.
struct Watching {
    child: Child,
    lines: Receiver<String>,
}

impl Watching {
    fn start(folder: &Path, args: &[&str]) -> Self {
        let mut ivx = common::ivx(folder, &[&["exec", "e.ivx", "--watch"], args].concat());
        fs::create_dir_all(folder.join("tmp")).expect("folders can be made");
        ivx.env("TMPDIR", folder.join("tmp"));
        let mut child =
            ivx.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
        let out = BufReader::new(child.stdout.take().expect("it is piped"));
        let (tell, lines) = channel();
        thread::spawn(move || {
            out.lines().map_while(Result::ok).try_for_each(|line| tell.send(line))
        });
        Self { child, lines }
    }

    fn line(&self) -> String {
        match self.lines.recv_timeout(BOUND) {
            Ok(line) => line,
            Err(RecvTimeoutError::Timeout) => panic!("nothing more is said"),
            Err(RecvTimeoutError::Disconnected) => panic!("it has ended"),
        }
    }

    /// What is said until a line of which this is true, with that.
    fn until(&self, is_last: impl Fn(&str) -> bool) -> Vec<String> {
        let mut said = vec![self.line()];
        while !said.last().is_some_and(|line| is_last(line)) {
            said.push(self.line());
        }
        said
    }

    /// The next event of a kind.
    fn event(&self, kind: &str) -> Value {
        let is_that = |line: &str| parse(line)["event"] == kind;
        parse(self.until(is_that).last().expect("there is a last one"))
    }

    /// Asks it to end. Returns its exit code, and what it complained of.
    fn stop(mut self) -> (Option<i32>, String) {
        let sent = Command::new("kill").args(["-INT", &self.child.id().to_string()]).status();
        assert!(sent.expect("`kill` is there").success());
        let code = self.child.wait().expect("it ends").code();
        let mut err = String::new();
        let mut told = self.child.stderr.take().expect("it is piped");
        told.read_to_string(&mut err).expect("it speaks UTF-8");
        (code, err)
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        // It has ended, unless a test failed.
        let _ = self.child.kill();
    }
}

fn parse(line: &str) -> Value {
    serde_json::from_str(line).expect(line)
}

fn put(folder: &Path, name: &str, text: &str) {
    fs::write(folder.join(name), text).expect("files can be written");
}

/// As editors save that want to lose nothing.
fn replace(folder: &Path, name: &str, text: &str) {
    put(folder, "new~", text);
    fs::rename(folder.join("new~"), folder.join(name)).expect("files can be renamed");
}

#[test]
fn what_is_saved_runs_again_and_verdicts_that_moved_are_told() {
    let folder = common::project(&[("e.ivx", &spec("1.0"))]);
    let folder = folder.path();
    let watching = Watching::start(folder, &["--format", "json"]);
    assert_eq!(watching.event("ended")["claims"][0]["outcome"], "holds");
    assert_eq!(watching.event("watching")["files"], 1);

    put(folder, "e.ivx", &spec("3.0"));
    assert_eq!(watching.event("changed")["files"], json!([{ "file": "e.ivx", "how": "changed" }]));
    let moved = json!([{ "experiment": "e", "claim": "low", "before": "holds", "after": "fails" }]);
    assert_eq!(watching.event("moved")["verdicts"], moved);
    watching.event("watching");

    replace(folder, "e.ivx", &spec("1.5"));
    let moved = json!([{ "experiment": "e", "claim": "low", "before": "fails", "after": "holds" }]);
    assert_eq!(watching.event("moved")["verdicts"], moved);
    watching.event("watching");

    // The same bytes are no change, nor is another file beside it; what follows would come second.
    replace(folder, "e.ivx", &spec("1.5"));
    put(folder, "other.ivx", "");
    replace(folder, "e.ivx", &spec("1.25"));
    assert_eq!(watching.event("changed")["files"], json!([{ "file": "e.ivx", "how": "changed" }]));
    assert_eq!(watching.event("moved")["verdicts"], json!([]));
    watching.event("watching");
    assert_eq!(watching.stop(), (Some(130), String::new()));
}

#[test]
fn a_spec_that_is_broken_or_gone_is_waited_for() {
    let folder = common::project(&[("e.ivx", &spec("1.0"))]);
    let folder = folder.path();
    let watching = Watching::start(folder, &["--format", "json"]);
    watching.event("watching");
    replace(folder, "e.ivx", "edition \"2026\"\nexperiment e {\n");
    watching.event("wrong");
    watching.event("watching");
    replace(folder, "e.ivx", &spec("3.0"));
    // What came out before it was broken is what it is compared with.
    assert_eq!(watching.event("moved")["verdicts"][0]["before"], "holds");
    watching.event("watching");

    fs::remove_file(folder.join("e.ivx")).expect("it is there");
    assert_eq!(watching.event("changed")["files"], json!([{ "file": "e.ivx", "how": "gone" }]));
    watching.event("wrong");
    watching.event("watching");
    replace(folder, "e.ivx", &spec("1.0"));
    assert_eq!(watching.event("changed")["files"], json!([{ "file": "e.ivx", "how": "there" }]));
    assert_eq!(watching.event("ended")["claims"][0]["outcome"], "holds");
    watching.event("watching");
    let (code, err) = watching.stop();
    assert_eq!(code, Some(130));
    assert!(err.contains("IVX0101") && err.contains("e.ivx: there is no such file"), "{err}");
}

#[test]
fn files_that_a_spec_names_are_watched_where_they_come_and_go() {
    let text = r#"edition "2026"
include "parts/low.ivx"
experiment f {
    let numbers = load_array("data/numbers.json", dims: [x])
    measure first = mean(numbers, over: x)
    claim "small" : first < 2.0
}
"#;
    let folder = common::project(&[("e.ivx", text)]);
    let folder = folder.path();
    let watching = Watching::start(folder, &["--format", "json"]);
    watching.event("wrong");
    watching.event("watching");
    for (name, content) in [("parts", spec("1.0")), ("data", "[1.0, 2.0]".to_owned())] {
        fs::create_dir(folder.join(name)).expect("folders can be made");
        let file = if name == "parts" { "parts/low.ivx" } else { "data/numbers.json" };
        put(folder, file, &content);
    }
    // Whatever it has met meanwhile.
    watching.event("ended");
    assert_eq!(watching.event("watching")["files"], 3);

    replace(folder, "parts/low.ivx", &spec("3.0"));
    let changed = json!([{ "file": "parts/low.ivx", "how": "changed" }]);
    assert_eq!(watching.event("changed")["files"], changed);
    assert_eq!(watching.event("moved")["verdicts"][0]["claim"], "low");
    watching.event("watching");
    replace(folder, "data/numbers.json", "[1.0, 5.0]");
    assert_eq!(watching.event("moved")["verdicts"][0]["claim"], "small");
    watching.event("watching");

    fs::remove_dir_all(folder.join("data")).expect("it is there");
    watching.event("wrong");
    watching.event("watching");
    fs::create_dir(folder.join("data")).expect("folders can be made");
    replace(folder, "data/numbers.json", "[1.0]");
    assert_eq!(watching.event("moved")["verdicts"][0]["after"], "holds");
    watching.event("watching");
    assert_eq!(watching.stop().0, Some(130));
}

/// The first program is done, the second waits.
const PATIENT: &str = r#"edition "2026"
experiment e {
    axis i = 0..2
    let run = command("sh", args: ["-c", "[ $1 = 0 ] || [ -e ../../go ] || { echo > ../../began; sleep 600; }; echo $1", "sh", i], stdout: "o.json")
    measure x = read_scalar(run, "o.json")
}
"#;

#[test]
fn a_change_stops_a_run_and_the_next_one_goes_on_from_there() {
    let folder = common::project(&[("e.ivx", PATIENT)]);
    let folder = folder.path();
    let watching = Watching::start(folder, &["--format", "json", "--jobs", "2"]);
    let is_done =
        |line: &str| parse(line)["address"] == "e/run[i=0]" && parse(line)["event"] == "finished";
    watching.until(is_done);
    appears(&folder.join("began"));
    put(folder, "go", "");
    replace(folder, "e.ivx", &PATIENT.replace("measure x", "measure y"));
    watching.event("stopped");
    watching.event("changed");
    let is_known =
        |line: &str| parse(line)["address"] == "e/run[i=0]" && parse(line)["event"] == "hit";
    watching.until(is_known);
    assert_eq!(watching.event("ended")["failed"], 0);
    watching.event("watching");
    let (code, err) = watching.stop();
    assert_eq!(code, Some(130));
    assert!(err.contains("stopping, since a file has changed"), "{err}");
}

#[test]
fn ctrl_c_ends_a_run_that_is_watched() {
    let folder = common::project(&[("e.ivx", PATIENT)]);
    let folder = folder.path();
    let watching = Watching::start(folder, &["--format", "json"]);
    appears(&folder.join("began"));
    assert_eq!(watching.stop().0, Some(130));
}

#[test]
fn people_are_told_in_plain_lines() {
    let folder = common::project(&[("e.ivx", &spec("1.0"))]);
    let folder = folder.path();
    let watching = Watching::start(folder, &[]);
    let is_watching = |line: &str| line == "watching 1 file: Ctrl-C ends";
    watching.until(is_watching);
    replace(folder, "e.ivx", &spec("3.0"));
    let said = watching.until(is_watching);
    assert_eq!(said[..2], ["", "changed: e.ivx"]);
    assert!(said.iter().any(|line| line.contains("nodes executed")), "{said:?}");
    let end = said.len() - 3;
    assert_eq!(said[end..][..2], ["1 verdict moved:", "  holds → fails  e: low"]);
    replace(folder, "e.ivx", &spec("3.5"));
    assert!(watching.until(is_watching).iter().any(|line| line == "no verdict moved"));
    assert_eq!(watching.stop(), (Some(130), String::new()));
}

#[test]
fn a_spec_that_was_never_there_is_not_waited_for() {
    let folder = common::project(&[]);
    let said = common::ivx(folder.path(), &["exec", "e.ivx", "--watch"]).output().expect("it runs");
    assert_eq!(said.status.code(), Some(2));
}
