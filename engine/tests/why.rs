//! Why a node is known or not, for each kind of change.

use std::path::Path;
use std::time::SystemTime;

use ivx_cache::{Cache, Digest, Provenance, Record};
use ivx_engine::{
    Draw, Fed, Foreseen, InputChange, NodeIndex, Plan, Reason, Source, Step, Why, explain, key,
    number_digest, platform, why,
};
use ivx_op::{Args, Array, Ctx, Dim, Held, Labels, Lit, Op, OpError, Part, Registry, declare};

/// The declarations of one time: keys ask for nothing but versions.
macro_rules! declared {
    ($time:ident, $toy:literal, $net:literal) => {
        mod $time {
            use super::*;

            declare! {
                /// An operation.
                pub(super) struct Toy = "toy" @ $toy -> Array {}
            }

            impl Op for Toy {
                fn run(&self, _: &Ctx) -> Result<Array, OpError> {
                    Ok(Array::scalar(0.0))
                }
            }

            declare! {
                /// What parts name.
                pub(super) struct Net = "net" @ $net -> Array {}
            }

            impl Op for Net {
                fn run(&self, _: &Ctx) -> Result<Array, OpError> {
                    Ok(Array::scalar(0.0))
                }
            }

            pub(super) fn registry() -> Registry {
                Registry::default().op::<Toy>().op::<Net>()
            }
        }
    };
}

declared!(now, 1, 1);
declared!(later, 2, 1);
declared!(other, 1, 2);

fn fed(sources: Vec<Source>) -> Fed {
    Fed { dims: vec![], sources, labelled: false, name: String::new() }
}

fn node(i: usize) -> Source {
    Source::Node(NodeIndex::new(i))
}

fn step(address: &str, args: Args, ports: Vec<(String, Vec<Fed>)>) -> Step {
    Step {
        address: address.into(),
        op: "toy".into(),
        args,
        held: vec![],
        ports,
        draw: None,
        shapes: None,
    }
}

/// Data, two models on it that draw, and a figure of what a number and the models make.
fn plan() -> Plan {
    let mut data = step("e/data", Args::from([("n".into(), 20.into())]), vec![]);
    data.draw = Some(Draw { seed: 0, member: None });
    let net = Part::new("net").with("width", 8);
    let mut models = Vec::new();
    for member in 0..2 {
        let learner = Part::new("net").with("inner", net.clone());
        let args = Args::from([("learner".into(), learner.into())]);
        let address = format!("e/model/member[{member}]");
        let mut model = step(&address, args, vec![("on".into(), vec![fed(vec![node(0)])])]);
        model.draw = Some(Draw { seed: 0, member: Some(member) });
        models.push(model);
    }
    let shape = Part::new("net").with("tau", Lit::Held(Held::Slot(0)));
    let ports = vec![
        ("by".into(), vec![fed(vec![Source::Number(0.5)])]),
        (
            "y".into(),
            vec![Fed {
                dims: vec![Dim::new("method", Labels::Names(vec!["A".into(), "B".into()]))],
                sources: vec![node(1), node(2)],
                labelled: true,
                name: "gap".into(),
            }],
        ),
    ];
    let mut figure = step("e/figure", Args::from([("shape".into(), shape.into())]), ports);
    figure.held = vec![fed(vec![node(0)])];
    let mut plan = Plan::default();
    for step in [data].into_iter().chain(models).chain([figure]) {
        add(&mut plan, step);
    }
    plan
}

fn add(plan: &mut Plan, step: Step) {
    let inputs: Vec<_> = step.sources().filter_map(|source| source.node()).collect();
    let node = plan.graph.add_node(step);
    for input in inputs {
        plan.graph.update_edge(input, node, ());
    }
}

/// Records every node of a plan as if it had run; its output is of its key.
fn remember(plan: &Plan, registry: &Registry, root: &Path) {
    let mut cache = Cache::open(root, &platform()).expect("the cache opens");
    let mut outputs: Vec<Digest> = Vec::new();
    for step in plan.graph.node_weights() {
        let digest = |source: &Source| match source {
            Source::Number(x) => number_digest(*x),
            Source::Node(node) => outputs[node.index()],
        };
        let key = key(step, registry, digest);
        let output = cache.objects().put(&key.0).expect("the disk works");
        let version = registry.decl(&step.op).map_or(0, |decl| decl.version);
        let provenance = Provenance {
            op: format!("{}@{version}", step.op),
            node: step.address.clone(),
            inputs: step.sources().map(|source| digest(&source)).collect(),
            explanation: explain(step, registry, digest),
            library: "toy".into(),
            millis: 7,
        };
        outputs.push(output.digest);
        cache
            .commit(Record { key, platform: platform(), output, provenance })
            .expect("the disk works");
    }
    cache.close().expect("the disk works");
}

