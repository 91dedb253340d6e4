//! What `ivx cache gc`, `verify` and `rebuild` leave of a project's cache.

mod common;

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, SystemTime};

use common::ivx;

const SPEC: &str = r#"edition "2026"

experiment swept {
    param width: Int = 40
    axis seed = 0..3
    let data = sample(sinusoids(), n: 10)
    let model = train(map_estimate(net: mlp(hidden: [width, 40])), on: data, steps: 10)
    measure value = mean(predict(model, at: grid(-1.0, 1.0, points: 5)), over: x)
}
"#;

const LONG: &str = r#"edition "2026"

experiment long {
    axis seed = 0..60
    let data = sample(sinusoids(), n: 20)
    let model = train(map_estimate(net: mlp(hidden: [64, 64])), on: data, steps: 3_000)
    measure value = mean(predict(model, at: grid(-1.0, 1.0, points: 5)), over: x)
}
"#;

fn project() -> tempfile::TempDir {
    common::project(&[("swept.ivx", SPEC), ("specs/long.ivx", LONG)])
}

/// What a command says, complaints last.
#[track_caller]
fn said(folder: &Path, args: &[&str], code: i32) -> String {
    let output = ivx(folder, args).output().expect("the command runs");
    let text = [output.stdout, output.stderr].concat();
    let text = String::from_utf8(text).expect("the command speaks UTF-8");
    assert_eq!(output.status.code(), Some(code), "{args:?}: {text}");
    text
}

/// The number before `word`.
#[track_caller]
fn number(text: &str, word: &str) -> usize {
    let words: Vec<&str> = text.split([' ', '\n', ',']).collect();
    let place = words.windows(2).position(|pair| pair[1].trim_end_matches('s') == word);
    let place = place.unwrap_or_else(|| panic!("no {word}: {text}"));
    words[place].parse().expect("a number stands before it")
}

/// How many nodes a run of the spec executes, with this width.
#[track_caller]
fn executed(folder: &Path, width: &str) -> usize {
    let set = format!("swept.width={width}");
    number(&said(folder, &["exec", "swept.ivx", "--set", &set], 0), "of")
}

#[track_caller]
fn removed(folder: &Path, args: &[&str]) -> usize {
    let args = [&["cache", "gc"], args].concat();
    let dry = said(folder, &[&args[..], &["--dry-run"]].concat(), 0);
    let wet = said(folder, &[&args[..], &["--yes"]].concat(), 0);
    assert_eq!(dry.replace("would remove", "removed").replace("would free", "freed"), wet);
    number(&wet, "record")
}

fn cached(folder: &Path, what: &str) -> Vec<PathBuf> {
    let entries = |folder: &Path| {
        let entries = fs::read_dir(folder).expect("it is there");
        entries.map(|entry| entry.expect("it is listed").path()).collect::<Vec<_>>()
    };
    let paths = entries(&folder.join(".ivx/cache").join(what));
    let flat = |path: PathBuf| if path.is_dir() { entries(&path) } else { vec![path] };
    let mut paths: Vec<_> = paths.into_iter().flat_map(flat).collect();
    paths.sort();
    paths
}

fn flip(path: &Path, at: usize) {
    let mut bytes = fs::read(path).expect("it is there");
    bytes[at] ^= 1;
    fs::remove_file(path).expect("it is there");
    fs::write(path, bytes).expect("files can be written");
}

#[test]
fn what_a_sweep_drops_and_only_that_is_executed_again() {
    for limit in [&["--keep-runs", "1"][..], &["--keep-runs", "1", "--older-than", "0s"]] {
        let folder = project();
        let folder = folder.path();
        let nodes = executed(folder, "40");
        let others = executed(folder, "30");
        assert!(0 < others && others < nodes);
        assert_eq!(executed(folder, "40"), 0);
        let gone = removed(folder, limit);
        assert_eq!(gone, others, "of the first run only what the last used stays");
        assert_eq!(executed(folder, "40"), 0);
        assert_eq!(executed(folder, "30"), gone);
    }
}

#[test]
fn without_a_limit_every_result_stays() {
    let folder = project();
    let folder = folder.path();
    executed(folder, "40");
    executed(folder, "30");
    assert_eq!(removed(folder, &[]), 0);
    assert_eq!((executed(folder, "40"), executed(folder, "30")), (0, 0));
}

#[test]
fn age_and_size_are_limits_and_the_last_run_of_each_spec_may_be_chosen() {
    let folder = project();
    let folder = folder.path();
    said(folder, &["exec", "specs/long.ivx"], 0);
    let nodes = executed(folder, "40");
    assert_eq!(removed(folder, &["--older-than", "1h"]), 0);
    assert_eq!(removed(folder, &["--max-size", "1GiB"]), 0);
    assert_eq!(removed(folder, &["--keep-runs", "1", "--max-size", "0B"]), 0);
    let told = said(folder, &["cache", "gc", "--keep-runs", "1", "--max-size", "0B", "--yes"], 0);
    assert!(told.contains("hold more than 0 B"), "{told}");
    // All that the long run used was used before.
    let left: u64 = ["objects", "journal", "runs", "keys", "found"]
        .iter()
        .flat_map(|what| cached(folder, what))
        .map(|path| fs::metadata(path).expect("it is there").len())
        .sum();
    assert!(removed(folder, &["--max-size", &format!("{}B", left / 2)]) > 0);
    assert_eq!(executed(folder, "40"), 0);
    assert!(number(&said(folder, &["exec", "specs/long.ivx"], 0), "of") > 0);
    assert!(removed(folder, &["--older-than", "0s"]) > nodes);
    assert_eq!(executed(folder, "40"), nodes);
}

