//! Looking at a store without changing it.

#![expect(clippy::unwrap_used, reason = "a failure of the set-up fails the test")]

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use ivx_cache::{
    Cache, CacheError, Digest, Fetched, Output, Provenance, Record, Sweep, Wanted, sweep,
};

fn add(cache: &mut Cache, n: u8, output: Output) {
    let provenance = Provenance {
        op: "f@1".into(),
        node: format!("e/f[{n}]"),
        inputs: vec![],
        explanation: "op f@1".into(),
        library: "l".into(),
        millis: 1,
    };
    cache
        .commit(Record { key: Digest([n; 32]), platform: "x86".into(), output, provenance })
        .unwrap();
}

/// Everything below a folder, with what is in files.
fn contents(folder: &Path) -> Vec<(PathBuf, Option<Vec<u8>>)> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let is_folder = path.is_dir();
        all.push((path.clone(), (!is_folder).then(|| fs::read(&path).unwrap())));
        if is_folder {
            all.extend(contents(&path));
        }
    }
    all.sort();
    all
}

#[test]
fn a_store_that_is_not_there_is_empty_and_stays_away() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("cache");
    let mut cache = Cache::look(&root, "x86").unwrap();
    cache.refresh().unwrap();
    assert_eq!((cache.records().count(), cache.troubles()), (0, vec![]));
    assert_eq!(cache.written().unwrap().len(), 0);
    drop(cache);
    assert!(!root.exists());
}

#[test]
fn a_look_finds_everything_and_changes_nothing() {
    let root = tempfile::tempdir().unwrap();
    let mut cache = Cache::open(root.path(), "x86").unwrap();
    let output = cache.objects().put(&[7; 5000]).unwrap();
    add(&mut cache, 1, output.clone());
    cache.close().unwrap();
    // As on a disk that was only copied in part.
    for gone in ["locks", "tmp", "corrupt", "checkpoints"] {
        fs::remove_dir(root.path().join(gone)).unwrap();
    }
    let before = contents(root.path());
    let cache = Cache::look(root.path(), "x86").unwrap();
    assert_eq!(cache.lookup(&Digest([1; 32])).unwrap().output, output);
    assert_eq!(cache.objects().read(&output).unwrap(), Fetched::Bytes([7; 5000].into()));
    assert!(matches!(
        sweep(root.path(), Sweep::Wet, |_| Wanted::default()),
        Err(CacheError::Busy { .. })
    ));
    drop(cache);
    let after = contents(root.path());
    // The sweep made its folders; the look made none.
    assert!(before.iter().all(|entry| after.contains(entry)));
    fs::write(root.path().join("other"), "").unwrap();
    fs::remove_file(root.path().join("version")).unwrap();
    fs::write(root.path().join("version"), "ivx cache 99\n").unwrap();
    assert!(matches!(Cache::look(root.path(), "x86"), Err(CacheError::Version { .. })));
}

#[test]
fn records_are_as_old_as_their_journals() {
    let root = tempfile::tempdir().unwrap();
    let started = SystemTime::now();
    for n in [3, 1, 2] {
        let mut cache = Cache::open(root.path(), "x86").unwrap();
        for n in [n, n + 10] {
            let output = cache.objects().put(&[n]).unwrap();
            add(&mut cache, n, output);
        }
        cache.close().unwrap();
    }
    let written = Cache::look(root.path(), "x86").unwrap().written().unwrap();
    let mut keys: Vec<_> = written.keys().map(|(key, _)| key.0[0]).collect();
    keys.sort_by_key(|n| (written[&(Digest([*n; 32]), "x86".to_owned())], *n));
    assert_eq!(keys, [3, 13, 1, 11, 2, 12]);
    let now = SystemTime::now();
    assert!(written.values().all(|begun| (started..=now).contains(begun)));
}
