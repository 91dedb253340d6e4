//! Worlds of another process, with a shell script in the place of Python; and with Python itself, where `IVX_PYTHON` names
//! one that has gymnasium.

mod common;

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const BOUND: Duration = Duration::from_mins(2);

/// An agent that learns in a world, which is called as `call` says.
fn spec(call: &str, steps: u32) -> String {
    format!(
        r#"edition "2026"
experiment e {{
    axis seed = 0..1
    let how = dqn(net: mlp(hidden: [4]), warm_up: 8, batch: 4)
    let run = learn(how, in: {call}, for: steps({steps}), every: {every}, trials: 2, lanes: 2)
    measure won = mean(run.returns, over: trial)
    measure played = run.played
}}
"#,
        every = steps / 2
    )
}

/// A project whose interpreter lies in it.
fn project() -> tempfile::TempDir {
    let folder =
        common::project(&[("fake.sh", include_str!("../../library/foreign/tests/fake.sh"))]);
    let path = folder.path().join("fake.sh");
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("it is ours");
    folder
}

fn call(folder: &Path, name: &str, rest: &str) -> String {
    format!("gymnasium(\"{name}\", python: \"{}\"{rest})", folder.join("fake.sh").display())
}

fn write(folder: &Path, text: &str) {
    fs::write(folder.join("e.ivx"), text).expect("files can be written");
}

