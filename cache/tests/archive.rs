//! Archives: what goes out comes in, and nothing else does.

#![expect(clippy::unwrap_used, reason = "a failure of the set-up fails the test")]

use std::fs;
use std::path::{Path, PathBuf};

use ivx_cache::{
    ArchiveError, Cache, Digest, Exported, Fetched, Imported, Limits, Output, Provenance, Record,
    export, import,
};
use tar::{Builder, EntryType, Header};
use tempfile::TempDir;

const HEAD: (&str, &[u8]) = ("ivx-archive", b"ivx archive 1\n");

fn record(n: u8, platform: &str, output: Output) -> Record {
    let provenance = Provenance {
        op: "train@3".into(),
        node: format!("e/model[seed={n}]"),
        inputs: vec![Digest([0; 32])],
        explanation: format!("op train@3\nseed {n}"),
        library: "feed".into(),
        millis: 40,
    };
    Record { key: Digest([n; 32]), platform: platform.into(), output, provenance }
}

fn open(root: &TempDir) -> Cache {
    let mut cache = Cache::open(root.path(), "x86").unwrap();
    assert_eq!(cache.troubles(), []);
    cache
}

/// Bytes that can be told apart and do not press to nothing.
fn bytes(n: u8, len: usize) -> Vec<u8> {
    let mut x = u32::from(n) + 1;
    let next = |_| {
        x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        x.to_be_bytes()[0]
    };
    (0..len).map(next).collect()
}

fn add(cache: &mut Cache, n: u8, platform: &str, len: usize) -> Record {
    let record = record(n, platform, cache.objects().put(&bytes(n, len)).unwrap());
    cache.commit(record.clone()).unwrap();
    record
}

/// A store of two small and two large results, one of another platform.
fn store() -> (TempDir, Cache) {
    let root = tempfile::tempdir().unwrap();
    let mut cache = open(&root);
    for (n, platform, len) in [(3, "x86", 9000), (1, "x86", 10), (2, "arm", 20), (4, "arm", 5000)] {
        add(&mut cache, n, platform, len);
    }
    (root, cache)
}

fn exported(cache: &Cache, keep: impl Fn(&Record) -> bool) -> (Vec<u8>, Exported) {
    let mut archive = Vec::new();
    let done = export(cache, keep, &mut archive, Path::new("archive")).unwrap();
    (archive, done)
}

/// The files and folders of a store, but for the sled and what is empty anyway.
fn files(root: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in fs::read_dir(root).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { all.extend(files(&path)) } else { all.push(path) }
    }
    all.sort();
    all
}

/// A tar of these entries, pressed.
fn archive(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let entries: Vec<_> =
        entries.iter().map(|(name, bytes)| (header(name, bytes), bytes.to_vec())).collect();
    pressed(&tar_of(&entries))
}

fn header(name: &str, bytes: &[u8]) -> Header {
    let mut header = Header::new_ustar();
    header.set_entry_type(EntryType::Regular);
    // Not `set_path`, which refuses what a hostile archive has.
    header.as_old_mut().name[..name.len()].copy_from_slice(name.as_bytes());
    header.set_mode(0o444);
    header.set_size(bytes.len() as u64);
    header.set_cksum();
    header
}

fn tar_of(entries: &[(Header, Vec<u8>)]) -> Vec<u8> {
    let mut tar = Builder::new(Vec::new());
    for (header, bytes) in entries {
        tar.append(header, &bytes[..]).unwrap();
    }
    tar.into_inner().unwrap()
}

fn pressed(tar: &[u8]) -> Vec<u8> {
    zstd::encode_all(tar, 3).unwrap()
}

/// The entries of a good archive.
fn entries() -> Vec<(String, Vec<u8>)> {
    let (archive, _) = exported(&store().1, |_| true);
    let tar = zstd::decode_all(&archive[..]).unwrap();
    let mut tar = tar::Archive::new(&tar[..]);
    let entries = tar.entries().unwrap().map(|entry| {
        let mut entry = entry.unwrap();
        let mut bytes = Vec::new();
        std::io::copy(&mut entry, &mut bytes).unwrap();
        (entry.path().unwrap().to_str().unwrap().to_owned(), bytes)
    });
    entries.collect()
}

fn borrowed(entries: &[(String, Vec<u8>)]) -> Vec<(&str, &[u8])> {
    entries.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect()
}

/// Checks that an archive is refused for a reason, and that nothing is left of it anywhere.
#[track_caller]
fn refuses(archive: &[u8], reason: &str) {
    refuses_with(archive, &Limits::default(), reason);
}

