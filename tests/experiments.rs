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
    for folder in ["", "ch2", "ch3", "ch4", "ch5", "command", "papers", "studies"]
        .map(|folder| root().join(folder))
    {
        for entry in fs::read_dir(folder).expect("experiments are there").flatten() {
            if entry.path().extension().is_none_or(|extension| extension != "ivx") {
                continue;
            }
            let text = fs::read_to_string(entry.path()).expect("specs can be read");
            let sizes = ["seeds", "steps", "epochs"].map(|size| format!("param {size}: Int"));
            let has_sizes = sizes.iter().any(|size| text.contains(size));
            assert_eq!(text.contains("profile smoke"), has_sizes, "{}", entry.path().display());
            for profile in [&[][..], &["--profile", "paper"]] {
                let mut args = vec!["ivx".into(), "check".into(), entry.path().into_os_string()];
                args.extend(profile.iter().map(Into::into));
                let said = run(args);
                assert_eq!((said.code, said.err.as_str()), (0, ""), "{}", entry.path().display());
            }
            n_specs += 1;
        }
    }
    assert!(n_specs >= 20, "{n_specs}");
}

#[test]
fn the_thesis_runs_at_its_smallest() {
    let project = Project::with(&[]);
    for (name, text) in specs() {
        project.write(&name, &text);
    }
    let out = project.path("out").display().to_string();
    let sets = ["--profile", "smoke", "--out", &out];
    let executed = project.executed("thesis.ivx", &sets);
    assert!(executed > 100, "{executed}");
    assert_eq!(project.executed("thesis.ivx", &sets), 0);
    let results = project.read("out/results.ron");
    // The two tables of Example 2.1 do not depend on sizes.
    assert!(results.contains("2.2a: risk-averse agents go LEFT"));
    for figure in [
        "2.1", "2.3", "2.4a", "2.4b", "2.4c", "2.5a", "2.5b", "2.5c", "2.5d", "2.10a", "2.10b",
        "5.4a", "5.4b", "5.4c", "5.6", "5.8a", "5.8b",
    ] {
        assert!(project.read(&format!("out/figures/{figure}.svg")).starts_with("<svg"), "{figure}");
    }
}

/// Two people cross each of six streets; the real ones are not ours to pass on.
#[test]
fn pedestrians_run_on_streets_that_somebody_has() {
    let project = Project::with(&[]);
    let spec = root().join("ethucy/pedestrians.ivx");
    project.write("pedestrians.ivx", &fs::read_to_string(spec).expect("it is there"));
    let streets =
        ["biwi_eth", "biwi_hotel", "students001", "students003", "crowds_zara01", "crowds_zara02"];
    for (i, street) in streets.into_iter().enumerate() {
        let row = |t: u32| {
            let x = 0.4 * f64::from(t);
            format!("{0} 1 {x} {i}.0\n{0} 2 {1} 9.5\n", 10 * t, 12.0 - x)
        };
        project.write(&format!("{street}.txt"), &(0..30).map(row).collect::<String>());
    }
    let said = project.run("check", "pedestrians.ivx", &[]);
    assert_eq!((said.code, said.err.as_str()), (0, ""));
    assert!(project.executed("pedestrians.ivx", &["--profile", "smoke"]) > 30);
}

#[test]
fn networks_run_at_their_smallest() {
    let project = Project::with(&[]);
    for (name, text) in specs() {
        project.write(&name, &text);
    }
    let out = project.path("out").display().to_string();
    let sets = ["--profile", "smoke", "--out", &out];
    assert!(project.executed("networks.ivx", &sets) > 20);
    assert_eq!(project.executed("networks.ivx", &sets), 0);
    assert!(project.read("out/figures/glyphs.svg").starts_with("<svg"));
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
    let table = project.read("results/ch2/boxes/tables/2.2a.csv");
    let rows: Vec<&str> = table.lines().collect();
    assert!(rows.contains(&"WCU,1,0") || rows.contains(&"WCU,1.0,0.0"), "{table}");
}

