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

#[test]
fn mathematics_is_the_same_of_what_is_known_and_what_is_computed() {
    // Not known before anything runs, and 0.
    let zero = "let data = sample(sinusoids(), n: 3)
        let zero = 0.0 * rmse(train(linear_mle(features: polynomial(degree: 0)), on: data), on: data)
        axis k = [-1.5, 2.0]";
    let of = [
        "abs(X)",
        "ceil(X)",
        "floor(X)",
        "round(X)",
        "sign(X)",
        "exp(X)",
        "log(X * X)",
        "sqrt(X * X)",
        "sin(X)",
        "cos(X)",
        "tanh(X)",
        "pow(X, 3)",
        "max(X, 0.5)",
        "min(X, 0.5)",
        "clip(X, -1, 1)",
        "where(X > 0.5, X, -X)",
    ];
    let sum = |x: &str| of.map(|one| format!("1.0 * {}", one.replace('X', x))).join(" + ");
    let (known, computed) = (sum("k"), sum("(k + zero)"));
    check(&format!("{zero}\n measure m = where({known} == {computed}, 1.0, 0.0)"), "1.0,1.0");
}

#[test]
fn lists_are_reckoned_with_item_by_item() {
    check("axis k = pow(2.0, [0, 1, 3])\n measure m = 1.0 * k", "1.0,2.0,8.0");
    check("axis k = 10 * [1, 2] + [0, 5]\n measure m = 1.0 * k", "10.0,25.0");
    check("measure m = where([1, 2] == [1.0, 2.0], 1.0, 0.0)", "1.0");
    check("axis k = -[1, 2]\n measure m = 1.0 * k", "-1.0,-2.0");
    check(
        "axis s = [1, 2]\n axis k = -pow(2.0, [1, -1])\n measure m = s * k",
        "-2.0,-4.0,-0.5,-1.0",
    );
    check(
        "axis k = [\"a\", \"b\"]\n let n = where(k == \"a\", 1, 2)\n measure m = 1.0 * n",
        "1.0,2.0",
    );
    check("measure m = floor(2.0 * pi) + floor(10.0 * exp(1))", "33.0");
}

#[test]
fn the_name_of_a_dimension_is_its_own_number() {
    let curve = "let peak(a: Float) = -abs(a - 0.5)
        let curve = reward_at(reward(peak), at: grid(-1.0, 1.0, points: 5))";
    check(&format!("{curve}\n measure m = argmax(curve, over: x, of: x)"), "0.5");
    check(&format!("{curve}\n measure m = argmax(curve, over: x)"), "0.5");
    check(&format!("{curve}\n measure m = lowest(curve, n: 2, over: x, of: x)"), "-1.0,-0.5");
    // What is declared is meant.
    check(
        &format!(
            "{curve}\n let x = 7.0 * curve[x: 1.0]\n measure m = argmax(curve, over: x, of: x)"
        ),
        "-3.5",
    );
}

#[test]
fn a_function_is_passed_on_with_what_it_mentions() {
    let at = "at: grid(0.0, 1.0, points: 2)";
    let line = "let line(a: Float, slope: Float = 10.0) = slope * a + shift";
    check(
        &format!("axis shift = [1, 2]\n {line}\n measure m = reward_at(reward(line), {at})"),
        "1.0,11.0,2.0,12.0",
    );
    let kinked = "let half(a: Float) = a / 2\n let kinked(b: Scalar) = where(b >= 1.0, half(b), 0)";
    check(&format!("{kinked}\n measure m = reward_at(reward(kinked), {at})"), "0.0,0.5");
    let decade = "let decade(x: Float) = pow(10.0, x)";
    check(
        &format!(
            "{decade}\n measure m = reward_at(reward(decade), at: mapped(grid(0.0, 1.0, points: 2), by: decade))"
        ),
        "10.0,10000000000.0",
    );
}
