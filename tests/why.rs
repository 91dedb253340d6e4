//! `ivx why`, as a person and a program see it.

use ivx_cache::Cache;
use ivx_engine::platform;
use serde_json::Value;

use crate::project::Project;

const SMALL: &str = include_str!("specs/small.ivx");

fn small() -> Project {
    let project = Project::with(&[("small.ivx", SMALL)]);
    project.executed("small.ivx", &[]);
    project
}

/// What is said of a node, without what differs from run to run.
#[track_caller]
fn why(project: &Project, node: &str, rest: &[&str]) -> String {
    let said = project.run("why", "small.ivx", &[&[node], rest].concat());
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{}", said.out);
    let lines = said.out.lines().map(|line| line.split(", made in").next().unwrap_or(line));
    lines.filter(|line| !line.contains(" build of the library")).collect::<Vec<_>>().join("\n")
}

#[track_caller]
fn json(project: &Project, node: &str, rest: &[&str]) -> Value {
    let rest = [&[node, "--format", "json"], rest].concat();
    let said = project.run("why", "small.ivx", &rest);
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{}", said.out);
    serde_json::from_str(&said.out).expect("it is JSON")
}

#[test]
fn a_parameter_is_told_with_who_set_it() {
    let project = small();
    let text = SMALL
        .replace("param members", "param n: Int = 8\n    param members")
        .replace("n: 8)", "n: n)")
        .replace("axis seed", "profile quick { n = 10 }\n    axis seed");
    project.write("small.ivx", &text);
    let head = "run      small/data[seed=0]  (sample)\nthe nearest earlier record of this node:\n  small/data[seed=0], sample@2\n";
    let said = |rest: &[&str]| why(&project, "small/data[seed=0]", rest);
    let by = |value, by| format!("{head}- `sample.n` was 8, is {value} (`small.n`, by {by})");
    assert_eq!(said(&[]), by(10, "profile `quick`"));
    assert_eq!(said(&["--set", "small.n=9"]), by(9, "`--set`"));
    project.write("small.ivx", &text.replace("n: Int = 8", "n: Int = 7"));
    let default = format!("{head}- `sample.n` was 8, is 7 (`small.n`, its default)");
    assert_eq!(said(&["--profile", "paper"]), default);
}

#[test]
fn a_parameter_is_found_in_nested_parts_and_other_files() {
    let project = small();
    project.write("lib.ivx", "edition \"2026\"\nparam rate: Float = 0.01\nlet steps = 20\n");
    let spec = SMALL.replace(
        "edition \"2026\"\n",
        "edition \"2026\"\nuse \"lib.ivx\" { rate as speed, steps }\n",
    );
    let spec = spec
        .replace(
            "net: mlp(hidden: [8])",
            "net: mlp(hidden: [width]), optimiser: adamw(lr: linear(speed, 0.0))",
        )
        .replace("steps: 20", "steps: steps")
        .replace("param seeds", "param width: Int = 8\n    param seeds");
    project.write("small.ivx", &spec);
    project.executed("small.ivx", &[]);
    let node = "small/model[seed=1]/member[1]";
    let said = why(&project, node, &["--set", "width=9", "--set", "lib.rate=0.5"]);
    let expected = "\
- `train.learner.learner.net.hidden[0]` was 8, is 9 (`small.width`, by `--set`)
- `train.learner.learner.optimiser.lr.from` was 0.01, is 0.5 (`lib.rate`, by `--set`)";
    assert!(said.ends_with(expected), "{said}");
    project.write("lib.ivx", "edition \"2026\"\nparam rate: Float = 0.01\nlet steps = 21\n");
    let said = why(&project, node, &[]);
    assert!(said.ends_with("- `train.steps` was 20, is 21"), "{said}");
}

#[test]
fn an_input_is_followed_to_the_root_cause() {
    let project = small();
    project.write("small.ivx", &SMALL.replace("n: 8)", "n: 9)"));
    let waiting = "\
unknown  small/gap[seed=0,ke=MA]  (regret)
the nearest earlier record of this node:
  small/gap[seed=0,ke=MA], regret@1
- input `decision` is not known yet because `sample.n` was 8, is 9
    small/decision[seed=0,ke=MA]
    <- small/model[seed=0]/member[0]
    <- small/data[seed=0]";
    assert_eq!(why(&project, "small/gap[seed=0,ke=MA]", &[]), waiting);
    let told = json(&project, "small/gap[seed=0,ke=MA]", &[]);
    let node = &told["nodes"][0];
    assert_eq!((&node["state"], &node["key"]), (&"unknown".into(), &Value::Null));
    let cause = &node["inputs"][0]["causes"][0];
    assert_eq!(cause["difference"]["path"], "sample.n");
    assert_eq!(
        (&cause["difference"]["before"], &cause["difference"]["after"]),
        (&"8".into(), &"9".into())
    );
    assert_eq!(cause["path"].as_array().map(Vec::len), Some(3));
}

