//! Runs of small graphs of toy operations.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use ivx_cache::Cache;
use ivx_engine::{
    Fate, Fed, Options, Outcome, Plan, Silence, Source, Step, Stop, Verified, platform, schedule,
    verify,
};
use ivx_op::{Args, Array, Artifact as _, Ctx, Dim, Labels, Named, Op, OpError, Registry, declare};
use petgraph::graph::NodeIndex;

declare! {
    /// The sum of what it is given and `x`, many times over so that it is an object.
    struct Plus = "plus" @ 1 -> Array [n] {
        /// What is summed.
        of: Named<Array>;
        /// What is added.
        x: f64;
    }
}

impl Op for Plus {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        if self.x == 13.0 {
            return Err(OpError::Failed("unlucky".to_owned()));
        }
        assert!(self.x != 666.0, "worse than unlucky");
        let sum: f64 = self.of.0.values.iter().map(|array| array.values[0]).sum();
        let labels = Labels::Numbers((0..1000).map(f64::from).collect());
        Ok(Array::series(Dim::new("n", labels), vec![sum + self.x; 1000]))
    }
}

static CALLS: AtomicUsize = AtomicUsize::new(0);

declare! {
    /// Another number each time it is called: what an operation must not be.
    struct Fickle = "fickle" @ 1 -> Array {}
}

impl Op for Fickle {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let calls = CALLS.fetch_add(1, Ordering::SeqCst);
        let labels = Labels::Numbers((0..1000).map(f64::from).collect());
        Ok(Array::series(
            Dim::new("n", labels),
            // Ten apart: what others make of one by adding a little is the bytes of none.
            vec![10.0 * f64::from(u32::try_from(calls).expect("few calls")); 1000],
        ))
    }
}

declare! {
    /// Nearly the same number each time it is called, as on other processors.
    struct Drift = "drift" @ 1 -> Array {}
}

impl Op for Drift {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        static CALLS: AtomicUsize = AtomicUsize::new(0);
        let calls = u32::try_from(CALLS.fetch_add(1, Ordering::SeqCst)).expect("few calls");
        Ok(Array::scalar(1.0 + 1e-9 * f64::from(calls)))
    }
}

/// A plan of `plus` nodes: what each adds, and which earlier nodes it sums.
fn plan(nodes: &[(f64, &[usize])]) -> Plan {
    let mut plan = Plan::default();
    for (i, (x, inputs)) in nodes.iter().enumerate() {
        let sources = inputs.iter().map(|input| Source::Node(NodeIndex::new(*input))).collect();
        let fed = Fed { dims: Vec::new(), sources, labelled: false, name: String::new() };
        let step = Step {
            address: format!("node {i}"),
            op: "plus".into(),
            args: Args::from([("x".into(), (*x).into())]),
            held: vec![],
            ports: vec![("of".into(), vec![fed])],
            draw: None,
            shapes: None,
        };
        let node = plan.graph.add_node(step);
        for input in *inputs {
            plan.graph.add_edge(NodeIndex::new(*input), node, ());
        }
    }
    plan
}

/// Makes a node one of an operation without arguments.
fn become_op(plan: &mut Plan, node: usize, op: &str) {
    let step = &mut plan.graph[NodeIndex::new(node)];
    (step.op, step.args, step.ports) = (op.into(), Args::new(), Vec::new());
}

static STEPS: AtomicUsize = AtomicUsize::new(0);

declare! {
    /// Six steps, the first time broken off in the fourth.
    struct Long = "long" @ 1 -> Array {}
}

impl Op for Long {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let start = ctx.resume().map_or(0, |state| state[0]);
        for t in start..6 {
            ctx.checkpoint(|| vec![t])?;
            if STEPS.fetch_add(1, Ordering::SeqCst) == 3 {
                return Err(OpError::Failed("broken off".to_owned()));
            }
        }
        Ok(Array::scalar(6.0))
    }
}

fn registry() -> Registry {
    Registry::default().op::<Plus>().op::<Fickle>().op::<Drift>().op::<Long>()
}

fn run(plan: &Plan, root: &Path, wanted: &[usize]) -> Outcome {
    let registry = registry();
    let mut cache = Cache::open(root, &platform()).expect("the cache opens");
    let options = Options {
        jobs: 2,
        memory: u64::MAX,
        fail_fast: false,
        library: "toy".into(),
        checkpoint: Duration::ZERO,
        limit: None,
        stop: Stop::default(),
    };
    let wanted: BTreeSet<NodeIndex> = wanted.iter().map(|i| NodeIndex::new(*i)).collect();
    let outcome = schedule(plan, &registry, &mut cache, &options, &wanted, &mut Silence)
        .expect("the cache works");
    cache.close().expect("the cache closes");
    outcome
}

fn fates(outcome: &Outcome) -> String {
    let letter = |fate: &Fate| match fate {
        Fate::Waiting => 'w',
        Fate::Hit => 'h',
        Fate::Ran { .. } => 'r',
        Fate::Failed { .. } => 'f',
        Fate::Skipped { .. } => 's',
    };
    outcome.nodes.iter().map(|node| letter(&node.fate)).collect()
}

