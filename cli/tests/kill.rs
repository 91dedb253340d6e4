//! A run that is killed loses nothing that it had done.

mod common;

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const SPEC: &str = r#"edition "2026"

experiment killed {
    axis seed = 0..4
    let data = sample(sinusoids(), n: 10)
    let model = train(ensemble(map_estimate(net: mlp(hidden: [48, 48])), members: 8), on: data, steps: 1_500)
    measure spread = mean(std(predict(model, at: grid(-1.0, 1.0, points: 11)), over: member), over: x)
}
"#;

fn ivx(folder: &Path, command: &str) -> Command {
    common::ivx(folder, &[command, "killed.ivx"])
}

fn said(folder: &Path, command: &str) -> String {
    let output = ivx(folder, command).output().expect("the command runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("the command speaks UTF-8")
}

/// The number before `word`, as in `12 hit`.
fn number(text: &str, word: &str) -> usize {
    let words: Vec<&str> = text.split([' ', '\n', ',']).filter(|word| !word.is_empty()).collect();
    let place = words.windows(2).rposition(|pair| pair[1] == word).expect("the word is there");
    words[place].parse().expect("a number stands before it")
}

fn project() -> tempfile::TempDir {
    common::project(&[("killed.ivx", SPEC)])
}

#[test]
fn completed_nodes_are_not_run_again_and_the_results_are_the_same() {
    let whole = project();
    said(whole.path(), "exec");
    let expected = std::fs::read(whole.path().join("results/killed/results.ron"))
        .expect("results are written");

    let killed = project();
    let mut known = 0;
    for _ in 0..4 {
        let mut run = ivx(killed.path(), "exec");
        let mut child =
            run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the command starts");
        let began = Instant::now();
        // Until a few more nodes are done; a machine too fast for that finishes the run instead.
        while child.try_wait().expect("the child can be asked").is_none()
            && began.elapsed() < Duration::from_secs(20)
        {
            if number(&said(killed.path(), "plan"), "hit") >= known + 4 {
                break;
            }
        }
        child.kill().expect("the child can be killed");
        child.wait().expect("the child ends");
        known = number(&said(killed.path(), "plan"), "hit");
    }
    assert!(known > 0, "something was done before the last kill");

    let last = said(killed.path(), "exec");
    let nodes = number(&last.replace("of ", ""), "nodes");
    assert!(
        last.contains(&format!("{} of {nodes} nodes executed", nodes - known)),
        "{known} were known: {last}"
    );
    let results = std::fs::read(killed.path().join("results/killed/results.ron"))
        .expect("results are written");
    assert!(results == expected, "an interrupted run finds the same");
}

#[test]
fn eight_runs_at_once_do_no_node_twice() {
    let project = project();
    let children: Vec<_> = (0..8)
        .map(|_| {
            ivx(project.path(), "exec")
                .stdout(Stdio::piped())
                .stderr(Stdio::null())
                .spawn()
                .expect("starts")
        })
        .collect();
    let mut executed = 0;
    let mut nodes = 0;
    for child in children {
        let output = child.wait_with_output().expect("the child ends");
        assert!(output.status.success());
        let text = String::from_utf8(output.stdout).expect("the command speaks UTF-8");
        let line = text
            .lines()
            .find(|line| line.contains("nodes executed"))
            .expect("exec says what it executed");
        let mut words = line.split(' ');
        executed += words.next().and_then(|n| n.parse::<usize>().ok()).expect("a number");
        nodes = words.nth(1).and_then(|n| n.parse().ok()).expect("a number");
    }
    assert_eq!(executed, nodes, "they share the work");
}

#[test]
#[cfg(unix)]
fn a_run_stopped_by_hand_keeps_what_it_did() {
    let project = project();
    let child = ivx(project.path(), "exec").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let child = child.expect("the command starts");
    let began = Instant::now();
    while number(&said(project.path(), "plan"), "hit") == 0
        && began.elapsed() < Duration::from_secs(20)
    {
        std::thread::sleep(Duration::from_millis(5));
    }
    let asked = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(asked.expect("signals can be sent").success());
    let output = child.wait_with_output().expect("the child ends");
    // A machine may be fast enough to be done before.
    if output.status.code() != Some(0) {
        assert_eq!(output.status.code(), Some(130));
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(said.contains("stopped: what was executed is kept"), "{said}");
        assert!(!project.path().join("results/killed/results.ron").exists());
        let ran = number(&said.replace("of ", ""), "nodes");
        assert!(ran > 0, "{said}");
    }
    let before = number(&said(project.path(), "plan"), "hit");
    let last = said(project.path(), "exec");
    let nodes = number(&last.replace("of ", ""), "nodes");
    assert!(last.contains(&format!("{} of {nodes} nodes executed", nodes - before)), "{last}");
}