/// All that is told of some nodes, a line each.
fn told(plan: &Plan, registry: &Registry, root: &Path) -> Vec<String> {
    let cache = Cache::look(root, &platform()).expect("the cache opens");
    let nodes: Vec<NodeIndex> = plan.graph.node_indices().collect();
    let all = why(plan, registry, &cache, &nodes).expect("the disk works");
    all.iter().flat_map(|why| lines(plan, why)).collect()
}

fn lines(plan: &Plan, why: &Why<'_>) -> Vec<String> {
    let name = |node: NodeIndex| plan.graph[node].address.trim_start_matches("e/").to_owned();
    let state = match why.foreseen {
        Foreseen::Hit => return Vec::new(),
        Foreseen::Run => "run",
        Foreseen::Unknown => "unknown",
    };
    let own = |what: String| format!("{state} {}: {what}", name(why.node));
    let mut lines: Vec<String> = Vec::new();
    match &why.record {
        None => lines.push(own("no record".into())),
        Some(earlier) if earlier.record.provenance.node != plan.graph[why.node].address => {
            lines.push(own(format!("like {}", earlier.record.provenance.node)));
        }
        Some(_) => {}
    }
    lines.extend(why.differences.iter().map(|difference| own(difference.to_string())));
    for input in &why.inputs {
        let change = match input.change {
            InputChange::Changed => "changed",
            InputChange::Unknown => "unknown",
            InputChange::Added => "added",
            InputChange::Removed => "removed",
        };
        let from = input.node.map(name).or(input.before.clone()).unwrap_or_default();
        let input_line = format!("{} {change} {from}", input.port);
        for cause in &input.causes {
            let path: Vec<String> = cause.path.iter().map(|node| name(*node)).collect();
            let reason = match &cause.reason {
                Reason::Differs(difference) => difference.to_string(),
                Reason::New => "new".to_owned(),
                Reason::Lost => "lost".to_owned(),
            };
            lines.push(own(format!("{input_line} <- {}: {reason}", path.join(" <- "))));
        }
        if input.causes.is_empty() {
            lines.push(own(input_line));
        }
    }
    lines
}

/// What is told after a change of the plan that was run.
#[track_caller]
fn check(change: impl Fn(&mut Plan), expected: &[&str]) {
    check_with(&now::registry(), change, expected);
}

#[track_caller]
fn check_with(registry: &Registry, change: impl Fn(&mut Plan), expected: &[&str]) {
    let root = tempfile::tempdir().expect("temporary folders can be made");
    remember(&plan(), &now::registry(), root.path());
    let mut changed = plan();
    change(&mut changed);
    assert_eq!(told(&changed, registry, root.path()), expected);
}

fn at(plan: &mut Plan, i: usize) -> &mut Step {
    &mut plan.graph[NodeIndex::new(i)]
}

#[test]
fn of_what_did_not_change_there_is_nothing_to_tell() {
    check(|_| {}, &[]);
    check(|plan| at(plan, 0).address = "e/renamed".into(), &[]);
}

#[test]
fn an_empty_cache_knows_no_operation() {
    let root = tempfile::tempdir().expect("temporary folders can be made");
    let told = told(&plan(), &now::registry(), root.path());
    assert_eq!(told[0], "run data: no record");
    assert_eq!(told[1], "unknown model/member[0]: no record");
    assert_eq!(told[2], "unknown model/member[0]: on unknown data <- data: new");
    let last = "unknown figure: y unknown model/member[1] <- model/member[1] <- data: new";
    assert_eq!(told.last().map(String::as_str), Some(last));
}

#[test]
fn a_parameter_is_followed_through_two_levels() {
    let n = "`toy.n` was 20, is 25";
    check(
        |plan| drop(at(plan, 0).args.insert("n".into(), 25.into())),
        &[
            &format!("run data: {n}"),
            &format!("unknown model/member[0]: on unknown data <- data: {n}"),
            &format!("unknown model/member[1]: on unknown data <- data: {n}"),
            &format!("unknown figure: shape.tau unknown data <- data: {n}"),
            &format!("unknown figure: y unknown model/member[0] <- model/member[0] <- data: {n}"),
            &format!("unknown figure: y unknown model/member[1] <- model/member[1] <- data: {n}"),
        ],
    );
}

