//! A run whose disk dies or fills up at some write goes on from there to the same results.
//!
//! A sample of the writes is tried; `IVX_EVERY_WRITE=1` tries each of them.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

use ivx_cache::faulty::{Failure, Faulty};
use ivx_cache::{Cache, CacheError, Disk, Fetched, Trouble};
use ivx_engine::{Event, Listen, Options, Plan, Stop, expand, platform, report, schedule, wanted};
use ivx_grammar::check::{File, Project, Settings, check};
use ivx_grammar::{ir, parse};
use ivx_op::{Array, Ctx, Dim, Labels, One, Op, OpError, Registry, declare};
use tempfile::TempDir;

const SPEC: &str = r#"edition "2026"

experiment faults {
    axis i = 0..52
    let small = leaf(x: i)
    let large = wide(of: small)
    let long = slow(of: large)
    measure both = total(left: large, right: long)
}
"#;
const N_NODES: usize = 4 * 52;

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
    }
}

impl Op for Wide {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let numbers: Vec<f64> = (0..1000).map(f64::from).collect();
        let values = numbers.iter().map(|n| self.of.0.values[0] + n).collect();
        Ok(Array::series(Dim::new("n", Labels::Numbers(numbers)), values))
    }
}

declare! {
    /// The sum of four parts, kept after each: it goes on from where it was.
    struct Slow = "slow" @ 1 -> Array {
        /// Of what.
        of: One<Array>;
    }
}

impl Op for Slow {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let state = ctx.resume().and_then(|state| <[u8; 16]>::try_from(state).ok());
        let [mut t, mut sum] = state.map_or([0.0; 2], |state| {
            let (t, sum) = state.split_at(8);
            [t, sum].map(|half| f64::from_le_bytes(half.try_into().expect("half of 16 bytes")))
        });
        while t < 4.0 {
            let part = self.of.0.values.iter().map(|x| (x + t).sqrt());
            (sum, t) = (sum + part.sum::<f64>(), t + 1.0);
            ctx.checkpoint(|| [t.to_le_bytes(), sum.to_le_bytes()].concat())?;
        }
        Ok(Array::scalar(sum))
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

/// The spec, ready to run.
struct Experiment {
    registry: Registry,
    spec: ir::Spec,
    plan: Plan,
}

impl Experiment {
    fn new() -> Self {
        let registry = Registry::default().op::<Leaf>().op::<Wide>().op::<Slow>().op::<Total>();
        let (ast, faults) = parse(SPEC, 0);
        assert_eq!(faults, []);
        let file =
            File { stem: "faults".into(), text: SPEC.into(), ast: ast.into(), ..File::default() };
        let project = Project { files: vec![file] };
        let (spec, faults) = check(&project, &registry, &Settings::default());
        assert_eq!(faults, []);
        let plan = expand(&spec, &registry);
        assert_eq!(plan.graph.node_count(), N_NODES);
        Self { registry, spec, plan }
    }

    /// The results of a run, or what kept it from them.
    fn run(&self, disk: Disk, root: &Path, told: &mut Told) -> Result<String, CacheError> {
        let mut cache = Cache::open_on(disk, root, &platform())?;
        let options = Options {
            jobs: 1,
            memory: u64::MAX,
            fail_fast: false,
            library: "toy".into(),
            checkpoint: Duration::ZERO,
            limit: None,
            stop: Stop::default(),
        };
        let wanted = wanted(&self.plan);
        let outcome = schedule(&self.plan, &self.registry, &mut cache, &options, &wanted, told);
        cache.close()?;
        Ok(report("faults", &self.spec, &self.plan, &outcome?).results.to_ron())
    }

