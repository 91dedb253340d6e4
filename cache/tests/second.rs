//! A second store behind a cache: what it has is used, and nothing that is wrong with it is.

#![expect(clippy::unwrap_used, reason = "a failure of the set-up fails the test")]

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use ivx_cache::faulty::{Failure, Faulty};
use ivx_cache::{
    Cache, Committed, Digest, Disk, Fetched, Folder, Mode, Output, Provenance, Record, Second,
    Traffic, Trouble,
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
            inputs: vec![],
            explanation: format!("op train@3\nseed {n}\n"),
            library: "feed".into(),
            millis: 40,
        },
    }
}

fn second(folder: &Path, mode: Mode) -> Second {
    let store = match mode {
        Mode::Read => Folder::open(folder).unwrap(),
        Mode::Write => Folder::create(folder).unwrap(),
    };
    Second::new(Box::new(store), "far".into(), mode).unwrap()
}

/// An empty cache of a platform with a store behind it.
fn cache(platform: &str, folder: &Path, mode: Mode) -> (TempDir, Cache) {
    let root = tempfile::tempdir().unwrap();
    let mut cache = Cache::open(root.path(), platform).unwrap();
    cache.attach(second(folder, mode));
    (root, cache)
}

/// A store in which a cache of platform `x86` has put `[n; len]` under the key `[n; 32]`.
fn store(results: &[(u8, usize)]) -> (TempDir, Vec<Record>) {
    let folder = tempfile::tempdir().unwrap();
    let (_root, mut cache) = cache("x86", folder.path(), Mode::Write);
    let put = |&(n, len): &(u8, usize)| {
        let record = record(n, "x86", cache.objects().put(&vec![n; len]).unwrap());
        assert_eq!(cache.commit(record.clone()).unwrap(), Committed::New);
        record
    };
    let records = results.iter().map(put).collect();
    assert_eq!(cache.close().unwrap(), []);
    (folder, records)
}

fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(self::files(&path));
        } else {
            files.push((path.clone(), fs::read(path).unwrap()));
        }
    }
    files.sort();
    files
}

fn place_of_record(folder: &Path, n: u8, platform: &str) -> PathBuf {
    let key = Digest([n; 32]).to_string();
    folder.join("records").join(&key[..2]).join(format!("{key}-{platform}"))
}

fn place_of_object(folder: &Path, bytes: &[u8]) -> PathBuf {
    let digest = Digest::of(bytes).to_string();
    folder.join("objects").join(&digest[..2]).join(digest)
}

#[test]
fn what_one_cache_puts_there_another_finds_and_keeps() {
    let (folder, records) = store(&[(1, 10), (2, 10_000), (3, 10_000)]);
    let (root, mut cache) = cache("x86", folder.path(), Mode::Read);
    assert_eq!(cache.second().unwrap().n_keys(), 3);
    for record in &records {
        assert_eq!(cache.lookup(&record.key), None);
        assert_eq!(cache.find(&record.key), Some(record));
        assert_eq!(cache.lookup(&record.key), Some(record));
    }
    assert_eq!(cache.find(&Digest([9; 32])), None);
    let read = cache.objects().read(&records[1].output).unwrap();
    assert_eq!(read, Fetched::Bytes(vec![2; 10_000].into()));
    let traffic = Traffic { taken: 3, copied: 1, put: 0 };
    assert_eq!(cache.second().unwrap().traffic(), traffic);
    assert_eq!(cache.close().unwrap(), []);

    // What was asked for and has its bytes is known without the store.
    drop(folder);
    let cache = Cache::open(root.path(), "x86").unwrap();
    assert_eq!(cache.records().collect::<Vec<_>>(), [&records[0], &records[1]]);
    let read = cache.objects().read(&records[1].output).unwrap();
    assert_eq!(read, Fetched::Bytes(vec![2; 10_000].into()));
}

#[test]
fn the_files_are_as_the_format_says() {
    let (folder, records) = store(&[(7, 5), (8, 5000)]);
    assert_eq!(fs::read(folder.path().join("version")).unwrap(), b"ivx store 1\n");
    let found = files(folder.path());
    let large = [8; 5000];
    let expected = [
        place_of_object(folder.path(), &large),
        place_of_record(folder.path(), 7, "x86"),
        place_of_record(folder.path(), 8, "x86"),
        folder.path().join("version"),
    ];
    assert_eq!(found.iter().map(|(path, _)| path).collect::<Vec<_>>(), expected.each_ref());
    assert_eq!(found[0].1, large);
    // A record is a journal of its own, which a cache would read.
    let root = tempfile::tempdir().unwrap();
    drop(Cache::open(root.path(), "x86").unwrap());
    for (i, (_, bytes)) in found[1..3].iter().enumerate() {
        fs::write(root.path().join("journal").join(format!("{i}.log")), bytes).unwrap();
    }
    let cache = Cache::open(root.path(), "x86").unwrap();
    assert_eq!(cache.records().collect::<Vec<_>>(), records.iter().collect::<Vec<_>>());
}

