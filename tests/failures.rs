//! What happens when something goes wrong.

use crate::project::{Project, run};

/// One problem cannot be decided, since its probabilities do not sum to one; the other can.
const HALF_BROKEN: &str = r#"edition "2026"

experiment half {
    let white = belief([lottery([0.0], [1.0])])
    axis chance = { "sound": lottery([-1.0, 1.0], [0.5, 0.5]), "broken": lottery([-1.0, 1.0], [0.5, 0.4]) }
    measure broken = decide(boxes(left: white, right: belief([chance])))[action: "LEFT"] * 2.0
    measure sound  = decide(boxes(left: white, right: white))
}
"#;

#[test]
fn independent_work_goes_on_after_a_failure() {
    let project = Project::with(&[("half.ivx", HALF_BROKEN)]);
    let said = project.run("exec", "half.ivx", &[]);
    assert_eq!(said.code, 1, "{}{}", said.out, said.err);
    assert!(said.err.contains("failed: half/broken"), "{}", said.err);
    assert!(said.out.contains("1 failed, 2 skipped because of them"), "{}", said.out);
    let results = project.read("results/half/results.ron");
    assert!(results.contains("half/broken"), "{results}");
    // What is known of the measure is there beside what is not.
    assert!(results.contains("NaN") && results.contains("1.0"), "{results}");
    // What did not depend on it is there, and is not run again.
    let again = project.run("exec", "half.ivx", &[]);
    assert_eq!(again.code, 1);
    assert!(again.out.contains("0 of "), "{}", again.out);
}

#[test]
fn a_failing_claim_is_an_error_only_under_strict() {
    let spec = r#"edition "2026"
experiment wrong {
    claim "one is more than two" : 1.0 > 2.0
}
"#;
    let project = Project::with(&[("wrong.ivx", spec)]);
    let said = project.run("exec", "wrong.ivx", &[]);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.out.contains("  fails     one is more than two"), "{}", said.out);
    assert_eq!(project.run("exec", "wrong.ivx", &["--strict"]).code, 1);
}

#[test]
fn settings_that_do_not_fit_are_refused() {
    let project = Project::with(&[("small.ivx", include_str!("specs/small.ivx"))]);
    for (set, part) in [
        ("members=many", "wants an Int, and `many` is none"),
        ("members", "write NAME=VALUE without spaces"),
        ("membres=3", "did you mean `members`?"),
        ("members=2.5", "is Int, but its value by `--set` is Float"),
        ("members=0", "set here by `--set`"),
    ] {
        let said = project.run("check", "small.ivx", &["--set", set]);
        assert_eq!(said.code, 2, "{set}: {}", said.out);
        assert!(said.err.contains(part), "{set}: {}", said.err);
    }
    let said = project.run("check", "small.ivx", &["--profile", "quikc"]);
    assert!(said.code == 2 && said.err.contains("no profile is called `quikc`"), "{}", said.err);
}

#[test]
fn the_limit_of_nodes_is_set_by_hand() {
    let project = Project::with(&[("small.ivx", include_str!("specs/small.ivx"))]);
    for command in ["check", "plan", "exec"] {
        let said = project.run(command, "small.ivx", &["--max-nodes", "7"]);
        assert_eq!(said.code, 2, "{command}");
        let told = "the program has more than 7 nodes, with this one for each of 2 seed × 2 ke";
        assert!(said.err.contains(told), "{}", said.err);
        assert!(said.err.contains("`--max-nodes` raises the limit"), "{}", said.err);
    }
    assert_eq!(project.run("check", "small.ivx", &["--max-nodes", "100"]).code, 0);
}

