//! Nodes on workers that share a store with the run: the same results, whatever dies meanwhile.

#![cfg(target_os = "linux")]

mod common;

use std::fs;
use std::io::Read as _;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Longer than anything takes here on a busy machine.
const BOUND: Duration = Duration::from_mins(2);

/// Models, which are objects, and programs that write down that they run and wait until they may end.
fn project(then: &str) -> tempfile::TempDir {
    let folder = common::project(&[]);
    let root = folder.path().display();
    let script = format!(
        "echo $1 >> {root}/began; until [ -e {root}/go ]; do sleep 0.05; done; {then} echo $1"
    );
    let spec = format!(
        r#"edition "2026"
experiment e {{
    axis seed = 0..3
    axis i = 0..6
    let data = sample(sinusoids(), n: 10)
    let model = train(ensemble(map_estimate(net: mlp(hidden: [48, 48])), members: 2), on: data, steps: 50)
    let run = command("sh", args: ["-c", "{script}", "sh", i], stdout: "o.json")
    measure spread = mean(std(predict(model, at: grid(-1.0, 1.0, points: 11)), over: member), over: x)
    measure x = read_scalar(run, "o.json")
    claim "they spread" : mean(spread, over: seed) > 0.0
}}
"#
    );
    fs::write(folder.path().join("e.ivx"), spec).expect("files can be written");
    folder
}

fn ivx(folder: &Path, args: &[&str]) -> Command {
    let mut ivx = common::ivx(folder, args);
    ivx.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    ivx
}

/// A process that does not outlive its test.
struct Tied(Child);

impl Tied {
    fn pid(&self) -> String {
        self.0.id().to_string()
    }

    fn signal(&self, signal: &str) {
        let sent = Command::new("kill").args([signal, &self.pid()]).status();
        assert!(sent.expect("there is kill").success());
    }

    /// How it ended, and what it said.
    fn end(mut self) -> (i32, String) {
        let began = Instant::now();
        while self.0.try_wait().expect("it can be asked").is_none() {
            assert!(began.elapsed() < BOUND, "it does not end");
            sleep(Duration::from_millis(10));
        }
        let (mut out, mut err) = (String::new(), String::new());
        self.0.stdout.take().expect("a pipe").read_to_string(&mut out).expect("text");
        self.0.stderr.take().expect("a pipe").read_to_string(&mut err).expect("text");
        let code = self.0.wait().expect("it has ended").code().expect("no signal ended it");
        (code, out + &err)
    }
}

impl Drop for Tied {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn worker(folder: &Path, n: usize) -> Tied {
    let cache = format!("worker{n}");
    let args = ["worker", "store", "--cpus", "1", "--cache", &cache, "--with-parent"];
    Tied(ivx(folder, &args).spawn().expect("it starts"))
}

const EXEC: [&str; 6] = ["exec", "e.ivx", "--store", "store", "--on", "workers --dead 2s"];

fn start(folder: &Path) -> Tied {
    Tied(ivx(folder, &EXEC).spawn().expect("it starts"))
}

fn run(folder: &Path) -> Output {
    ivx(folder, &EXEC).output().expect("it runs")
}

/// Which programs began, in order.
fn began(folder: &Path) -> Vec<String> {
    let text = fs::read_to_string(folder.join("began")).unwrap_or_default();
    text.lines().map(str::to_owned).collect()
}

fn wait_until(what: impl Fn() -> bool) {
    let start = Instant::now();
    while !what() {
        assert!(start.elapsed() < BOUND, "it does not come to that");
        sleep(Duration::from_millis(10));
    }
}

fn go(folder: &Path) {
    fs::write(folder.join("go"), "").expect("files can be written");
}

fn results(folder: &Path) -> String {
    fs::read_to_string(folder.join("results/e/results.ron")).expect("there are results")
}

/// The results of the same spec in the same place, without workers.
fn alone(folder: &Path) -> String {
    let mut ivx = ivx(folder, &["exec", "e.ivx", "--out", "alone"]);
    let output = ivx.env("IVX_CACHE", folder.join("alone-cache")).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    fs::read_to_string(folder.join("alone/results.ron")).expect("there are results")
}

/// Says that a run came out as one without workers, and that the programs of `n_lost` batches ran once more.
fn same(folder: &Path, n_lost: usize) {
    let ran = began(folder);
    assert!(ran.len() <= 6 + n_lost, "{ran:?}");
    assert_eq!(results(folder), alone(folder));
}

#[test]
fn two_workers_come_to_the_same_results() {
    let folder = project("");
    let folder = folder.path();
    go(folder);
    let workers = [worker(folder, 1), worker(folder, 2)];
    let output = run(folder);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("with 2 threads") || said.contains("with 1 thread"), "{said}");
    same(folder, 0);
    // Who was asked to end does, and then nobody is waited for who has nothing to do.
    for worker in workers {
        worker.signal("-TERM");
        assert_eq!(worker.end().0, 130);
    }
    let output = run(folder);
    assert!(output.status.success());
    assert!(String::from_utf8_lossy(&output.stdout).contains("0 of "), "nothing runs again");
}

