//! A second store behind the cache, through the command: it saves work, and can do no harm.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use ivx_cache::{Cache, Digest, Folder, Mode, Output, Record, Second, Store as _};
use ivx_engine::{
    Fate, Foreseen, Options, Plan, Silence, Stop, consult, foresee, platform, schedule, wanted,
};
use ivx_op::Registry;
use proptest::collection::vec;
use proptest::prelude::{ProptestConfig, any, proptest};
use proptest::sample::{Index, select};
use proptest::test_runner::RngSeed;
use tempfile::TempDir;

use crate::keys::{CHANGES, experiment, plan, writing};
use crate::project::{Project, Said};

const SPEC: &str = "store.ivx";
const RESULTS: &str = "results/store/results.ron";
const CACHE: &str = ".ivx/cache";

fn project() -> Project {
    let small = include_str!("specs/small.ivx").replace("hidden: [8]", "hidden: [32, 32]");
    Project::in_memory(&[(SPEC, &small)])
}

/// A store of all results of the spec, how many there are, and the results.
struct Full {
    folder: TempDir,
    n_nodes: usize,
    results: String,
}

impl Full {
    fn new() -> Self {
        let folder = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir());
        let folder = folder.expect("temporary folders can be made");
        let project = project();
        let said = exec(&project, folder.path(), &["--store-mode", "write"]);
        let (executed, n_nodes) = executed(&said);
        assert_eq!(executed, n_nodes);
        assert!(said.err.contains(": 0 results, new ones are put there"), "{}", said.err);
        assert!(said.err.contains(&format!(" {n_nodes} results put")), "{}", said.err);
        Self { folder, n_nodes, results: project.read(RESULTS) }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn files(&self, below: &str) -> Vec<PathBuf> {
        let mut files = all_files(self.path());
        files.retain(|path| path.starts_with(self.path().join(below)));
        files
    }

    /// Runs the spec elsewhere with this store, which must end in the same results.
    #[track_caller]
    fn used(&self) -> (Project, Said) {
        let project = project();
        let said = exec(&project, self.path(), &[]);
        assert_eq!(said.code, 0, "{}{}", said.out, said.err);
        assert!(project.read(RESULTS) == self.results, "{}", said.err);
        // What the cache keeps is what its names say.
        for (name, bytes) in project.files(&format!("{CACHE}/objects")) {
            assert_eq!(name.rsplit('/').next(), Some(&*Digest::of(&bytes).to_string()));
        }
        (project, said)
    }
}

fn exec(project: &Project, store: &Path, rest: &[&str]) -> Said {
    let store = store.to_str().expect("temporary folders have plain names");
    project.run("exec", SPEC, &[&["--store", store], rest].concat())
}

/// The numbers in `12 of 34 nodes executed`.
#[track_caller]
fn executed(said: &Said) -> (usize, usize) {
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    let line = said.out.lines().find(|line| line.contains("nodes executed"));
    let line = line.expect("exec says what it executed");
    let mut numbers = line.split(' ').filter_map(|word| word.parse().ok());
    (numbers.next().expect("a number"), numbers.next().expect("another"))
}

/// How many hits a plan tells.
fn hits(project: &Project, store: &Path) -> usize {
    let store = store.to_str().expect("temporary folders have plain names");
    let said = project.run("plan", SPEC, &["--store", store]);
    let last = said.out.lines().last().expect("a plan has a last line");
    let hits = last.split(": ").nth(1).and_then(|hits| hits.split(' ').next()?.parse().ok());
    hits.unwrap_or_else(|| panic!("{last}"))
}

#[test]
fn two_caches_share_a_store_and_the_second_runs_nothing() {
    let full = Full::new();
    let before = full.files("records");
    let elsewhere = project();
    assert_eq!(hits(&elsewhere, full.path()), full.n_nodes);
    let records = Cache::open(&elsewhere.path(CACHE), "x").expect("the cache opens");
    assert_eq!(records.records().count(), 0, "a plan keeps nothing");
    drop(records);
    let (project, said) = full.used();
    assert_eq!(executed(&said), (0, full.n_nodes));
    let found = format!(": {} results, nothing is put there", full.n_nodes);
    assert!(said.err.starts_with("store ") && said.err.contains(&found), "{}", said.err);
    assert!(said.err.contains(&format!(" {} results taken", full.n_nodes)), "{}", said.err);
    // A change runs what it must, and a store that is read stays as it is.
    assert!(executed(&exec(&project, full.path(), &["--set", "members=3"])).0 > 0);
    assert_eq!(full.files("records"), before);
}

#[test]
fn what_is_not_in_the_store_runs_and_the_rest_is_found() {
    let full = Full::new();
    for record in full.files("records").iter().step_by(7) {
        fs::remove_file(record).expect("files can be removed");
    }
    let n_hits = hits(&project(), full.path());
    let (_, said) = full.used();
    // Keys beyond what ran are known once it did.
    let (executed, n_nodes) = executed(&said);
    assert!(executed >= 1 && n_nodes - executed >= n_hits, "{executed} of {n_nodes}, {n_hits}");
    assert_eq!(executed, full.n_nodes - full.files("records").len());
}