#[track_caller]
fn refuses_with(archive: &[u8], limits: &Limits, reason: &str) {
    let around = tempfile::tempdir().unwrap();
    let root = around.path().join("a/cache");
    let mut cache = Cache::open(&root, "x86").unwrap();
    add(&mut cache, 9, "x86", 6000);
    cache.sync().unwrap();
    let before = files(around.path());
    match import(&mut cache, archive, limits) {
        Err(ArchiveError::Refused(why)) => assert!(why.contains(reason), "{why}"),
        other => panic!("{other:?}"),
    }
    assert_eq!(cache.records().count(), 1);
    assert_eq!(files(around.path()), before);
    cache.refresh().unwrap();
    assert_eq!((cache.records().count(), cache.troubles()), (1, vec![]));
}

#[test]
fn what_goes_out_comes_in() {
    let (_root, from) = store();
    let (archive, done) = exported(&from, |_| true);
    assert_eq!(done, Exported { records: 4, objects: 2, bytes: 14_000, missing: 0 });
    let root = tempfile::tempdir().unwrap();
    let mut to = open(&root);
    let known = add(&mut to, 1, "x86", 10);
    let taken = import(&mut to, &archive[..], &Limits::default()).unwrap();
    assert_eq!(taken, Imported { records: 4, new_records: 3, objects: 2, bytes: 14_000 });
    for cache in [&to, &open(&root)] {
        assert_eq!(cache.records().collect::<Vec<_>>(), from.records().collect::<Vec<_>>());
        assert_eq!(cache.lookup(&known.key), Some(&known));
        for record in from.records() {
            let n = record.key.0[0];
            let len = usize::try_from(record.output.size).unwrap();
            let read = cache.objects().read(&record.output).unwrap();
            assert_eq!(read, Fetched::Bytes(bytes(n, len).into()));
        }
    }
    // Of another platform: found where the own has none.
    assert_eq!(to.lookup(&Digest([2; 32])).unwrap().platform, "arm");
    let staged = fs::read_dir(root.path().join("tmp")).unwrap().count();
    assert_eq!(staged, 0);
    // Again, it changes nothing.
    let before = files(root.path());
    let taken = import(&mut to, &archive[..], &Limits::default()).unwrap();
    assert_eq!((taken.new_records, files(root.path())), (0, before));
    // And goes out as it came in, whatever the order that it was written in.
    assert_eq!(exported(&to, |_| true).0, archive);
}

#[test]
fn some_records_go_with_their_objects_only() {
    let (_root, from) = store();
    let (archive, done) = exported(&from, |record| record.platform == "x86");
    assert_eq!(done, Exported { records: 2, objects: 1, bytes: 9000, missing: 0 });
    let root = tempfile::tempdir().unwrap();
    import(&mut open(&root), &archive[..], &Limits::default()).unwrap();
    let keys: Vec<u8> = open(&root).records().map(|record| record.key.0[0]).collect();
    assert_eq!(keys, [1, 3]);
}

#[test]
fn a_record_whose_object_is_gone_goes_without_it() {
    let (root, from) = store();
    fs::remove_dir_all(root.path().join("objects")).unwrap();
    let (archive, done) = exported(&from, |_| true);
    assert_eq!((done.objects, done.missing), (0, 2));
    let root = tempfile::tempdir().unwrap();
    let mut to = open(&root);
    import(&mut to, &archive[..], &Limits::default()).unwrap();
    let record = to.lookup(&Digest([3; 32])).unwrap();
    assert_eq!(to.objects().read(&record.output).unwrap(), Fetched::Missing);
}

#[test]
fn an_import_heals_a_damaged_object_and_is_seen_by_others() {
    let (_root, from) = store();
    let root = tempfile::tempdir().unwrap();
    let mut to = open(&root);
    let record = add(&mut to, 3, "x86", 9000);
    let hex = record.output.digest.to_string();
    let path = root.path().join("objects").join(&hex[..2]).join(&hex);
    fs::remove_file(&path).unwrap();
    fs::write(&path, "damaged").unwrap();
    let mut other = open(&root);
    import(&mut to, &exported(&from, |_| true).0[..], &Limits::default()).unwrap();
    assert_eq!(to.objects().read(&record.output).unwrap(), Fetched::Bytes(bytes(3, 9000).into()));
    other.refresh().unwrap();
    assert_eq!(other.records().count(), 4);
}

