//! Several processes on one store, some of them killed.
//!
//! The test binary starts itself: a child runs one test of this file with its part in the
//! environment, and does nothing when it is run as a test.

#![expect(clippy::unwrap_used, reason = "a failure of the set-up fails the test")]

use std::env;
use std::fs;
use std::io::{self, BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Instant;

use ivx_cache::{
    Cache, Committed, Digest, Fetched, History, Provenance, Record, Run, Sweep, Wanted, check,
    sweep,
};
use tempfile::TempDir;

const ROOT: &str = "IVX_CACHE_TEST_ROOT";

fn child(test: &str, root: &Path) -> Child {
    Command::new(env::current_exe().unwrap())
        .args(["--exact", test, "--nocapture"])
        .env(ROOT, root)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap()
}

/// The numbers that a child says, until it ends.
fn said(child: &mut Child) -> impl Iterator<Item = u32> + use<> {
    let lines = BufReader::new(child.stdout.take().unwrap()).lines().map_while(Result::ok);
    lines.filter_map(|line| line.strip_prefix("said ")?.parse().ok())
}

fn say(n: u32) {
    // Not `println!`: the harness would hold it back. It may have begun a line.
    let mut out = io::stdout();
    writeln!(out, "\nsaid {n}").unwrap();
    out.flush().unwrap();
}

/// Output `n`; every third is an object.
fn bytes(n: u32) -> Vec<u8> {
    n.to_le_bytes().repeat(if n.is_multiple_of(3) { 2000 } else { 5 })
}

fn key(n: u32) -> Digest {
    Digest::of(&n.to_le_bytes())
}

fn add(cache: &mut Cache, n: u32) -> Committed {
    let output = cache.objects().put(&bytes(n)).unwrap();
    let provenance = Provenance {
        op: "f@1".into(),
        node: format!("e/f[{n}]"),
        inputs: vec![key(n + 1)],
        explanation: "op f@1\n".repeat(20),
        library: "l".into(),
        millis: 1,
    };
    cache.commit(Record { key: key(n), platform: "x".into(), output, provenance }).unwrap()
}

fn assert_holds(cache: &Cache, n: u32) {
    let record = cache.lookup(&key(n)).unwrap_or_else(|| panic!("record {n} was lost"));
    let found = cache.objects().read(&record.output).unwrap();
    assert_eq!(found, Fetched::Bytes(bytes(n).into()), "output {n}");
}

#[test]
fn child_that_writes_until_killed() {
    let Some(root) = env::var_os(ROOT) else {
        return;
    };
    let mut cache = Cache::open(root.as_ref(), "x").unwrap();
    let first = u32::try_from(cache.records().count()).unwrap();
    for n in first.. {
        add(&mut cache, n);
        if n % 4 == 3 {
            cache.sync().unwrap();
            say(n);
        }
    }
}

#[test]
fn a_killed_writer_loses_nothing_that_it_synced() {
    let root = tempfile::tempdir().unwrap();
    for round in 1..=6 {
        let mut writer = child("child_that_writes_until_killed", root.path());
        let mut said = said(&mut writer);
        let known: Vec<_> = said.by_ref().take(3 * round).collect();
        assert_eq!(known.len(), 3 * round);
        writer.kill().unwrap();
        let last = said.last().unwrap_or(known[known.len() - 1]);
        writer.wait().unwrap();
        let cache = Cache::open(root.path(), "x").unwrap();
        (0..=last).for_each(|n| assert_holds(&cache, n));
        let dangling = cache
            .records()
            .filter(|record| cache.objects().read(&record.output).unwrap() == Fetched::Missing);
        assert_eq!(dangling.count(), 0, "a committed record has its object");
    }
}

#[test]
fn child_that_writes_the_same() {
    let Some(root) = env::var_os(ROOT) else {
        return;
    };
    let mut cache = Cache::open(root.as_ref(), "x").unwrap();
    for n in 0..60 {
        add(&mut cache, n);
    }
    cache.close().unwrap();
}

#[test]
fn processes_that_write_the_same_agree() {
    let root = tempfile::tempdir().unwrap();
    let writers: Vec<_> =
        (0..3).map(|_| child("child_that_writes_the_same", root.path())).collect();
    for writer in writers {
        assert!(writer.wait_with_output().unwrap().status.success());
    }
    let mut cache = Cache::open(root.path(), "x").unwrap();
    assert_eq!(cache.troubles(), []);
    (0..60).for_each(|n| assert_holds(&cache, n));
    let stats = cache.stats().unwrap();
    assert_eq!((stats.records, stats.objects), (60, 20));
}

#[test]
fn child_that_locks() {
    let Some(root) = env::var_os(ROOT) else {
        return;
    };
    let mut cache = Cache::open(root.as_ref(), "x").unwrap();
    let _lock = cache.try_lock(&key(0)).unwrap().expect("nobody else has it");
    say(0);
    io::stdin().read_line(&mut String::new()).unwrap();
}

#[test]
fn a_lock_excludes_other_processes_and_dies_with_its_own() {
    let root = tempfile::tempdir().unwrap();
    let mut holder = child("child_that_locks", root.path());
    assert_eq!(said(&mut holder).next(), Some(0));
    let mut cache = Cache::open(root.path(), "x").unwrap();
    assert!(cache.try_lock(&key(0)).unwrap().is_none());
    holder.kill().unwrap();
    holder.wait().unwrap();
    assert!(cache.try_lock(&key(0)).unwrap().is_some());
}

#[test]
fn child_that_sweeps() {
    let Some(root) = env::var_os(ROOT) else {
        return;
    };
    say(0);
    let wanted = |_: &[Run]| Wanted { since: Some(u64::MAX), ..Wanted::default() };
    sweep(root.as_ref(), Sweep::Wet, wanted).unwrap();
}

/// A store of 150 records, 50 of them with objects, in three journals; a kept run used every
/// second, the other run all.
fn store_to_sweep() -> TempDir {
    let root = tempfile::tempdir().unwrap();
    for third in 0..3 {
        let mut cache = Cache::open(root.path(), "x").unwrap();
        for n in third * 50..third * 50 + 50 {
            add(&mut cache, n);
        }
        cache.checkpoints().save(&key(third), b"state").unwrap();
        cache.close().unwrap();
    }
    let cache = Cache::open(root.path(), "x").unwrap();
    cache.note_run(1, (0..150).map(key).collect(), "all").unwrap();
    let kept = cache.note_run(2, (0..150).step_by(2).map(key).collect(), "even").unwrap();
    let history = History::open(root.path()).unwrap();
    history.keep(history.runs.iter().find(|run| run.name == kept).unwrap()).unwrap();
    root
}

/// A copy of a store, made faster than the store was: nothing is synced.
fn copy(store: &TempDir) -> TempDir {
    fn copy_folder(from: &Path, to: &Path) {
        for entry in fs::read_dir(from).unwrap() {
            let entry = entry.unwrap();
            let to = to.join(entry.file_name());
            if entry.file_type().unwrap().is_dir() {
                fs::create_dir(&to).unwrap();
                copy_folder(&entry.path(), &to);
            } else {
                fs::copy(entry.path(), to).unwrap();
            }
        }
    }
    let root = tempfile::tempdir().unwrap();
    copy_folder(store.path(), root.path());
    root
}

#[test]
fn a_sweep_that_is_killed_anywhere_leaves_a_correct_store() {
    let store = store_to_sweep();
    let root = copy(&store);
    let mut whole = child("child_that_sweeps", root.path());
    let mut words = said(&mut whole);
    assert_eq!(words.next(), Some(0));
    let began = Instant::now();
    assert!(whole.wait().unwrap().success());
    let took = began.elapsed();

    for i in 0..12 {
        let root = copy(&store);
        let mut sweeper = child("child_that_sweeps", root.path());
        let mut words = said(&mut sweeper);
        assert_eq!(words.next(), Some(0));
        thread::sleep(took * i / 10);
        sweeper.kill().unwrap();
        sweeper.wait().unwrap();

        let found = check(root.path()).unwrap();
        assert_eq!((found.damaged, found.gone), (vec![], 0), "a record has its object");
        let mut cache = Cache::open(root.path(), "x").unwrap();
        assert_eq!(cache.troubles(), []);
        (0..150).step_by(2).for_each(|n| assert_holds(&cache, n));
        let left: Vec<_> = cache.records().map(|record| record.key).collect();
        (1..150).filter(|n| left.contains(&key(*n))).for_each(|n| assert_holds(&cache, n));
        drop(cache);

        let wanted = |_: &[Run]| Wanted { since: Some(u64::MAX), ..Wanted::default() };
        let swept = sweep(root.path(), Sweep::Wet, wanted).unwrap();
        assert_eq!(swept.troubles, []);
        let cache = Cache::open(root.path(), "x").unwrap();
        let stats = cache.stats().unwrap();
        // Each sixth of the 150 is even and an object.
        assert_eq!((stats.records, stats.objects, stats.checkpoints), (75, 25, 0));
        assert_eq!((stats.runs, stats.kept_runs), (1, 1));
    }
}