#[test]
fn a_store_that_is_read_is_not_written() {
    let (folder, _) = store(&[(1, 10_000)]);
    let before = files(folder.path());
    let (_root, mut cache) = cache("x86", folder.path(), Mode::Read);
    let new = record(2, "x86", cache.objects().put(&[2; 10_000]).unwrap());
    cache.commit(new).unwrap();
    assert_eq!(cache.close().unwrap(), []);
    assert!(files(folder.path()) == before);
    assert!(Folder::open(&folder.path().join("none")).is_err());
    assert!(!folder.path().join("none").exists());
}

#[test]
fn the_own_platform_comes_first_and_others_are_better_than_none() {
    let (folder, _) = store(&[(1, 10)]);
    let (_root, mut arm) = cache("arm", folder.path(), Mode::Write);
    assert_eq!(arm.find(&Digest([1; 32])).unwrap().platform, "x86");
    let (_root, mut other) = cache("arm", folder.path(), Mode::Write);
    let own = record(1, "arm", other.objects().put(b"arm").unwrap());
    other.commit(own).unwrap();
    assert_eq!(other.close().unwrap(), []);
    for platform in ["arm", "x86"] {
        let (_root, mut cache) = cache(platform, folder.path(), Mode::Read);
        assert_eq!(cache.find(&Digest([1; 32])).unwrap().platform, platform);
    }
    let (_root, mut cache) = cache("mips", folder.path(), Mode::Read);
    assert_eq!(cache.find(&Digest([1; 32])).unwrap().platform, "arm");
}

/// What another cache says of a store whose record 1 is asked for, once something was done to
/// it; it must not use it, nor keep any of it.
#[track_caller]
fn refuses(len: usize, harm: impl FnOnce(&Path), expected: &str) {
    let (folder, records) = store(&[(1, len), (2, len)]);
    harm(folder.path());
    let (root, mut cache) = cache("x86", folder.path(), Mode::Read);
    if let Some(found) = cache.find(&Digest([1; 32])).cloned() {
        assert_eq!(found, records[0], "a record is what it was");
        assert_eq!(cache.objects().read(&found.output).unwrap(), Fetched::Missing);
    }
    let notes = cache.close().unwrap();
    let [Trouble::Store { store, what }] = &notes[..] else { panic!("{notes:?}") };
    assert_eq!(store, "far");
    assert!(what.contains(expected), "{what}");
    let mut cache = Cache::open(root.path(), "x86").unwrap();
    assert_eq!((cache.records().count(), cache.troubles()), (0, vec![]));
    assert_eq!(files(&root.path().join("objects")), []);
    assert_eq!(fs::read_dir(root.path().join("corrupt")).unwrap().count(), 0);
}

/// Replaces a file.
fn write(path: &Path, bytes: &[u8]) {
    fs::remove_file(path).unwrap();
    fs::write(path, bytes).unwrap();
}

#[test]
fn every_record_that_is_not_what_its_name_says_is_refused() {
    let one = |folder: &Path| place_of_record(folder, 1, "x86");
    let two = |folder: &Path| place_of_record(folder, 2, "x86");
    refuses(10, |f| fs::rename(two(f), one(f)).unwrap(), "the record of another key");
    refuses(10, |f| fs::rename(one(f), place_of_record(f, 1, "x87")).unwrap(), "another platform");
    refuses(10, |f| write(&one(f), b""), "damaged");
    refuses(10, |f| write(&one(f), b"ivx journal 1\n"), "damaged");
    for cut in [1, 50, 150] {
        let truncate = |f: &Path| {
            let bytes = fs::read(one(f)).unwrap();
            write(&one(f), &bytes[..bytes.len() - cut]);
        };
        refuses(10, truncate, "damaged");
    }
    for byte in [0, 14, 18, 30, 70, 120] {
        let flip = |f: &Path| {
            let mut bytes = fs::read(one(f)).unwrap();
            bytes[byte] ^= 4;
            write(&one(f), &bytes);
        };
        refuses(10, flip, "damaged");
    }
    let double = |f: &Path| {
        let (first, second) = (fs::read(one(f)).unwrap(), fs::read(two(f)).unwrap());
        write(&one(f), &[&first[..], &second[14..]].concat());
    };
    refuses(10, double, "damaged");
    let giant = |f: &Path| File::create(one(f)).unwrap().set_len(1 << 40).unwrap();
    refuses(10, giant, "1099511627776 bytes where at most 4194304");
    let folder = |f: &Path| {
        fs::remove_file(one(f)).unwrap();
        fs::create_dir(one(f)).unwrap();
    };
    refuses(10, folder, "no plain file");
}