#[test]
fn what_is_known_is_told_with_its_record() {
    let project = small();
    let data = "small/data[seed=1]";
    let said = project.run("why", "small.ivx", &[data]);
    let known =
        format!("hit      {data}  (sample)\nits result is known:\n  {data}, sample@2, made in ");
    assert!(said.out.starts_with(&known), "{}", said.out);
    assert!(said.out.contains("  by this build of the library, on "), "{}", said.out);
    let told = json(&project, data, &[]);
    let (node, run) = (&told["nodes"][0], project.read("results/small/run.ron"));
    for digest in [&node["key"], &node["record"]["output"]] {
        assert!(run.contains(digest.as_str().expect("it is known")), "{digest} in {run}");
    }
    assert_eq!(node["record"]["this_library"], true);
    // The same under another name.
    project.write("small.ivx", &SMALL.replace("data", "seen"));
    let said = why(&project, "small/seen[seed=1]", &[]);
    assert!(said.contains("  as small/data[seed=1], which computes the same"), "{said}");
}

#[test]
fn records_of_another_build_and_platform_are_told_as_such() {
    let (made, project) = (small(), Project::with(&[("small.ivx", SMALL)]));
    let open = |project: &Project| {
        Cache::open(&project.path(".ivx/cache"), &platform()).expect("the cache opens")
    };
    let mut cache = open(&project);
    for record in open(&made).records() {
        let mut record = record.clone();
        record.provenance.library = "0123456789abcdef".to_owned();
        record.platform = "elsewhere".to_owned();
        cache.commit(record).expect("the disk works");
    }
    cache.close().expect("the disk works");
    let data = "small/data[seed=1]";
    let said = project.run("why", "small.ivx", &[data]).out;
    assert!(
        said.contains("\n  by another build of the library (01234567), on elsewhere\n"),
        "{said}"
    );
    assert_eq!(json(&project, data, &[])["nodes"][0]["record"]["this_library"], false);
    project.write("small.ivx", &SMALL.replace("n: 8)", "n: 9)"));
    let said = project.run("why", "small.ivx", &[data]).out;
    let last = "\n  by another build of the library (01234567)\n  on elsewhere\n- `sample.n` was 8, is 9\n";
    assert!(said.ends_with(last), "{said}");
}

#[test]
fn several_nodes_get_a_summary_by_cause() {
    let project = small();
    project.write("small.ivx", &SMALL.replace("steps: 20", "steps: 21"));
    let said = why(&project, "small/model", &["--set", "members=3"]);
    let expected = "\
6 nodes begin with small/model: 0 hit, 6 run, 0 unknown
all that are no hits:
- `train.steps` was 20, is 21
run      small/model[seed=0]/member[0] and 3 more
run      small/model[seed=0]/member[2] and 1 more
- the member was 1, is 2";
    assert_eq!(said, expected);
    let said = why(&project, "small/data", &[]);
    assert_eq!(said, "2 nodes begin with small/data: 2 hit, 0 run, 0 unknown");
    let told = json(&project, "small/model", &[]);
    assert_eq!(told["nodes"].as_array().map(Vec::len), Some(4));
}

#[test]
fn names_are_completed_where_one_node_is_meant_and_suggested_otherwise() {
    let project = small();
    let said = why(&project, "small/dat", &["--set", "seeds=1"]);
    assert!(said.starts_with("hit      small/data[seed=0]  (sample)"), "{said}");
    let said = project.run("why", "small.ivx", &["small/modle"]);
    assert_eq!(said.code, 2);
    assert_eq!(said.err, "error: no node is called `small/modle`: did you mean `small/model`?\n");
}

#[test]
fn without_a_cache_nothing_is_known_and_none_is_made() {
    let project = Project::with(&[("small.ivx", SMALL)]);
    let said = why(&project, "small/gap[seed=0,ke=MA]", &[]);
    let expected = "\
unknown  small/gap[seed=0,ke=MA]  (regret)
the cache has no record of `regret`
- input `decision` is not known yet because the cache has no record of `sample`
    small/decision[seed=0,ke=MA]
    <- small/model[seed=0]/member[0]
    <- small/data[seed=0]";
    assert_eq!(said, expected);
    assert!(!project.path(".ivx/cache").exists());
}

#[test]
fn a_node_goes_by_all_names_of_its_equals() {
    let twin =
        SMALL.replace("edition \"2026\"\n", "").replace("experiment small", "experiment twin");
    let twin = twin.replace("figure \"", "figure \"twin ").replace("table \"", "table \"twin ");
    let twin = twin.replace("sample(reward, n: 8)", "sample(reward, n: seeds + 6)");
    let project = Project::with(&[("small.ivx", &(SMALL.to_owned() + &twin))]);
    project.executed("small.ivx", &[]);
    let said = why(&project, "twin/data[seed=0]", &[]);
    let expected = "\
twin/data[seed=0] has nodes that equal others, which they are told as:
hit      small/data[seed=0]  (sample)
";
    assert!(said.starts_with(expected), "{said}");
    let said = why(&project, "twin/model", &["--set", "twin.seeds=3"]);
    assert!(said.contains("nodes begin with twin/model: 0 hit, 0 run, "), "{said}");
    let said = project.run("why", "small.ivx", &["twin/modle"]).err;
    assert!(said.contains("did you mean `twin/model`?"), "{said}");
}
