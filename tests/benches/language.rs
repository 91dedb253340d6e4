//! How long the stages before running take, and how they grow: `cargo bench -p ivx-tests`.

#[path = "../generate.rs"]
mod generate;

use std::time::{Duration, Instant};

use ivx_engine::{Plan, Source, expand, key, number_digest};
use ivx_grammar::check::{File, Project, Settings, check, runs};
use ivx_grammar::parse;
use ivx_op::{Array, Ctx, Many, One, Op, OpError, Registry, declare};

declare! {
    /// The sum of some arrays and a number.
    struct Plus = "plus" @ 1 -> Array [union] {
        /// The number.
        x: f64;
        /// The arrays.
        of: Many<One<Array>>;
    }
}

impl Op for Plus {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        unreachable!("nothing runs here")
    }
}

/// The fastest of so many runs counts: others were disturbed.
const RUNS: usize = 5;

#[expect(clippy::print_stdout, reason = "a bench tells what it measured")]
fn main() {
    let registry = ivx_library::registry().op::<Plus>();
    println!("{:>8} {:>8} | {:^45} | ns per node", "", "", "ms");
    println!(
        "{:>8} {:>8} | {:>8} {:>8} {:>8} {:>8} {:>9} | check expand   key",
        "lines", "nodes", "parse", "check", "expand", "key", "all"
    );
    for (lines, nodes) in [
        // More nodes a line.
        (50, 10),
        (50, 100),
        (50, 1_000),
        (50, 10_000),
        (50, 100_000),
        // More lines.
        (500, 10_000),
        (5_000, 10_000),
        (50_000, 100_000),
    ] {
        row(&generate::spec(lines, nodes), &registry);
    }
    // One call a line, then three operations a line.
    for lines in [100, 1_000, 10_000, 100_000] {
        let plus = |i, [a, b, c]: [String; 3]| format!("plus(x: {i}, of: [{a}, {b}, {c}])");
        row(&generate::layered(lines, plus), &registry);
    }
    for lines in [100, 1_000, 10_000, 100_000] {
        let half = |_, [a, b, c]: [String; 3]| format!("({a} + {b} + {c}) * 0.5");
        row(&generate::layered(lines, half), &registry);
    }
}

#[expect(clippy::print_stdout, reason = "a bench tells what it measured")]
fn row(text: &str, registry: &Registry) {
    let ((ast, faults), parsing) = fastest(|| parse(text, 0));
    assert_eq!(faults, [], "what is generated parses");
    let (path, stem) = ("spec.ivx".to_owned(), "spec".to_owned());
    let file = File { path, stem, text: text.to_owned(), ast: ast.into(), ..File::default() };
    let (project, settings) = (Project { files: vec![file] }, Settings::default());
    let ((spec, faults), checking) = fastest(|| check(&project, registry, &settings));
    assert!(runs(&faults), "what is generated is sound: {:?}", faults.first());
    let (plan, expanding) = fastest(|| expand(&spec, registry));
    let ((), hashing) = fastest(|| keys(&plan, registry));
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    let nodes = plan.graph.node_count();
    let per_node = |time: Duration| time.as_nanos() / nodes as u128;
    println!(
        "{:>8} {nodes:>8} | {:>8.2} {:>8.2} {:>8.2} {:>8.2} {:>9.2} | {:>5} {:>6} {:>5}",
        text.lines().count(),
        ms(parsing),
        ms(checking),
        ms(expanding),
        ms(hashing),
        ms(parsing + checking + expanding + hashing),
        per_node(checking),
        per_node(expanding),
        per_node(hashing),
    );
}

/// The keys of all nodes, as if each one's output were its key.
fn keys(plan: &Plan, registry: &Registry) {
    let mut digests = Vec::with_capacity(plan.graph.node_count());
    for step in plan.graph.node_weights() {
        let digest = key(step, registry, |source| match source {
            Source::Node(node) => digests[node.index()],
            Source::Number(x) => number_digest(*x),
        });
        digests.push(digest);
    }
}

fn fastest<T>(mut work: impl FnMut() -> T) -> (T, Duration) {
    let mut timed = || {
        let start = Instant::now();
        let done = work();
        (done, start.elapsed())
    };
    let first = timed();
    (1..RUNS).map(|_| timed()).fold(first, |best, next| if next.1 < best.1 { next } else { best })
}
