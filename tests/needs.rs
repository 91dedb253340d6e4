//! What nodes take of memory, foreseen before anything runs: through parts that hold what is still to be computed too.

use ivx_engine::{Plan, Step, expand};
use ivx_grammar::check::{File, Project, Settings, check, runs};
use ivx_grammar::parse;

const SPEC: &str = r#"edition "2026"
experiment e {
    axis seed = 0..1
    axis units(n) = { "few": 10, "many": 1_000 }
    let world = chain(cells: 4)
    let shown = demonstrations(act(random(), in: world, episodes: 2))
    let run = learn(bc(shown, net: mlp(hidden: [units.n])), in: world, for: updates(2))
    let walked = act(trained(run.agent), in: world, episodes: 1_000, limit: 10)
    measure m = mean(returns(walked), over: episode)
}
"#;

fn planned() -> (Plan, ivx_op::Registry) {
    let (ast, faults) = parse(SPEC, 0);
    let (path, stem) = ("e.ivx".to_owned(), "e".to_owned());
    let file = File { path, stem, text: SPEC.to_owned(), ast: ast.into(), ..File::default() };
    let registry = ivx_library::registry();
    let (ir, more) = check(&Project { files: vec![file] }, &registry, &Settings::default());
    assert!(runs(&faults) && runs(&more), "{more:?}");
    (expand(&ir, &registry), registry)
}

#[test]
fn a_learning_from_demonstrations_takes_what_its_network_does() {
    let (plan, registry) = planned();
    let memory = |step: &Step| step.needs(&plan, &registry, 0).memory;
    let of = |op: &str| -> Vec<u64> {
        plan.graph.node_weights().filter(|step| step.op == op).map(memory).collect()
    };
    let mut learning = of("learn");
    learning.sort_unstable();
    // 4 states, a bias and 2 actions with a bias: 6 numbers of 4 bytes of each parameter.
    let params = |units: u64| (4 * units + units + 2 * units + 2) * 6 * 4;
    assert!(learning[0] >= params(10) && learning[0] < params(10) + 20_000, "{learning:?}");
    assert!(learning[1] >= params(1_000) && learning[1] < 10 * params(1_000), "{learning:?}");
    // A state and a step of each of ten thousand, twice.
    let acting = of("act").into_iter().max().expect("they act");
    assert!((160_000..1_000_000).contains(&acting), "{acting}");
}
