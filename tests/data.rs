//! Files of one's own as data, seen from the command.

use crate::project::Project;

const LINE: &str = "linear_mle(features: polynomial(degree: 1))";

fn error_of(data: &str) -> String {
    format!("rmse(train({LINE}, on: {data}), on: {data})")
}

#[test]
fn names_in_the_coordinates_of_an_axis_are_files_beside_the_spec_that_has_them() {
    let spec = format!(
        "edition \"2026\"\nuse \"lib/places.ivx\" {{ place as where }}\n\
         experiment e {{\n    axis file = [\"x.csv\", \"y.csv\"]\n\
         let one = read_table(where.file, target: where.target)\n\
         let two = read_table(file, target: \"y\")\n\
         measure far = {}\n    measure near = {}\n    measure picked = near[file: \"y.csv\"]\n}}\n",
        error_of("one"),
        error_of("two"),
    );
    let places = "edition \"2026\"\naxis place(file, target) = {\n\
         \"hill\": (\"hill.csv\", \"litres\"), \"x\": (target: \"y\", file: \"../x.csv\") }\n";
    let project = Project::with(&[
        ("spec.ivx", &spec),
        ("lib/places.ivx", places),
        ("lib/hill.csv", "depth,litres\n1,2\n2,4\n3,7\n"),
        ("x.csv", "x,y\n1,2\n2,4\n3,6\n"),
        ("y.csv", "x,y\n1,2\n2,7\n3,5\n"),
    ]);
    // `x.csv` is named from both files, and is one node: three files are read, learnt from and measured.
    assert_eq!(project.executed("spec.ivx", &[]), 9);
    project.write("lib/hill.csv", "depth,litres\n1,2\n2,4\n3,8\n");
    assert_eq!(project.executed("spec.ivx", &[]), 3);
    project.write("lib/places.ivx", &places.replace("hill.csv", "hull.csv"));
    let said = project.run("check", "spec.ivx", &[]);
    assert!(said.err.contains("`hull.csv` cannot be read"), "{}", said.err);
    assert!(said.err.contains("lib/places.ivx:3"), "{}", said.err);
}

#[test]
fn what_is_wrong_with_tracks_is_told_before_anything_runs() {
    let check = |text: &str, call: &str, expected: &str| {
        let spec = format!(
            "edition \"2026\"\nexperiment e {{\n    let data = {call}\n    measure m = mean(inputs(data, column: 0), over: row)\n}}\n"
        );
        let project = Project::with(&[("spec.ivx", &spec), ("a.txt", text), ("b.json", "")]);
        let said = project.run("check", "spec.ivx", &[]);
        let words: Vec<&str> = said.err.split_whitespace().collect();
        let told = words.join(" ").replace(" │ ", " ");
        assert!(said.code != 0 && told.contains(expected), "{expected}: {}", said.err);
    };
    let walk = "0 1 2 3\n10 1 3 3\n";
    check(walk, "read_tracks([\"a.txt\"])", "`a.txt`: none of 1 tracks has 20 points");
    check(
        "0 1 2\n",
        "read_tracks([\"a.txt\"])",
        "`a.txt`, line 1: 3 numbers in the place of frame",
    );
    check("", "read_tracks([\"a.txt\"])", "`a.txt` has no rows");
    check(walk, "read_tracks([])", "name one");
    check(walk, "read_tracks([\"a.txt\", \"a.txt\"])", "`a.txt` is named twice in `files`");
    check(walk, "read_tracks([\"b.json\"])", "`b.json` does not say how it is written");
    check(walk, "read_tracks([\"a.txt\"], kinds: [\"BUS\"])", "leave `kinds` out");
    // The form is known before anything runs.
    check(
        walk,
        "one_hot(read_tracks([\"a.txt\"], past: 1, future: 1))",
        "whose targets are no classes",
    );
}

