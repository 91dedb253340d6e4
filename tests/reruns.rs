//! What runs again, and what does not: the promise of the cache.

use crate::project::Project;

const SMALL: &str = include_str!("specs/small.ivx");

fn small() -> Project {
    Project::with(&[("small.ivx", SMALL)])
}

/// What an edit of the spec executes, after the spec was run.
#[track_caller]
fn executed_after(edit: impl Fn(&str) -> String) -> usize {
    let project = small();
    assert!(project.executed("small.ivx", &[]) > 0);
    let edited = edit(SMALL);
    assert_ne!(edited, SMALL, "the edit finds its place");
    project.write("small.ivx", &edited);
    project.executed("small.ivx", &[])
}

#[test]
fn a_second_run_executes_nothing_and_finds_the_same() {
    let project = small();
    assert!(project.executed("small.ivx", &[]) > 0);
    let first = settled(project.files("results/small"));
    assert_eq!(project.executed("small.ivx", &[]), 0);
    assert_eq!(settled(project.files("results/small")), first);
    assert!(first.iter().any(|(name, _)| name == "figures/gap.svg"));
    assert!(first.iter().any(|(name, _)| name == "tables/gap.md"));
}

#[test]
fn results_do_not_depend_on_threads_or_the_cache() {
    let results = |rest: &[&str]| {
        let project = small();
        let said = project.run("exec", "small.ivx", rest);
        assert_eq!(said.code, 0, "{}", said.err);
        (settled(project.files("results/small")), said.err.contains("it runs alone"))
    };
    let one = results(&["--jobs", "1"]);
    assert!(!one.1, "a machine has memory for these");
    assert_eq!(results(&["--jobs", "2"]), one);
    assert_eq!(results(&["--jobs", "5", "--checkpoint", "0s"]), one);
    assert_eq!(results(&["--jobs", "4", "--memory", "1KB"]), (one.0, true));
}

#[test]
fn comments_names_and_the_order_of_arguments_do_not_matter() {
    assert_eq!(
        executed_after(|spec| spec.replace("let data", "// where it comes from\n    let data")),
        0
    );
    assert_eq!(executed_after(|spec| spec.replace("model", "learned")), 0);
    assert_eq!(
        executed_after(|spec| spec.replace("drawn", "shown")),
        2,
        "a name that a legend shows is drawn anew, and nothing else"
    );
    assert_eq!(executed_after(|spec| spec.replace("(data[seed: 0]", "( // why\n data[seed:0]")), 0);
    assert_eq!(
        executed_after(|spec| spec.replace("on: data, steps: 20", "steps: 20, on: data")),
        0
    );
    assert_eq!(executed_after(|spec| spec.replace("n: 8)", "n: 8, noise: 0.1)")), 0);
    assert_eq!(executed_after(|spec| spec.replace("    ", "\t")), 0);
    assert_eq!(executed_after(|spec| spec.replace("small", "renamed")), 0);
}

#[test]
fn splitting_a_spec_into_files_executes_nothing() {
    let project = small();
    project.executed("small.ivx", &[]);
    let line = "    let reward = sinusoids()\n";
    let rest = SMALL.replace(line, "").replace(
        "edition \"2026\"\n",
        "edition \"2026\"\nuse \"worlds/one.ivx\" { world as reward }\n",
    );
    project.write("worlds/one.ivx", "edition \"2026\"\nlet world = sinusoids()\n");
    project.write("small.ivx", &rest);
    assert_eq!(project.executed("small.ivx", &[]), 0);
}

#[test]
fn a_changed_knowledge_equivalent_executes_only_what_reads_it() {
    let project = small();
    project.executed("small.ivx", &[]);
    project.write("small.ivx", &SMALL.replace("\"WCM\": wcm()", "\"WCM\": wcm(), \"BCM\": bcm()"));
    let plan = project.run("plan", "small.ivx", &["--nodes"]);
    let mut run: Vec<&str> = plan.out.lines().filter(|line| line.starts_with("run")).collect();
    run.sort_unstable();
    assert_eq!(
        run,
        ["run      small/decision[seed=0,ke=BCM]", "run      small/decision[seed=1,ke=BCM]"]
    );
    // Two decisions, their regrets, the figure and the table.
    assert_eq!(project.executed("small.ivx", &[]), 6);
}

#[test]
fn more_members_train_only_the_new_ones() {
    let project = small();
    project.executed("small.ivx", &[]);
    let said = project.run("plan", "small.ivx", &["--nodes", "--set", "members=5"]);
    let trained: Vec<&str> = said.out.lines().filter(|line| line.contains("/model")).collect();
    let run = trained.iter().filter(|line| line.starts_with("run")).count();
    let hit = trained.iter().filter(|line| line.starts_with("hit")).count();
    assert_eq!((run, hit), (3 * 2, 2 * 2), "{}", said.out);
}

#[test]
fn a_change_without_effect_stops_where_it_has_none() {
    // Ties are split by the first maximiser, so that a tighter grid of the same points changes
    // the figure's inputs not at all: the regret's key depends on the decision's bytes.
    let executed = executed_after(|spec| spec.replace("\"MA\": ma()", "\"MA\": mvm(xi: 0.0)"));
    // The decisions run again and are the same bytes; nothing after them runs.
    assert_eq!(executed, 2);
}

