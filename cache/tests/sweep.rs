//! What a sweep drops and what it leaves, what the history remembers, and what is found damaged.

#![expect(clippy::unwrap_used, reason = "a failure of the set-up fails the test")]

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use ivx_cache::{
    Cache, CacheError, Digest, Fetched, History, Provenance, Rebuilt, Record, Run, Sweep, Swept,
    Trouble, Wanted, check, rebuild,
};
use tempfile::TempDir;

fn sweep(root: &Path, wanted: &Wanted, how: Sweep) -> Result<Swept, CacheError> {
    ivx_cache::sweep(root, how, |_| wanted.clone())
}

const DAY: u64 = 24 * 3600 * 1000;

fn now() -> u64 {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap();
    u64::try_from(now.as_millis()).unwrap()
}

fn key(n: u8) -> Digest {
    Digest([n; 32])
}

/// Commits `[n; len]` under the key `[n; 32]` for each pair, in one journal.
fn add(root: &Path, outputs: &[(u8, usize)]) {
    let mut cache = Cache::open(root, "x86").unwrap();
    for &(n, len) in outputs {
        let provenance = Provenance {
            op: if n.is_multiple_of(2) { "even@1" } else { "odd@1" }.into(),
            node: format!("e/f[{n}]"),
            inputs: vec![],
            explanation: String::new(),
            library: "l".into(),
            millis: u64::from(n),
        };
        let output = cache.objects().put(&vec![n; len]).unwrap();
        cache.commit(Record { key: key(n), platform: "x86".into(), output, provenance }).unwrap();
    }
    cache.close().unwrap();
}

/// Notes a run that ended so many days ago and used these keys.
fn note(root: &Path, days: u64, keys: &[u8]) -> String {
    let cache = Cache::open(root, "x86").unwrap();
    let keys = keys.iter().copied().map(key).collect();
    cache.note_run(now() - days * DAY, keys, &format!("{days} days ago")).unwrap()
}

/// Makes every journal as old as that.
fn age(root: &Path, days: u64) {
    for path in files(&root.join("journal")) {
        let time = SystemTime::now() - Duration::from_millis(days * DAY);
        File::open(path).unwrap().set_modified(time).unwrap();
    }
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> =
        entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect();
    files.sort();
    files
}

/// The numbers whose records are there, each with its output.
fn known(root: &Path) -> Vec<u8> {
    let mut cache = Cache::open(root, "x86").unwrap();
    assert_eq!(cache.troubles(), []);
    let numbers = cache.records().map(|record| {
        let n = record.key.0[0];
        let Fetched::Bytes(bytes) = cache.objects().read(&record.output).unwrap() else {
            panic!("output {n} is gone")
        };
        assert!(!bytes.is_empty() && bytes.iter().all(|byte| *byte == n));
        n
    });
    numbers.collect()
}

fn run_names(root: &Path) -> Vec<String> {
    let history = History::open(root).unwrap();
    assert_eq!(history.troubles, []);
    history.runs.iter().map(|run| run.name.clone()).collect()
}

fn find(history: &History, name: &str) -> Run {
    history.runs.iter().find(|run| run.name == name).unwrap().clone()
}

fn keep(root: &Path, name: &str) {
    let history = History::open(root).unwrap();
    history.keep(&find(&history, name)).unwrap();
}

/// A store with records 1 to 6 of 10 or 10 000 bytes, and three runs: 1 2 3, 3 4 and 4 5; no
/// run used 6. The journals are from before the runs.
fn store() -> (TempDir, [String; 3]) {
    let root = tempfile::tempdir().unwrap();
    add(root.path(), &[(1, 10), (2, 10_000)]);
    add(root.path(), &[(3, 10_000), (4, 10)]);
    add(root.path(), &[(5, 10_000), (6, 10_000)]);
    age(root.path(), 100);
    let runs = [(30, &[1, 2, 3][..]), (20, &[3, 4]), (10, &[4, 5])];
    let names = runs.map(|(days, keys)| note(root.path(), days, keys));
    (root, names)
}

