//! Losses of agents (torch).

use ivx_library::agent::{q_loss, q_target};
use ivx_math::moments::real;
use ivx_math::policy::boltzmann;
use ivx_nn::{Curve, Graph, Layer, ParamId, Params, Payment, Shape, SoftSteps, Var};
use serde_json::{Value, json};

use crate::harness::{Case, check_kind, check_wrong, number, numbers, rows};
use crate::networks::{Tensor, at, input};

#[test]
fn golden_losses_of_q_learning_agree() {
    check_kind("agents_baselines", "dqn", |case, path| dqn(case, path, 1));
    // A discount of two steps.
    check_wrong("agents_baselines", "dqn", |case, path| dqn(case, path, 2));
}

type Computed = fn(&Case, bool) -> Value;

/// To the tolerance of the file (1e-9), and each with a formula that is nearly right: demonstrations and steps of the
/// agent exchanged, and half of a loss.
#[test]
fn golden_losses_of_imitation_agree_and_tell_wrong_ones() {
    let kinds: [(&str, Computed); 4] =
        [("sqil", sqil), ("gail", gail), ("gail_gp", gail_gp), ("bc_aux", bc_aux)];
    for (kind, computed) in kinds {
        check_kind("agents_baselines", kind, |case, path| at(&computed(case, false), path));
        check_wrong("agents_baselines", kind, |case, path| at(&computed(case, true), path));
    }
}