#[test]
fn objects_of_other_bytes_are_refused_and_their_nodes_run() {
    let full = Full::new();
    for object in full.files("objects") {
        let n = fs::read(&object).expect("files can be read").len();
        fs::write(&object, vec![7; n]).expect("files can be written");
    }
    // What reads models must run for one to be needed.
    for record in full.files("records") {
        let bytes = fs::read(&record).expect("files can be read");
        if !bytes.windows(6).any(|word| word == b"train@") {
            fs::remove_file(record).expect("files can be removed");
        }
    }
    let (_, said) = full.used();
    assert!(said.err.contains("bytes of another digest"), "{}", said.err);
    assert!(executed(&said).0 > full.n_nodes / 3);
}

#[test]
fn damaged_records_are_refused_and_their_nodes_run() {
    let full = Full::new();
    for (i, record) in full.files("records").iter().enumerate() {
        let mut bytes = fs::read(record).expect("files can be read");
        match i % 4 {
            0 => bytes.truncate(bytes.len() * (i % 13) / 13),
            1 => bytes[i * 31 % 100] ^= 1 << (i % 8),
            2 => bytes = fs::read(&full.files("records")[i - 1]).expect("files can be read"),
            _ => {}
        }
        fs::write(record, bytes).expect("files can be written");
    }
    let n_hits = hits(&project(), full.path());
    let (_, said) = full.used();
    assert!(said.err.contains("more are refused"), "{}", said.err);
    let (executed, n_nodes) = executed(&said);
    assert!(n_nodes - executed >= n_hits, "{executed} of {n_nodes}, {n_hits}");
    assert!(executed > full.n_nodes / 2, "{executed}");
}

/// Puts a record in the place of the one of its key and platform.
fn forge(full: &Full, record: &Record) {
    let scratch = tempfile::tempdir().expect("temporary folders can be made");
    let mut cache = Cache::open(scratch.path(), "x").expect("the cache opens");
    let store = Folder::create(&scratch.path().join("store")).expect("a store can be made");
    // A record is put only where its object is.
    let hex = record.output.digest.to_string();
    let n = usize::try_from(record.output.size).expect("objects fit into memory");
    store.put(&format!("objects/{}/{hex}", &hex[..2]), &vec![0; n]).expect("files can be written");
    let store = Second::new(Box::new(store), String::new(), Mode::Write);
    cache.attach(store.expect("the store is empty"));
    cache.commit(record.clone()).expect("the record is new");
    cache.close().expect("the disk works");
    let hex = record.key.to_string();
    let place = Path::new("records").join(&hex[..2]).join(format!("{hex}-{}", record.platform));
    let target = full.path().join(&place);
    fs::copy(scratch.path().join("store").join(place), target).expect("files can be copied");
}

/// What the store says of the nodes of an operation.
fn records(full: &Full, op: &str) -> Vec<Record> {
    let (project, _) = full.used();
    let store = Folder::open(full.path()).expect("there is a store");
    let mut cache = Cache::open(&project.path(CACHE), "x").expect("the cache opens");
    let store = Second::new(Box::new(store), String::new(), Mode::Read).expect("it is whole");
    cache.attach(store);
    let keys = full.files("records");
    let keys = keys.iter().filter_map(|path| path.file_name()?.to_str()?.get(..64)?.parse().ok());
    let keys: Vec<Digest> = keys.collect();
    let all = keys.iter().filter_map(|key| cache.find(key).cloned());
    all.filter(|record| record.provenance.op.starts_with(op)).collect()
}

#[test]
fn a_record_that_lies_without_the_bytes_for_it_is_found_out() {
    let full = Full::new();
    let trained = records(&full, "train");
    assert!(trained.len() > 1 && trained.iter().all(|record| record.output.inline.is_none()));
    for record in &trained {
        // Where the bytes of the lie should be, there are others.
        let digest = Digest::of(&record.key.0);
        let size = record.output.size;
        let lie = Record { output: Output { digest, size, inline: None }, ..record.clone() };
        forge(&full, &lie);
        let hex = digest.to_string();
        let shelf = full.path().join("objects").join(&hex[..2]);
        fs::create_dir_all(&shelf).expect("folders can be made");
        let n = usize::try_from(size).expect("objects fit into memory");
        fs::write(shelf.join(hex), vec![0; n]).expect("files can be written");
    }
    let (project, said) = full.used();
    assert!(said.err.contains("gives something else here than it has on record"), "{}", said.err);
    assert!(said.err.contains("nothing that it says is used"), "{}", said.err);
    // And what the cache knows now is the truth.
    fs::remove_file(project.path(RESULTS)).expect("files can be removed");
    assert_eq!(project.executed(SPEC, &[]), 0);
    assert!(project.read(RESULTS) == full.results);
}

#[test]
fn results_of_another_platform_are_taken_where_there_are_no_own() {
    let full = Full::new();
    let own = ivx_engine::platform();
    for record in full.files("records") {
        fs::remove_file(record).expect("files can be removed");
    }
    let theirs = Full::new();
    for record in records(&theirs, "") {
        assert_eq!(record.platform, own);
        forge_as(&full, &Record { platform: "sparc-solaris".into(), ..record });
    }
    let (_, said) = full.used();
    assert_eq!(executed(&said), (0, full.n_nodes));
}