#[track_caller]
fn swept(root: &Path, wanted: &Wanted) -> (usize, Vec<u8>) {
    let before = files(root);
    let dry = sweep(root, wanted, Sweep::Dry).unwrap();
    // An open of the store makes what is not there.
    assert_eq!(files(root), before, "only looks");
    let wet = sweep(root, wanted, Sweep::Wet).unwrap();
    assert_eq!(dry, wet, "says what it will do");
    assert_eq!(wet.troubles, []);
    let left: u64 = files(root)
        .iter()
        .filter(|path| path.parent() != Some(root) && !path.starts_with(root.join("hints.sled")))
        .map(|path| fs::metadata(path).unwrap().len())
        .sum();
    assert_eq!(wet.left, left);
    (wet.records, known(root))
}

#[test]
fn the_history_tells_runs_in_order_and_they_share_their_lists() {
    let root = tempfile::tempdir().unwrap();
    add(root.path(), &[(1, 10)]);
    let names = [note(root.path(), 1, &[1, 2]), note(root.path(), 3, &[2, 1, 2])];
    let history = History::open(root.path()).unwrap();
    assert_eq!(history.troubles, []);
    let told: Vec<_> = history.runs.iter().map(|run| (&*run.name, &*run.summary)).collect();
    assert_eq!(told, [(&*names[1], "3 days ago"), (&*names[0], "1 days ago")]);
    assert!(names.iter().all(|name| name.len() == 8));
    let lists = files(&root.path().join("keys"));
    assert_eq!(lists.len(), 1);
    assert_eq!(fs::read(&lists[0]).unwrap(), [[1; 32], [2; 32]].concat());
    let size = |path: &PathBuf| fs::metadata(path).unwrap().len();
    assert_eq!(files(&root.path().join("runs")).iter().map(size).max(), Some(32 + 8 + 32 + 10));
}

#[test]
fn without_limits_only_what_nothing_leads_to_goes() {
    let (root, names) = store();
    let root = root.path();
    let stray = "objects/00/stray";
    fs::create_dir_all(root.join("objects/00")).unwrap();
    for path in [stray, "tmp/left", "locks/left", "corrupt/left", "keys/left"] {
        fs::write(root.join(path), "by a killed process").unwrap();
    }
    let (dropped, left) = swept(root, &Wanted::default());
    assert_eq!((dropped, left), (0, vec![1, 2, 3, 4, 5, 6]));
    for path in [stray, "tmp/left", "locks/left", "corrupt/left", "keys/left"] {
        assert!(!root.join(path).exists(), "{path}");
    }
    assert_eq!(run_names(root), names);
    assert_eq!(files(&root.join("journal")).len(), 1, "journals of one week are merged");
}

#[test]
fn runs_are_the_limit() {
    let (root, names) = store();
    let wanted = Wanted { runs: Some([names[2].clone()].into()), ..Wanted::default() };
    assert_eq!(swept(root.path(), &wanted), (4, vec![4, 5]));
    assert_eq!(run_names(root.path()), names[2..]);
    assert_eq!(files(&root.path().join("keys")).len(), 1);
    assert_eq!(files(&root.path().join("objects")).len(), 1);
}

#[test]
fn what_no_run_mentions_is_safe_for_a_week() {
    let none = Wanted { runs: Some(BTreeSet::new()), ..Wanted::default() };
    for (days, left) in [(6, vec![6]), (8, vec![])] {
        let (root, _) = store();
        age(root.path(), days);
        assert_eq!(swept(root.path(), &none).1, left, "{days} days");
        // The merged journal is no younger than those before it.
        age_is(root.path(), days);
    }
}

#[track_caller]
fn age_is(root: &Path, days: u64) {
    for path in files(&root.join("journal")) {
        let age = fs::metadata(path).unwrap().modified().unwrap().elapsed().unwrap();
        assert_eq!(u64::try_from(age.as_millis()).unwrap() / DAY, days);
    }
}