#[test]
fn a_change_that_was_run_is_followed_to_where_it_began() {
    // The data and one model were made again since: the figure's inputs are known and others.
    let root = tempfile::tempdir().expect("temporary folders can be made");
    let registry = now::registry();
    remember(&plan(), &registry, root.path());
    let mut changed = plan();
    at(&mut changed, 0).args.insert("n".into(), 25.into());
    let mut part = Plan::default();
    for i in 0..3 {
        add(&mut part, at(&mut changed, i).clone());
    }
    remember(&part, &registry, root.path());
    let n = "`toy.n` was 20, is 25";
    assert_eq!(
        told(&changed, &registry, root.path()),
        [
            format!("run figure: shape.tau changed data <- data: {n}"),
            format!("run figure: y changed model/member[0] <- model/member[0] <- data: {n}"),
            format!("run figure: y changed model/member[1] <- model/member[1] <- data: {n}"),
        ]
    );
}

#[test]
fn a_nested_part_is_told_by_its_path() {
    let width = |plan: &mut Plan| {
        let inner = Part::new("net").with("width", 16);
        let learner = Part::new("net").with("inner", inner);
        at(plan, 1).args.insert("learner".into(), learner.into());
    };
    let what = "`toy.learner.inner.width` was 8, is 16";
    let after = format!("unknown figure: y unknown model/member[0] <- model/member[0]: {what}");
    check(width, &[&format!("run model/member[0]: {what}"), &after]);
}

#[test]
fn versions_of_operations_and_parts_are_told() {
    let version = "the operation was toy@1, is toy@2";
    let told = |registry: &Registry| {
        let root = tempfile::tempdir().expect("temporary folders can be made");
        remember(&plan(), &now::registry(), root.path());
        told(&plan(), registry, root.path())
    };
    let of_op = told(&later::registry());
    assert_eq!(of_op[0], format!("run data: {version}"));
    assert_eq!(of_op[1], format!("unknown model/member[0]: {version}"));
    assert_eq!(of_op[2], format!("unknown model/member[0]: on unknown data <- data: {version}"));
    let of_part = told(&other::registry());
    let part = "the part `toy.learner` was net@1, is net@2";
    assert_eq!(of_part[0], format!("run model/member[0]: {part}"));
    let inner = "the part `toy.learner.inner` was net@1, is net@2";
    assert_eq!(of_part[1], format!("run model/member[0]: {inner}"));
    assert_eq!(of_part[4], "unknown figure: the part `toy.shape` was net@1, is net@2");
}

#[test]
fn seeds_and_members_are_told_beside_the_nearest_of_another_node() {
    let seed = |plan: &mut Plan| {
        at(plan, 2).draw = Some(Draw { seed: 3, member: Some(1) });
        at(plan, 2).address = "e/model[seed=3]/member[1]".into();
    };
    let what = "the seed was 0, is 3";
    check(
        seed,
        &[
            "run model[seed=3]/member[1]: like e/model/member[1]",
            &format!("run model[seed=3]/member[1]: {what}"),
            &format!(
                "unknown figure: y unknown model[seed=3]/member[1] <- model[seed=3]/member[1]: {what}"
            ),
        ],
    );
    let member = |plan: &mut Plan| {
        at(plan, 2).draw = Some(Draw { seed: 0, member: Some(7) });
        at(plan, 2).address = "e/model/member[7]".into();
    };
    let root = tempfile::tempdir().expect("temporary folders can be made");
    remember(&plan(), &now::registry(), root.path());
    let mut changed = plan();
    member(&mut changed);
    let told = told(&changed, &now::registry(), root.path());
    assert_eq!(told[0], "run model/member[7]: like e/model/member[1]");
    assert_eq!(told[1], "run model/member[7]: the member was 1, is 7");
}

