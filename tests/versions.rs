//! The guard against stale results: an operation whose output moves must raise its version.
//!
//! `versions.txt` has a line for each operation: name and version, the digest of its declaration,
//! and, for each platform known, the digest of everything it gave on `specs/every_op.ivx`.
//! `BLESS=1` writes it anew; review the difference, and raise versions where outputs moved.

use std::collections::BTreeMap;
use std::path::Path;

use ivx_cache::Digest;
use ivx_engine::platform;

use crate::project::Project;

#[test]
fn an_output_that_moves_raises_its_version() {
    let project = Project::with(&[
        ("every_op.ivx", include_str!("specs/every_op.ivx")),
        ("paper.ron", include_str!("specs/paper.ron")),
    ]);
    project.executed("every_op.ivx", &[]);
    let outputs = outputs(&project);
    let registry = ivx_library::registry();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("versions.txt");
    let known = std::fs::read_to_string(&path).unwrap_or_default();
    let known: Vec<Vec<&str>> = known.lines().map(|line| line.split(' ').collect()).collect();
    let mut lines = Vec::new();
    let mut moved = Vec::new();
    for decl in registry.decls() {
        // No operation of the library results in a record yet, of which it reads a field.
        let part = matches!(decl.role, ivx_op::Role::Part(_)) || decl.name == "field";
        let output = outputs.get(decl.name);
        assert!(part || output.is_some(), "`{}` is missing from specs/every_op.ivx", decl.name);
        let name = format!("{}@{}", decl.name, decl.version);
        let declared = Digest::of(format!("{decl} {}", decl.stochastic).as_bytes()).short();
        let output = output.map_or("part".to_owned(), |text| Digest::of(text.as_bytes()).short());
        let before = known.iter().find(|line| line[0] == name);
        if before.is_some_and(|line| line[1] != declared) {
            moved.push(format!("the declaration of {name}"));
        }
        let here =
            before.and_then(|line| line.chunks(2).skip(1).find(|pair| pair[0] == platform()));
        if here.is_some_and(|pair| pair[1] != output) {
            moved.push(format!("the output of {name}"));
        }
        let mut line = format!("{name} {declared} {} {output}", platform());
        for other in before.into_iter().flat_map(|line| line.chunks(2).skip(1)) {
            if other[0] != platform() {
                line = [&line, other[0], other[1]].join(" ");
            }
        }
        lines.push(line);
        if before.is_none() {
            moved.push(format!("{name}, which is new,"));
        }
    }
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, lines.join("\n") + "\n").expect("golden files can be written");
    } else {
        let advice = "raise the version, or show that the results are equal; then BLESS=1";
        assert!(moved.is_empty(), "moved: {}; {advice}", moved.join(", "));
    }
}

/// The digests of everything that each operation gave, by the operation's name.
fn outputs(project: &Project) -> BTreeMap<String, String> {
    let plan = project.run("plan", "every_op.ivx", &["--dot"]);
    let run = project.read("results/every_op/run.ron");
    let mut outputs: BTreeMap<String, String> = BTreeMap::new();
    for line in plan.out.lines().filter(|line| line.contains("label=")) {
        let label = line.split_once("label=\"").and_then(|(_, rest)| rest.split_once("\", fill"));
        let label = label.expect("labels are quoted").0;
        let (address, op) = label.rsplit_once("\\n").expect("a label has two lines");
        let address = address.replace("\\\"", "\"").replace("\\\\", "\\");
        let node = run.split_once(&format!("{address:?}")).expect("every node is in run.ron").1;
        let digest = node
            .split("output: ")
            .nth(1)
            .and_then(|rest| rest.split('"').nth(1))
            .expect("it has an output");
        let all = outputs.entry(op.to_owned()).or_default();
        all.extend([&address, " ", digest, "\n"]);
    }
    outputs
}
