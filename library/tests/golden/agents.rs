//! Losses of agents (torch).

use ivx_library::agent::{q_loss, q_target};
use ivx_nn::{Graph, Params, Shape};
use serde_json::{Value, json};

use crate::harness::{Case, check_kind, number, numbers};
use crate::networks::{Tensor, input};

#[test]
fn golden_losses_of_q_learning_agree() {
    check_kind("agents_baselines", "dqn", dqn);
}

fn dqn(case: &Case, path: &[&str]) -> Option<Value> {
    let graph = Graph::<f64>::new(Params::default());
    let of = |name: &str| {
        let tensor = input(case, name);
        graph.variable(tensor.batch(), &tensor.values)
    };
    let column = |values: &[f64]| graph.input(Shape::vectors(values.len(), 1), values);
    let discount = number(&case.inputs["gamma"]);
    let weighs = numbers(&case.inputs["done"]).into_iter().map(|done| discount * (1.0 - done));
    let (rewards, weighs) = (numbers(&case.inputs["r"]), weighs.collect::<Vec<_>>());
    let own = case.name.starts_with("double").then(|| of("q_next_online"));
    let next = (of("q_next_target"), own);
    let target = graph.still(|| q_target(&graph, next, column(&rewards), column(&weighs)));
    let (q, acts) = (of("q"), column(&numbers(&case.inputs["a"])));
    // Beyond any error Huber's loss is half the square.
    let far = 1e6;
    let loss = match path.last()?.rsplit('_').next()? {
        "huber" => q_loss(&graph, q, acts, target, 1.0),
        "mse" => graph.affine(q_loss(&graph, q, acts, target, far), 2.0, 0.0),
        "target" => return Some(json!(graph.value(target))),
        _ => return None,
    };
    if path.last()?.starts_with("grad") {
        graph.backward(loss);
        return Some(Tensor { shape: input(case, "q").shape, values: graph.grad(q) }.json());
    }
    Some(json!(graph.scalar(loss)))
}