#[test]
fn locks_are_roots() {
    let folder = project();
    let folder = folder.path();
    said(folder, &["exec", "swept.ivx", "--lock"], 0);
    let others = executed(folder, "30");
    assert_eq!(removed(folder, &["--older-than", "0s"]), others);
    said(folder, &["exec", "swept.ivx", "--locked"], 0);
    assert_eq!((executed(folder, "40"), executed(folder, "30")), (0, others));
    // A lock that can't be understood may need anything.
    fs::write(folder.join("specs/ivx.lock"), "damaged").expect("files can be written");
    let refused = said(folder, &["cache", "gc", "--older-than", "0s", "--yes"], 3);
    assert!(refused.contains("specs/ivx.lock"), "{refused}");
    assert_eq!(executed(folder, "30"), 0);
}

#[test]
fn a_killed_run_is_safe_for_a_week() {
    let folder = project();
    let folder = folder.path();
    let nodes = executed(folder, "40");
    // As if it had been killed before its end.
    for run in cached(folder, "runs") {
        fs::remove_file(run).expect("it is there");
    }
    assert_eq!(removed(folder, &["--keep-runs", "1"]), 0);
    for journal in cached(folder, "journal") {
        let written = SystemTime::now() - Duration::from_hours(8 * 24);
        let journal = File::open(journal).expect("it is there");
        journal.set_modified(written).expect("times can be set");
    }
    assert_eq!(removed(folder, &["--keep-runs", "1"]), nodes);
}

#[test]
fn a_cache_in_use_is_not_swept_and_a_run_beside_sweeps_is_not_harmed() {
    let whole = project();
    said(whole.path(), &["exec", "specs/long.ivx"], 0);
    let results = "results/specs/long/results.ron";
    let expected = fs::read_to_string(whole.path().join(results)).expect("they are written");

    let folder = project();
    let folder = folder.path();
    executed(folder, "40");
    let mut command = ivx(folder, &["exec", "specs/long.ivx"]);
    let mut child = command.stdout(Stdio::null()).spawn().expect("the command starts");
    let (mut n_refused, mut n_swept) = (0, 0);
    while child.try_wait().expect("the child can be asked").is_none() {
        let gc = ivx(folder, &["cache", "gc", "--older-than", "0s", "--yes"]).output();
        let gc = gc.expect("the command runs");
        let err = String::from_utf8_lossy(&gc.stderr).into_owned();
        if gc.status.success() {
            n_swept += 1;
        } else {
            assert_eq!(gc.status.code(), Some(3));
            // The child may have ended before it could be named.
            let named = format!("process {} (", child.id());
            assert!(err.contains("is in use"), "{err}");
            n_refused += usize::from(err.contains(&named) && err.contains("exec specs/long.ivx"));
        }
    }
    assert!(child.wait().expect("the child ends").success());
    assert!(n_refused > 0, "{n_refused} refused, {n_swept} swept");
    assert!(fs::read_to_string(folder.join(results)).is_ok_and(|found| found == expected));
    if n_swept == 0 {
        let again = said(folder, &["exec", "specs/long.ivx"], 0);
        assert_eq!(number(&again, "of"), 0);
    }
    assert!(said(folder, &["cache", "verify"], 0).contains("nothing is damaged"));
}

#[test]
fn damage_is_found_put_aside_and_made_good() {
    let folder = project();
    let folder = folder.path();
    let nodes = executed(folder, "40");
    let results = folder.join("results/swept/results.ron");
    let expected = fs::read(&results).expect("they are written");
    assert!(said(folder, &["cache", "verify"], 0).contains("nothing is damaged"));
    let objects = cached(folder, "objects");
    assert!(objects.len() >= 3);
    flip(&objects[1], 77);
    flip(&cached(folder, "journal")[0], 30);
    flip(&cached(folder, "runs")[0], 50);
    let told = said(folder, &["cache", "verify"], 1);
    assert_eq!(told.lines().filter(|line| line.starts_with("damaged  ")).count(), 3, "{told}");
    assert!(told.contains("3 damaged") && told.contains("their whole records saved"), "{told}");
    assert!(told.contains("1 record without an object"), "{told}");
    assert!(told.contains(" and 0 runs;"), "{told}");
    let told = said(folder, &["cache", "verify"], 0);
    assert_eq!(number(&told, "record"), nodes - 1, "{told}");
    assert!(said(folder, &["cache", "stats"], 0).contains("3 damaged files put aside"));

    fs::remove_file(&results).expect("it is there");
    assert_eq!(executed(folder, "40"), 1, "the record that was lost");
    assert!(fs::read(&results).is_ok_and(|found| found == expected));
    removed(folder, &[]);
    assert!(said(folder, &["cache", "stats"], 0).contains("0 damaged files put aside"));
}

#[test]
fn what_can_be_lost_is_made_anew() {
    let folder = project();
    let folder = folder.path();
    executed(folder, "40");
    executed(folder, "30");
    assert_eq!(cached(folder, "journal").len(), 2);
    fs::remove_dir_all(folder.join(".ivx/cache/hints.sled")).expect("it is there");
    let told = said(folder, &["cache", "rebuild"], 0);
    assert!(told.contains("of 2 journals are in 1 now"), "{told}");
    assert!(number(&told, "operation") >= 4, "{told}");
    assert_eq!(cached(folder, "journal").len(), 1);
    assert!(folder.join(".ivx/cache/hints.sled/current").exists());
    assert_eq!((executed(folder, "40"), executed(folder, "30")), (0, 0));
}