#[test]
fn studies_are_short_and_run_at_their_smallest() {
    let project = Project::with(&[]);
    for folder in ["papers/data", "studies"] {
        for entry in fs::read_dir(root().join(folder)).expect("studies are there").flatten() {
            let text = fs::read_to_string(entry.path()).expect("they are text");
            let name = Path::new(folder).join(entry.file_name()).display().to_string();
            let is_spec = entry.path().extension().is_some_and(|extension| extension == "ivx");
            assert!(!is_spec || text.lines().count() <= 60, "{name}");
            project.write(&name, &text);
        }
    }
    for study in ["ablation", "baselines", "nested_folds", "own_bandit", "sweep", "wind"] {
        let (spec, out) =
            (format!("studies/{study}.ivx"), project.path(study).display().to_string());
        let said = project.run("exec", &spec, &["--profile", "smoke", "--out", &out]);
        // One learning rate of the sweep is there to run away, and the rest is shown.
        assert_eq!(said.code, u8::from(study == "sweep"), "{study}: {}{}", said.out, said.err);
        assert!(said.out.contains("nodes executed"), "{}", said.out);
        assert!(project.read(&format!("{study}/report.html")).contains("</html>"));
    }
    assert!(project.read("sweep/tables/sweep.md").contains("missing (2 of 2)"));
    assert!(project.read("sweep/figures/sweep.svg").contains("values are missing"));
}

fn specs() -> Vec<(String, String)> {
    let mut specs = Vec::new();
    for folder in ["", "ch2", "ch3", "ch4", "ch5", "published"] {
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

/// Numbers of the thesis as files, and claims about them.
#[test]
fn published_tables_are_read_and_compared_with() {
    let tables: Vec<(String, String)> = fs::read_dir(root().join("published"))
        .expect("published tables are there")
        .flatten()
        .map(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            (name, fs::read_to_string(entry.path()).expect("tables can be read"))
        })
        .collect();
    let read: std::collections::BTreeMap<&str, ivx_op::Published> = tables
        .iter()
        .map(|(name, text)| (name.as_str(), ivx_op::read_published(text).expect("it is sound")))
        .collect();
    let sizes: Vec<usize> = read.values().map(|table| table.values.len()).collect();
    // 3.2, 3.3, 4.1, 4.2, 5.1, 5.2 and C.1, by their grids.
    assert_eq!(sizes, [48, 84, 12, 24, 20, 20, 28]);
    assert!(read.values().all(|table| table.values.iter().all(Option::is_some)));

    let project = Project::with(&[]);
    for (name, text) in &tables {
        project.write(&format!("published/{name}"), text);
    }
    project.write("compared.ivx", COMPARED);
    let said = project.run("exec", "compared.ivx", &["--strict"]);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    assert_eq!(said.out.matches("  holds ").count(), 4, "{}", said.out);
}

const COMPARED: &str = r#"edition "2026"

experiment compared {
    published t33 from "published/table_3_3.ron"
    published t41 from "published/table_4_1.ron"
    published t51 from "published/table_5_1.ron"
    let success = t33[metric: "Success"]
    measure overall = mean(success, over: scene)
    measure return = t51[method: "mu+sigma-IVE[5]", eta: 0.5]
    table "3.3" = table([overall], rows: method)
    claim "RIP-WCM succeeds more often than DIM in every family" :
        success[method: "RIP-WCM"] > success[method: "DIM"]
    claim "at the highest threshold" : 325.0 == return within(10.0)
    claim "a number of Table 3.3" :
        t33[scene: "Hills", method: "RIP-MA", metric: "Success"] == 97.5
    claim "ITD infers the reward of CoinGrid" :
        t41[task: "CoinGrid", method: "ITD"] > t41[task: "CoinGrid", method: "SQIL"]
}
"#;
