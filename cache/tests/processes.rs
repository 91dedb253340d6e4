//! Several processes on one store, some of them killed.
//!
//! The test binary starts itself: a child runs one test of this file with its part in the
//! environment, and does nothing when it is run as a test.

#![expect(clippy::unwrap_used, reason = "a failure of the set-up fails the test")]

use std::env;
use std::io::{self, BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use ivx_cache::{Cache, Committed, Digest, Fetched, Provenance, Record};

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