fn dqn(case: &Case, path: &[&str], steps: i32) -> Option<Value> {
    let graph = Graph::<f64>::new(Params::default());
    let of = |name: &str| {
        let tensor = input(case, name);
        graph.variable(tensor.batch(), &tensor.values)
    };
    let column = |values: &[f64]| graph.input(Shape::vectors(values.len(), 1), values);
    let discount = number(&case.inputs["gamma"]).powi(steps);
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

fn column(graph: &Graph<f64>, values: &[f64]) -> Var {
    graph.input(Shape::vectors(values.len(), 1), values)
}

fn batch(graph: &Graph<f64>, case: &Case, name: &str) -> Var {
    let tensor = input(case, name);
    graph.variable(tensor.batch(), &tensor.values)
}

/// A gradient in the shape of an input.
fn like(case: &Case, name: &str, values: Vec<f64>) -> Value {
    Tensor { shape: input(case, name).shape, values }.json()
}

fn sqil(case: &Case, wrong: bool) -> Value {
    let graph = Graph::<f64>::new(Params::default());
    let (alpha, discount) = (number(&case.inputs["alpha"]), number(&case.inputs["gamma"]));
    let weighs = numbers(&case.inputs["done"]).into_iter().map(|done| discount * (1.0 - done));
    let is_demo = numbers(&case.inputs["is_demo"]);
    let pays = is_demo.iter().map(|demo| if wrong { 1.0 - demo } else { *demo });
    let all = SoftSteps {
        values: batch(&graph, case, "q"),
        acts: column(&graph, &numbers(&case.inputs["a"])),
        rewards: column(&graph, &pays.collect::<Vec<_>>()),
        next: batch(&graph, case, "q_next_target"),
        discounts: column(&graph, &weighs.collect::<Vec<_>>()),
    };
    let side = |demo: f64| {
        let places: Vec<usize> = (0..is_demo.len()).filter(|i| is_demo[*i] == demo).collect();
        let of = |var: Var| graph.items(var, &places);
        SoftSteps {
            values: of(all.values),
            acts: of(all.acts),
            rewards: of(all.rewards),
            next: of(all.next),
            discounts: of(all.discounts),
        }
    };
    let targets = graph.value(graph.soft_targets(&all, alpha));
    let soft = graph.value(graph.still(|| graph.soft_values(all.next, alpha)));
    let policy = rows(&case.inputs["q"]).into_iter().map(|row| boltzmann(&row, alpha));
    let [loss, ..] = graph.soft_imitation_loss(&side(1.0), &side(0.0), alpha, 1.0);
    graph.backward(loss);
    json!({
        "soft_value_next": soft,
        "target": targets,
        "loss": graph.scalar(loss),
        "grad": like(case, "q", graph.grad(all.values)),
        "policy": policy.collect::<Vec<_>>(),
    })
}

fn gail(case: &Case, wrong: bool) -> Value {
    let graph = Graph::<f64>::new(Params::default());
    let [shown, own] = ["logits_expert", "logits_agent"].map(|name| batch(&graph, case, name));
    let sides = if wrong { (own, shown) } else { (shown, own) };
    let loss = graph.discriminator_loss(sides.0, sides.1);
    graph.backward(loss);
    let (shown_logits, own_logits) = (graph.value(shown), graph.value(own));
    let paid = |payment: Payment| -> Vec<f64> {
        own_logits.iter().map(|logit| payment.of(*logit)).collect()
    };
    let share = |logits: &[f64], right: fn(f64) -> bool| {
        real(logits.iter().filter(|x| right(**x)).count()) / real(logits.len())
    };
    json!({
        "loss": graph.scalar(loss),
        "grads": { "logits_expert": graph.grad(shown), "logits_agent": graph.grad(own) },
        "reward_neg_log_1mD": paid(Payment::Positive),
        "reward_log_D": paid(Payment::Negative),
        "reward_airl": paid(Payment::Logit),
        "acc_expert": share(&shown_logits, |x| x > 0.0),
        "acc_agent": share(&own_logits, |x| x < 0.0),
    })
}

/// A parameter, in the layout of the file or transposed.
fn parameter(params: &mut Params<f64>, name: &str, tensor: Tensor) -> ParamId {
    params.add(name.to_owned(), tensor.shape, tensor.values)
}

fn gail_gp(case: &Case, wrong: bool) -> Value {
    let mut params = Params::<f64>::default();
    let layers = [("W1", Curve::Tanh), ("W2", Curve::Identity)].map(|(name, curve)| {
        let weight = input(case, name).transposed();
        let n = weight.shape[1];
        let weight = parameter(&mut params, name, weight);
        let bias = params.add_fixed(format!("{name}.bias"), vec![n], vec![0.0; n]);
        Layer { weight, bias, curve }
    });
    let graph = Graph::new(params);
    let [shown, own] = ["x_expert", "x_agent"].map(|name| batch(&graph, case, name));
    let (x, y) = if wrong { (own, shown) } else { (shown, own) };
    let between = graph.between(x, y, batch(&graph, case, "mix"));
    let (_, slopes) = graph.input_gradient(&layers, between);
    let slopes = like(case, "x_expert", graph.value(slopes));
    let penalty = graph.gradient_penalty(&layers, between);
    graph.backward(penalty);
    let grad = |i: usize, name: &str| {
        let shape = input(case, name).transposed().shape;
        let values = graph.params().grad(layers[i].weight).expect("it learns").to_vec();
        Tensor { shape, values }.transposed().json()
    };
    json!({
        "input_grad": slopes,
        "penalty": graph.scalar(penalty),
        "grads": { "W1": grad(0, "W1"), "W2": grad(1, "W2") },
    })
}

fn bc_aux(case: &Case, wrong: bool) -> Value {
    let mut params = Params::<f64>::default();
    let names = ["W_torso", "W_q", "W_pi"];
    let ids = names.map(|name| parameter(&mut params, name, input(case, name)));
    let graph = Graph::new(params);
    let torso = |name: &str| {
        let h = graph.linear_back(batch(&graph, case, name), ids[0]);
        graph.curve(h, Curve::Relu)
    };
    let acts = |name: &str| column(&graph, &numbers(&case.inputs[name]));
    let q = graph.linear_back(torso("s"), ids[1]);
    let q_loss = graph.mean(graph.squared(graph.pick(q, acts("a")), acts("y")));
    let logits = graph.linear_back(torso("s_demo"), ids[2]);
    let cloned = (logits, acts("a_demo"));
    let [total, cloning] = graph.with_cloning(q_loss, cloned, if wrong { 0.5 } else { 1.0 });
    graph.backward(total);
    let grads = names.iter().zip(ids).map(|(name, id)| {
        let grad = graph.params().grad(id).expect("it learns").to_vec();
        ((*name).to_owned(), like(case, name, grad))
    });
    json!({
        "q_loss": graph.scalar(q_loss),
        "bc_loss": graph.scalar(cloning),
        "total": graph.scalar(total),
        "grads": Value::Object(grads.collect()),
    })
}
