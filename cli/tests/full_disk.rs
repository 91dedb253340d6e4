//! A cache on a file system of 2 MB: it fills up, says so, and goes on once there is room.

#![cfg(target_os = "linux")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const SPEC: &str = r#"edition "2026"

experiment full {
    axis seed = 0..4
    let data = sample(sinusoids(), n: 10)
    let model = train(ensemble(map_estimate(net: mlp(hidden: [96, 96])), members: 4), on: data, steps: 2)
    measure spread = mean(std(predict(model, at: grid(-1.0, 1.0, points: 11)), over: member), over: x)
}
"#;

/// A small file system, unmounted when dropped.
struct Small(tempfile::TempDir);

impl Small {
    /// `None` where mounting is not permitted.
    fn mount() -> Option<Self> {
        let folder = tempfile::tempdir().expect("temporary folders can be made");
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", "size=2m", "ivx-test"]).arg(folder.path());
        mount.output().is_ok_and(|mounted| mounted.status.success()).then_some(Self(folder))
    }
}

impl Drop for Small {
    fn drop(&mut self) {
        // One that stays is empty memory.
        Command::new("umount").arg(self.0.path()).output().ok();
    }
}

fn exec(project: &Path, cache: &Path) -> Output {
    let mut ivx = Command::new(env!("CARGO_BIN_EXE_ivx"));
    ivx.args(["exec", "full.ivx"]).current_dir(project).env("IVX_CACHE", cache);
    ivx.output().expect("the command runs")
}

/// The numbers in `12 of 34 nodes executed`.
fn executed(output: &Output) -> (usize, usize) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout);
    let line = said.lines().find(|line| line.contains("nodes executed")).expect("a count is told");
    let mut numbers = line.split(' ').filter_map(|word| word.parse().ok());
    (numbers.next().expect("a number"), numbers.next().expect("another"))
}

fn results(project: &Path) -> Vec<u8> {
    fs::read(project.join("results/full/results.ron")).expect("results are written")
}

#[test]
#[expect(clippy::print_stderr, reason = "who runs the tests should know what was not tried")]
fn a_full_file_system_is_told_and_the_run_goes_on_once_there_is_room() {
    let Some(small) = Small::mount() else {
        eprintln!("skipped: mounting a tmpfs is not permitted here");
        return;
    };
    let project = tempfile::tempdir().expect("temporary folders can be made");
    fs::write(project.path().join("full.ivx"), SPEC).expect("files can be written");
    let (_, nodes) = executed(&exec(project.path(), &project.path().join("roomy")));
    let expected = results(project.path());
    fs::remove_dir_all(project.path().join("results")).expect("results can be removed");

    let (cache, filler) = (small.0.path().join("cache"), small.0.path().join("filler"));
    fs::write(&filler, vec![1; 1_200_000]).expect("so much has room");
    let output = exec(project.path(), &cache);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("error: the disk is full: "), "{said}");
    assert!(said.contains(&cache.display().to_string()), "{said}");
    assert!(!project.path().join("results").exists(), "there are no results yet");

    let known = ivx_cache::Cache::open(&cache, &ivx_engine::platform());
    let known = known.expect("the cache is whole").records().count();
    assert!(known > 0, "what had room is kept");
    fs::remove_file(filler).expect("files can be removed");
    let output = exec(project.path(), &cache);
    assert_eq!(executed(&output), (nodes - known, nodes));
    assert!(results(project.path()) == expected, "the results are the same");
}

#[test]
#[expect(clippy::print_stderr, reason = "who runs the tests should know what was not tried")]
fn results_that_have_no_room_leave_those_before() {
    let Some(small) = Small::mount() else {
        eprintln!("skipped: mounting a tmpfs is not permitted here");
        return;
    };
    let (project, elsewhere) = (small.0.path(), tempfile::tempdir());
    let cache = elsewhere.expect("temporary folders can be made");
    fs::write(project.join("full.ivx"), SPEC).expect("files can be written");
    executed(&exec(project, cache.path()));
    let set = || {
        let all = ["results.ron", "run.ron", "report.md", "report.html"];
        all.map(|name| fs::read(project.join("results/full").join(name)).expect("it is written"))
    };
    let mut before = set();
    let filler = project.join("filler");
    let mut n_full = 0;
    for (n, room) in ["n: 11", "n: 12", "n: 13"].iter().zip([40_000, 8_000, 0]) {
        fs::write(project.join("full.ivx"), SPEC.replace("n: 10", n)).expect("it has room");
        let mut rest = vec![1; 2 << 20];
        fs::write(&filler, &rest).expect_err("it has no room");
        let taken = fs::metadata(&filler).expect("it is there").len();
        rest.truncate(usize::try_from(taken).expect("it is small").saturating_sub(room));
        fs::remove_file(&filler).expect("files can be removed");
        // What is on the way to the disk may take a block or two that were free a moment ago.
        while fs::write(&filler, &rest).is_err() {
            rest.truncate(rest.len().saturating_sub(4096));
        }
        let output = exec(project, cache.path());
        fs::remove_file(&filler).expect("files can be removed");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.success() {
            before = set();
            continue;
        }
        n_full += 1;
        assert_eq!(output.status.code(), Some(3), "{said}");
        assert!(said.contains("the results that were there are as they were"), "{said}");
        assert!(set() == before, "the set before is whole");
    }
    assert!(n_full > 0, "the disk was full");
    executed(&exec(project, cache.path()));
    assert!(set() != before, "with room there is a new set");
    // The folder, and what is there for as long as it is written.
    assert_eq!(fs::read_dir(project.join("results")).expect("it is there").count(), 1);
}