#[test]
fn a_profile_builds_on_its_base() {
    let project = Project::with(&[
        ("lib/sizes.ivx", include_str!("cases/lib/sizes.ivx")),
        ("e.ivx", include_str!("cases/ok_profile_base.ivx")),
    ]);
    for (profile, params) in [
        ("paper", ["\"sizes.steps\": 3", "\"n\": 30", "\"noise\": 0.1"]),
        ("small", ["\"sizes.steps\": 3", "\"n\": 10", "\"noise\": 0.2"]),
        ("quick", ["\"sizes.steps\": 1", "\"n\": 10", "\"noise\": 0.2"]),
        ("desk", ["\"sizes.steps\": 1", "\"n\": 20", "\"noise\": 0.2"]),
    ] {
        let out = project.path(profile).display().to_string();
        project.executed("e.ivx", &["--profile", profile, "--out", &out]);
        let results = project.read(&format!("{profile}/results.ron"));
        for param in params {
            assert!(results.contains(param), "{profile}: {param}: {results}");
        }
    }
}

#[test]
fn differences_between_results_are_told() {
    let project = Project::with(&[("small.ivx", include_str!("specs/small.ivx"))]);
    project.executed("small.ivx", &[]);
    let before = project.path("before.ron");
    std::fs::copy(project.path("results/small/results.ron"), &before)
        .expect("results can be copied");
    let diff = |after: &str| {
        let after = project.path(after);
        run(vec!["ivx".into(), "diff".into(), before.clone().into(), after.into()])
    };
    let said = diff("results/small");
    assert_eq!((said.code, said.out.as_str()), (0, "no differences\n"));
    project.executed("small.ivx", &["--set", "members=3"]);
    let said = diff("results/small@members=3");
    assert_eq!(said.code, 1);
    assert!(said.out.contains("~ param small.members: 2 -> 3"), "{}", said.out);
    assert!(said.out.contains("~ measure small/spread: 2 of 2 moved"), "{}", said.out);
}

#[test]
fn a_missing_spec_and_a_wrong_command_are_told() {
    let said = run(vec!["ivx".into(), "exec".into(), "no/such.ivx".into()]);
    assert_eq!(said.code, 2);
    assert!(said.err.contains("no/such.ivx"), "{}", said.err);
    assert_eq!(run(vec!["ivx".into(), "exce".into()]).code, 2);
    assert_eq!(run(vec!["ivx".into(), "--help".into()]).code, 0);
}

#[test]
fn only_what_ivx_wrote_is_taken_away() {
    let spec = include_str!("specs/small.ivx");
    let project = Project::with(&[("small.ivx", spec)]);
    project.executed("small.ivx", &[]);
    project.write("results/small/figures/mine.svg", "mine");
    project.write("results/small/figures/more/mine.svg", "mine");
    project.write("small.ivx", &spec.replace("figure \"gap\"", "figure \"other\""));
    project.executed("small.ivx", &[]);
    let files: Vec<String> =
        project.files("results/small/figures").into_iter().map(|(name, _)| name).collect();
    assert_eq!(files, ["members.svg", "mine.svg", "more/mine.svg", "other.svg"]);
}

/// One of two step sizes has no decision: probabilities that do not sum to one, at one seed of `"some"` and at all of `"all"`.
const PARTS_MISSING: &str = r#"edition "2026"

experiment parts {
    axis seed = 0..6
    axis part = ["none", "some", "all"]
    let share = match part {
        "none": 0.5,
        "some": where(seed == 2, 0.4, 0.5),
        "all": 0.4,
    }
    let chance = belief([lottery([-1.0, 1.0], [0.5, share])])
    let white = belief([lottery([0.0], [1.0])])
    let data = sample(sinusoids(), n: 5)
    let drawn = rmse(train(linear_mle(features: polynomial(degree: 0)), on: data), on: data)
    measure m = decide(boxes(left: white, right: chance))[action: "LEFT"] + drawn
    measure all_seeds = mean(m, over: seed)
    measure the_rest  = mean(m, over: seed, skip_missing: true)
    measure chosen    = argmax(m + 0.0 * drawn, over: part, of: m, skip_missing: true)
    table "told" = table(m, rows: part, digits: 1)
    table "rest" = table(m, rows: part, digits: 1, skip_missing: true)
    figure "told" = bars(m, by: part)
    figure "rest" = bars(m, by: part, skip_missing: true)
    claim "none" : m[part: "none"] < 9.0
    claim "some" : m[part: "some"] < 9.0
    claim "all" : m[part: "all"] < 9.0
    claim "pair" : m[part: "some"] < m[part: "none"] + 9.0
    claim "mean" : mean(m[part: "some"], over: seed) < 9.0
    claim "rest" : mean(m[part: "some"], over: seed, skip_missing: true) < 9.0
}
"#;

