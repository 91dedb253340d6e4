//! Nodes that other machines run: the same results, whatever becomes of the machines.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use ivx_cache::{Cache, Digest, Folder, Mode, Second};
use ivx_engine::{
    Came, Crew, Event, Listen, News, Options, Plan, Room, Stop, Ticket, Word, expand, platform,
    report, schedule_on, wanted,
};
use ivx_grammar::check::{File, Project, Settings, check};
use ivx_grammar::{ir, parse};
use ivx_op::{Args, Array, Ctx, Dim, Labels, Needs, One, Op, OpError, Registry, Shapes, declare};
use tempfile::TempDir;

const SPEC: &str = r#"edition "2026"

experiment away {
    axis i = 0..6
    let small = leaf(x: i)
    let large = wide(of: small)
    let picky = odd(of: small)
    measure sum = total(left: large, right: picky)
}
"#;
/// One is odd, and what needs it is skipped.
const N_NODES: usize = 4 * 6;

declare! {
    /// A number: it lies inside its record.
    struct Leaf = "leaf" @ 1 -> Array {
        /// Which.
        x: f64;
    }
}

impl Op for Leaf {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        Ok(Array::scalar(self.x))
    }
}

declare! {
    /// A thousand numbers: an object.
    struct Wide = "wide" @ 1 -> Array [n] {
        /// Where they begin.
        of: One<Array>;
        /// How much memory it takes, in bytes.
        memory: usize = 7;
    }
}

impl Op for Wide {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let numbers: Vec<f64> = (0..1000).map(f64::from).collect();
        let values = numbers.iter().map(|n| self.of.0.values[0] + n).collect();
        Ok(Array::series(Dim::new("n", Labels::Numbers(numbers)), values))
    }

    fn needs(_: &Args, _: Option<&Shapes>, _: u64) -> Needs {
        Needs { threads: 1, memory: 7 }
    }
}

declare! {
    /// A number, unless it is three.
    struct Odd = "odd" @ 1 -> Array {
        /// Of what.
        of: One<Array>;
    }
}

impl Op for Odd {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let x = self.of.0.values[0];
        if x == 3.0 { Err(OpError::Failed("it is three".into())) } else { Ok(Array::scalar(x)) }
    }
}

declare! {
    /// The sum of all numbers of both.
    struct Total = "total" @ 1 -> Array {
        /// These.
        left: One<Array>;
        /// And those.
        right: One<Array>;
    }
}

impl Op for Total {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        Ok(Array::scalar(self.left.0.values.iter().chain(&self.right.0.values).sum()))
    }
}

fn registry() -> Registry {
    Registry::default().op::<Leaf>().op::<Wide>().op::<Odd>().op::<Total>()
}

fn options(library: &str) -> Options {
    Options {
        jobs: 1,
        memory: u64::MAX,
        fail_fast: false,
        library: library.into(),
        checkpoint: Duration::ZERO,
        limit: None,
        stop: Stop::default(),
    }
}

fn second(store: &Path) -> Second {
    let folder = Folder::create(store).expect("a folder");
    Second::new(Box::new(folder), "store".into(), Mode::Write).expect("it lists")
}

/// What becomes of batches.
#[derive(Clone, Copy, PartialEq)]
enum Luck {
    /// They run.
    Runs,
    /// Machines are lost under them, and they run on another.
    Loses,
    /// They are said to have run.
    Lies,
    /// Whoever hands them out is gone after so many.
    Ends(u64),
}

/// Who is told what becomes of batches.
type Listener = Box<dyn FnMut(News) + Send>;

/// A machine that runs one batch at a time, and shares no more than the store.
struct Machine {
    store: PathBuf,
    own: PathBuf,
    library: &'static str,
    luck: Luck,
    memory: u64,
    tell: Arc<Mutex<Option<Listener>>>,
    ran: Arc<Mutex<Vec<Digest>>>,
}

impl Machine {
    fn new(store: &Path, own: &Path, luck: Luck) -> Self {
        Self {
            store: store.to_owned(),
            own: own.to_owned(),
            library: "toy",
            luck,
            memory: 100,
            tell: Arc::default(),
            ran: Arc::default(),
        }
    }
}

impl Crew for Machine {
    fn room(&self) -> Room {
        Room { threads: 2, largest: Needs { threads: 1, memory: self.memory } }
    }