#[test]
fn age_is_the_limit() {
    for (days, left, n_runs) in
        [(35, vec![1, 2, 3, 4, 5], 3), (25, vec![3, 4, 5], 2), (15, vec![4, 5], 1), (0, vec![], 0)]
    {
        let (root, names) = store();
        let wanted = Wanted { since: Some(now() - days * DAY), ..Wanted::default() };
        assert_eq!(swept(root.path(), &wanted), (6 - left.len(), left), "{days} days");
        assert_eq!(run_names(root.path()), names[3 - n_runs..]);
    }
}

#[test]
fn chosen_runs_are_safe_from_age_and_size() {
    for wanted in [
        Wanted { since: Some(now()), ..Wanted::default() },
        Wanted { max_bytes: Some(0), ..Wanted::default() },
    ] {
        let (root, names) = store();
        let wanted = Wanted { runs: Some([names[0].clone()].into()), ..wanted };
        assert_eq!(swept(root.path(), &wanted), (3, vec![1, 2, 3]));
    }
}

#[test]
fn size_is_the_limit_and_what_was_used_longest_ago_goes_first() {
    let (root, _) = store();
    let all = sweep(root.path(), &Wanted::default(), Sweep::Wet).unwrap().left;
    // No run used 6; of the records of one run, the object of 2 took less time for its size.
    for (less, left) in [
        (0, vec![1, 2, 3, 4, 5, 6]),
        (1, vec![1, 2, 3, 4, 5]),
        (11_000, vec![1, 3, 4, 5]),
        (20_300, vec![3, 4, 5]),
        (30_000, vec![4, 5]),
        (41_000, vec![]),
    ] {
        let (root, _) = store();
        let wanted = Wanted { max_bytes: Some(all - less), ..Wanted::default() };
        let (_, found) = swept(root.path(), &wanted);
        assert_eq!(found, left, "{less} bytes less");
        assert_eq!(run_names(root.path()).len(), 3);
    }
}

#[test]
fn kept_runs_and_locked_outputs_are_roots() {
    for wanted in [
        Wanted { runs: Some(BTreeSet::new()), ..Wanted::default() },
        Wanted { since: Some(now()), ..Wanted::default() },
        Wanted { max_bytes: Some(0), ..Wanted::default() },
    ] {
        let (root, names) = store();
        keep(root.path(), &names[1]);
        let locked = [Digest::of(&[1; 10]), Digest::of(&[6; 10_000]), Digest::of(b"other")];
        let wanted = Wanted { locked: locked.into(), ..wanted };
        assert_eq!(swept(root.path(), &wanted), (2, vec![1, 3, 4, 6]), "{wanted:?}");
        assert!(run_names(root.path()).contains(&names[1]));
        // Once it is forgotten, what it used goes.
        let history = History::open(root.path()).unwrap();
        history.forget(&find(&history, &names[1])).unwrap();
        drop(history);
        assert_eq!(swept(root.path(), &wanted), (2, vec![1, 6]), "{wanted:?}");
    }
}

#[test]
fn a_kept_run_whose_list_is_lost_stops_sweeps_and_can_not_be_kept() {
    let everything = Wanted { since: Some(now()), ..Wanted::default() };
    let (root, names) = store();
    keep(root.path(), &names[0]);
    for list in files(&root.path().join("keys")) {
        fs::remove_file(list).unwrap();
    }
    let error = sweep(root.path(), &everything, Sweep::Wet).unwrap_err();
    assert!(matches!(error, CacheError::NoKeys { run, .. } if run == names[0]));
    assert_eq!(known(root.path()), [1, 2, 3, 4, 5, 6]);
    let history = History::open(root.path()).unwrap();
    let error = history.keep(&find(&history, &names[1])).unwrap_err();
    assert!(matches!(error, CacheError::NoKeys { run, .. } if run == names[1]));
    drop(history);

    let (root, names) = store();
    keep(root.path(), &names[0]);
    let file = files(&root.path().join("runs")).remove(0);
    flip(&file, 40);
    let error = sweep(root.path(), &everything, Sweep::Wet).unwrap_err();
    assert!(matches!(error, CacheError::NoKeys { path, .. } if path == file));
    assert_eq!(known(root.path()), [1, 2, 3, 4, 5, 6]);
}