#[test]
fn a_seed_more_leaves_the_others_alone() {
    let project = small();
    project.executed("small.ivx", &[]);
    let said = project.run("plan", "small.ivx", &["--nodes", "--set", "small.seeds=3"]);
    let run = said.out.lines().filter(|line| line.starts_with("run"));
    assert!(run.clone().all(|line| line.contains("seed=2")), "{}", said.out);
    assert_eq!(run.count(), 1, "the new data; the rest waits for it");
}

#[test]
fn damaged_bytes_are_computed_again_and_never_served() {
    let project =
        Project::with(&[("small.ivx", &SMALL.replace("hidden: [8]", "hidden: [32, 32]"))]);
    project.executed("small.ivx", &[]);
    let first = settled(project.files("results/small"));
    let objects = project.files(".ivx/cache/objects");
    assert!(!objects.is_empty(), "models of this size are objects");
    for (name, mut bytes) in objects {
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        let path = project.path(&format!(".ivx/cache/objects/{name}"));
        std::fs::remove_file(&path).expect("objects can be removed");
        std::fs::write(&path, bytes).expect("objects can be written");
    }
    // A new grid of predictions makes the models' bytes needed.
    project.write(
        "small.ivx",
        &project.read("small.ivx").replace("points: 11)), over", "points: 12)), over"),
    );
    assert!(project.executed("small.ivx", &[]) > 0);
    project.write(
        "small.ivx",
        &project.read("small.ivx").replace("points: 12)), over", "points: 11)), over"),
    );
    project.executed("small.ivx", &[]);
    assert_eq!(settled(project.files("results/small")), first);
}

/// What is a matter of the spec, not of the run.
fn settled(mut files: Vec<(String, Vec<u8>)>) -> Vec<(String, Vec<u8>)> {
    files.retain(|(name, _)| name != "run.ron" && name != "report.html");
    files
}

#[test]
fn a_cache_without_objects_is_filled_again() {
    let project =
        Project::with(&[("small.ivx", &SMALL.replace("hidden: [8]", "hidden: [32, 32]"))]);
    project.executed("small.ivx", &[]);
    let first = settled(project.files("results/small"));
    std::fs::remove_dir_all(project.path(".ivx/cache/objects")).expect("objects can be removed");
    project.executed("small.ivx", &[]);
    assert_eq!(settled(project.files("results/small")), first);
}

#[test]
fn every_node_has_an_address_of_its_own() {
    let project = Project::with(&[
        ("every_op.ivx", include_str!("specs/every_op.ivx")),
        ("paper.ron", include_str!("specs/paper.ron")),
        ("table.csv", include_str!("specs/table.csv")),
        ("gaps.csv", include_str!("specs/gaps.csv")),
        ("walks.txt", include_str!("specs/walks.txt")),
        ("drives.csv", include_str!("specs/drives.csv")),
    ]);
    let said = project.run("plan", "every_op.ivx", &["--nodes"]);
    let mut addresses: Vec<&str> =
        said.out.lines().filter_map(|line| line.split_once(' ')).map(|(_, a)| a).collect();
    let n = addresses.len();
    addresses.sort_unstable();
    addresses.dedup();
    assert_eq!(addresses.len(), n);
}

#[test]
fn what_is_known_comes_out_the_same_again() {
    let project = small();
    let verified = |rest: &[&str]| {
        let said = project.run("verify", "small.ivx", rest);
        assert_eq!(said.code, 0, "{}{}", said.out, said.err);
        let (n, words) = said.out.split_once(' ').expect("a number comes first");
        assert!(words.contains(&format!("nodes run again: {n} the same")), "{}", said.out);
        n.parse::<usize>().expect("a number")
    };
    assert_eq!(verified(&[]), 0);
    let executed = project.executed("small.ivx", &[]);
    assert!(verified(&[]) >= executed);
    let some = verified(&["--sample", "20%"]);
    assert!(some < executed && some == verified(&["--sample", "20%"]));
    assert_eq!(project.run("verify", "small.ivx", &["--sample", "half"]).code, 2);
}

#[test]
fn a_lock_holds_what_a_run_found() {
    let project = small();
    assert_eq!(project.run("exec", "small.ivx", &["--locked"]).code, 2, "there is no lock yet");
    assert_eq!(project.run("exec", "small.ivx", &["--lock"]).code, 0);
    let first = project.read("ivx.lock");
    let said = project.run("exec", "small.ivx", &["--locked"]);
    assert!(said.code == 0 && said.out.contains("as locked in ivx.lock"), "{}", said.out);
    assert_eq!(project.run("exec", "small.ivx", &["--lock"]).code, 0);
    assert_eq!(project.read("ivx.lock"), first, "nothing moved");

    project.write("small.ivx", &SMALL.replace("sample(reward, n: 8)", "sample(reward, n: 9)"));
    let said = project.run("exec", "small.ivx", &["--locked"]);
    assert!(said.code == 1 && said.out.contains("not as locked in ivx.lock"), "{}", said.out);
    assert!(said.out.contains("  ~ small/data"), "{}", said.out);
}
