//! Published numbers.

use crate::project::Project;

const SPEC: &str = "edition \"2026\"
published t from \"paper.ron\"
experiment e {
    measure hills = t[scene: \"Hills\"]
    measure average = mean(t, over: scene)
    measure errors = t.errors[scene: \"Hills\"]
    claim \"less\" : t[scene: \"Hills\"] < 1.0
    claim \"some are missing\" : t < 1.0
}
";

#[test]
fn numbers_reach_measures_and_claims_and_gaps_stay_gaps() {
    let paper = include_str!("specs/paper.ron");
    let project = Project::with(&[("e.ivx", SPEC), ("paper.ron", paper)]);
    let said = project.run("exec", "e.ivx", &[]);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    let results = project.read("results/e/results.ron");
    let flat: String = results.split_whitespace().collect();
    assert!(flat.contains("labels:Names([\"DIM\",\"RIP\",])"), "{results}");
    for values in ["[0.25,0.75,]", "[0.375,NaN,]", "[0.1,NaN,]"] {
        assert!(flat.contains(&format!("values:{values}")), "{values}: {results}");
    }
    assert!(
        said.out.contains("  holds     less") && said.out.contains("undecided some"),
        "{}",
        said.out
    );
}

#[test]
fn neither_the_file_nor_its_source_reaches_a_key() {
    let paper = include_str!("specs/paper.ron");
    let project = Project::with(&[("e.ivx", SPEC), ("paper.ron", paper)]);
    assert!(project.executed("e.ivx", &[]) > 0);
    project.write("tables/other.ron", &paper.replace("Filos, Table 3.3", "elsewhere"));
    project.write("e.ivx", &SPEC.replace("paper.ron", "tables/other.ron"));
    assert_eq!(project.executed("e.ivx", &[]), 0);
    project.write("tables/other.ron", &paper.replace("0.25", "0.3"));
    assert!(project.executed("e.ivx", &[]) > 0);
}