fn flip(path: &Path, at: usize) {
    let mut bytes = fs::read(path).unwrap();
    bytes[at] ^= 1;
    fs::remove_file(path).unwrap();
    fs::write(path, bytes).unwrap();
}

#[test]
fn checkpoints_go_that_nobody_went_on_with() {
    let (root, _) = store();
    let checkpoints = Cache::open(root.path(), "x86").unwrap().checkpoints();
    let days = |days| SystemTime::now() - Duration::from_millis(days * DAY);
    for (n, age) in [(1, 8), (2, 6), (3, 1)] {
        checkpoints.save(&key(n), b"state").unwrap();
        let path = root.path().join("checkpoints").join(key(n).to_string());
        File::open(path).unwrap().set_modified(days(age)).unwrap();
    }
    let there = || [1, 2, 3].map(|n| checkpoints.load(&key(n)).is_some());
    assert_eq!(sweep(root.path(), &Wanted::default(), Sweep::Wet).unwrap().checkpoints, 1);
    assert_eq!(there(), [false, true, true]);
    let wanted = Wanted { since: Some(now() - 3 * DAY), ..Wanted::default() };
    assert_eq!(sweep(root.path(), &wanted, Sweep::Wet).unwrap().checkpoints, 1);
    assert_eq!(there(), [false, false, true]);
}

#[test]
fn a_store_in_use_is_not_swept_and_its_user_is_named() {
    let (root, _) = store();
    let cache = Cache::open(root.path(), "x86").unwrap();
    let none = Wanted { since: Some(now()), ..Wanted::default() };
    let error = sweep(root.path(), &none, Sweep::Wet).unwrap_err();
    assert!(matches!(error, CacheError::Busy { .. }));
    if cfg!(target_os = "linux") {
        let error = error.to_string();
        assert!(error.contains(&format!("process {} (`", std::process::id())), "{error}");
    }
    assert!(matches!(rebuild(root.path()), Err(CacheError::Busy { .. })));
    assert_eq!(sweep(root.path(), &none, Sweep::Dry).unwrap().records, 6);
    drop(cache);
    assert_eq!(swept(root.path(), &none), (6, vec![]));
}

#[test]
fn journals_keep_their_age_and_their_number_is_small() {
    let root = tempfile::tempdir().unwrap();
    let root = root.path();
    for n in 1..=12 {
        add(root, &[(n, 10)]);
        let path = files(&root.join("journal")).pop().unwrap();
        let time = SystemTime::now() - Duration::from_millis(u64::from(n) * 10 * DAY);
        File::open(path).unwrap().set_modified(time).unwrap();
    }
    // Ten days apart, none shares its week.
    assert_eq!(swept(root, &Wanted::default()), (0, (1..=12).collect()));
    assert_eq!(files(&root.join("journal")).len(), 12);
    let wanted = Wanted { since: Some(now() - 55 * DAY), ..Wanted::default() };
    assert_eq!(swept(root, &wanted), (7, (1..=5).collect()));
    age(root, 3);
    let before = files(&root.join("journal"));
    assert_eq!(swept(root, &Wanted::default()), (0, (1..=5).collect()));
    let merged = files(&root.join("journal"));
    assert!(merged.len() == 1 && !before.contains(&merged[0]));
    assert_eq!(swept(root, &Wanted::default()), (0, (1..=5).collect()));
    assert_eq!(files(&root.join("journal")), merged, "nothing to merge, nothing written");
}