/// Puts a record in the place of record 1, as someone would who can write to the store.
fn forge(folder: &Path, forged: &Record) {
    let root = tempfile::tempdir().unwrap();
    let mut cache = Cache::open(root.path(), "x86").unwrap();
    cache.commit(forged.clone()).unwrap();
    cache.close().unwrap();
    let journals = files(&root.path().join("journal"));
    write(&place_of_record(folder, 1, "x86"), &journals[0].1);
}

#[test]
fn records_that_no_cache_puts_there_are_refused() {
    let huge = Output { digest: Digest([5; 32]), size: 1 << 40, inline: None };
    refuses(10, |f| forge(f, &record(1, "x86", huge)), "its object is too large");
    let bytes = vec![1; 100_000];
    let inline = Output { digest: Digest::of(&bytes), size: 100_000, inline: Some(bytes.into()) };
    refuses(10, |f| forge(f, &record(1, "x86", inline)), "more bytes inside it");
    let acts = |f: &Path| {
        let small = Output { digest: Digest::of(b"a"), size: 1, inline: Some((*b"a").into()) };
        let mut forged = record(1, "x86", small);
        forged.provenance.node = "e/\u{1b}[2J".into();
        forge(f, &forged);
    };
    refuses(10, acts, "control characters");
}

#[test]
fn every_object_that_is_not_what_its_name_says_is_refused() {
    let object = |folder: &Path| place_of_object(folder, &[1; 10_000]);
    refuses(10_000, |f| write(&object(f), &[2; 10_000]), "bytes of another digest");
    refuses(10_000, |f| write(&object(f), &[1; 9_999]), "9999 bytes in place of 10000");
    let giant = |f: &Path| File::create(object(f)).unwrap().set_len(1 << 40).unwrap();
    refuses(10_000, giant, "1099511627776 bytes in place of 10000");
    let folder = |f: &Path| {
        fs::remove_file(object(f)).unwrap();
        fs::create_dir(object(f)).unwrap();
    };
    refuses(10_000, folder, "no plain file");
}

#[cfg(unix)]
#[test]
fn links_are_not_followed() {
    use std::os::unix::fs::symlink;
    let outside = tempfile::tempdir().unwrap();
    let link = |path: &Path| {
        let moved = outside.path().join(path.file_name().unwrap());
        fs::rename(path, &moved).unwrap();
        symlink(&moved, path).unwrap();
    };
    refuses(10, |f| link(&place_of_record(f, 1, "x86")), "no plain file");
    refuses(10_000, |f| link(&place_of_object(f, &[1; 10_000])), "no plain file");
    refuses(10, |f| link(&f.join("records/01")), "no folder");
    let shelf = |f: &Path| link(place_of_object(f, &[1; 10_000]).parent().unwrap());
    refuses(10_000, shelf, "no folder");
}

#[cfg(unix)]
#[test]
fn nothing_is_written_through_a_link() {
    use std::os::unix::fs::symlink;
    for place in ["records", "records/01", "objects", "tmp"] {
        let (folder, outside) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        fs::write(folder.path().join("version"), "ivx store 1\n").unwrap();
        let link = folder.path().join(place);
        fs::create_dir_all(link.parent().unwrap()).unwrap();
        symlink(outside.path(), &link).unwrap();
        let (_root, mut cache) = cache("x86", folder.path(), Mode::Write);
        let new = record(1, "x86", cache.objects().put(&[1; 10_000]).unwrap());
        assert_eq!(cache.commit(new).unwrap(), Committed::New);
        assert_ne!(cache.close().unwrap(), [], "{place}");
        assert_eq!(fs::read_dir(outside.path()).unwrap().count(), 0, "{place}");
    }
    // A link in the place of a file is replaced, not followed.
    let (folder, outside) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (target, link) = (outside.path().join("t"), place_of_record(folder.path(), 1, "x86"));
    fs::create_dir_all(link.parent().unwrap()).unwrap();
    fs::write(&target, "mine").unwrap();
    symlink(&target, &link).unwrap();
    let (_root, mut cache) = cache("x86", folder.path(), Mode::Write);
    cache.find(&Digest([1; 32]));
    let new = record(1, "x86", cache.objects().put(b"new").unwrap());
    cache.commit(new).unwrap();
    cache.close().unwrap();
    assert_eq!(fs::read(&target).unwrap(), b"mine");
    assert!(fs::symlink_metadata(&link).unwrap().is_file());
}