    fn begin(&self, tell: Listener) -> io::Result<()> {
        *self.tell.lock().expect("nobody panics") = Some(tell);
        Ok(())
    }

    fn run(&self, batch: u64, keys: &[Digest], _: Needs) -> io::Result<()> {
        let (store, own, library, luck) =
            (self.store.clone(), self.own.clone(), self.library, self.luck);
        let (tell, ran, keys) = (Arc::clone(&self.tell), Arc::clone(&self.ran), keys.to_vec());
        thread::spawn(move || {
            let say = |news| {
                tell.lock().expect("nobody panics").as_mut().expect("somebody listens")(news);
            };
            if luck == Luck::Loses && batch.is_multiple_of(2) {
                say(News::Lost { batch, why: "it was struck by lightning".into() });
            }
            let mut words = Vec::new();
            for key in keys {
                if luck == Luck::Lies {
                    words.push((key, Word::Done(platform())));
                    continue;
                }
                let mut cache = Cache::open(&own, &platform()).expect("it opens");
                cache.attach(second(&store));
                let text =
                    cache.second().expect("there is one").ticket(&key).expect("there is a ticket");
                let ticket = Ticket::read(&text).expect("it reads");
                let find = |_: &_| Err("is nowhere".to_owned());
                let came = ticket.run(&registry(), &mut cache, &options(library), &find);
                assert_eq!(cache.close().expect("it closes"), []);
                ran.lock().expect("nobody panics").push(key);
                words.push((
                    key,
                    match came.expect("the cache works") {
                        Ok(Came::Done) => Word::Done(platform()),
                        Ok(Came::Failed(why)) => Word::Failed(why),
                        Ok(Came::Missing(digest)) => Word::Missing(digest),
                        Ok(Came::Stopped) => unreachable!("nobody stops it"),
                        Err(refused) => Word::Refused(refused.to_string()),
                    },
                ));
            }
            say(News::Done { batch, words, why: String::new() });
            if luck == Luck::Ends(batch) {
                say(News::Gone { why: "it was killed".into() });
            }
        });
        Ok(())
    }

    fn cancel(&self, _: u64) -> io::Result<()> {
        Ok(())
    }
}

struct Experiment {
    spec: ir::Spec,
    plan: Plan,
}

impl Experiment {
    fn new() -> Self {
        let (ast, faults) = parse(SPEC, 0);
        assert_eq!(faults, []);
        let file = File { stem: "a".into(), text: SPEC.into(), ast: ast.into(), ..File::default() };
        let project = Project { files: vec![file] };
        let (spec, faults) = check(&project, &registry(), &Settings::default());
        assert_eq!(faults, []);
        let plan = expand(&spec, &registry());
        assert_eq!(plan.graph.node_count(), N_NODES);
        Self { spec, plan }
    }

    /// The results of a run, and what it told.
    fn run(&self, root: &Path, store: Option<&Path>, crew: Option<&dyn Crew>) -> (String, Told) {
        let mut cache = Cache::open(root, &platform()).expect("it opens");
        if let Some(store) = store {
            cache.attach(second(store));
        }
        let mut told = Told::default();
        let registry = registry();
        let outcome = schedule_on(
            crew,
            (&self.plan, &registry),
            &mut cache,
            &options("toy"),
            &wanted(&self.plan),
            &mut told,
        );
        let outcome = outcome.expect("the cache works");
        assert_eq!(cache.close().expect("it closes"), []);
        (report("away", &self.spec, &self.plan, &outcome).results.to_ron(), told)
    }
}

#[derive(Default)]
struct Told {
    started: BTreeSet<String>,
    finished: usize,
    failed: Vec<String>,
    noted: Vec<String>,
}

impl Listen for Told {
    fn event(&mut self, event: Event<'_>) {
        match event {
            Event::Started { address, .. } => drop(self.started.insert(address.to_owned())),
            Event::Finished { .. } => self.finished += 1,
            Event::Failed { address, why } => self.failed.push(format!("{address}: {why}")),
            Event::Noted { what } => self.noted.push(what),
            _ => {}
        }
    }
}

/// A cache, a store, and the cache of another machine.
fn places() -> (TempDir, [PathBuf; 3]) {
    let folder = tempfile::tempdir().expect("folders can be made");
    let places = ["here", "store", "there"].map(|name| folder.path().join(name));
    (folder, places)
}

