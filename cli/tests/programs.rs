//! Programs as nodes, where they depend on the process that runs them.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

fn project(spec: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("temporary folders can be made");
    for name in [".ivx", "tmp", "one", "two"] {
        fs::create_dir(folder.path().join(name)).expect("the folder is empty");
    }
    let text = format!("edition \"2026\"\nexperiment e {{\n{spec}\n}}\n");
    fs::write(folder.path().join("e.ivx"), text).expect("files can be written");
    folder
}

fn ivx(folder: &Path) -> Command {
    let mut ivx = Command::new(env!("CARGO_BIN_EXE_ivx"));
    ivx.args(["exec", "e.ivx"]).current_dir(folder).env_remove("IVX_CACHE");
    ivx.env("TMPDIR", folder.join("tmp"));
    ivx
}

/// How many nodes a run executes, with one variable set.
#[track_caller]
fn executed(folder: &Path, variable: Option<(&str, &str)>) -> usize {
    let mut ivx = ivx(folder);
    ivx.envs(variable);
    let output = ivx.output().expect("the command runs");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    let line = said.lines().find(|line| line.contains("nodes executed")).expect("exec says it");
    line.split(' ').next().and_then(|n| n.parse().ok()).expect("the line begins with the number")
}

#[test]
fn an_inherited_variable_counts_by_its_value() {
    let folder = project(
        "measure m = read_scalar(command(\"sh\", args: [\"-c\", \"echo ${N-7}\"], \
         env: [inherited(\"N\")], stdout: \"n\"), \"n\")",
    );
    let folder = folder.path();
    let results = || fs::read_to_string(folder.join("results/e/results.ron")).expect("written");
    assert_eq!(executed(folder, Some(("N", "1"))), 2);
    assert_eq!(executed(folder, Some(("N", "1"))), 0);
    assert_eq!(executed(folder, Some(("M", "2"))), 2, "without it");
    assert!(results().contains("7.0"));
    assert_eq!(executed(folder, Some(("N", "3"))), 2);
    assert!(results().contains("3.0"));
    assert_eq!(executed(folder, Some(("N", "1"))), 0, "both are known");
}

#[test]
fn a_program_counts_by_its_bytes_and_not_by_its_place() {
    let folder = project("measure m = read_scalar(command(\"tool\", stdout: \"n\"), \"n\")");
    let folder = folder.path();
    let write = |place: &str, script: &str| {
        let path = folder.join(place).join("tool");
        fs::write(&path, format!("#!/bin/sh\n{script}\n")).expect("files can be written");
        fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("it is ours");
    };
    let with = |place: &str| {
        let search = format!("{}:/usr/bin:/bin", folder.join(place).display());
        executed(folder, Some(("PATH", &search)))
    };
    write("one", "echo 1");
    write("two", "echo 1");
    assert_eq!(with("one"), 2);
    assert_eq!(with("two"), 0);
    write("two", "echo 1.0");
    assert_eq!(with("two"), 2, "another program, the output of which is written otherwise");
    write("two", "echo  1.0");
    assert_eq!(with("two"), 1, "another program, the output of which is the same");
}

/// A program that says who it is, and sleeps with another.
const SLEEPS: &str = "measure m = read_scalar(command(\"sh\", \
     args: [\"-c\", \"echo $$ > ../../pid; sleep 1000 & sleep 1000\"], stdout: \"n\"), \"n\")";

fn wait_for(what: &dyn Fn() -> bool) {
    assert!((0..2000).any(|_| {
        sleep(Duration::from_millis(10));
        what()
    }));
}

/// Who the program is; nobody before it said so.
fn pid(folder: &Path) -> String {
    fs::read_to_string(folder.join("pid")).unwrap_or_default().trim().to_owned()
}

/// Whether no process of the program's group is left.
fn is_gone(pid: &str) -> bool {
    let processes = fs::read_dir("/proc").expect("processes are listed").flatten();
    let stats = processes.filter_map(|entry| fs::read_to_string(entry.path().join("stat")).ok());
    // Behind the name in brackets: state, parent, group. Zombies wait for whoever is to reap them.
    let of_group = |stat: String| {
        let fields: Vec<&str> =
            stat.rsplit_once(") ").map_or(stat.as_str(), |(_, rest)| rest).split(' ').collect();
        fields[0] != "Z" && fields.get(2) == Some(&pid)
    };
    !stats.into_iter().any(of_group)
}

#[test]
fn a_killed_run_leaves_no_program() {
    let folder = project(SLEEPS);
    let folder = folder.path();
    let mut run = ivx(folder);
    let mut run = run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    wait_for(&|| !pid(folder).is_empty());
    assert!(!is_gone(&pid(folder)));
    run.kill().expect("the command can be killed");
    run.wait().expect("the command ends");
    wait_for(&|| is_gone(&pid(folder)));
}

#[test]
fn a_second_interruption_ends_programs_and_leaves_nothing() {
    let folder = project(SLEEPS);
    let folder = folder.path();
    let mut run = ivx(folder);
    let run = run.stdout(Stdio::null()).stderr(Stdio::null());
    let mut run = run.spawn().expect("the command starts");
    wait_for(&|| !pid(folder).is_empty());
    let mut ended = false;
    for _ in 0..2000 {
        let signal = Command::new("kill").args(["-INT", &run.id().to_string()]).status();
        assert!(signal.expect("`kill` is there").success());
        sleep(Duration::from_millis(10));
        if let Some(status) = run.try_wait().expect("it can be asked") {
            assert_eq!(status.code(), Some(130));
            ended = true;
            break;
        }
    }
    assert!(ended);
    wait_for(&|| is_gone(&pid(folder)));
    assert_eq!(fs::read_dir(folder.join("tmp")).expect("it is there").count(), 0);
}
