//! A second store that is slow: it is asked for many at once, and what is put there is put beside the run.

#![expect(clippy::unwrap_used, reason = "a failure of the set-up fails the test")]

use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::sleep;
use std::time::{Duration, Instant};

use ivx_cache::{
    Cache, Committed, Digest, Fetched, Mode, Provenance, Record, Second, Store, StoreError,
};

const N_AT_ONCE: usize = 16;
const DELAY: Duration = Duration::from_millis(20);

/// A store in memory that takes a while for everything.
#[derive(Clone, Debug, Default)]
struct Slow(Arc<Inner>);

#[derive(Debug, Default)]
struct Inner {
    files: Mutex<BTreeMap<String, Vec<u8>>>,
    n_requests: AtomicUsize,
    now: AtomicUsize,
    most: AtomicUsize,
    fails: AtomicBool,
    /// Whether nothing is answered for now.
    hangs: AtomicBool,
}

impl Slow {
    fn request<T>(
        &self,
        name: &str,
        of: impl FnOnce(&mut BTreeMap<String, Vec<u8>>) -> T,
    ) -> Result<T, StoreError> {
        let inner = &self.0;
        inner.n_requests.fetch_add(1, Ordering::SeqCst);
        inner.most.fetch_max(1 + inner.now.fetch_add(1, Ordering::SeqCst), Ordering::SeqCst);
        sleep(DELAY);
        while inner.hangs.load(Ordering::SeqCst) {
            sleep(DELAY);
        }
        inner.now.fetch_sub(1, Ordering::SeqCst);
        if inner.fails.load(Ordering::SeqCst) {
            return Err(StoreError::Failed { name: name.into(), source: io::Error::other("gone") });
        }
        Ok(of(&mut inner.files.lock().unwrap()))
    }

    fn n_files(&self, folder: &str) -> usize {
        self.0.files.lock().unwrap().keys().filter(|name| name.starts_with(folder)).count()
    }

    fn n_requests(&self) -> usize {
        self.0.n_requests.swap(0, Ordering::SeqCst)
    }

    /// The most requests that there were at one time.
    fn most(&self) -> usize {
        self.0.most.swap(0, Ordering::SeqCst)
    }
}

impl Store for Slow {
    fn list(&self, _: &str, _: usize) -> Result<Vec<String>, StoreError> {
        unreachable!("shelves are listed all at once")
    }

    fn shelves(
        &self,
        folder: &str,
        _: usize,
        _: &mut dyn FnMut(StoreError),
    ) -> Result<Vec<String>, StoreError> {
        let below = format!("{folder}/");
        self.request(folder, |files| {
            files.keys().filter_map(|name| name.strip_prefix(&below)).map(str::to_owned).collect()
        })
    }

    fn size(&self, name: &str) -> Result<Option<u64>, StoreError> {
        self.request(name, |files| files.get(name).map(|bytes| bytes.len() as u64))
    }

    fn get(&self, name: &str, _: u64) -> Result<Option<Vec<u8>>, StoreError> {
        self.request(name, |files| files.get(name).cloned())
    }

    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        self.request(name, |files| files.insert(name.into(), bytes.into()))?;
        Ok(())
    }

    fn remove(&self, _: &str) -> Result<(), StoreError> {
        unreachable!("nothing is removed")
    }

    fn create(&self, _: &str, _: &[u8]) -> Result<bool, StoreError> {
        unreachable!("it does not matter who is first")
    }

    fn add(&self, name: &str, bytes: &[u8]) -> Result<bool, StoreError> {
        self.request(name, |files| {
            let records = files.keys().filter(|name| name.starts_with("records/")).count();
            let objects = files.keys().filter(|name| name.starts_with("objects/")).count();
            assert!(objects >= records, "an object comes before its record");
            files.insert(name.into(), bytes.into()).is_none()
        })
    }

    fn n_at_once(&self) -> usize {
        N_AT_ONCE
    }
}

fn cache(root: &Path, store: &Slow, mode: Mode) -> Cache {
    let mut cache = Cache::open(root, "x86").unwrap();
    cache.attach(Second::new(Box::new(store.clone()), "far".into(), mode).unwrap());
    cache
}

