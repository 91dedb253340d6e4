//! What a node costs besides its own work, and what of that each part costs:
//! `cargo bench -p ivx-engine`.
//!
//! Microseconds of processor time, of all threads, a node; durability included.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::mpsc;
use std::time::Duration;

use ivx_cache::{Cache, Digest, Provenance, Record};
use ivx_engine::{
    Fed, Options, Plan, Silence, Source, Step, Stop, explain, key, platform, schedule,
};
use ivx_op::{
    Args, Array, Artifact as _, Call, Ctx, Gathered, Named, Op, OpError, Registry, declare,
};
use petgraph::graph::NodeIndex;

declare! {
    /// The sum of what it is given and `x`.
    struct Plus = "plus" @ 1 -> Array {
        /// What is summed.
        of: Named<Array>;
        /// What is added.
        x: f64;
    }
}

impl Op for Plus {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        Ok(Array::scalar(self.x + self.of.0.values.iter().map(|x| x.values[0]).sum::<f64>()))
    }
}

const WIDTH: usize = 100;
/// So many nodes are run for each row, in stores of their own.
const NODES: usize = 100_000;

#[expect(clippy::print_stdout, reason = "a bench tells what it measured")]
fn main() {
    println!("{:>8} {:>8} {:>9} {:>8}", "nodes", "cold us", "no-op us", "own us");
    for n in [1_000, 10_000, 100_000] {
        let plan = layered(n);
        let (mut cold, mut again, mut own) = (0.0, 0.0, 0.0);
        for _ in 0..NODES / n {
            let folder = tempfile::tempdir().expect("temporary folders can be made");
            cold += microseconds(|| run(&plan, folder.path(), n));
            again += microseconds(|| run(&plan, folder.path(), 0));
            own += microseconds(|| work(&plan));
        }
        let [cold, again, own] = [cold, again, own].map(|sum| per(sum, NODES));
        println!("{n:>8} {cold:>8.1} {again:>9.1} {own:>8.1}");
    }
    println!("\nof a cold run, one by one:");
    for (part, cost) in parts() {
        println!("{cost:>8.1} us  {part}");
    }
}

/// Layers of nodes that sum three of the layer before.
fn layered(n: usize) -> Plan {
    let mut plan = Plan::default();
    for i in 0..n {
        let (layer, j) = (i / WIDTH, i % WIDTH);
        let inputs: Vec<NodeIndex> = (0..if layer == 0 { 0 } else { 3 })
            .map(|k| NodeIndex::new((layer - 1) * WIDTH + (j + k) % WIDTH))
            .collect();
        let sources = inputs.iter().map(|input| Source::Node(*input)).collect();
        let fed = Fed { dims: Vec::new(), sources, labelled: false, name: String::new() };
        let node = plan.graph.add_node(Step {
            address: format!("bench/n{layer}_{j}"),
            op: "plus".into(),
            #[expect(clippy::cast_precision_loss, reason = "there are few nodes")]
            args: Args::from([("x".into(), (i as f64).into())]),
            held: Vec::new(),
            ports: vec![("of".into(), vec![fed])],
            draw: None,
            shapes: None,
        });
        for input in inputs {
            plan.graph.add_edge(input, node, ());
        }
    }
    plan
}

fn registry() -> Registry {
    Registry::default().op::<Plus>()
}

fn run(plan: &Plan, root: &Path, expected: usize) {
    let mut cache = Cache::open(root, &platform()).expect("the cache opens");
    let options = Options {
        jobs: std::thread::available_parallelism().map_or(1, usize::from),
        memory: u64::MAX,
        fail_fast: false,
        library: "bench".into(),
        checkpoint: Duration::from_secs(10),
        limit: None,
        stop: Stop::default(),
    };
    let outcome = schedule(plan, &registry(), &mut cache, &options, &BTreeSet::new(), &mut Silence)
        .expect("the cache works");
    cache.close().expect("the cache closes");
    let ran = outcome.nodes.iter().filter(|node| matches!(node.fate, ivx_engine::Fate::Ran { .. }));
    assert_eq!(ran.count(), expected);
}

/// The operation alone: arguments decoded, result encoded.
fn work(plan: &Plan) {
    let registry = registry();
    let mut results: Vec<ivx_op::Bytes> = Vec::with_capacity(plan.graph.node_count());
    for step in plan.graph.node_weights() {
        let values = step.sources().filter_map(|source| source.node());
        let values = values.map(|node| results[node.index()].clone()).collect();
        let fed = Gathered { dims: Vec::new(), values, name: String::new() };
        let call = Call { args: step.args.clone(), ports: [("of".into(), vec![fed])].into() };
        results.push(registry.run("plus", &call, &Ctx::new("plus", 0, None)).expect("it runs"));
    }
}

/// The parts that a node passes through, each by itself.
fn parts() -> Vec<(&'static str, f64)> {
    let n = 10_000;
    let (plan, registry) = (layered(n), registry());
    let steps: Vec<&Step> = plan.graph.node_weights().collect();
    let digest =
        |source: &Source| Digest::of(&source.node().unwrap_or_default().index().to_le_bytes());
    let folder = tempfile::tempdir().expect("temporary folders can be made");
    let mut cache = Cache::open(folder.path(), &platform()).expect("the cache opens");
    let output =
        cache.objects().put(&Array::scalar(1.0).encode()).expect("it is inside the record");
    let records: Vec<Record> = steps
        .iter()
        .map(|step| Record {
            key: key(step, &registry, digest),
            platform: platform(),
            output: output.clone(),
            provenance: Provenance {
                op: "plus@1".into(),
                node: step.address.clone(),
                inputs: step.sources().map(|source| digest(&source)).collect(),
                explanation: explain(step, &registry, digest),
                library: "bench".into(),
                millis: 0,
            },
        })
        .collect();
    let keys: Vec<Digest> = records.iter().map(|record| record.key).collect();
    let mut timed = Vec::new();
    let mut part = |name, work: &mut dyn FnMut()| timed.push((name, per(microseconds(work), n)));
    part("the key", &mut || {
        for step in &steps {
            std::hint::black_box(key(step, &registry, digest));
        }
    });
    part("its explanation", &mut || {
        for step in &steps {
            std::hint::black_box(explain(step, &registry, digest));
        }
    });
    part("the lock", &mut || {
        for key in &keys {
            cache.try_lock(key).expect("the disk works").expect("nobody else is there");
        }
    });
    part("the journal, synced at the end", &mut || {
        for record in records.clone() {
            cache.commit(record).expect("the disk works");
        }
        cache.sync().expect("the disk works");
    });
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("threads start");
    let (sender, receiver) = mpsc::channel();
    part("there and back to a thread, one by one", &mut || {
        pool.in_place_scope(|scope| {
            for i in 0..n {
                let sender = sender.clone();
                scope.spawn(move |_| sender.send(i).expect("we listen"));
                receiver.recv().expect("it sends");
            }
        });
    });
    timed
}

/// The processor time of the whole process that some work takes.
fn microseconds(work: impl FnOnce()) -> f64 {
    let before = used();
    work();
    used() - before
}

/// Microseconds of processor time used so far, by all threads: in hundredths of a second.
fn used() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("Linux tells");
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split(' ').collect();
    let ticks = |i: usize| fields[i].parse::<f64>().expect("ticks are a number");
    // After the name: state is field 1, user time 12, system time 13.
    (ticks(12) + ticks(13)) * 1e4
}

fn per(microseconds: f64, nodes: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "there are few nodes")]
    let nodes = nodes as f64;
    microseconds / nodes
}
