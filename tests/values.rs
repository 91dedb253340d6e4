//! What specs amount to where labels, records and ensembles meet.

use crate::project::Project;

/// Checks the values of a measure `m`, as results have them, of an experiment with these items.
#[track_caller]
fn check(items: &str, expected: &str) {
    let spec = format!("edition \"2026\"\nexperiment e {{\n{items}\n}}\n");
    let project = Project::with(&[("e.ivx", &spec)]);
    project.executed("e.ivx", &[]);
    let results: String = project.read("results/e/results.ron").split_whitespace().collect();
    let measure = results.split("\"m\":(").nth(1).expect("there is a measure `m`");
    let values = measure.split("values:[").nth(1).and_then(|rest| rest.split(",]").next());
    assert_eq!(values, Some(expected), "{items}");
}

#[test]
fn any_is_a_label_like_any_other() {
    let axis = "axis ke = { \"any\": 1.0, \"x\": 2.0 }\n";
    check(&format!("{axis} measure m = (10.0 * ke)[ke: \"x\"]"), "20.0");
    check(&format!("{axis} measure m = (10.0 * ke)[ke: [\"x\", \"any\"]]"), "20.0,10.0");
}

#[test]
fn numbers_in_records_are_widened() {
    let m = "measure m = rmse(train(linear_map(
        features: polynomial(degree: 1), prior: normal(0.0, r.s)), on: data), on: data) * 0.0 + r.s";
    let data = "let data = sample(sinusoids(), n: 9)\n axis k = [\"a\", \"b\"]\n";
    let arms = "let r = match k { \"a\": (s: 1.5, n: 1), \"b\": (s: 2, n: 3) }\n";
    check(&format!("{data}{arms}{m}"), "1.5,2.0");
    let axis = "let r = (s: 0.5)\n axis l = { \"a\": (s: 1.5), \"b\": (s: 2) }";
    check(&format!("{data}{axis}\n{}", m.replace("r.s", "l.s")), "1.5,2.0");
    check("axis k(s) = { \"x\": (s: 1), \"y\": (s: 0.5) }\n measure m = 2.0 * k.s", "2.0,1.0");
}

#[test]
fn members_in_the_field_of_an_axis_are_members() {
    let items = "let linear = linear_mle(features: polynomial(degree: 1))
        axis way(learner, other) = {
            \"a\": (ensemble(linear, members: 3, prior_network: false), linear),
            \"b\": (ensemble(linear, members: 3, prior_network: false), linear) }
        let data = sample(sinusoids(), n: 9)
        let error = rmse(train(way.learner, on: data), on: data)
        // Each coordinate has three members, and what stands beside has none.
        measure m = sum(error * 0.0 + 1.0, over: member)
            + 10.0 * (rmse(train(way.other, on: data), on: data) * 0.0 + 1.0)";
    check(items, "13.0,13.0");
}

#[test]
fn records_are_coordinates() {
    check(
        "axis u(a, b) = [(b: 2, a: 1), (a: 0.5, b: 3)]\n measure m = u.a + 10.0 * u.b",
        "21.0,30.5",
    );
    check(
        "axis u(a, b) = [(1, \"x\"), (2, \"y\"), (4, \"x\")]
         measure m = sum(1.0 * u.a, over: u, by: u.b)",
        "5.0,2.0",
    );
}
