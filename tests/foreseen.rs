//! What `ivx plan` and `ivx why` say is what `ivx exec` does.
//!
//! Every run tries the same edits; `PROPTEST_CASES=1000` tries more of them.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use ivx_cache::{Cache, Digest, Output};
use ivx_engine::{
    Fate, Foreseen, NodeIndex, Options, Outcome, Plan, Silence, Stop, foresee, platform, schedule,
    wanted, why,
};
use ivx_op::Registry;
use proptest::collection::vec;
use proptest::prelude::{Just, ProptestConfig, Strategy, any, prop_oneof, proptest};
use proptest::sample::{Index, select};
use proptest::test_runner::RngSeed;
use serde_json::Value;

use crate::keys::{CHANGES, Experiment, Writing, experiment, plan, writing};
use crate::project::Project;

fn config() -> ProptestConfig {
    let config = ProptestConfig::default();
    let cases = if config.cases == 256 { 16 } else { config.cases };
    ProptestConfig { cases, rng_seed: RngSeed::Fixed(0), failure_persistence: None, ..config }
}

/// What happens between two runs.
#[derive(Clone, Debug)]
enum Edit {
    /// A value changes.
    Change(fn(&mut Experiment)),
    /// The same is written otherwise.
    Rewrite(Writing),
    /// Back to what was run first.
    Revert,
    /// Another experiment altogether.
    Replace(Experiment),
}

/// What is lost of the cache between two runs.
#[derive(Clone, Debug)]
enum Loss {
    Nothing,
    /// One of the objects, or all.
    Object(Index),
    Objects,
    /// One of the journals.
    Journal(Index),
}

fn edit() -> impl Strategy<Value = Edit> {
    prop_oneof![
        4 => select(&CHANGES[..]).prop_map(Edit::Change),
        2 => writing().prop_map(Edit::Rewrite),
        1 => Just(Edit::Revert),
        1 => experiment().prop_map(Edit::Replace),
    ]
}

fn loss() -> impl Strategy<Value = Loss> {
    prop_oneof![
        3 => Just(Loss::Nothing),
        2 => any::<Index>().prop_map(Loss::Object),
        1 => Just(Loss::Objects),
        2 => any::<Index>().prop_map(Loss::Journal),
    ]
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn a_run_does_what_was_foreseen(
        first in experiment(),
        edits in vec((edit(), loss()), 1..4),
    ) {
        let root = tempfile::tempdir().expect("temporary folders can be made");
        let registry = ivx_library::registry();
        let (mut experiment, mut writing) = (first.clone(), Writing::default());
        check(&writing.of(&experiment), &registry, root.path());
        assert!(!files(&root.path().join("objects")).is_empty(), "some results are objects");
        for (edit, loss) in edits {
            match edit {
                Edit::Change(change) => change(&mut experiment),
                Edit::Rewrite(other) => writing = other,
                Edit::Revert => experiment = first.clone(),
                Edit::Replace(other) => experiment = other,
            }
            lose(&loss, root.path());
            check(&writing.of(&experiment), &registry, root.path());
        }
    }
}

/// Foresees a run of a spec, runs it, and compares.
fn check(texts: &[String], registry: &Registry, root: &Path) {
    let plan = plan(texts, registry);
    let cache = Cache::look(root, &platform()).expect("the cache opens");
    let foreseen = foresee(&plan, registry, &cache);
    let nodes: Vec<NodeIndex> = plan.graph.node_indices().collect();
    let reasons = why(&plan, registry, &cache, &nodes).expect("the disk works");
    let recorded: BTreeSet<Digest> = cache.records().map(|record| record.key).collect();
    let objects: BTreeSet<String> =
        files(&root.join("objects")).iter().map(|path| name(path)).collect();
    let outcome = run(&plan, registry, root);

    let asked = wanted(&plan);
    let ran = |node: NodeIndex| matches!(outcome.nodes[node.index()].fate, Fate::Ran { .. });
    let made: BTreeSet<Digest> = nodes
        .iter()
        .filter(|node| ran(**node))
        .filter_map(|n| outcome.nodes[n.index()].key)
        .collect();
    for node in nodes {
        let (ended, address) = (&outcome.nodes[node.index()], &plan.graph[node].address);
        let (foreseen, reason) = (foreseen[node.index()], &reasons[node.index()]);
        let key = ended.key.expect("its inputs are known by now");
        assert_eq!(reason.foreseen, foreseen, "{address}");
        assert!(reason.key.is_none_or(|foreseen| foreseen == key), "{address}");
        assert_eq!(reason.key.is_none(), foreseen == Foreseen::Unknown, "{address}");
        let gone = |output: &Output| {
            output.inline.is_none() && !objects.contains(&output.digest.to_string())
        };
        match (foreseen, &ended.fate) {
            (Foreseen::Hit, Fate::Hit) => assert!(recorded.contains(&key), "{address}"),
            (Foreseen::Hit, Fate::Ran { .. }) => {
                // Its bytes were gone, and something that ran, or the results, needed them.
                assert!(ended.output.as_ref().is_some_and(gone), "{address}");
                let needed = plan.graph.neighbors(node).any(ran) || asked.contains(&node);
                assert!(needed, "{address}");
            }
            (Foreseen::Run, Fate::Ran { .. }) => assert!(!recorded.contains(&key), "{address}"),
            (Foreseen::Unknown, Fate::Ran { .. }) => {
                // Unless its bytes were gone too, as those of a hit.
                let again = ended.output.as_ref().is_some_and(gone);
                assert!(!recorded.contains(&key) || again, "{address}");
            }
            // An equal key was made earlier in this run, or was known.
            (Foreseen::Run, Fate::Hit) => assert!(made.contains(&key), "{address}"),
            (Foreseen::Unknown, Fate::Hit) => {
                assert!(recorded.contains(&key) || made.contains(&key), "{address}");
            }
            (_, fate) => panic!("{address}: {fate:?}"),
        }
        let differs = !reason.differences.is_empty() || !reason.inputs.is_empty();
        let told = differs || reason.record.is_none();
        assert_eq!(told, foreseen != Foreseen::Hit, "{address}: {reason:?}");
    }
}