#[test]
fn who_may_write_mends_what_was_damaged() {
    let (folder, records) = store(&[(1, 10_000)]);
    let before = files(folder.path());
    write(&place_of_record(folder.path(), 1, "x86"), b"half of");
    write(&place_of_object(folder.path(), &[1; 10_000]), &[1; 500]);
    let (_root, mut cache) = cache("x86", folder.path(), Mode::Write);
    assert_eq!(cache.find(&Digest([1; 32])), None);
    cache.objects().put(&[1; 10_000]).unwrap();
    cache.commit(records[0].clone()).unwrap();
    assert_eq!(cache.close().unwrap().len(), 1);
    assert!(files(folder.path()) == before);
}

#[test]
fn the_first_record_of_a_key_stays() {
    let (folder, records) = store(&[(1, 10)]);
    let before = files(folder.path());
    // A cache that did not ask.
    let (_root, mut cache) = cache("x86", folder.path(), Mode::Write);
    let mut later = records[0].clone();
    later.provenance.millis += 1;
    cache.commit(later).unwrap();
    assert_eq!(cache.close().unwrap(), []);
    assert!(files(folder.path()) == before);
}

#[test]
fn what_is_found_to_be_wrong_is_forgotten_with_all_that_the_store_said() {
    let (folder, _) = store(&[(1, 10_000), (2, 10)]);
    write(&place_of_object(folder.path(), &[1; 10_000]), &[0; 10_000]);
    let before = files(folder.path());
    let (root, mut cache) = cache("x86", folder.path(), Mode::Write);
    assert!(cache.find(&Digest([2; 32])).is_some());
    let lie = cache.find(&Digest([1; 32])).unwrap().output.clone();
    assert_eq!(cache.objects().read(&lie).unwrap(), Fetched::Missing);
    let truth = record(1, "x86", cache.objects().put(&[7; 10_000]).unwrap());
    assert_eq!(cache.commit(truth.clone()).unwrap(), Committed::Against);
    assert_eq!(cache.lookup(&Digest([2; 32])), None);
    assert_eq!(cache.find(&Digest([2; 32])), None, "nothing more is asked");
    let notes = cache.close().unwrap();
    let said: Vec<_> = notes.iter().map(ToString::to_string).collect();
    assert!(said[1].contains("gives something else here than it has on record"), "{said:?}");
    let cache = Cache::open(root.path(), "x86").unwrap();
    assert_eq!(cache.records().collect::<Vec<_>>(), [&truth]);
    assert!(files(folder.path()) == before, "nothing more is put there");
}

#[test]
fn a_store_that_fails_half_way_ends_with_a_note() {
    for (write, failure) in
        [0, 1, 3, 5, 8, 11].map(|w| [(w, Failure::Full), (w, Failure::Quota)]).concat()
    {
        let folder = tempfile::tempdir().unwrap();
        drop(second(folder.path(), Mode::Write));
        let disk: Disk = Faulty::from(write, failure).disk();
        let store = Folder::create_on(disk, folder.path()).unwrap();
        let root = tempfile::tempdir().unwrap();
        let mut cache = Cache::open(root.path(), "x86").unwrap();
        cache.attach(Second::new(Box::new(store), "far".into(), Mode::Write).unwrap());
        for n in 1..4 {
            let new = record(n, "x86", cache.objects().put(&[n; 5000]).unwrap());
            assert_eq!(cache.commit(new).unwrap(), Committed::New);
        }
        let notes = cache.close().unwrap();
        assert_eq!(notes.len(), 1, "{notes:?}");
        assert!(notes[0].to_string().contains("nothing more is written there"), "{notes:?}");
        // What is there is whole, or refused.
        let (_root, mut other) = self::cache("x86", folder.path(), Mode::Read);
        for n in 1..4 {
            if let Some(found) = other.find(&Digest([n; 32])).cloned() {
                let read = other.objects().read(&found.output).unwrap();
                assert_eq!(read, Fetched::Bytes(vec![n; 5000].into()));
            }
        }
        assert_eq!(other.close().unwrap(), []);
    }
}

#[test]
fn writers_at_once_leave_whole_files_only() {
    let folder = tempfile::tempdir().unwrap();
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                let (_root, mut cache) = cache("x86", folder.path(), Mode::Write);
                for n in 0..20 {
                    let new = record(n, "x86", cache.objects().put(&vec![n; 20_000]).unwrap());
                    cache.commit(new).unwrap();
                }
                assert_eq!(cache.close().unwrap(), []);
            });
            scope.spawn(|| {
                for _ in 0..10 {
                    let (_root, mut cache) = cache("x86", folder.path(), Mode::Write);
                    for n in 0..20 {
                        if let Some(found) = cache.find(&Digest([n; 32])).cloned() {
                            let read = cache.objects().read(&found.output).unwrap();
                            assert_eq!(read, Fetched::Bytes(vec![n; 20_000].into()));
                        }
                    }
                    assert_eq!(cache.troubles(), []);
                }
            });
        }
    });
    assert_eq!(files(folder.path()).len(), 41);
}