/// Commits results of the keys 0 to `n`, each with an object of its own.
fn commit(cache: &mut Cache, n: u8) {
    for n in 0..n {
        let output = cache.objects().put(&vec![n; 5000]).unwrap();
        let provenance = Provenance {
            op: "train@3".into(),
            node: format!("e/model[seed={n}]"),
            inputs: vec![],
            explanation: String::new(),
            library: "feed".into(),
            millis: 40,
        };
        let record = Record { key: Digest([n; 32]), platform: "x86".into(), output, provenance };
        assert_eq!(cache.commit(record).unwrap(), Committed::New);
    }
}

#[test]
fn results_are_put_beside_the_run_and_taken_at_once() {
    let (here, there) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let store = Slow::default();
    let mut writer = cache(here.path(), &store, Mode::Write);
    let began = Instant::now();
    commit(&mut writer, 100);
    assert!(began.elapsed() < 100 * DELAY, "who commits does not wait for the store");
    assert_eq!(writer.close().unwrap(), []);
    assert_eq!((store.n_files("objects/"), store.n_files("records/")), (100, 100));
    assert!(store.most() > N_AT_ONCE / 2);

    let mut reader = cache(there.path(), &store, Mode::Read);
    store.n_requests();
    let keys: Vec<_> = (0..120).map(|n| Digest([n; 32])).collect();
    reader.seek(&keys);
    assert_eq!(store.n_requests(), 200, "a record and whether its object is there");
    assert!(store.most() > N_AT_ONCE / 2);
    let known: Vec<_> = keys.iter().filter_map(|key| reader.lookup(key).cloned()).collect();
    assert_eq!(known.len(), 100);
    reader.objects().bring(known.iter().map(|record| &record.output)).unwrap();
    assert!(store.n_requests() == 100 && store.most() > N_AT_ONCE / 2);
    let read = reader.objects().read(&known[7].output).unwrap();
    assert_eq!(read, Fetched::Bytes(vec![7; 5000].into()));
    assert_eq!(reader.close().unwrap(), []);
    // Once everything is here, nothing is asked for but what there is.
    let mut again = cache(there.path(), &store, Mode::Write);
    again.seek(&keys);
    assert_eq!(again.close().unwrap(), []);
    assert_eq!(store.n_requests(), 1);
}

#[test]
fn what_was_left_is_put_by_the_next_run() {
    let (here, store) = (tempfile::tempdir().unwrap(), Slow::default());
    let mut first = cache(here.path(), &store, Mode::Write);
    store.0.hangs.store(true, Ordering::SeqCst);
    commit(&mut first, 100);
    assert_eq!(first.wait_for_second(DELAY), 100, "a store that hangs holds nobody up");
    first.leave_second();
    store.0.hangs.store(false, Ordering::SeqCst);
    assert_eq!(first.close().unwrap(), []);
    sleep(10 * DELAY);
    assert!(store.n_files("records/") <= N_AT_ONCE);
    let mut second = cache(here.path(), &store, Mode::Write);
    second.seek(&(0..100).map(|n| Digest([n; 32])).collect::<Vec<_>>());
    assert_eq!(second.wait_for_second(Duration::MAX), 0);
    assert_eq!(store.n_files("records/"), 100);
}

#[test]
fn of_many_that_fail_at_once_one_is_told() {
    let (here, store) = (tempfile::tempdir().unwrap(), Slow::default());
    let mut writer = cache(here.path(), &store, Mode::Write);
    commit(&mut writer, 50);
    assert_eq!(writer.wait_for_second(Duration::MAX), 0);
    let other = tempfile::tempdir().unwrap();
    let mut failing = cache(other.path(), &store, Mode::Write);
    store.0.fails.store(true, Ordering::SeqCst);
    store.n_requests();
    failing.seek(&(0..50).map(|n| Digest([n; 32])).collect::<Vec<_>>());
    commit(&mut failing, 50);
    let notes = failing.close().unwrap();
    let said: Vec<_> = notes.iter().map(ToString::to_string).collect();
    assert_eq!(said.len(), 2, "{said:?}");
    assert!(
        said[0].contains("nothing more is read") && said[1].contains("nothing more is written")
    );
    assert!(store.n_requests() <= 2 * N_AT_ONCE, "who fails is not asked for long");
}