#[test]
fn other_machines_come_to_the_same_results() {
    let experiment = Experiment::new();
    let (_folder, [here, store, there]) = places();
    let (expected, alone) = experiment.run(&here.with_extension("alone"), None, None);
    assert_eq!(alone.failed, ["away/picky[i=3]: it is three"]);
    let machine = Machine::new(&store, &there, Luck::Runs);
    let (results, told) = experiment.run(&here, Some(&store), Some(&machine));
    assert_eq!(results, expected);
    assert_eq!(told.failed, alone.failed);
    // What is skipped is the sum of the one that failed.
    assert_eq!((told.finished, machine.ran.lock().unwrap().len()), (N_NODES - 2, N_NODES - 1));
    // The next run knows all of it, from the store too.
    for cache in [&here, &here.with_extension("new")] {
        let (results, told) = experiment.run(cache, Some(&store), None);
        assert_eq!(results, expected);
        assert_eq!(told.started, BTreeSet::from(["away/picky[i=3]".to_owned()]));
    }
}

#[test]
fn lost_machines_cost_time_only() {
    let experiment = Experiment::new();
    let (_folder, [here, store, there]) = places();
    let (expected, _) = experiment.run(&here.with_extension("alone"), None, None);
    let machine = Machine::new(&store, &there, Luck::Loses);
    let (results, told) = experiment.run(&here, Some(&store), Some(&machine));
    assert_eq!(results, expected);
    assert!(told.noted.iter().all(|note| note.contains("struck by lightning")), "{:?}", told.noted);
    assert!(told.noted.len() > 5);
}

#[test]
fn what_is_said_is_not_believed() {
    let experiment = Experiment::new();
    let (_folder, [here, store, there]) = places();
    let machine = Machine::new(&store, &there, Luck::Lies);
    let (_, told) = experiment.run(&here, Some(&store), Some(&machine));
    assert_eq!((told.finished, told.failed.len()), (0, 6));
    let none = "away/small[i=0]: it came back without a result: nothing is said of it";
    assert!(told.failed.contains(&none.to_owned()), "{:?}", told.failed);
}

#[test]
fn another_version_is_refused_before_any_work() {
    let experiment = Experiment::new();
    let (_folder, [here, store, there]) = places();
    let machine = Machine { library: "other", ..Machine::new(&store, &there, Luck::Runs) };
    let (_, told) = experiment.run(&here, Some(&store), Some(&machine));
    assert_eq!(told.finished, 0);
    let refused =
        "the ticket is of library toy, and this is other: install the same ivx on all machines";
    assert!(told.failed[0].ends_with(refused), "{:?}", told.failed);
    assert!(told.failed.len() < 6, "nothing more is begun");
}

#[test]
fn what_was_done_before_the_end_is_not_done_again() {
    let experiment = Experiment::new();
    let (_folder, [here, store, there]) = places();
    let (expected, _) = experiment.run(&here.with_extension("alone"), None, None);
    let machine = Machine::new(&store, &there, Luck::Ends(7));
    let (_, first) = experiment.run(&here, Some(&store), Some(&machine));
    assert!(first.finished >= 5, "{}", first.finished);
    assert!(
        first.failed.iter().all(|why| why.ends_with("it was killed") || why.ends_with("three"))
    );
    let mut once: BTreeSet<Digest> = machine.ran.lock().unwrap().iter().copied().collect();
    let again = Machine::new(&store, &there, Luck::Runs);
    let (results, _) = experiment.run(&here, Some(&store), Some(&again));
    assert_eq!(results, expected);
    let three: Vec<Digest> =
        again.ran.lock().unwrap().iter().copied().filter(|key| !once.insert(*key)).collect();
    // What failed runs again, and what ended unheard is known.
    assert!(three.len() <= 1, "{three:?}");
    assert_eq!(once.len(), N_NODES - 1);
}

#[test]
fn more_memory_than_any_machine_has_is_an_error() {
    let experiment = Experiment::new();
    let (_folder, [here, store, there]) = places();
    let machine = Machine { memory: 6, ..Machine::new(&store, &there, Luck::Runs) };
    let (_, told) = experiment.run(&here, Some(&store), Some(&machine));
    let large = "away/large[i=0]: it needs 1 MB of memory, and the largest machine has 0 MB";
    assert!(told.failed.contains(&large.to_owned()), "{:?}", told.failed);
}