#[test]
fn what_is_damaged_is_found_put_aside_and_what_is_whole_saved() {
    let (root, _) = store();
    let root = root.path();
    Cache::open(root, "x86").unwrap().checkpoints().save(&key(1), b"state").unwrap();
    let whole = check(root).unwrap();
    assert_eq!((whole.records, whole.objects, whole.object_bytes), (6, 4, 40_000));
    assert_eq!((whole.checkpoints, whole.runs, whole.gone), (1, 3, 0));
    assert_eq!((whole.damaged, whole.mended), (vec![], false));

    let objects = files(&root.join("objects"));
    flip(&objects[0], 9999);
    fs::remove_file(&objects[1]).unwrap();
    flip(&files(&root.join("checkpoints"))[0], 3);
    let run = files(&root.join("runs")).remove(1);
    flip(&run, 33);
    let list = root.join("keys").join(Digest::of(&[[4; 32], [5; 32]].concat()).to_string());
    flip(&list, 0);
    let journal = files(&root.join("journal")).remove(0);
    flip(&journal, 40);
    let found = check(root).unwrap();
    assert_eq!((found.records, found.objects, found.gone), (5, 2, 2), "{found:?}");
    assert_eq!((found.checkpoints, found.runs, found.mended), (0, 2, true));
    let of = |kind: fn(&Trouble) -> bool| found.damaged.iter().filter(|t| kind(t)).count();
    assert_eq!(of(|t| matches!(t, Trouble::DamagedFile { moved_to, .. } if moved_to.exists())), 2);
    assert_eq!(of(|t| matches!(t, Trouble::DamagedRun { kept: false, .. })), 1);
    assert_eq!(of(|t| matches!(t, Trouble::DamagedKeys { .. })), 1);
    assert_eq!(of(|t| matches!(t, Trouble::DamagedRecord { .. })), 1);
    assert_eq!(found.damaged.len(), 5);
    assert!(!journal.exists() && !run.exists() && !list.exists());
    assert_eq!(files(&root.join("corrupt")).len(), 5);

    let again = check(root).unwrap();
    // A run whose list is gone is told of until it is forgotten.
    assert!(matches!(&again.damaged[..], [Trouble::DamagedKeys { .. }]), "{again:?}");
    assert_eq!((again.records, again.gone), (5, 2));
    let history = History::open(root).unwrap();
    history.runs.iter().for_each(|run| history.forget(run).unwrap());
    drop(history);
    assert_eq!(check(root).unwrap().damaged, []);
}

#[test]
fn a_store_in_use_is_checked_and_its_journals_left() {
    let (root, _) = store();
    let root = root.path();
    let journal = files(&root.join("journal")).remove(0);
    flip(&journal, 40);
    let mut cache = Cache::open(root, "x86").unwrap();
    cache.hints().note_millis("odd@1", 1);
    cache.close().unwrap();
    let cache = Cache::open(root, "x86").unwrap();
    let hints = File::create(root.join("locks").join("hints")).unwrap();
    hints.lock().unwrap();
    let found = check(root).unwrap();
    assert!(matches!(found.damaged[..], [Trouble::DamagedRecord { .. }]), "{found:?}");
    assert!(!found.mended && journal.exists());
    drop((cache, hints));
    assert!(check(root).unwrap().mended && !journal.exists());
}

#[test]
fn what_can_be_lost_is_made_anew() {
    let (root, _) = store();
    let root = root.path();
    let last = files(&root.join("journal")).pop().unwrap();
    let len = fs::metadata(&last).unwrap().len();
    File::options().append(true).open(&last).unwrap().set_len(len - 3).unwrap();
    let mut cache = Cache::open(root, "x86").unwrap();
    cache.hints().note_millis("odd@1", 1_000_000);
    cache.close().unwrap();

    let Rebuilt { records, journals, ops, troubles } = rebuild(root).unwrap();
    // The torn one was cut this moment, the others are from another week.
    assert_eq!((records, journals, ops), (5, (3, 2), 2));
    assert!(matches!(troubles[..], [Trouble::TornJournal { .. }]));
    let mut cache = Cache::open(root, "x86").unwrap();
    assert_eq!(cache.troubles(), []);
    // The means of 1, 3 and 5, and of 2 and 4.
    assert_eq!(cache.hints().expected_millis("odd@1"), Some(3));
    assert_eq!(cache.hints().expected_millis("even@1"), Some(3));
    drop(cache);
    fs::remove_dir_all(root.join("journal")).unwrap();
    let mut cache = Cache::open(root, "x86").unwrap();
    assert_eq!(cache.hints().expected_millis("even@1"), Some(3), "they lie in sled");
}