#[test]
fn what_failed_is_missing_and_the_rest_is_shown() {
    let project = Project::with(&[("parts.ivx", PARTS_MISSING)]);
    let said = project.run("exec", "parts.ivx", &[]);
    assert_eq!(said.code, 1, "{}{}", said.out, said.err);
    for told in [
        "holds     none",
        "undecided some  difference NaN, n = 5: seed 2 is missing",
        "undecided all  difference NaN: seeds 0, 1, 2, 3, 4, 5 are missing",
        "undecided pair  difference NaN, n = 5: seed 2 is missing",
        "undecided mean  difference NaN: seed 2 is missing",
        "holds     rest  difference -8.147 in [-8.255, -8.003], n = 5",
    ] {
        assert!(said.out.contains(told), "{told} in {}", said.out);
    }
    let read = |file: &str| project.read(&format!("results/parts/{file}"));
    let table = read("tables/told.md");
    assert!(table.contains("missing (1 of 6)") && table.contains("missing (6 of 6)"), "{table}");
    let table = read("tables/rest.md");
    assert!(table.contains("(5 of 6)") && table.contains("missing (6 of 6)"), "{table}");
    assert!(read("tables/rest.csv").contains("m missing"), "{}", read("tables/rest.csv"));
    let figure = read("figures/told.svg");
    assert!(figure.contains("7 of 18 values are missing, and what is made of them"), "{figure}");
    assert!(read("figures/rest.svg").contains("what is shown is made of the rest"));
    let results = read("results.ron");
    // A coordinate that is missing names the node that failed, and the failures say why.
    let at = results.find("\"part=some,seed=2\": \"parts/").expect("the coordinate is named");
    let node = results[at..].split('"').nth(3).expect("there is a node");
    assert!(results.contains(&format!("{node:?}: \"")), "{node}");
    assert!(results.contains("\"all_seeds\"") && results.contains("\"the_rest\""));
    assert!(said.out.contains("missing"), "{}", said.out);

    // What was made of what is there is known, and what failed fails again.
    let again = project.run("exec", "parts.ivx", &[]);
    assert_eq!((again.code, read("results.ron")), (1, results));
    assert!(again.out.contains("0 of "), "{}", again.out);
    // Nothing is begun behind a failure where that is asked for.
    let fast = Project::with(&[("parts.ivx", PARTS_MISSING)]);
    let said = fast.run("exec", "parts.ivx", &["--fail-fast", "--jobs", "1"]);
    assert_eq!(said.code, 1, "{}", said.err);
}

#[test]
fn what_was_once_missing_is_made_anew_when_it_is_there() {
    let project = Project::with(&[("parts.ivx", PARTS_MISSING)]);
    project.run("exec", "parts.ivx", &[]);
    project.write("parts.ivx", &PARTS_MISSING.replace("0.4", "0.5"));
    let said = project.run("exec", "parts.ivx", &[]);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    let sound = Project::with(&[("parts.ivx", &PARTS_MISSING.replace("0.4", "0.5"))]);
    sound.run("exec", "parts.ivx", &[]);
    let results = |project: &Project| project.read("results/parts/results.ron");
    assert_eq!(results(&project), results(&sound));
    assert!(!results(&project).contains("missing: {"), "{}", results(&project));
}