#[test]
fn names_that_lead_elsewhere_are_refused() {
    let good = entries();
    let object = &good[2].1;
    let upper = good[2].0.to_uppercase();
    for name in [
        "../escaped",
        "objects/../../escaped",
        "/tmp/escaped",
        "objects/../version",
        "version",
        "journal/evil.log",
        "objects/zz",
        "objects/",
        "",
        "journal",
        &upper,
        &good[2].0.replace("objects", "objects/."),
        "objects\\escaped",
        "C:\\escaped",
    ] {
        let mut entries = borrowed(&good);
        entries[2] = (name, object);
        refuses(&archive(&entries), "does not belong there");
    }
    let mut entries = borrowed(&good);
    entries.swap(2, 3);
    refuses(&archive(&entries), "is there twice, or out of order");
    entries[2] = entries[3];
    refuses(&archive(&entries), "is there twice, or out of order");
    let mut entries = borrowed(&good);
    entries.insert(2, entries[1]);
    refuses(&archive(&entries), "`journal` does not belong there");
    refuses(&archive(&[entries[0], entries[3]]), "does not belong there");
    // An object that no record names.
    let stray = bytes(77, 5000);
    let name = format!("objects/{}", Digest::of(&stray));
    let mut entries = borrowed(&good);
    entries.insert(4, (&name, &stray));
    refuses(&archive(&entries), "does not belong there");
}

#[test]
fn whatever_is_no_plain_file_is_refused() {
    let good = entries();
    let (name, object) = &good[2];
    let of_type = |kind: u8, link: &str| {
        let mut all: Vec<_> =
            good.iter().map(|(name, bytes)| (header(name, bytes), bytes.clone())).collect();
        all[2].0.as_old_mut().linkflag = [kind];
        all[2].0.as_old_mut().linkname[..link.len()].copy_from_slice(link.as_bytes());
        all[2].0.set_cksum();
        pressed(&tar_of(&all))
    };
    // Links, devices, folders, pipes, long names, extensions, sparse files.
    for kind in b"1234567gxLKSDMN\0" {
        refuses(&of_type(*kind, ""), &format!("`{name}` is no plain file"));
        refuses(&of_type(*kind, "/etc/passwd"), "is no plain file");
    }
    refuses(&of_type(b'0', "../../secret"), "is no plain file");
    let mut gnu = Header::new_gnu();
    gnu.set_path(name).unwrap();
    gnu.set_size(object.len() as u64);
    gnu.set_entry_type(EntryType::Regular);
    gnu.set_cksum();
    let mut all: Vec<_> =
        good.iter().map(|(name, bytes)| (header(name, bytes), bytes.clone())).collect();
    all[2].0 = gnu;
    refuses(&pressed(&tar_of(&all)), "is no plain file");
}

#[test]
fn wrong_bytes_are_refused() {
    let good = entries();
    let mut damaged = good.clone();
    damaged[2].1[100] ^= 1;
    refuses(&archive(&borrowed(&damaged)), "has the digest");
    let mut short = good.clone();
    short[2].1.pop();
    refuses(&archive(&borrowed(&short)), "bytes, not");
    let mut other = good.clone();
    other[0].1 = b"ivx archive 2\n".to_vec();
    refuses(&archive(&borrowed(&other)), "does not begin as \"ivx archive 1\" does");
    refuses(&archive(&borrowed(&good[1..])), "does not begin");
    for at in [0, 14, 30, 100, good[1].1.len() - 1] {
        let mut damaged = good.clone();
        damaged[1].1[at] ^= 1;
        refuses(&archive(&borrowed(&damaged)), "a record in it is damaged");
    }
    let mut cut = good.clone();
    cut[1].1.pop();
    refuses(&archive(&borrowed(&cut)), "a record in it is damaged");
    refuses(b"", "");
    refuses(b"PK\x03\x04 not at all", "does not read");
    refuses(&pressed(b"not a tar"), "does not read");
}

#[test]
fn a_cut_archive_is_refused_wherever_it_is_cut() {
    let (whole, _) = exported(&store().1, |_| true);
    for len in (0..whole.len()).step_by(97).chain([whole.len() - 1]) {
        refuses(&whole[..len], "");
    }
    // Cut before it was pressed, at every entry and within one.
    let tar = zstd::decode_all(&whole[..]).unwrap();
    for len in (0..tar.len() - 1024).step_by(512).chain([700, 5000]) {
        refuses(&pressed(&tar[..len]), "");
    }
    let good = entries();
    refuses(&archive(&borrowed(&good[..good.len() - 1])), "it was cut off");
    // And what is longer than it should be.
    refuses(&[&whole[..], b"x"].concat(), "something follows its end");
    refuses(&[&whole[..], &whole[..]].concat(), "something follows its end");
    refuses(&pressed(&[&tar[..], b"x"].concat()), "something follows its end");
}