fn run(plan: &Plan, registry: &Registry, root: &Path) -> Outcome {
    let mut cache = Cache::open(root, &platform()).expect("the cache opens");
    let options = Options {
        jobs: 2,
        memory: u64::MAX,
        fail_fast: false,
        library: "tests".into(),
        checkpoint: Duration::from_mins(1),
        limit: None,
        stop: Stop::default(),
    };
    let outcome = schedule(plan, registry, &mut cache, &options, &wanted(plan), &mut Silence);
    cache.close().expect("the cache closes");
    outcome.expect("the cache works")
}

fn lose(loss: &Loss, root: &Path) {
    let (folder, which) = match loss {
        Loss::Nothing => return,
        Loss::Object(which) => ("objects", Some(which)),
        Loss::Objects => ("objects", None),
        Loss::Journal(which) => ("journal", Some(which)),
    };
    let files = files(&root.join(folder));
    let lost: Vec<PathBuf> = match which {
        Some(_) if files.is_empty() => return,
        Some(which) => vec![files[which.index(files.len())].clone()],
        None => files,
    };
    for file in lost {
        fs::remove_file(file).expect("files can be removed");
    }
}

/// The files below a folder, if it is there.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let all = entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] });
    let mut all: Vec<PathBuf> = all.collect();
    all.sort();
    all
}

fn name(path: &Path) -> String {
    path.file_name().expect("files have names").to_string_lossy().into_owned()
}

const SMALL: &str = include_str!("specs/small.ivx");

#[test]
fn a_plan_tells_a_program_what_it_tells_a_person() {
    let project = Project::with(&[("small.ivx", SMALL)]);
    project.executed("small.ivx", &[]);
    project.write("small.ivx", &SMALL.replace("steps: 20", "steps: 21"));
    let lines = project.run("plan", "small.ivx", &["--nodes"]).out;
    let told = project.run("plan", "small.ivx", &["--format", "json"]).out;
    let told: Value = serde_json::from_str(&told).expect("it is JSON");
    let nodes = told["nodes"].as_array().expect("nodes are a list");
    let text = |value: &Value| value.as_str().expect("it is a text").to_owned();
    let of_program: Vec<String> = nodes
        .iter()
        .map(|node| format!("{:<8} {}", text(&node["state"]), text(&node["address"])))
        .collect();
    let of_person: Vec<&str> = lines.lines().collect();
    assert_eq!(of_program, of_person[..of_person.len() - 1]);
    assert!(["hit", "run", "unknown"].iter().all(|state| lines.contains(state)));
}

#[test]
fn hits_without_bytes_are_told() {
    let spec = SMALL.replace("hidden: [8]", "hidden: [32, 32]");
    let project = Project::with(&[("small.ivx", &spec)]);
    project.executed("small.ivx", &[]);
    let said = |command: &str, rest: &[&str]| project.run(command, "small.ivx", rest).out;
    let model = "small/model[seed=0]/member[0]";
    assert!(!said("plan", &[]).contains("gone") && !said("why", &[model]).contains("gone"));
    fs::remove_dir_all(project.path(".ivx/cache/objects")).expect("objects can be removed");
    let told = said("plan", &[]);
    let last = "the bytes of 5 hits are gone: where one is needed, its node runs again\n";
    assert!(told.ends_with(last), "{told}");
    assert!(said("why", &[model]).ends_with("where they are needed, it runs again\n"));
    let told: Value =
        serde_json::from_str(&said("plan", &["--format", "json"])).expect("it is JSON");
    let nodes = told["nodes"].as_array().expect("nodes are a list");
    assert_eq!(nodes.iter().filter(|node| node["gone"] == true).count(), 5);
}

#[test]
fn foreseeing_leaves_the_cache_alone_or_away() {
    let project = Project::with(&[("small.ivx", SMALL)]);
    let (cache, asked) =
        (project.path(".ivx/cache"), [("plan", &[][..]), ("why", &["small/data"])]);
    for (command, rest) in asked {
        assert_eq!(project.run(command, "small.ivx", rest).code, 0);
        assert!(!cache.exists(), "{command} made a cache");
    }
    project.executed("small.ivx", &[]);
    let before = stamps(&cache);
    for (command, rest) in asked {
        let said = project.run(command, "small.ivx", rest);
        assert!(said.code == 0 && said.out.contains("hit"), "{command}: {}", said.out);
        assert_eq!(stamps(&cache), before, "{command} changed the cache");
    }
}

/// Every file and folder of a folder, itself too, with when it was changed.
fn stamps(folder: &Path) -> Vec<(PathBuf, SystemTime)> {
    let stamp = |path: &Path| {
        let changed = fs::metadata(path).and_then(|file| file.modified());
        (path.to_owned(), changed.expect("files have times"))
    };
    let mut all = vec![stamp(folder)];
    for entry in fs::read_dir(folder).expect("folders can be read").flatten() {
        let path = entry.path();
        if path.is_dir() { all.extend(stamps(&path)) } else { all.push(stamp(&path)) }
    }
    all.sort();
    all
}
