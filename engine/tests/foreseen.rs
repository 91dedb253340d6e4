//! What is foreseen of nodes with equal keys.

use std::collections::BTreeSet;
use std::time::Duration;

use ivx_cache::Cache;
use ivx_engine::{
    Fate, Fed, Foreseen, NodeIndex, Options, Plan, Silence, Source, Step, Stop, foresee, platform,
    schedule,
};
use ivx_op::{Args, Array, Ctx, Named, Op, OpError, Registry, declare};

declare! {
    /// The sign of `x`, whatever it is given.
    struct Sign = "sign" @ 1 -> Array {
        /// What is there for the key.
        of: Named<Array>;
        /// Of what.
        x: f64;
    }
}

impl Op for Sign {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let n = f64::from(u32::try_from(self.of.0.values.len()).expect("inputs are few"));
        Ok(Array::scalar(self.x.signum() * n.max(1.0)))
    }
}

#[test]
fn what_is_to_run_is_a_hit_if_an_equal_key_was_made_first() {
    let mut plan = Plan::default();
    // Both inputs come out as 1, so that what follows from them has one key.
    for (x, input) in [(2.0, None), (3.0, None), (-1.0, Some(0)), (-1.0, Some(1))] {
        let sources: Vec<_> = input.map(NodeIndex::new).into_iter().collect();
        let fed = Fed {
            dims: vec![],
            sources: sources.iter().map(|node| Source::Node(*node)).collect(),
            labelled: false,
            name: String::new(),
        };
        let node = plan.graph.add_node(Step {
            address: format!("node {x} {input:?}"),
            op: "sign".into(),
            args: Args::from([("x".into(), x.into())]),
            held: vec![],
            ports: vec![("of".into(), vec![fed])],
            draw: None,
            shapes: None,
        });
        for input in sources {
            plan.graph.add_edge(input, node, ());
        }
    }
    let (root, registry) =
        (tempfile::tempdir().expect("a folder"), Registry::default().op::<Sign>());
    let mut cache = Cache::open(root.path(), &platform()).expect("the cache opens");
    let mut run = |plan: &Plan| {
        let foreseen = foresee(plan, &registry, &cache);
        let options = Options {
            jobs: 2,
            memory: u64::MAX,
            fail_fast: false,
            library: "toy".into(),
            checkpoint: Duration::ZERO,
            limit: None,
            stop: Stop::default(),
        };
        let outcome =
            schedule(plan, &registry, &mut cache, &options, &BTreeSet::new(), &mut Silence);
        (foreseen, outcome.expect("the cache works"))
    };
    let mut first = Plan::default();
    for node in [0, 1] {
        first.graph.add_node(plan.graph[NodeIndex::new(node)].clone());
    }
    assert_eq!(run(&first).0, [Foreseen::Run; 2]);
    let (foreseen, outcome) = run(&plan);
    assert_eq!(foreseen, [Foreseen::Hit, Foreseen::Hit, Foreseen::Run, Foreseen::Run]);
    let ran = outcome.nodes.iter().filter(|node| matches!(node.fate, Fate::Ran { .. })).count();
    let hits = outcome.nodes.iter().filter(|node| node.fate == Fate::Hit).count();
    assert_eq!((ran, hits), (1, 3));
    assert_eq!(outcome.nodes[2].key, outcome.nodes[3].key);
}