#[test]
fn every_flipped_bit_is_refused_or_harmless() {
    let (whole, _) = exported(&store().1, |record| record.output.inline.is_some());
    let mut refused = 0;
    let (mut root, limits) = (tempfile::tempdir().unwrap(), Limits::default());
    let mut to = open(&root);
    for bit in 0..whole.len() * 8 {
        let mut damaged = whole.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        match import(&mut to, &damaged[..], &limits) {
            Err(ArchiveError::Refused(_)) => {
                refused += 1;
                assert_eq!(to.records().count(), 0, "bit {bit}");
            }
            Ok(_) => {
                assert_eq!(exported(&to, |_| true).0, whole, "bit {bit}");
                root = tempfile::tempdir().unwrap();
                to = open(&root);
            }
            Err(error) => panic!("{error}"),
        }
    }
    assert!(refused * 10 > whole.len() * 8 * 9, "{refused} of {} are refused", whole.len() * 8);
}

#[test]
fn what_unfolds_to_too_much_is_refused() {
    let limits = Limits { entries: 6, entry: 20_000, total: 40_000, ratio: 10, free: 40_000 };
    let (good, _) = exported(&store().1, |_| true);
    let root = tempfile::tempdir().unwrap();
    import(&mut open(&root), &good[..], &limits).unwrap();
    refuses_with(&good, &Limits { entries: 4, ..limits }, "holds more than 4 files");
    refuses_with(&good, &Limits { entry: 8999, ..limits }, "has more than 8999 bytes");
    refuses_with(&good, &Limits { total: 15_000, ..limits }, "unfolds to more than 15000 bytes");
    // A gigabyte of zeros in a few kilobytes, as an object, as records and behind the end.
    let entries = entries();
    let zeros = vec![0; 30_000_000];
    let bomb = |i: usize| {
        let mut entries = borrowed(&entries);
        entries[i].1 = &zeros;
        archive(&entries)
    };
    let small = Limits { entry: u64::MAX, total: u64::MAX, free: 100_000, ..limits };
    assert!(bomb(1).len() < 100_000);
    refuses_with(&bomb(1), &small, "unfolds to more than");
    refuses_with(&bomb(0), &small, "unfolds to more than");
    refuses_with(&bomb(2), &small, "bytes, not");
    let tar = zstd::decode_all(&good[..]).unwrap();
    refuses_with(&pressed(&[&tar[..], &zeros].concat()), &small, "unfolds to more than");
    // A size that no disk has.
    let mut all: Vec<_> =
        entries.iter().map(|(name, bytes)| (header(name, bytes), bytes.clone())).collect();
    all[1].0.set_size(1 << 50);
    all[1].0.set_cksum();
    refuses(&pressed(&tar_of(&all)), "has more than");
}

#[test]
fn records_that_conflict_are_refused_with_all_that_came_with_them() {
    let (_root, from) = store();
    let (archive, _) = exported(&from, |_| true);
    let root = tempfile::tempdir().unwrap();
    let mut to = open(&root);
    let own = record(4, "arm", to.objects().put(b"another result").unwrap());
    to.commit(own.clone()).unwrap();
    let before = files(root.path());
    let why = import(&mut to, &archive[..], &Limits::default()).unwrap_err().to_string();
    assert!(why.contains("gave two results for one key on arm"), "{why}");
    assert_eq!(to.records().collect::<Vec<_>>(), [&own]);
    assert_eq!(files(root.path()), before);
    // Twice in one archive: the same, and another.
    for second in [record(4, "arm", own.output.clone()), from.records().last().unwrap().clone()] {
        let mut journal = entries()[1].1.clone();
        let root = tempfile::tempdir().unwrap();
        let mut cache = open(&root);
        cache.commit(second).unwrap();
        let (one, _) = exported(&cache, |_| true);
        let tar = zstd::decode_all(&one[..]).unwrap();
        let mut tar = tar::Archive::new(&tar[..]);
        let mut entry = tar.entries().unwrap().nth(1).unwrap().unwrap();
        let mut more = Vec::new();
        std::io::copy(&mut entry, &mut more).unwrap();
        journal.extend(&more[14..]);
        let archive = self::archive(&[HEAD, ("journal", &journal), ("end", b"")]);
        refuses(&archive, "is there twice");
    }
}