fn forge_as(full: &Full, record: &Record) {
    let hex = record.key.to_string();
    let shelf = full.path().join("records").join(&hex[..2]);
    fs::create_dir_all(shelf).expect("folders can be made");
    forge(full, record);
}

#[test]
fn a_store_that_can_t_be_used_is_a_note() {
    let full = Full::new();
    let check = |store: &Path, expected: &str| {
        let project = project();
        let said = exec(&project, store, &[]);
        assert_eq!(executed(&said), (full.n_nodes, full.n_nodes));
        assert!(
            said.err.contains("note: the store ") && said.err.contains(expected),
            "{}",
            said.err
        );
        assert!(project.read(RESULTS) == full.results);
    };
    let elsewhere = tempfile::tempdir().expect("temporary folders can be made");
    check(&elsewhere.path().join("absent"), "there is none");
    assert!(!elsewhere.path().join("absent").exists());
    check(elsewhere.path(), "there is none");
    fs::write(elsewhere.path().join("file"), "text").expect("files can be written");
    check(&elsewhere.path().join("file"), "is not used: version: ");
    fs::write(full.path().join("version"), "ivx store 9\n").expect("files can be written");
    check(full.path(), "a store of another format");
    fs::write(full.path().join("version"), vec![0; 1 << 20]).expect("files can be written");
    check(full.path(), "1048576 bytes where at most 12");
}

fn config() -> ProptestConfig {
    let config = ProptestConfig::default();
    let cases = if config.cases == 256 { 8 } else { config.cases };
    ProptestConfig { cases, rng_seed: RngSeed::Fixed(0), failure_persistence: None, ..config }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn a_run_with_a_store_does_what_was_foreseen_with_it(
        mut experiment in experiment(),
        writing in writing(),
        edits in vec((select(&CHANGES[..]), any::<bool>(), any::<Index>()), 1..4),
    ) {
        let registry = ivx_library::registry();
        let store = tempfile::tempdir().expect("temporary folders can be made");
        drop(Folder::create(store.path()).expect("a store can be made"));
        let mut cache = tempfile::tempdir().expect("temporary folders can be made");
        for (change, fresh, lost) in edits {
            check(&plan(&writing.of(&experiment), &registry), &registry, &cache, &store);
            if fresh {
                cache = tempfile::tempdir().expect("temporary folders can be made");
            } else {
                change(&mut experiment);
            }
            let files = all_files(store.path());
            fs::remove_file(&files[lost.index(files.len())]).expect("files can be removed");
        }
        check(&plan(&writing.of(&experiment), &registry), &registry, &cache, &store);
    }
}

/// Foresees a run with a store, runs it, and compares.
fn check(plan: &Plan, registry: &Registry, cache: &TempDir, store: &TempDir) {
    let attached = |mut cache: Cache, mode: Mode| {
        let folder = Folder::create(store.path()).expect("there is a store");
        let second = Second::new(Box::new(folder), String::new(), mode);
        cache.attach(second.expect("it can be listed"));
        cache
    };
    let look = Cache::look(cache.path(), &platform()).expect("the cache opens");
    let mut look = attached(look, Mode::Read);
    consult(plan, registry, &mut look);
    let foreseen = foresee(plan, registry, &look);
    drop(look);
    let opened = Cache::open(cache.path(), &platform()).expect("the cache opens");
    let mut opened = attached(opened, Mode::Write);
    let options = Options {
        jobs: 2,
        memory: u64::MAX,
        fail_fast: false,
        library: "tests".into(),
        checkpoint: Duration::from_mins(1),
        limit: None,
        stop: Stop::default(),
    };
    let wanted = wanted(plan);
    let outcome = schedule(plan, registry, &mut opened, &options, &wanted, &mut Silence);
    let outcome = outcome.expect("the cache works");
    assert_eq!(opened.close().expect("the cache closes"), []);
    let made = |key| {
        let ran = |node: &&ivx_engine::Node| matches!(node.fate, Fate::Ran { .. });
        outcome.nodes.iter().filter(ran).any(|node| node.key == key)
    };
    for (node, foreseen) in outcome.nodes.iter().zip(foreseen) {
        match (foreseen, &node.fate) {
            (Foreseen::Hit, Fate::Hit)
            | (Foreseen::Run, Fate::Ran { .. })
            | (Foreseen::Unknown, Fate::Hit | Fate::Ran { .. }) => {}
            (Foreseen::Run, Fate::Hit) => assert!(made(node.key), "an equal node was first"),
            (foreseen, fate) => panic!("{foreseen:?}, and then {fate:?}"),
        }
    }
}

fn all_files(store: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for below in ["records", "objects"] {
        for shelf in fs::read_dir(store.join(below)).expect("the folder is there").flatten() {
            files.extend(fs::read_dir(shelf.path()).expect("shelves are folders").flatten());
        }
    }
    let mut files: Vec<PathBuf> = files.into_iter().map(|file| file.path()).collect();
    files.sort();
    files
}
