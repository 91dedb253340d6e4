//! What runs at once, and in which order: toy operations that write down when they run.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Mutex;
use std::thread;
use std::time::Duration;

use ivx_cache::Cache;
use ivx_engine::{
    Event, Fed, Listen, Options, Outcome, Plan, Source, Step, Stop, platform, schedule,
};
use ivx_op::{
    Args, Array, Ctx, Dim, Labels, Lit, Named, Needs, Op, OpError, Registry, Shapes, declare,
};
use petgraph::graph::NodeIndex;

/// What toys have written down, by the test that they belong to.
static TOLD: Mutex<BTreeMap<String, Told>> = Mutex::new(BTreeMap::new());

#[derive(Clone, Debug, Default, PartialEq)]
struct Told {
    /// The toys in the order in which they started.
    order: Vec<i64>,
    /// What each one running now needs.
    now: BTreeMap<i64, Needs>,
    most_at_once: usize,
    most_threads: usize,
    most_memory: u64,
    /// Those that were never beside another.
    alone: BTreeSet<i64>,
}

macro_rules! toy {
    ($(#[doc = $doc:literal] $ty:ident = $name:literal for $millis:literal;)+) => {$(
        declare! {
            #[doc = $doc]
            struct $ty = $name @ 1 -> Array [n] {
                /// The test that it belongs to.
                test: String;
                /// Which one it is.
                id: i64;
                /// How many threads it needs.
                threads: usize = 1;
                /// How much memory it needs, in bytes.
                memory: usize = 0;
                /// How often the bytes of its inputs it needs besides.
                copies: usize = 0;
                /// What it comes after.
                after: Named<Array>;
            }
        }

        impl Op for $ty {
            fn run(&self, _: &Ctx) -> Result<Array, OpError> {
                let bytes: usize = self.after.0.values.iter().map(|x| x.values.len() * 8).sum();
                let memory = (self.memory + self.copies * bytes) as u64;
                begin(&self.test, self.id, Needs { threads: self.threads, memory });
                thread::sleep(Duration::from_millis($millis));
                end(&self.test, self.id);
                let labels = Labels::Numbers((0..1000).map(f64::from).collect());
                #[expect(clippy::cast_precision_loss, reason = "there are few toys")]
                let values = vec![self.id as f64; 1000];
                Ok(Array::series(Dim::new("n", labels), values))
            }

            fn needs(args: &Args, _: Option<&Shapes>, input_bytes: u64) -> Needs {
                let number = |name: &str| match args.get(name) {
                    Some(Lit::Int(n)) => n.unsigned_abs(),
                    _ => 0,
                };
                let threads = usize::try_from(number("threads")).expect("there are few threads");
                Needs { threads, memory: number("memory") + number("copies") * input_bytes }
            }
        }
    )+};
}

toy! {
    /// A toy that is over soon.
    Short = "short" for 2;
    /// A toy that takes its time.
    Long = "long" for 120;
}

fn begin(test: &str, id: i64, needs: Needs) {
    let mut told = TOLD.lock().expect("no toy panics");
    let told = told.entry(test.to_owned()).or_default();
    told.order.push(id);
    told.now.insert(id, needs);
    if told.now.len() == 1 {
        told.alone.insert(id);
    } else {
        told.alone.retain(|id| !told.now.contains_key(id));
    }
    told.most_at_once = told.most_at_once.max(told.now.len());
    told.most_threads = told.most_threads.max(told.now.values().map(|needs| needs.threads).sum());
    told.most_memory = told.most_memory.max(told.now.values().map(|needs| needs.memory).sum());
}

fn end(test: &str, id: i64) {
    let mut told = TOLD.lock().expect("no toy panics");
    told.get_mut(test).expect("it began").now.remove(&id);
}

fn told(test: &str) -> Told {
    TOLD.lock().expect("no toy panics").remove(test).unwrap_or_default()
}

/// A toy to be: its operation, arguments besides its number, and the toys that it comes after.
type Toy<'a> = (&'a str, &'a [(&'a str, i64)], &'a [usize]);

/// - `first`: the number of the first toy.
fn plan(test: &str, first: i64, toys: &[Toy]) -> Plan {
    let mut plan = Plan::default();
    for (id, (op, needs, after)) in (first..).zip(toys) {
        let sources = after.iter().map(|input| Source::Node(NodeIndex::new(*input))).collect();
        let fed = Fed { dims: Vec::new(), sources, labelled: false, name: String::new() };
        let mut args = Args::from([("test".into(), test.into()), ("id".into(), id.into())]);
        for (name, default) in [("threads", 1), ("memory", 0), ("copies", 0)] {
            let given = needs.iter().find(|(given, _)| *given == name);
            args.insert(name.into(), given.map_or(default, |(_, n)| *n).into());
        }
        let node = plan.graph.add_node(Step {
            address: format!("toy {id}"),
            op: (*op).into(),
            args,
            held: Vec::new(),
            ports: vec![("after".into(), vec![fed])],
            draw: None,
            shapes: None,
        });
        for input in *after {
            plan.graph.add_edge(NodeIndex::new(*input), node, ());
        }
    }
    plan
}

#[derive(Default)]
struct Notes(Vec<String>);