#[test]
fn labels_names_and_coordinates_are_told_where_they_travel() {
    let names = |names: &[&str]| Labels::Names(names.iter().map(|&name| name.into()).collect());
    check(
        |plan| at(plan, 3).ports[1].1[0].dims[0].labels = names(&["A", "C"]),
        &[r#"run figure: what `toy.y` gathers over was method ["A", "B"], is method ["A", "C"]"#],
    );
    check(
        |plan| at(plan, 3).ports[1].1[0].name = "regret".into(),
        &["run figure: the name of `toy.y` was gap, is regret"],
    );
    let added = |plan: &mut Plan| {
        let y = &mut at(plan, 3).ports[1].1[0];
        y.dims[0].labels = names(&["A", "B", "C"]);
        y.sources.push(node(0));
    };
    let axes = r#"what `toy.y` gathers over was method ["A", "B"], is method ["A", "B", "C"]"#;
    check(added, &[&format!("run figure: {axes}"), "run figure: y added data"]);
    let more = |plan: &mut Plan| at(plan, 3).ports[1].1.push(fed(vec![node(0)]));
    check(
        more,
        &["run figure: the number of values of `toy.y` was 1, is 2", "run figure: y added data"],
    );
    let fewer = |plan: &mut Plan| {
        let y = &mut at(plan, 3).ports[1].1[0];
        y.dims[0].labels = names(&["B"]);
        y.sources.remove(0);
    };
    let axes = r#"what `toy.y` gathers over was method ["A", "B"], is method ["B"]"#;
    check(fewer, &[&format!("run figure: {axes}"), "run figure: y removed e/model/member[0]"]);
}

#[test]
fn numbers_and_held_artifacts_are_told() {
    check(
        |plan| at(plan, 3).ports[0].1[0].sources[0] = Source::Number(0.25),
        &["run figure: `toy.by` was 0.5, is 0.25"],
    );
    check(
        |plan| at(plan, 3).ports[0].1[0].sources[0] = node(0),
        &["run figure: `toy.by` was 0.5, is e/data"],
    );
    check(
        |plan| at(plan, 3).held[0].sources[0] = Source::Number(2.0),
        &["run figure: `toy.shape.tau` was e/data, is 2.0"],
    );
    check(
        |plan| at(plan, 3).held[0].sources[0] = node(1),
        &["run figure: `toy.shape.tau` was e/data, is e/model/member[0]"],
    );
}

#[test]
fn what_is_not_known_any_more_is_said_to_be_lost() {
    // Only the figure's record is left of the first run.
    let (first, second) = (tempfile::tempdir(), tempfile::tempdir());
    let (first, second) = (first.expect("a folder"), second.expect("a folder"));
    let registry = now::registry();
    remember(&plan(), &registry, first.path());
    let old = Cache::look(first.path(), &platform()).expect("the cache opens");
    let figure = old.records().find(|record| record.provenance.node == "e/figure").cloned();
    let mut changed = plan();
    at(&mut changed, 0).args.insert("n".into(), 25.into());
    let mut part = Plan::default();
    for i in 0..3 {
        add(&mut part, at(&mut changed, i).clone());
    }
    remember(&part, &registry, second.path());
    let mut cache = Cache::open(second.path(), &platform()).expect("the cache opens");
    cache.commit(figure.expect("it was recorded")).expect("the disk works");
    cache.close().expect("the disk works");
    assert_eq!(
        told(&changed, &registry, second.path())[0],
        "run figure: shape.tau changed data <- data: lost"
    );
}

#[test]
fn the_nearest_is_of_the_node_then_has_fewest_differences_then_is_latest() {
    let root = tempfile::tempdir().expect("temporary folders can be made");
    let registry = now::registry();
    let data = |address: &str, n: i64, m: i64| {
        let mut plan = Plan::default();
        let args = Args::from([("n".into(), n.into()), ("m".into(), m.into())]);
        add(&mut plan, step(address, args, vec![]));
        plan
    };
    for (address, n, m) in [("e/a", 1, 1), ("e/a", 2, 1), ("e/a", 3, 2), ("e/b", 9, 9)] {
        remember(&data(address, n, m), &registry, root.path());
    }
    let told = |address, n, m| told(&data(address, n, m), &registry, root.path());
    // Both have one difference: the later one.
    assert_eq!(told("e/a", 5, 1), ["run a: `toy.n` was 2, is 5"]);
    assert_eq!(told("e/a", 5, 2), ["run a: `toy.n` was 3, is 5"]);
    // Of the node, though another's is nearer.
    assert_eq!(told("e/a", 9, 8), ["run a: `toy.m` was 2, is 8", "run a: `toy.n` was 3, is 9"]);
    assert_eq!(told("e/c", 9, 8), ["run c: like e/b", "run c: `toy.m` was 9, is 8"]);
}

#[test]
fn of_a_hit_its_record_is_told() {
    let root = tempfile::tempdir().expect("temporary folders can be made");
    remember(&plan(), &now::registry(), root.path());
    let cache = Cache::look(root.path(), &platform()).expect("the cache opens");
    let all = why(&plan(), &now::registry(), &cache, &[NodeIndex::new(2)]).expect("the disk works");
    let [Why { foreseen: Foreseen::Hit, key: Some(key), record: Some(earlier), .. }] = &all[..]
    else {
        panic!("{all:?}");
    };
    assert_eq!((&earlier.record.key, earlier.record.provenance.millis), (key, 7));
    assert_eq!(earlier.record.provenance.node, "e/model/member[1]");
    assert!(earlier.begun.is_some_and(|begun| begun <= SystemTime::now()));
}