fn first_value(outcome: &Outcome, node: usize) -> f64 {
    Array::decode(&outcome.values[&NodeIndex::new(node)]).expect("it decodes").values[0]
}

#[test]
fn failures_and_panics_skip_only_what_depends_on_them() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(&[
        (1.0, &[]),
        (13.0, &[]),
        (2.0, &[0, 1]),
        (666.0, &[0]),
        (3.0, &[3]),
        (4.0, &[0]),
        (5.0, &[2]),
    ]);
    let outcome = run(&plan, folder.path(), &[5]);
    assert_eq!(fates(&outcome), "rfsfsrs");
    assert_eq!(first_value(&outcome, 5), 5.0);
    assert_eq!(outcome.nodes[1].fate, Fate::Failed { why: "unlucky".into() });
    assert!(
        matches!(&outcome.nodes[3].fate, Fate::Failed { why } if why.contains("worse than unlucky"))
    );
    assert_eq!(outcome.nodes[6].fate, Fate::Skipped { cause: NodeIndex::new(1) });
}

#[test]
fn equal_bytes_stop_a_change() {
    let folder = tempfile::tempdir().unwrap();
    run(&plan(&[(1.0, &[]), (2.0, &[]), (5.0, &[0, 1]), (6.0, &[2])]), folder.path(), &[3]);
    // 0 + 3 is what 1 + 2 was: node 2 runs, and gives what it gave.
    let outcome =
        run(&plan(&[(0.0, &[]), (3.0, &[]), (5.0, &[0, 1]), (6.0, &[2])]), folder.path(), &[3]);
    assert_eq!(fates(&outcome), "rrrh");
    // Back again: everything is known.
    let outcome =
        run(&plan(&[(1.0, &[]), (2.0, &[]), (5.0, &[0, 1]), (6.0, &[2])]), folder.path(), &[3]);
    assert_eq!(fates(&outcome), "hhhh");
}

#[test]
fn lost_objects_are_made_again_when_they_are_needed() {
    let folder = tempfile::tempdir().unwrap();
    let chain = [(1.0, [].as_slice()), (2.0, &[0]), (3.0, &[1])];
    let first = first_value(&run(&plan(&chain), folder.path(), &[2]), 2);
    std::fs::remove_dir_all(folder.path().join("objects")).unwrap();
    std::fs::create_dir(folder.path().join("objects")).unwrap();
    // Nobody needs the bytes: still known.
    assert_eq!(fates(&run(&plan(&chain), folder.path(), &[])), "hhh");
    // The last one is wanted, which needs the one before, and so on.
    let outcome = run(&plan(&chain), folder.path(), &[2]);
    assert_eq!(fates(&outcome), "rrr");
    assert_eq!(first_value(&outcome, 2), first);
    // A new user needs the bytes of a known node.
    std::fs::remove_dir_all(folder.path().join("objects")).unwrap();
    std::fs::create_dir(folder.path().join("objects")).unwrap();
    let longer = [chain[0], chain[1], (9.0, &[1])];
    assert_eq!(fates(&run(&plan(&longer), folder.path(), &[2])), "rrr");
}

#[test]
fn a_second_result_for_one_key_names_the_operation() {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = Plan::default();
    let fickle = |op: &str| Step {
        address: "a fickle node".into(),
        op: op.into(),
        args: Args::new(),
        held: vec![],
        ports: Vec::new(),
        draw: None,
        shapes: None,
    };
    plan.graph.add_node(fickle("fickle"));
    assert_eq!(fates(&run(&plan, folder.path(), &[0])), "r");
    std::fs::remove_dir_all(folder.path().join("objects")).unwrap();
    std::fs::create_dir(folder.path().join("objects")).unwrap();
    let outcome = run(&plan, folder.path(), &[0]);
    let Fate::Failed { why } = &outcome.nodes[0].fate else {
        panic!("{:?}", outcome.nodes[0].fate)
    };
    assert!(why.contains("fickle@1") && why.contains("a fickle node"), "{why}");
}

#[test]
fn what_needs_lost_bytes_that_cannot_be_made_again_is_skipped() {
    let folder = tempfile::tempdir().unwrap();
    // The first sums nothing; node 0 is then made fickle.
    let fickle = |nodes: &[(f64, &[usize])]| {
        let mut plan = plan(nodes);
        become_op(&mut plan, 0, "fickle");
        plan
    };
    let known: [(f64, &[usize]); 2] = [(0.0, &[]), (1.0, &[0])];
    assert_eq!(fates(&run(&fickle(&known), folder.path(), &[1])), "rr");
    std::fs::remove_dir_all(folder.path().join("objects")).unwrap();
    std::fs::create_dir(folder.path().join("objects")).unwrap();
    // Node 1 is known, but its bytes are wanted; the others are new. All need those of node 0.
    let nodes = [known[0], known[1], (2.0, &[0]), (3.0, &[0]), (4.0, &[1]), (0.5, &[])];
    let outcome = run(&fickle(&nodes), folder.path(), &[1, 4, 5]);
    assert_eq!(fates(&outcome), "fssssr");
    assert_eq!(outcome.values.keys().map(|node| node.index()).collect::<Vec<_>>(), [5]);
}

