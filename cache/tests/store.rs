//! The store through its public face: what goes in comes out, for every handle, or not at all.

#![expect(clippy::unwrap_used, reason = "a failure of the set-up fails the test")]

use std::fs;
use std::path::{Path, PathBuf};

use ivx_cache::{
    Cache, CacheError, Committed, Conflict, Digest, Fetched, Output, Provenance, Record, Stats,
    Trouble,
};
use tempfile::TempDir;

/// A record whose key is `[n; 32]`.
fn record(n: u8, platform: &str, output: Output) -> Record {
    Record {
        key: Digest([n; 32]),
        platform: platform.into(),
        output,
        provenance: Provenance {
            op: "train@3".into(),
            node: format!("e/model[seed={n}]"),
            inputs: vec![Digest([0; 32])],
            explanation: format!("op train@3\nseed {n}"),
            library: "feed".into(),
            millis: 40,
        },
    }
}

fn open(root: &TempDir) -> Cache {
    let mut cache = Cache::open(root.path(), "x86").unwrap();
    assert_eq!(cache.troubles(), []);
    cache
}

/// Puts `[n; len]` and commits it under the key `[n; 32]`.
fn add(cache: &mut Cache, n: u8, len: usize) -> Record {
    let record = record(n, "x86", cache.objects().put(&vec![n; len]).unwrap());
    assert_eq!(cache.commit(record.clone()).unwrap(), Committed::New);
    record
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

#[test]
fn a_reopened_store_knows_what_was_committed() {
    let root = tempfile::tempdir().unwrap();
    let mut cache = open(&root);
    let small = add(&mut cache, 1, 10);
    let large = add(&mut cache, 2, 10_000);
    assert_eq!(cache.close().unwrap(), []);

    let cache = open(&root);
    assert_eq!(cache.records().collect::<Vec<_>>(), [&small, &large]);
    assert_eq!(cache.lookup(&Digest([3; 32])), None);
    for (n, len) in [(1, 10), (2, 10_000)] {
        let output = &cache.lookup(&Digest([n; 32])).unwrap().output;
        let bytes = Fetched::Bytes(vec![n; len].into());
        assert_eq!(cache.objects().read(output).unwrap(), bytes);
    }
    let stats = cache.stats().unwrap();
    assert_eq!((stats.records, stats.journals, stats.objects), (2, 1, 1));
    assert_eq!((stats.object_bytes, stats.corrupt), (10_000, 0));
}

#[test]
fn a_run_that_commits_nothing_leaves_no_trace() {
    let root = tempfile::tempdir().unwrap();
    let mut cache = open(&root);
    add(&mut cache, 1, 10);
    cache.hints().note_millis("train@3", 5);
    cache.close().unwrap();
    let before = files(root.path());
    let cache = open(&root);
    assert!(cache.lookup(&Digest([1; 32])).is_some());
    cache.close().unwrap();
    assert_eq!(files(root.path()), before);
}

#[test]
fn handles_see_each_others_records_after_a_refresh() {
    let root = tempfile::tempdir().unwrap();
    let (mut a, mut b) = (open(&root), open(&root));
    for n in 1..4 {
        let from_a = add(&mut a, n, 10);
        let from_b = add(&mut b, n + 100, 10_000);
        assert_eq!(b.lookup(&from_a.key), None);
        a.refresh().unwrap();
        b.refresh().unwrap();
        assert_eq!(b.lookup(&from_a.key), Some(&from_a));
        assert_eq!(a.lookup(&from_b.key), Some(&from_b));
    }
    assert_eq!((a.troubles(), b.troubles()), (vec![], vec![]));
    assert_eq!((a.records().count(), b.records().count()), (6, 6));
}

#[test]
fn the_own_platform_wins_and_then_the_first_by_name() {
    let root = tempfile::tempdir().unwrap();
    let mut cache = open(&root);
    for (platform, len) in [("zarch", 1), ("arm", 2), ("mips", 3)] {
        let output = cache.objects().put(&vec![0; len]).unwrap();
        assert_eq!(cache.commit(record(1, platform, output)).unwrap(), Committed::New);
    }
    let size = |cache: &Cache| cache.lookup(&Digest([1; 32])).unwrap().output.size;
    assert_eq!(size(&cache), 2);
    let output = cache.objects().put(&[0; 4]).unwrap();
    cache.commit(record(1, "x86", output)).unwrap();
    assert_eq!(size(&cache), 4);
    cache.close().unwrap();
    assert_eq!(size(&open(&root)), 4);
    assert_eq!(size(&Cache::open(root.path(), "zarch").unwrap()), 1);
}

#[test]
fn the_first_writer_wins_and_another_result_is_refused() {
    let root = tempfile::tempdir().unwrap();
    let mut cache = open(&root);
    let first = add(&mut cache, 1, 10);
    let mut again = first.clone();
    again.provenance.node = "another".into();
    assert_eq!(cache.commit(again.clone()).unwrap(), Committed::Known);
    assert_eq!(cache.lookup(&first.key), Some(&first));

    again.output = cache.objects().put(&[9; 10]).unwrap();
    let Err(CacheError::Conflict(conflict)) = cache.commit(again) else { panic!("no conflict") };
    let expected = Conflict {
        op: "train@3".into(),
        node: "another".into(),
        key: first.key,
        platform: "x86".into(),
        first: Digest::of(&[1; 10]),
        second: Digest::of(&[9; 10]),
    };
    assert_eq!(*conflict, expected);
    let message = conflict.to_string();
    for part in ["train@3", "another", &expected.first.to_string(), &expected.second.to_string()] {
        assert!(message.contains(part), "{message}");
    }
    cache.close().unwrap();
    assert_eq!(open(&root).records().collect::<Vec<_>>(), [&first]);
}

#[test]
fn two_processes_that_disagree_are_told_apart_when_read() {
    let root = tempfile::tempdir().unwrap();
    let (mut a, mut b) = (open(&root), open(&root));
    let first = add(&mut a, 1, 10);
    add(&mut b, 1, 11);
    a.refresh().unwrap();
    assert!(
        matches!(&a.troubles()[..], [Trouble::Conflict(c)] if c.second == Digest::of(&[1; 11]))
    );
    assert_eq!(a.lookup(&first.key), Some(&first));
    let mut later = Cache::open(root.path(), "x86").unwrap();
    assert!(matches!(&later.troubles()[..], [Trouble::Conflict(_)]));
    assert_eq!(later.lookup(&first.key), Some(&first));
}

#[test]
fn a_damaged_journal_does_not_hide_the_others() {
    let root = tempfile::tempdir().unwrap();
    let (mut a, mut b) = (open(&root), open(&root));
    let from_a = add(&mut a, 1, 10);
    add(&mut a, 2, 10);
    let journal = files(&root.path().join("journal")).pop().unwrap();
    let from_b = add(&mut b, 3, 10);
    drop((a, b));
    let len = fs::metadata(&journal).unwrap().len();
    fs::File::options().write(true).open(&journal).unwrap().set_len(len - 1).unwrap();

    let mut cache = Cache::open(root.path(), "x86").unwrap();
    assert!(
        matches!(&cache.troubles()[..], [Trouble::TornJournal { path, .. }] if *path == journal)
    );
    assert_eq!(cache.records().collect::<Vec<_>>(), [&from_a, &from_b]);
    add(&mut cache, 2, 10);
    drop(cache);
    assert_eq!(Cache::open(root.path(), "x86").unwrap().records().count(), 3);
    assert_eq!(fs::metadata(&journal).unwrap().len(), len - 1, "not ours to touch");
}

#[test]
fn an_action_is_locked_for_one_handle_at_a_time() {
    let root = tempfile::tempdir().unwrap();
    let (mut a, mut b) = (open(&root), open(&root));
    let key = Digest([1; 32]);
    let lock = a.try_lock(&key).unwrap().unwrap();
    assert!(b.try_lock(&key).unwrap().is_none());
    assert!(b.try_lock(&Digest([2; 32])).unwrap().is_some());
    drop(lock);
    assert!(b.try_lock(&key).unwrap().is_some());
}

#[test]
fn another_format_is_refused_with_the_file_named() {
    let root = tempfile::tempdir().unwrap();
    open(&root).close().unwrap();
    let path = root.path().join("version");
    let version = fs::read(&path).unwrap();
    fs::remove_file(&path).unwrap();
    for bit in 0..version.len() * 8 {
        let mut other = version.clone();
        other[bit / 8] ^= 1 << (bit % 8);
        fs::write(&path, &other).unwrap();
        let error = Cache::open(root.path(), "x86").unwrap_err();
        assert!(matches!(&error, CacheError::Version { path: at, .. } if *at == path), "{error}");
    }
    fs::write(&path, version).unwrap();
    open(&root);
}

#[test]
fn a_disk_that_refuses_is_an_error_with_the_path() {
    let root = tempfile::tempdir().unwrap();
    let cache = open(&root);
    let tmp = root.path().join("tmp");
    fs::remove_dir(&tmp).unwrap();
    fs::write(&tmp, "in the way").unwrap();
    let error = cache.objects().put(&[0; 5000]).unwrap_err();
    assert!(matches!(error, CacheError::Io { path, .. } if path.starts_with(&tmp)));
    assert!(matches!(Cache::open(&tmp, "x86"), Err(CacheError::Io { .. })));
    fs::remove_file(&tmp).unwrap();
    let cache = open(&root);
    assert_eq!(cache.stats().unwrap(), Stats::default());
    cache.objects().put(&[0; 5000]).unwrap();
}

#[test]
fn hints_survive_and_without_them_durations_come_from_the_records() {
    let root = tempfile::tempdir().unwrap();
    let mut cache = open(&root);
    add(&mut cache, 1, 10);
    cache.hints().note_millis("train@3", 80);
    cache.hints().note_millis("argmax@1", 1);
    cache.close().unwrap();

    let mut cache = open(&root);
    // Seeded with the record's 40: (3 · 40 + 80 + 2) / 4 = 50.
    assert_eq!(cache.hints().expected_millis("train@3"), Some(50));
    assert_eq!(cache.hints().expected_millis("argmax@1"), Some(1));
    cache.close().unwrap();

    fs::remove_dir_all(root.path().join("hints.sled")).unwrap();
    let mut cache = open(&root);
    assert_eq!(cache.hints().expected_millis("train@3"), Some(40));
    assert_eq!(cache.close().unwrap(), []);

    fs::write(root.path().join("hints.sled"), "garbage").unwrap();
    let mut cache = open(&root);
    assert_eq!(cache.hints().expected_millis("train@3"), Some(40));
    assert!(matches!(cache.close().unwrap()[..], [Trouble::DamagedHints { .. }]));
    assert_eq!(open(&root).close().unwrap(), []);
}
