//! A run killed at any moment: the next one ends in the same bytes and does nothing twice.
//!
//! `IVX_KILLS=500 cargo test --release -p ivx-cli --test crash -- --nocapture` kills 500 times.

mod common;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// 216 nodes: 64 trainings that keep their progress, and what follows from them.
const SPEC: &str = r#"edition "2026"

experiment crash {
    axis seed = 0..8
    axis ke = { "WCM": wcm(), "MA": ma(), "BCM": bcm() }
    let data = sample(sinusoids(), n: 10)
    let model = train(ensemble(map_estimate(net: mlp(hidden: [32, 32])), members: 8), on: data, steps: 1_500)
    let curve = predict(model, at: grid(-1.0, 1.0, points: 11))
    let decision = argmax(model, ke: ke, among: grid(-2.0, 2.0, points: 101))
    measure spread = mean(std(curve, over: member), over: x)
    measure gap = regret(decision, under: sinusoids())
    measure surprise = hallucination(decision, under: sinusoids())
    figure "gap" = bars(gap, by: ke)
    claim "pessimism is surprised less" : surprise[ke: "WCM"] < surprise[ke: "BCM"]
}
"#;

const FEWEST_NODES: usize = 200;

fn ivx(folder: &Path, args: &[&str]) -> Command {
    let mut ivx = common::ivx(folder, args);
    ivx.arg("crash.ivx");
    ivx
}

fn exec(folder: &Path) -> Command {
    // So often that hardly a training is killed without having kept something.
    ivx(folder, &["exec", "--jobs", "2", "--checkpoint", "0.003s"])
}

fn said(mut command: Command) -> String {
    let output = command.output().expect("the command runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("the command speaks UTF-8")
}

/// The nodes that `ivx plan` calls known.
fn known(folder: &Path) -> BTreeSet<String> {
    let plan = said(ivx(folder, &["plan", "--nodes"]));
    let hits = plan.lines().filter_map(|line| line.strip_prefix("hit "));
    hits.map(|address| address.trim().to_owned()).collect()
}

/// Ends the run, and returns how many nodes there are and which of them were executed.
fn finish(folder: &Path) -> (usize, BTreeSet<String>) {
    let text = said(exec(folder));
    let run = fs::read_to_string(folder.join("results/crash/run.ron")).expect("a run is told of");
    let run: Run = ron::Options::default()
        .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
        .from_str(&run)
        .expect("it is told of in RON");
    let nodes = run.nodes.len();
    let ran = run.nodes.into_iter().filter(|(_, node)| node.fate == "ran");
    let ran: BTreeSet<String> = ran.map(|(address, _)| address).collect();
    assert!(text.contains(&format!("{} of {nodes} nodes executed", ran.len())), "{text}");
    (nodes, ran)
}

#[derive(serde::Deserialize)]
struct Run {
    nodes: std::collections::BTreeMap<String, Node>,
}

#[derive(serde::Deserialize)]
struct Node {
    fate: String,
}

fn project() -> tempfile::TempDir {
    common::project(&[("crash.ivx", SPEC)])
}

/// A folder as it is, to go on in.
fn copy(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).expect("it is a folder").flatten() {
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if from.is_dir() {
            fs::create_dir_all(&to).expect("folders can be made");
            copy(&from, &to);
        } else {
            fs::copy(&from, &to).expect("files can be copied");
        }
    }
}

/// What a run found, but for what varies: file by file.
fn results(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    for name in ["results.ron", "report.md", "figures/gap.svg"] {
        let path = folder.join("results/crash").join(name);
        found.push((name.to_owned(), fs::read(path).expect("a run writes its results")));
    }
    found
}

/// Draws moments that differ from run to run.
struct Moments(u64);

impl Moments {
    fn new() -> Self {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |now| now.as_nanos());
        Self(u64::try_from(now % (1 << 62)).unwrap_or_default() | 1)
    }

    /// One below `span`, by xorshift.
    fn below(&mut self, span: Duration) -> Duration {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        let share = u32::try_from(self.0 >> 40).expect("24 bits are left");
        span.mul_f64(f64::from(share) / f64::from(1 << 24))
    }
}

/// Lets a run go on for a while and kills it. Returns whether it was still running.
fn kill(mut run: Child, after: Duration) -> bool {
    let started = Instant::now();
    while started.elapsed() < after {
        if run.try_wait().expect("the child can be asked").is_some() {
            return false;
        }
        std::thread::sleep(Duration::from_micros(200).min(after));
    }
    run.kill().expect("the child can be killed");
    !run.wait().expect("the child ends").success()
}

#[test]
#[expect(clippy::print_stderr, reason = "500 kills take a while, and are counted")]
fn a_run_killed_at_any_moment_ends_in_the_same_bytes() {
    let asked = std::env::var("IVX_KILLS").ok().map(|n| n.parse().expect("a number of kills"));
    let (wanted, mut moments) = (asked.unwrap_or(6_usize), Moments::new());
    let whole = project();
    let began = Instant::now();
    let (nodes, ran) = finish(whole.path());
    let took = began.elapsed();
    assert!(nodes >= FEWEST_NODES && ran.len() == nodes, "{} of {nodes}", ran.len());
    let expected = results(whole.path());

    let (mut kills, mut kept, mut killed, mut before) = (0, 0, project(), BTreeSet::new());
    let mut known_sum = 0;
    while kills < wanted {
        let mut run = exec(killed.path());
        let run = run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
        if !kill(run, moments.below(took / 3)) {
            // It was done before. From the beginning, then.
            assert!(results(killed.path()) == expected, "after {kills} kills");
            (killed, before) = (project(), BTreeSet::new());
            continue;
        }
        kills += 1;
        let checkpoints = fs::read_dir(killed.path().join(".ivx/cache/checkpoints"));
        kept += checkpoints.map_or(0, Iterator::count);
        let known = known(killed.path());
        assert!(known.is_superset(&before), "kill {kills} lost {:?}", before.difference(&known));
        let ended = tempfile::tempdir().expect("temporary folders can be made");
        copy(killed.path(), ended.path());
        let (_, ran) = finish(ended.path());
        let twice: Vec<_> = ran.intersection(&known).collect();
        assert!(twice.is_empty(), "kill {kills}: known, and executed again: {twice:?}");
        assert_eq!(ran.len() + known.len(), nodes, "kill {kills}");
        assert!(results(ended.path()) == expected, "kill {kills} changed the results");
        known_sum += known.len();
        before = known;
        if kills % 50 == 0 {
            eprintln!("{kills} kills, {known_sum} nodes known after them, {kept} checkpoints");
        }
    }
    assert!(known_sum > 0 && kept > 0, "{known_sum} nodes were known, {kept} checkpoints kept");
}