impl Listen for Notes {
    fn event(&mut self, event: Event<'_>) {
        if let Event::Noted { what } = event {
            self.0.push(what);
        }
    }
}

fn run(plan: &Plan, root: &Path, jobs: usize, memory: u64) -> (Outcome, Vec<String>) {
    let registry = Registry::default().op::<Short>().op::<Long>();
    let mut cache = Cache::open(root, &platform()).expect("the cache opens");
    let options = Options {
        jobs,
        memory,
        fail_fast: false,
        library: "toy".into(),
        checkpoint: Duration::from_secs(10),
        limit: None,
        stop: Stop::default(),
    };
    let mut notes = Notes::default();
    let outcome = schedule(plan, &registry, &mut cache, &options, &BTreeSet::new(), &mut notes)
        .expect("the cache works");
    cache.close().expect("the cache closes");
    assert!(outcome.nodes.iter().all(|node| node.output.is_some()), "every toy plays");
    (outcome, notes.0)
}

#[test]
fn no_more_runs_at_once_than_threads_and_memory_allow() {
    let needs: Vec<[(&str, i64); 2]> =
        (0..40).map(|i| [("threads", 1 + i * 7 % 3), ("memory", i * 13 % 60)]).collect();
    let toys: Vec<Toy> = needs.iter().map(|needs| ("short", &needs[..], &[][..])).collect();
    let folder = tempfile::tempdir().expect("temporary folders can be made");
    let (_, notes) = run(&plan("limits", 0, &toys), folder.path(), 4, 100);
    let told = told("limits");
    assert!((2..=4).contains(&told.most_threads), "{told:?}");
    assert!((60..=100).contains(&told.most_memory), "{told:?}");
    assert!(told.most_at_once > 1 && told.order.len() == 40, "{told:?}");
    assert_eq!(notes, [""; 0]);
}

#[test]
fn what_needs_more_than_there_is_runs_alone_and_is_told() {
    let small: Toy = ("short", &[("memory", 10)], &[]);
    let toys =
        [small, ("short", &[("memory", 101)], &[]), small, ("short", &[("threads", 5)], &[])];
    let toys: Vec<Toy> = toys.into_iter().chain([small; 8]).collect();
    let folder = tempfile::tempdir().expect("temporary folders can be made");
    let (_, notes) = run(&plan("alone", 0, &toys), folder.path(), 4, 100);
    let told = told("alone");
    assert!(told.alone.is_superset(&BTreeSet::from([1, 3])), "{told:?}");
    assert!(told.most_at_once > 1, "{told:?}");
    assert_eq!(notes.len(), 2);
    assert!(notes.iter().any(|note| note.starts_with("toy 1 needs 1 MB of memory, ")), "{notes:?}");
    assert!(notes.iter().any(|note| note.starts_with("toy 3 needs 5 threads, ")), "{notes:?}");
}

#[test]
fn needs_may_depend_on_the_size_of_inputs() {
    // The output of a toy is a little more than 8 000 bytes.
    let copier: Toy = ("long", &[("copies", 1)], &[0]);
    let toys: Vec<Toy> = [("short", &[][..], &[][..])].into_iter().chain([copier; 8]).collect();
    let folder = tempfile::tempdir().expect("temporary folders can be made");
    run(&plan("copies", 0, &toys), folder.path(), 4, 30_000);
    let few = told("copies");
    run(&plan("copies", 100, &toys), folder.path(), 4, 100_000);
    let many = told("copies");
    assert!((2..4).contains(&few.most_at_once), "{few:?}");
    assert_eq!(many.most_at_once, 4, "{many:?}");
}

#[test]
fn the_longest_path_starts_first_by_what_was_learned() {
    // A chain of three short ones, and a long one by itself.
    let toys: [Toy; 4] =
        [("short", &[], &[]), ("short", &[], &[0]), ("short", &[], &[1]), ("long", &[], &[])];
    let folder = tempfile::tempdir().expect("temporary folders can be made");
    // At first, one node is as long as another.
    run(&plan("paths", 0, &toys), folder.path(), 1, u64::MAX);
    let unknown = told("paths").order;
    run(&plan("paths", 10, &toys), folder.path(), 1, u64::MAX);
    assert_eq!((unknown, told("paths").order), (vec![0, 1, 2, 3], vec![13, 10, 11, 12]));
}

#[test]
fn limits_reach_neither_keys_nor_results() {
    let toys: [Toy; 4] = [
        ("short", &[("threads", 2), ("memory", 50)], &[]),
        ("short", &[("copies", 3)], &[0]),
        ("long", &[("memory", 70)], &[0]),
        ("short", &[], &[1, 2]),
    ];
    let found = [(1, 1), (2, 60), (4, u64::MAX)].map(|(jobs, memory)| {
        let folder = tempfile::tempdir().expect("temporary folders can be made");
        let plan = plan("keys", 0, &toys);
        let (first, _) = run(&plan, folder.path(), jobs, memory);
        assert_eq!(told("keys").order.len(), 4);
        run(&plan, folder.path(), 5 - jobs, 55);
        assert_eq!(told("keys").order, [0; 0], "everything is known");
        let digests = first.nodes.into_iter().map(|node| (node.key, node.output));
        digests.collect::<Vec<_>>()
    });
    assert!(found.windows(2).all(|pair| pair[0] == pair[1]));
}