/// The exit code and everything that was said.
fn said(folder: &Path, args: &[&str]) -> (Option<i32>, String) {
    let output = common::ivx(folder, args).output().expect("the command runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout) + &text(&output.stderr))
}

#[track_caller]
fn finds(folder: &Path, args: &[&str], code: i32, parts: &[&str]) {
    let (found, text) = said(folder, args);
    assert_eq!(found, Some(code), "{text}");
    for part in parts {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn a_result_knows_what_the_world_was() {
    let project = project();
    let folder = project.path();
    write(folder, &spec(&call(folder, "plain", ""), 24));
    finds(folder, &["exec", "e.ivx"], 0, &["4 of 4 nodes executed"]);
    write(folder, &spec(&call(folder, "plain", ", time_limit: 50"), 24));
    finds(folder, &["exec", "e.ivx"], 0, &["0 of 4 nodes executed"]);
    // The interpreter lies elsewhere and is another, and says the same.
    let text = fs::read_to_string(folder.join("fake.sh")).expect("it is there");
    let other = folder.join("other.sh");
    fs::write(&other, format!("{text}\n")).expect("files can be written");
    fs::set_permissions(&other, fs::Permissions::from_mode(0o755)).expect("it is ours");
    let there = call(folder, "plain", "").replace("fake.sh", "other.sh");
    write(folder, &spec(&there, 24));
    finds(folder, &["exec", "e.ivx"], 0, &["0 of 4 nodes executed"]);
    // It says that it is another version.
    fs::write(&other, text.replace("changed=0", "changed=2")).expect("files can be written");
    finds(folder, &["exec", "e.ivx"], 0, &["1 of 4 nodes executed"]);
    write(folder, &spec(&call(folder, "plain", ", kwargs: (size: 3)"), 24));
    finds(folder, &["exec", "e.ivx"], 0, &["1 of 4 nodes executed"]);
}

#[test]
fn what_does_not_fit_is_told_before_anything_runs() {
    let project = project();
    let folder = project.path();
    let check = |text: &str, parts: &[&str]| {
        write(folder, text);
        finds(folder, &["check", "e.ivx"], 2, parts);
    };
    let head = "edition \"2026\"\nexperiment e {\n    param n: Int = 3\n    measure m = ";
    let exact = |call: &str| format!("{head}value_iteration(in: {call}, discount: 0.9)\n}}\n");
    check(&exact(&call(folder, "plain", "")), &["this world is no table of states"]);
    check(&exact(&call(folder, "refused", "")), &["there is no such world", "cannot be used with"]);
    check(&exact(&call(folder, "crash", "")), &["exit code 1", "a Traceback"]);
    check(&exact(&call(folder, "mute", ", time_limit: 0.3")), &["within 0.3 s"]);
    let named = call(folder, "plain", ", kwargs: (n: n)");
    check(&exact(&named), &["is not written beside it", "write all arguments here"]);
    check(
        &exact(&call(folder, "plain", ", kwargs: 3")),
        &["`gymnasium.kwargs` is Record, found Int"],
    );
    let part = call(folder, "plain", ", kwargs: (ke: wcm())");
    check(&exact(&part), &["`gymnasium.kwargs` is Record"]);
    let computed = "{ axis id = [\"plain\"]\n measure m = value_iteration(in: gymnasium(id), discount: 0.9) }\n";
    check(&format!("edition \"2026\"\nexperiment e {computed}"), &["named where it is used"]);
}

#[test]
fn a_world_that_fails_is_the_failure_of_its_node() {
    let project = project();
    let folder = project.path();
    write(folder, &spec(&call(folder, "dies", ""), 24));
    finds(folder, &["exec", "e.ivx"], 1, &["`fake.sh` ended with exit code 3", "last\n", "words"]);
    write(folder, &spec(&call(folder, "hangs", ", time_limit: 1"), 24));
    finds(folder, &["exec", "e.ivx"], 1, &["did not answer within 1 s", "waiting"]);
    let _ = fs::remove_file(folder.join("fake.sh.asked"));
    write(folder, &spec(&call(folder, "changed", ""), 24));
    finds(folder, &["exec", "e.ivx"], 1, &["is not what it was when the spec was read"]);
}

/// Whether the interpreter that was started last has ended.
fn is_gone(folder: &Path) -> bool {
    let id = fs::read_to_string(folder.join("fake.sh.pid")).expect("it ran");
    let stat = Path::new("/proc").join(id.trim()).join("stat");
    (0..1000).any(|_| {
        sleep(Duration::from_millis(5));
        fs::read_to_string(&stat).map_or(true, |stat| stat.contains(") Z "))
    })
}

fn start(folder: &Path) -> Child {
    let mut ivx = common::ivx(folder, &["exec", "e.ivx", "--checkpoint", "0s"]);
    ivx.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the command starts")
}

fn kept(folder: &Path) -> bool {
    fs::read_dir(folder.join(".ivx/cache/checkpoints")).is_ok_and(|entries| entries.count() > 0)
}

/// Kills a run when it has kept something, runs it again, and compares what comes out with a whole run of it.
fn killed(text: impl Fn(&Path) -> String, gone: impl Fn(&Path)) {
    let results = |folder: &Path| fs::read(folder.join("results/e/results.ron")).expect("they are");
    let (whole, broken) = (project(), project());
    write(whole.path(), &text(whole.path()));
    finds(whole.path(), &["exec", "e.ivx"], 0, &[]);
    let folder = broken.path();
    write(folder, &text(folder));
    let mut kills = 0;
    for _ in 0..3 {
        let (mut child, began) = (start(folder), Instant::now());
        let ends = |child: &mut Child| child.try_wait().expect("it can be asked").is_some();
        while !(ends(&mut child) || kept(folder) && began.elapsed() > Duration::from_millis(300)) {
            assert!(began.elapsed() < BOUND, "it does not come to that");
            sleep(Duration::from_millis(2));
        }
        kills += i32::from(!ends(&mut child));
        child.kill().expect("it can be killed");
        child.wait().expect("it has ended");
        gone(folder);
    }
    assert!(kills > 0, "it was done before it could be killed");
    finds(folder, &["exec", "e.ivx"], 0, &[]);
    assert!(results(folder) == results(whole.path()), "an interrupted run finds the same");
}

#[test]
fn a_learning_that_is_killed_leaves_nobody_and_goes_on_to_the_same_bytes() {
    killed(|folder| spec(&call(folder, "plain", ""), 160), |folder| assert!(is_gone(folder)));
}

#[test]
fn so_does_one_in_a_world_of_gymnasium() {
    let Ok(python) = std::env::var("IVX_PYTHON") else {
        eprintln!("without IVX_PYTHON, a Python that has gymnasium, nothing is tried here");
        return;
    };
    let call = format!("gymnasium(\"CartPole-v1\", python: {python:?})");
    killed(|_| spec(&call, 20_000), |_| ());
}