#[test]
fn what_is_wrong_with_a_table_is_told_before_anything_runs() {
    let check = |file: &str, call: &str, expected: &str| {
        let spec = format!(
            "edition \"2026\"\nexperiment e {{\n    let data = {call}\n    measure m = {}\n}}\n",
            error_of("data")
        );
        let project = Project::with(&[("spec.ivx", &spec), ("d.csv", file)]);
        let said = project.run("check", "spec.ivx", &[]);
        let words: Vec<&str> = said.err.split_whitespace().collect();
        let told = words.join(" ").replace(" │ ", " ");
        assert!(said.code != 0 && told.contains(expected), "{}", said.err);
    };
    let read = "read_table(\"d.csv\", target: \"y\")";
    check("x,y\n1,2\n2,NA\n", read, "line 3, column `y`: `NA` is no number");
    check("x;y\n1;2\n", read, "its columns are separated by `;`");
    check("x,y\n", read, "it has no rows");
    check("", read, "no names of columns");
    check("x,y\n1,2\n", "read_table(\"d.csv\")", "what of `d.csv` is a target is not said");
    check("x,y\n1,2\n", "read_table(\"d.csv\", target: \"z\")", "it has no column `z`");
    let except = |names: &str| format!("read_table(\"d.csv\", target: \"y\", except: {names})");
    check("x,y\n1,2\n", &except("[\"id\"]"), "it has no column `id`");
    check("x,y\n1,2\n", &except("[\"x\"]"), "`except` leaves no input");
    check("x,y\n1,2\n", &except("[\"x\", \"x\"]"), "`x` is named twice in `except`");
    let both = except("[\"x\"], inputs: [\"z\"]");
    check("x,z,y\n1,2,3\n", &both, "`inputs` are columns, and `except` all others");
    // Two inputs are a vector, which a line does not take.
    check("x,z,y\n1,2,3\n", read, "pairs of numbers");
    let missing = "read_table(\"e.csv\", target: \"y\")";
    check("x,y\n1,2\n", missing, "`e.csv` cannot be read");
}

#[cfg(unix)]
#[test]
fn a_file_that_cannot_be_read_is_not_advice_for_itself() {
    let spec =
        "edition \"2026\"\nexperiment e {\n    measure m = load_array(\"l.csv\", dims: [i])\n}\n";
    let project = Project::with(&[("spec.ivx", spec)]);
    std::os::unix::fs::symlink("l.csv", project.path("l.csv")).expect("links can be made");
    let said = project.run("check", "spec.ivx", &[]);
    assert!(said.err.contains("`l.csv` cannot be read"), "{}", said.err);
    assert!(!said.err.contains("did you mean") && !said.err.contains("known here"), "{}", said.err);
}

#[test]
fn dimensions_get_new_names() {
    let check = |dims: &str, expected: &[&str]| {
        let spec = format!(
            "edition \"2026\"\nexperiment e {{\n    axis n = [1]\n    measure m = n * load_array(\"a.json\", dims: {dims})\n}}\n"
        );
        let project = Project::with(&[("spec.ivx", &spec), ("a.json", "[[1, NaN], [3, 4]]")]);
        let said = project.run("exec", "spec.ivx", &[]);
        let all = said.out + &said.err;
        assert!(expected.iter().all(|expected| all.contains(expected)), "{all}");
    };
    check("[i, j]", &["nodes executed"]);
    check("[i, n]", &["IVX0309", "`n` is declared"]);
    check("[i, i]", &["`load_array.dims` has `i` twice"]);
    check("[\"i\", j]", &["write it without quotes: `i`"]);
    check("[i]", &["`0` is a list of 2 and no number"]);
    check("i", &["`0` is a list of 2 and no number"]);
    check("1", &["write `dims: [row, column]`"]);
}

/// What a model learnt from goes with it: columns in another order and classes of other labels are told, with the cache
/// between.
#[test]
fn a_model_is_not_measured_on_other_columns_or_classes() {
    let spec = |labels: &str| {
        let read = |file: &str| {
            format!("standardised(read_table(\"{file}\", target: \"y\"{labels}), by: one)")
        };
        format!(
            "edition \"2026\"\nexperiment e {{\n    let one = read_table(\"a.csv\", target: \"y\"{labels})\n    \
             measure m = rmse(train(knn(k: 1), on: split({}, test: 0.5).train), on: {})\n}}\n",
            read("a.csv"),
            read("b.csv")
        )
    };
    let columns = Project::with(&[
        ("e.ivx", &spec("")),
        ("a.csv", "p,q,y\n1,2,3\n4,5,9\n"),
        ("b.csv", "q,p,y\n2,1,3\n5,4,9\n"),
    ]);
    let said = columns.run("exec", "e.ivx", &[]);
    let why = "number 1 of the inputs is `p` to the model and `q` in the data";
    assert!(said.code != 0 && said.err.contains(why), "{}{}", said.out, said.err);

    let labelled = spec(", labels: true").replace("rmse(", "accuracy(");
    let classes = Project::with(&[
        ("e.ivx", &labelled),
        ("a.csv", "x,y\n1,cat\n2,cat\n11,dog\n12,dog\n"),
        ("b.csv", "x,y\n10,dog\n11,dog\n13,fox\n"),
    ]);
    let said = classes.run("exec", "e.ivx", &[]);
    let why = "number 1 of the classes is `cat` to the model and `dog` in the data";
    assert!(said.code != 0 && said.err.contains(why), "{}{}", said.out, said.err);
    let listed = ", classes: [\"cat\", \"dog\", \"fox\"]";
    classes.write("e.ivx", &labelled.replace(", labels: true", listed));
    assert_eq!(classes.run("exec", "e.ivx", &[]).code, 0);
}