/// Asks a run to stop once a node has finished.
struct StopAfter(Stop, usize);

impl ivx_engine::Listen for StopAfter {
    fn event(&mut self, event: ivx_engine::Event<'_>) {
        if matches!(event, ivx_engine::Event::Finished { .. }) {
            self.1 -= 1;
            if self.1 == 0 {
                self.0.ask();
            }
        }
    }
}

#[test]
fn a_run_that_is_stopped_keeps_what_it_did() {
    let folder = tempfile::tempdir().unwrap();
    let chain = plan(&[(1.0, &[]), (2.0, &[0]), (3.0, &[1]), (4.0, &[2])]);
    let registry = Registry::default().op::<Plus>();
    let mut cache = Cache::open(folder.path(), &platform()).unwrap();
    let stop = Stop::default();
    let options = Options {
        jobs: 1,
        memory: u64::MAX,
        fail_fast: false,
        library: "toy".into(),
        checkpoint: Duration::ZERO,
        limit: None,
        stop: stop.clone(),
    };
    let wanted = BTreeSet::from([NodeIndex::new(3)]);
    let mut listen = StopAfter(stop, 2);
    let outcome = schedule(&chain, &registry, &mut cache, &options, &wanted, &mut listen).unwrap();
    cache.close().unwrap();
    assert_eq!(fates(&outcome), "rrww");
    assert_eq!(fates(&run(&chain, folder.path(), &[3])), "hhrr");
}

#[test]
fn what_is_known_is_run_again_and_compared() {
    let folder = tempfile::tempdir().unwrap();
    let mut all = plan(&[(1.0, &[]), (2.0, &[0]), (0.0, &[]), (0.0, &[]), (9.0, &[1])]);
    become_op(&mut all, 2, "fickle");
    become_op(&mut all, 3, "drift");
    let mut known = all.clone();
    known.graph.remove_node(NodeIndex::new(4));
    assert_eq!(fates(&run(&known, folder.path(), &[3])), "rrrr");

    let again = |platform: &str, share: f64| {
        let cache = Cache::open(folder.path(), platform).unwrap();
        verify(&all, &registry(), &cache, share, 2, &mut Silence).unwrap()
    };
    let found = again(&platform(), 1.0);
    // Node 4 is not known.
    let nodes: Vec<usize> = found.iter().map(|(node, _)| node.index()).collect();
    assert_eq!(nodes, [0, 1, 2, 3]);
    assert_eq!([&found[0].1, &found[1].1], [&Verified::Same; 2]);
    assert!(matches!(found[2].1, Verified::Differs { .. }), "{:?}", found[2]);
    assert!(matches!(found[3].1, Verified::Differs { .. }), "close is not enough at home");
    assert_eq!(again(&platform(), 0.0), []);

    let objects = folder.path().join("objects");
    std::fs::remove_dir_all(&objects).unwrap();
    std::fs::create_dir(&objects).unwrap();
    assert_eq!(again(&platform(), 1.0)[1].1, Verified::Gone);
}

#[test]
fn numbers_of_another_platform_may_be_close() {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = plan(&[(0.0, &[])]);
    become_op(&mut plan, 0, "drift");
    let mut cache = Cache::open(folder.path(), "elsewhere").unwrap();
    let array = Array::scalar(1.0 - 1e-8);
    let output = cache.objects().put(&array.encode()).unwrap();
    let key = ivx_engine::key(&plan.graph[NodeIndex::new(0)], &registry(), |_| unreachable!());
    let provenance = ivx_cache::Provenance {
        op: "drift@1".into(),
        node: "node 0".into(),
        inputs: Vec::new(),
        explanation: String::new(),
        library: "toy".into(),
        millis: 1,
    };
    let platform = "elsewhere".to_owned();
    cache.commit(ivx_cache::Record { key, platform, output, provenance }).unwrap();
    let found = verify(&plan, &registry(), &cache, 1.0, 1, &mut Silence).unwrap();
    assert!(matches!(found[0].1, Verified::Close { by } if by < 1e-6), "{found:?}");
}

#[test]
fn what_was_broken_off_goes_on_from_its_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = plan(&[(0.0, &[])]);
    become_op(&mut plan, 0, "long");
    let kept = || std::fs::read_dir(folder.path().join("checkpoints")).unwrap().count();
    assert_eq!(fates(&run(&plan, folder.path(), &[0])), "f");
    assert_eq!((STEPS.load(Ordering::SeqCst), kept()), (4, 1));
    assert_eq!(fates(&run(&plan, folder.path(), &[0])), "r");
    // Steps 3, 4 and 5.
    assert_eq!((STEPS.load(Ordering::SeqCst), kept()), (7, 0));
}
