//! Learners of vectors beside scikit-learn's, and mixtures beside those of `SciPy`'s normal distribution.

use ivx_data::{Dataset, Form};
use ivx_library::learner::{BoostedTrees, Knn, Learner, Logistic, Mixture, RandomForest, Ridge};
use ivx_library::metric::{Accuracy, Nll, Rmse};
use ivx_nn::Model;
use ivx_op::{Array, Ctx, Members, One, Op};
use serde_json::{Value, json};

use crate::harness::{Case, check, number, numbers, rows};

const CTX: Ctx = Ctx::new("train", 0, None);

#[test]
fn golden_baselines() {
    check("baselines", |case, path| {
        let [key] = path else { return None };
        match case.kind.as_str() {
            "ridge" | "logistic" | "knn" | "tree" | "boosted" => learned(case, key),
            "mixture" => mixed(case, key),
            _ => None,
        }
    });
}

fn learned(case: &Case, key: &str) -> Option<Value> {
    let data = data(case, "x", "y");
    let model = learner(case).train(&data, 0, &CTX).expect("it learns");
    let on = || One(self::data(case, "at", "to"));
    let model = || One(model.clone());
    let measured = match key {
        "predicted" => return Some(json!(model().predict(&on().x))),
        "shares" => return Some(json!(model().class_shares(&on().x))),
        "rmse" => Rmse { model: model(), on: on() }.run(&CTX),
        "accuracy" => Accuracy { model: model(), on: on() }.run(&CTX),
        "nll" => Nll { model: model(), on: on() }.run(&CTX),
        _ => return None,
    };
    Some(json!(measured.expect("it is measured").values[0]))
}

fn learner(case: &Case) -> Box<dyn Learner> {
    let of = |name: &str| number(&case.inputs[name]);
    let count = |name: &str| count(&case.inputs[name]);
    match case.kind.as_str() {
        "ridge" => Box::new(Ridge { alpha: of("alpha") }),
        "logistic" => Box::new(Logistic { c: of("c") }),
        "knn" => Box::new(Knn { k: count("k") }),
        "tree" => Box::new(RandomForest {
            trees: 1,
            depth: count("depth"),
            min_leaf: count("min_leaf"),
            inputs: usize::MAX,
            bootstrap: false,
        }),
        _ => Box::new(BoostedTrees {
            stages: count("stages"),
            rate: of("rate"),
            depth: count("depth"),
            min_leaf: count("min_leaf"),
        }),
    }
}

fn count(value: &Value) -> usize {
    usize::try_from(value.as_u64().expect("a count")).expect("it is small")
}

/// Rows of inputs, and rows of targets or a class for each.
fn data(case: &Case, x: &str, y: &str) -> Dataset {
    let (x, y) = (rows(&case.inputs[x]), &case.inputs[y]);
    let classes = case.inputs.get("classes").map(count);
    let (target, y) = match classes {
        Some(_) => (Vec::new(), numbers(y)),
        None => (vec![rows(y)[0].len()], rows(y).concat()),
    };
    let form = Form { input: vec![x[0].len()], target, classes, ..Form::default() };
    Dataset { form, x: x.concat(), y }
}

fn mixed(case: &Case, key: &str) -> Option<Value> {
    let members = rows(&case.inputs["thetas"]).into_iter().map(Model::Polynomial).collect();
    let noise = number(&case.inputs["noise"]);
    let mixture = Mixture { model: Members(members), noise: Some(One(Array::scalar(noise))) }
        .run(&CTX)
        .expect("it mixes");
    let on = Dataset::pairs(numbers(&case.inputs["x"]), numbers(&case.inputs["y"]));
    let measured = match key {
        "mean" => return Some(json!(mixture.predict(&on.x))),
        "std" => return Some(json!(mixture.stds(&on.x))),
        "nll" => Nll { model: One(mixture), on: One(on) }.run(&CTX),
        "rmse" => Rmse { model: One(mixture), on: One(on) }.run(&CTX),
        _ => return None,
    };
    Some(json!(measured.expect("it is measured").values[0]))
}