#[test]
fn a_worker_that_is_killed_costs_only_what_it_was_at() {
    let folder = project("");
    let folder = folder.path();
    let (first, _second) = (worker(folder, 1), worker(folder, 2));
    let run = start(folder);
    wait_until(|| began(folder).len() >= 2);
    first.signal("-KILL");
    // What it ran ends with it.
    go(folder);
    let (code, said) = run.end();
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("a machine was lost under e/run[i="), "{said}");
    same(folder, 1);
}

#[test]
fn after_its_driver_was_killed_the_next_run_goes_on() {
    let folder = project("");
    let folder = folder.path();
    let _workers = [worker(folder, 1), worker(folder, 2)];
    let run_once = start(folder);
    wait_until(|| began(folder).len() >= 2);
    let killed = Command::new("pkill").args(["-KILL", "-P", &run_once.pid()]).status();
    assert!(killed.expect("there is pkill").success());
    let (code, said) = run_once.end();
    assert_eq!(code, 1, "{said}");
    assert!(said.contains("nobody runs it any more: "), "{said}");
    go(folder);
    let output = run(folder);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    same(folder, 2);
}

#[test]
fn ctrl_c_ends_what_runs_and_the_next_run_goes_on() {
    let folder = project("");
    let folder = folder.path();
    let _workers = [worker(folder, 1), worker(folder, 2)];
    let run_once = start(folder);
    wait_until(|| began(folder).len() >= 2);
    run_once.signal("-INT");
    let (code, said) = run_once.end();
    assert_eq!(code, 130, "{said}");
    go(folder);
    let output = run(folder);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    same(folder, 2);
}

#[test]
fn what_takes_more_memory_than_any_machine_has_is_an_error() {
    // The system kills who takes too much.
    let folder = project("kill -9 $PPID;");
    let folder = folder.path();
    go(folder);
    let _workers = [worker(folder, 1), worker(folder, 2)];
    let output = run(folder);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("MB of memory, and no machine has twice as much"), "{said}");
}

#[test]
fn another_build_is_refused_before_any_work() {
    let folder = project("");
    let (key, other) = ("ab".repeat(32), "cd".repeat(32));
    let args = ["node", "exec", &key, "--store", "store", "--library", &other];
    let output = ivx(folder.path(), &args).output().expect("it runs");
    let (said, told) = (output.stdout, String::from_utf8_lossy(&output.stderr).into_owned());
    assert_eq!(output.status.code(), Some(2), "{told}");
    let said = String::from_utf8_lossy(&said);
    assert!(said.starts_with(&format!(r#"{{"key":"{key}","refused":"the ticket is of library"#)));
    assert!(told.contains(&other) && told.contains("and this is "), "{told}");
    assert!(!folder.path().join("store").exists(), "nothing was done");
}

#[test]
fn nobody_to_hand_nodes_to_is_told_at_once() {
    let folder = project("");
    let check = |args: &[&str], expected: &str| {
        let output = ivx(folder.path(), args).output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(expected), "{said}");
    };
    check(&["exec", "e.ivx", "--on", "workers"], "`--on` needs a store that all machines share");
    check(
        &["exec", "e.ivx", "--on", "sun", "--store", "s"],
        "`ivx-on-sun` is in no folder of PATH",
    );
}
