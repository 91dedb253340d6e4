//! Aggregates of many runs on many tasks, in the language: the numbers of rliable's own golden case.

use ivx_engine::Results;
use serde_json::Value;

use crate::project::Project;

const SPEC: &str = "edition \"2026\"
published scores from \"scores.ron\"
experiment e {
    axis seed = 0..8
    let x = match seed { 0: scores[run: \"0\"], 1: scores[run: \"1\"], 2: scores[run: \"2\"], 3: scores[run: \"3\"],
        4: scores[run: \"4\"], 5: scores[run: \"5\"], 6: scores[run: \"6\"], 7: scores[run: \"7\"] }
    let ours = x[method: \"ours\"]
    let others = x[method: \"others\"]
    measure mean_of_all = mean(ours, over: [seed, task])
    measure iqm_of_all = iqm(ours, over: [seed, task])
    measure gap = optimality_gap(ours, over: [seed, task])
    measure interval = stratified(ours, over: seed, tasks: task)
    measure middle = stratified(ours, over: seed, tasks: task, statistic: \"median\")[end: \"estimate\"]
    measure improvement = mean(probability_of_improvement(ours, others, over: seed), over: task)
    measure above = performance_profile(ours, over: [seed, task], at: [0.0, 0.5, 1.0])
    figure \"profile\" = plot([curve(performance_profile(x, over: task, at: [0.0, 0.25, 0.5, 0.75, 1.0]), x: threshold, by: method)])
    figure \"aggregate\" = bars(stratified(x, over: seed, tasks: task), by: method)
    table \"aggregate\" = table([stratified(x, over: seed, tasks: task)], rows: method)
    claim \"better\" : mean(probability_of_improvement(ours, others, over: seed), over: task) > 0.5
    claim \"by the trimmed mean\" : iqm(ours, over: [seed, task]) > iqm(others, over: [seed, task])
}
";

#[test]
fn golden_aggregates_of_the_language_are_those_of_rliable() {
    let golden: Value =
        serde_json::from_str(include_str!("golden/statistics.json")).expect("golden files read");
    let cases = golden["cases"].as_array().expect("there are cases");
    let case = cases.iter().find(|case| case["kind"] == "rliable").expect("there is one");
    let inputs = ["scores_runs_x_tasks", "scores_other"].map(|key| case["inputs"][key].to_string());
    let numbers = inputs.map(|text| text.replace(['[', ']'], "")).join(", ");
    let table = format!(
        "(source: \"none\", axes: [(\"method\", [\"ours\", \"others\"]), (\"run\", [\"0\", \"1\", \"2\", \"3\", \"4\", \
         \"5\", \"6\", \"7\"]), (\"task\", [\"0\", \"1\", \"2\", \"3\"])], values: [{numbers}])"
    );
    let project = Project::with(&[("e.ivx", SPEC), ("scores.ron", &table)]);
    let said = project.run("exec", "e.ivx", &[]);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    let results = Results::from_ron(&project.read("results/e/results.ron")).expect("results read");
    let measure = |name: &str| results.experiments["e"].measures[name].values.clone();
    for (name, golden) in [
        ("mean_of_all", "mean"),
        ("iqm_of_all", "iqm"),
        ("gap", "optimality_gap"),
        ("improvement", "prob_improvement"),
        ("middle", "median"),
    ] {
        let (found, expected) = (measure(name), &case["expected"][golden]);
        let expected = expected.as_f64().expect("a number");
        assert!((found[0] - expected).abs() < 1e-9, "{name}: {found:?}, {expected}");
    }
    let interval = measure("interval");
    assert_eq!(interval[0], measure("iqm_of_all")[0]);
    assert!(interval[1] < interval[0] && interval[0] < interval[2], "{interval:?}");
    assert_eq!((measure("above")[0], measure("above")[2]), (1.0, 0.0));
    // A difference of 0.008 of a probability is told by no 8 runs.
    assert!(said.out.contains("undecided better") && said.out.contains("n = 8"), "{}", said.out);
    for file in ["figures/profile.svg", "figures/aggregate.svg"] {
        assert!(project.read(&format!("results/e/{file}")).contains("<path"), "{file}");
    }
    let table = project.read("results/e/tables/aggregate.md");
    assert!(table.contains("0.474 ["), "{table}");
}
