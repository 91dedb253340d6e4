//! scikit-learn on the same splits, where Python with it is found (`IVX_PYTHON` names it).

use crate::project::Project;

/// Scores of scikit-learn on the splits that ivx made, beside those of ivx.
const SPEC: &str = r#"edition "2026"

experiment beside {
    axis seed = 0..2
    axis fold = 0..3
    axis learner(ours, theirs) = {
        "ridge": (ridge(alpha: 2.0), "linear_model.Ridge(alpha=2.0)"),
        "neighbours": (knn(k: 4), "neighbors.KNeighborsRegressor(4)"),
    }
    let all = shuffled(read_table("diabetes.csv", target: "progression"))
    let parts = folds(all, k: 3, fold: fold)
    let near = standardised(parts.train, by: parts.train)
    let far  = standardised(parts.test, by: parts.train)
    let run = command(
        "PYTHON", args: ["score.py", learner.theirs], files: ["score.py"],
        inputs: [
            as_file(near, "near.npz"), as_file(far, "far.npz"),
            as_file(parts.train, "train.npz"), as_file(parts.test, "test.npz"),
        ],
        stdout: "score.json")
    let ours = rmse(train(learner.ours, on: near), on: far)
    measure apart = abs(ours - read_scalar(run, "score.json", field: "rmse")) / ours
    measure scaled = read_scalar(run, "score.json", field: "scaled")
}

experiment classes {
    axis fold = 0..4
    let all = read_table("wine.csv", target: "cultivar", labels: true)
    let parts = folds(all, k: 4, fold: fold)
    let near = standardised(parts.train, by: parts.train)
    let far  = standardised(parts.test, by: parts.train)
    let run = command(
        "PYTHON", args: ["score.py", "linear_model.LogisticRegression(C=0.5, tol=1e-10, max_iter=10000)"],
        files: ["score.py"],
        inputs: [
            as_file(near, "near.npz"), as_file(far, "far.npz"),
            as_file(parts.train, "train.npz"), as_file(parts.test, "test.npz"),
        ],
        stdout: "score.json")
    let model = train(logistic(c: 0.5), on: near)
    measure apart = abs(nll(model, on: far) - read_scalar(run, "score.json", field: "nll"))
    measure right = abs(accuracy(model, on: far) - read_scalar(run, "score.json", field: "accuracy"))
}
"#;

const SCORE: &str = r#"
import json, sys
import numpy as np
from sklearn import linear_model, metrics, neighbors, preprocessing

near, far = np.load("near.npz"), np.load("far.npz")
train, test = np.load("train.npz"), np.load("test.npz")
scaler = preprocessing.StandardScaler().fit(train["x"])
scaled = max(np.abs(scaler.transform(a["x"]) - b["x"]).max() for a, b in [(train, near), (test, far)])
model = eval(sys.argv[1]).fit(near["x"], near["y"])
y = far["y"]
score = {"scaled": scaled, "rmse": 0.0, "nll": 0.0, "accuracy": 0.0}
if hasattr(model, "predict_proba"):
    score["nll"] = metrics.log_loss(y, model.predict_proba(far["x"]))
    score["accuracy"] = metrics.accuracy_score(y, model.predict(far["x"]))
else:
    score["rmse"] = float(np.sqrt(np.mean((model.predict(far["x"]) - y) ** 2)))
print(json.dumps(score))
"#;

#[test]
fn its_scores_on_the_same_splits_are_ours() {
    let Some(python) = std::env::var("IVX_PYTHON").ok().filter(|python| has_it(python)) else {
        eprintln!("skipped: `IVX_PYTHON` names no Python with scikit-learn");
        return;
    };
    let data = |name| {
        let data = concat!(env!("CARGO_MANIFEST_DIR"), "/../experiments/papers/data");
        let path = std::path::Path::new(data).join(name);
        std::fs::read_to_string(path).expect("the table is there")
    };
    let spec = SPEC.replace("PYTHON", &python);
    let project = Project::with(&[
        ("beside.ivx", &spec),
        ("score.py", SCORE),
        ("diabetes.csv", &data("diabetes.csv")),
        ("wine.csv", &data("wine.csv")),
    ]);
    let said = project.run("exec", "beside.ivx", &[]);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    let results = project.read("results/beside/results.ron");
    let mut n = 0;
    for values in results.split("values: [").skip(1) {
        for value in values.split(']').next().expect("a list ends").split(',') {
            let Ok(value) = value.trim().parse::<f64>() else { continue };
            assert!(value < 1e-6, "{value} in {results}");
            n += 1;
        }
    }
    assert_eq!(n, 2 * 12 + 2 * 4, "{results}");
}

fn has_it(python: &str) -> bool {
    let output = std::process::Command::new(python).args(["-c", "import sklearn"]).output();
    output.is_ok_and(|output| output.status.success())
}
