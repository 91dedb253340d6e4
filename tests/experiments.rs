//! The specs of `experiments/`.

use std::fs;
use std::path::{Path, PathBuf};

use crate::project::{Project, run};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../experiments")
}

#[test]
fn every_spec_checks_without_a_word_in_every_profile() {
    let mut n_specs = 0;
    for folder in [root(), root().join("ch2")] {
        for entry in fs::read_dir(folder).expect("experiments are there").flatten() {
            if entry.path().extension().is_none_or(|extension| extension != "ivx") {
                continue;
            }
            for profile in [&[][..], &["--profile", "paper"]] {
                let mut args = vec!["ivx".into(), "check".into(), entry.path().into_os_string()];
                args.extend(profile.iter().map(Into::into));
                let said = run(args);
                assert_eq!((said.code, said.err.as_str()), (0, ""), "{}", entry.path().display());
            }
            n_specs += 1;
        }
    }
    assert!(n_specs >= 7);
}

#[test]
fn the_thesis_runs_at_its_smallest() {
    let project = Project::with(&[]);
    for (name, text) in specs() {
        project.write(&name, &text);
    }
    let smallest = [
        "reward_ensemble.members=2",
        "reward_ensemble.hidden=[4, 4]",
        "reward_ensemble.steps=3",
        "ignorance.seeds=2",
        "polynomial_regression.seeds=2",
        "deep_ensemble.seeds=2",
        "overoptimisation.seeds=2",
        "behaviour_cloning.seeds=2",
        "behaviour_cloning.demos=10",
        "behaviour_cloning.steps=20",
        "behaviour_cloning.episodes=10",
        "value_learning.seeds=2",
        "value_learning.walks=5",
        "value_learning.episodes=20",
        "value_ensemble.seeds=2",
        "value_ensemble.passes=5",
    ];
    let sets: Vec<&str> = smallest.iter().flat_map(|set| ["--set", set]).collect();
    let executed = project.executed("thesis.ivx", &sets);
    assert!(executed > 100, "{executed}");
    assert_eq!(project.executed("thesis.ivx", &sets), 0);
    let results = project.read("results/thesis/results.ron");
    // The two tables of Example 2.1 do not depend on sizes.
    assert!(results.contains("2.2a: risk-averse agents go LEFT"));
    for figure in ["2.1", "2.4a", "2.4b", "2.4c", "2.5a", "2.5b", "2.5c", "2.5d", "2.10a", "2.10b"]
    {
        assert!(
            project.read(&format!("results/thesis/figures/{figure}.svg")).starts_with("<svg"),
            "{figure}"
        );
    }
}

#[test]
fn networks_run_at_their_smallest() {
    let project = Project::with(&[]);
    for (name, text) in specs() {
        project.write(&name, &text);
    }
    let smallest = [
        "glyphs.n=9",
        "glyphs.steps=2",
        "glyphs.seeds=1",
        "copying.n=5",
        "copying.steps=2",
        "copying.seeds=1",
        "posteriors.members=2",
        "posteriors.steps=3",
        "posteriors.seeds=2",
    ];
    let sets: Vec<&str> = smallest.iter().flat_map(|set| ["--set", set]).collect();
    assert!(project.executed("networks.ivx", &sets) > 20);
    assert_eq!(project.executed("networks.ivx", &sets), 0);
    assert!(project.read("results/networks/figures/glyphs.svg").starts_with("<svg"));
}

#[test]
fn the_tables_of_example_2_1_are_as_published() {
    let project = Project::with(&[]);
    for (name, text) in specs() {
        project.write(&name, &text);
    }
    let said = project.run("exec", "ch2/boxes.ivx", &["--strict"]);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    assert_eq!(said.out.matches("  holds ").count(), 7, "{}", said.out);
    let table = project.read("results/boxes/tables/2.2a.csv");
    let rows: Vec<&str> = table.lines().collect();
    assert!(rows.contains(&"WCU,1,0") || rows.contains(&"WCU,1.0,0.0"), "{table}");
}

fn specs() -> Vec<(String, String)> {
    let mut specs = Vec::new();
    for folder in ["", "ch2"] {
        for entry in fs::read_dir(root().join(folder)).expect("experiments are there").flatten() {
            let path = entry.path();
            if path.is_file() {
                let name = Path::new(folder).join(entry.file_name());
                specs.push((
                    name.display().to_string(),
                    fs::read_to_string(path).expect("specs can be read"),
                ));
            }
        }
    }
    specs
}