    /// Runs what a run with faults left, and says that nothing done was done again.
    fn goes_on(&self, root: &Path, before: &Told, expected: &str, place: &str) {
        let cache = Cache::open(root, &platform()).expect("the cache opens again");
        let known: BTreeSet<String> =
            cache.records().map(|record| record.provenance.node.clone()).collect();
        drop(cache);
        assert!(known.is_superset(&before.finished), "{place}: what was committed is known");
        let mut told = Told::default();
        let results = self.run(Disk::default(), root, &mut told).expect("the disk works again");
        assert!(told.started.is_disjoint(&known), "{place}: what is known is not run again");
        assert_eq!(told.started.len() + known.len(), N_NODES, "{place}");
        assert!(results == expected, "{place}: the results are the same");
    }
}

/// What a run told of its nodes.
#[derive(Default)]
struct Told {
    started: BTreeSet<String>,
    finished: BTreeSet<String>,
}

impl Listen for Told {
    fn event(&mut self, event: Event<'_>) {
        match event {
            Event::Started { address, .. } => drop(self.started.insert(address.to_owned())),
            Event::Finished { address, .. } => drop(self.finished.insert(address.to_owned())),
            _ => {}
        }
    }
}

/// A folder; in memory where there is one, since what is tried here is no loss of power.
fn folder() -> TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).expect("folders can be made")
}

/// The results of a run without faults, and how many writes it takes.
fn whole(experiment: &Experiment) -> (String, usize) {
    let (root, faulty) = (folder(), Faulty::never());
    let results = experiment.run(faulty.disk(), root.path(), &mut Told::default());
    (results.expect("the disk works"), faulty.n_writes())
}

/// All writes of a run, or some `n` of them: those of opening and closing, and a few between.
fn some(n_writes: usize, n: usize) -> Vec<usize> {
    if std::env::var_os("IVX_EVERY_WRITE").is_some() {
        return (0..n_writes).collect();
    }
    let ends = n / 4;
    let between = (ends..n_writes - ends).step_by((n_writes - 2 * ends) / (n - 2 * ends));
    (0..ends).chain(between).chain(n_writes - ends..n_writes).collect()
}

#[test]
fn a_run_that_dies_at_any_write_goes_on_to_the_same_results() {
    let experiment = Experiment::new();
    let (expected, n_writes) = whole(&experiment);
    assert!(n_writes > 5 * N_NODES, "{n_writes} writes");
    let (mut died, writes) = (0, some(n_writes, 80));
    for &write in &writes {
        let root = folder();
        let mut told = Told::default();
        let disk = Faulty::from(write, Failure::Death(write * 7919 % 1000)).disk();
        died += usize::from(experiment.run(disk, root.path(), &mut told).is_err());
        experiment.goes_on(root.path(), &told, &expected, &format!("death at write {write}"));
    }
    // Without the hints, a run is whole all the same.
    assert!(died + 40 > writes.len(), "{died} of {} deaths are errors", writes.len());
}

#[test]
fn a_full_disk_is_told_and_the_run_goes_on_once_there_is_room() {
    let experiment = Experiment::new();
    let (expected, n_writes) = whole(&experiment);
    for (i, &write) in some(n_writes, 48).iter().enumerate() {
        let failure = [Failure::Full, Failure::Quota, Failure::Stuck][i % 3];
        let place = format!("{failure:?} at write {write}");
        let root = folder();
        let mut told = Told::default();
        let disk = Faulty::from(write, failure).disk();
        match experiment.run(disk, root.path(), &mut told) {
            Err(error) => {
                assert!(
                    matches!(&error, CacheError::Full { path, .. } if path.starts_with(&root)),
                    "{place}: {error}"
                );
                assert!(error.to_string().contains("the disk is full"), "{error}");
            }
            Ok(results) => assert!(results == expected, "{place}: only hints are lost"),
        }
        let mut cache = Cache::open(root.path(), &platform()).expect("the cache opens again");
        let torn = |trouble: &Trouble| matches!(trouble, Trouble::TornJournal { .. });
        let troubles = cache.troubles();
        assert!(
            matches!(failure, Failure::Stuck) && troubles.iter().all(torn) || troubles.is_empty(),
            "{place}: {troubles:?}"
        );
        for record in cache.records() {
            let read = cache.objects().read(&record.output).expect("the disk works");
            assert!(matches!(read, Fetched::Bytes(_)), "{place}: {read:?}");
        }
        drop(cache);
        experiment.goes_on(root.path(), &told, &expected, &place);
    }
}
