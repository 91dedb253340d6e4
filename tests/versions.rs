//! The guard against stale results: what an operation gives can move only with its version, or with that of a part in
//! its description.
//!
//! `versions.txt` has a line for each operation and part: name and version, and the digest of its declaration. Behind
//! these stands a line for each operation with the parts that it was given together on `specs/every_op.ivx`: their
//! names and versions, and, for each platform known, the digest of everything that came out. `BLESS=1` writes it anew;
//! review the difference, and raise versions where outputs moved.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use ivx_cache::Digest;
use ivx_engine::platform;
use ivx_op::Registry;
use serde_json::Value;

use crate::project::Project;

/// An operation and its parts, each `name@version`, in a word.
type Group = String;

#[test]
fn an_output_that_moves_raises_a_version() {
    let project = Project::with(&[
        ("every_op.ivx", include_str!("specs/every_op.ivx")),
        ("paper.ron", include_str!("specs/paper.ron")),
        ("table.csv", include_str!("specs/table.csv")),
        ("gaps.csv", include_str!("specs/gaps.csv")),
        ("walks.txt", include_str!("specs/walks.txt")),
        ("drives.csv", include_str!("specs/drives.csv")),
    ]);
    project.executed("every_op.ivx", &[]);
    let registry = ivx_library::registry();
    let found = outputs(&project, &registry);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("versions.txt");
    let known = std::fs::read_to_string(&path).unwrap_or_default();
    let known: BTreeMap<&str, Vec<&str>> = known
        .lines()
        .filter_map(|line| line.split_once(' '))
        .map(|(name, rest)| (name, rest.split(' ').collect()))
        .collect();
    let (mut lines, mut moved) = (Vec::new(), Vec::new());
    for decl in registry.decls() {
        // Worlds of other software are nothing without it.
        let elsewhere = ["gymnasium", "procgen"].contains(&decl.name);
        let is_tried = found
            .keys()
            .any(|group| members(group).any(|name| name == versioned(&registry, decl.name)));
        assert!(elsewhere || is_tried, "`{}` is missing from specs/every_op.ivx", decl.name);
        let name = versioned(&registry, decl.name);
        let declared = Digest::of(format!("{decl} {}", decl.stochastic).as_bytes()).short();
        match known.get(name.as_str()) {
            None => moved.push(format!("{name}, which is new,")),
            Some(before) if before[0] != declared => {
                moved.push(format!("the declaration of {name}"));
            }
            Some(_) => {}
        }
        lines.push(format!("{name} {declared}"));
    }
    let mut others = BTreeSet::new();
    for (group, output) in &found {
        let before = known.get(with_operation(group).as_str());
        let here = before.and_then(|line| line.chunks(2).find(|pair| pair[0] == platform()));
        match (before, here) {
            (None, _) => moved.push(format!("{group}, which is new,")),
            (_, Some(pair)) if pair[1] != output => _ = others.insert(group.as_str()),
            _ => {}
        }
        // What moved here has moved elsewhere, where nobody has looked since.
        let is_as_before = here.is_some_and(|pair| pair[1] == output);
        let elsewhere = before.into_iter().flat_map(|line| line.chunks(2));
        let elsewhere = elsewhere.filter(|pair| pair[0] != platform());
        let elsewhere = elsewhere.filter(|pair| is_as_before || pair[1] == output);
        let mut line = format!("{} {} {output}", with_operation(group), platform());
        for pair in elsewhere {
            line = [&line, pair[0], pair[1]].join(" ");
        }
        lines.push(line);
    }
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, lines.join("\n") + "\n").expect("golden files can be written");
        return;
    }
    if !others.is_empty() {
        let all: BTreeSet<&str> = found.keys().map(String::as_str).collect();
        let blamed = blamed(&others, &all);
        let groups: Vec<&str> = others.into_iter().collect();
        moved.push(format!(
            "the outputs of {}: look at {}",
            groups.join(", "),
            blamed.into_iter().collect::<Vec<_>>().join(" or ")
        ));
    }
    let advice =
        "raise the version of what changed, or show that the results are equal; then BLESS=1";
    assert!(moved.is_empty(), "moved: {}; {advice}", moved.join(", "));
}

/// A name of a group that is none of an operation or part, even where it has no parts.
fn with_operation(group: &str) -> String {
    format!("={group}")
}

fn members(group: &str) -> impl Iterator<Item = &str> {
    group.split('+')
}

/// What is in all groups that moved and in none of those that did not; where there is nothing of the kind, what is in
/// all that moved.
fn blamed<'a>(moved: &BTreeSet<&'a str>, all: &BTreeSet<&'a str>) -> BTreeSet<&'a str> {
    let sets = moved.iter().map(|group| members(group).collect::<BTreeSet<_>>());
    let common = sets.reduce(|a, b| a.intersection(&b).copied().collect()).unwrap_or_default();
    let still =
        |name: &&str| all.difference(moved).any(|group| members(group).any(|other| other == *name));
    let (spread, own): (BTreeSet<&str>, BTreeSet<&str>) =
        common.iter().partition(|name| still(name));
    if own.is_empty() { spread } else { own }
}

fn versioned(registry: &Registry, name: &str) -> String {
    format!("{name}@{}", registry.decl(name).map_or(0, |decl| decl.version))
}

/// The digests of everything that operations gave with the same parts.
fn outputs(project: &Project, registry: &Registry) -> BTreeMap<Group, String> {
    let plan = project.run("plan", "every_op.ivx", &["--format", "json"]).out;
    let plan: Value = serde_json::from_str(&plan).expect("it is JSON");
    let run = project.read("results/every_op/run.ron");
    let mut all: BTreeMap<Group, String> = BTreeMap::new();
    for node in plan["nodes"].as_array().expect("a list") {
        let text = |value: &Value| value.as_str().expect("a text").to_owned();
        let address = text(&node["address"]);
        let entry = run.split_once(&format!("{address:?}")).expect("every node is in run.ron").1;
        let digest = entry.split("output: ").nth(1).and_then(|rest| rest.split('"').nth(1));
        let digest = digest.expect("it has an output");
        let parts = node["parts"].as_array().expect("a list").iter().map(text);
        let names = std::iter::once(text(&node["operation"])).chain(parts);
        let group: Vec<String> = names.map(|name| versioned(registry, &name)).collect();
        all.entry(group.join("+")).or_default().extend([&address, " ", digest, "\n"]);
    }
    all.into_iter().map(|(group, text)| (group, Digest::of(text.as_bytes()).short())).collect()
}

#[test]
fn what_moved_alone_is_blamed() {
    let all = ["train@4+mlp@1+relu@1", "train@4+mlp@1+tanh@1", "train@4+gru@1", "rmse@1"].into();
    let of = |moved: &[&'static str]| blamed(&moved.iter().copied().collect(), &all);
    assert_eq!(of(&["train@4+mlp@1+relu@1"]), ["relu@1"].into());
    assert_eq!(of(&["train@4+mlp@1+relu@1", "train@4+mlp@1+tanh@1"]), ["mlp@1"].into());
    let trained = ["train@4+gru@1", "train@4+mlp@1+relu@1", "train@4+mlp@1+tanh@1"];
    assert_eq!(of(&trained), ["train@4"].into());
    assert_eq!(of(&["rmse@1"]), ["rmse@1"].into());
}
