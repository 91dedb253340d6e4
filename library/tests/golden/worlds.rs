//! Losses of world models and their gradients, in double precision (torch).

use std::collections::BTreeMap;

use ivx_math::moments::{mean, real, std};
use ivx_math::mpv::across;
use ivx_math::two_hot::{Bins, signed_hyperbolic, signed_parabolic};
use ivx_nn::{
    Body, Curve, Graph, Heads, Latent, Module, ParamId, Params, Paths, Shape, Transitions, Var,
    partial_losses, predicted_values, reconstruction_losses,
};
use serde_json::{Value, json};

use crate::harness::{Case, check_kind, number};
use crate::networks::{Tensor, at, input};
use crate::targets::two_hot_as_rlax;

#[test]
fn golden_losses_of_world_models_agree() {
    check_kind("model_based_losses", "wm_loss", |case, path| at(&reconstruction(case), path));
    check_kind("model_based_losses", "muzero_loss", |case, path| at(&partial(case), path));
    check_kind("model_based_losses", "categorical_value", |case, path| {
        at(&categorical(case), path)
    });
}

#[test]
fn golden_implicit_values_of_a_reward_process_agree() {
    check_kind("model_based_losses", "ive_mrp", |case, path| at(&reward_process(case), path));
}

/// Linear maps without bias, from matrices of shape `[out, in]`, and curves after them.
#[derive(Default)]
struct Maps {
    params: Params<f64>,
    modules: BTreeMap<String, (Module, [ParamId; 2])>,
}

impl Maps {
    fn of(case: &Case, names: &[(&str, Curve)]) -> Self {
        let mut maps = Self::default();
        for (name, curve) in names {
            let weight = input(case, name).transposed();
            let (inputs, outputs) = (weight.shape[0], weight.shape[1]);
            let module = Module::Dense { inputs, outputs, curve: *curve };
            let weight = maps.params.add((*name).into(), weight.shape, weight.values);
            let bias = vec![0.0; outputs];
            let bias = maps.params.add_fixed(format!("{name}.bias"), vec![outputs], bias);
            maps.modules.insert((*name).to_owned(), (module, [weight, bias]));
        }
        maps
    }

    fn body(&self, name: &str) -> Body<'_> {
        let (module, params) = &self.modules[name];
        Body { module, params }
    }

    fn grads(&self, graph: &Graph<f64>) -> serde_json::Map<String, Value> {
        let each = self.modules.iter().map(|(name, (_, [weight, _]))| {
            let params = graph.params();
            let values = params.grad(*weight).expect("all learn").to_vec();
            let grad = Tensor { shape: params.shape(*weight).to_vec(), values };
            (name.clone(), grad.transposed().json())
        });
        each.collect()
    }
}

/// The column `k` of `[n, K]` as `[n, 1]`, or of `[n, K, a]` as `[n, a]`.
fn column(graph: &Graph<f64>, tensor: &Tensor, k: usize) -> Var {
    let (n, steps) = (tensor.shape[0], tensor.shape[1]);
    let width = tensor.values.len() / (n * steps);
    let rows = tensor.values.chunks(width).skip(k).step_by(steps);
    graph.input(Shape::vectors(n, width), &rows.flatten().copied().collect::<Vec<_>>())
}

/// The column `k` of indices `[n, K]`, or of `[n]`, one-hot.
fn one_hot(graph: &Graph<f64>, tensor: &Tensor, k: usize, of: usize) -> Var {
    let (n, steps) = (tensor.shape[0], tensor.shape.get(1).copied().unwrap_or(1));
    let indices = tensor.values.iter().skip(k).step_by(steps).copied();
    let hot = |index: f64| (0..of).map(move |i| f64::from(u8::from(real(i) == index)));
    graph.input(Shape::vectors(n, of), &indices.flat_map(hot).collect::<Vec<_>>())
}

fn total(graph: &Graph<f64>, losses: impl IntoIterator<Item = Var>) -> Var {
    losses.into_iter().reduce(|a, b| graph.add(a, b)).expect("there are losses")
}

fn n_actions(case: &Case) -> usize {
    case.inputs["num_actions"].as_u64().expect("a count").try_into().expect("a small one")
}

fn reconstruction(case: &Case) -> Value {
    let maps = Maps::of(
        case,
        &[
            ("W_h", Curve::Tanh),
            ("W_f", Curve::Identity),
            ("W_p", Curve::Identity),
            ("W_r", Curve::Identity),
        ],
    );
    let graph = Graph::new(maps.params.clone());
    let vectors = |name: &str| {
        let tensor = input(case, name);
        let (n, len) = (tensor.shape[0], tensor.shape.get(1).copied().unwrap_or(1));
        graph.input(Shape::vectors(n, len), &tensor.values)
    };
    let of = Transitions {
        states: vectors("s"),
        actions: one_hot(&graph, &input(case, "a"), 0, n_actions(case)),
        rewards: vectors("r_next"),
        next: vectors("s_next"),
    };
    let nets = Latent {
        representation: maps.body("W_h"),
        dynamics: maps.body("W_p"),
        reward: maps.body("W_r"),
    };
    let log_sigma = input(case, "log_sigma").values;
    let n = graph.shape(of.states).n;
    let log_std = graph.variable(Shape::vectors(n, log_sigma.len()), &log_sigma.repeat(n));
    let losses = reconstruction_losses(&graph, &nets, maps.body("W_f"), &of, (log_std, true));
    let total = total(&graph, losses);
    graph.backward(total);
    let mut grads = maps.grads(&graph);
    let per_item = graph.grad(log_std);
    let summed =
        (0..log_sigma.len()).map(|i| per_item.iter().skip(i).step_by(log_sigma.len()).sum::<f64>());
    grads.insert("log_sigma".into(), summed.collect());
    let [rebuilt, moved, reward] = losses.map(|loss| graph.scalar(loss));
    json!({ "s_rec": rebuilt, "z_dyn": moved, "r_dyn": reward, "total": graph.scalar(total), "grads": grads })
}

fn partial(case: &Case) -> Value {
    let maps = Maps::of(
        case,
        &[
            ("W_h", Curve::Tanh),
            ("W_d", Curve::Tanh),
            ("W_r", Curve::Identity),
            ("W_v", Curve::Identity),
            ("W_pi", Curve::Identity),
        ],
    );
    let graph = Graph::new(maps.params.clone());
    let (states, actions) = (input(case, "obs"), input(case, "actions"));
    let n_steps = actions.shape[1];
    let columns = |name: &str, n: usize| -> Vec<Var> {
        (0..n).map(|k| column(&graph, &input(case, name), k)).collect()
    };
    let paths = Paths {
        states: graph.input(states.batch(), &states.values),
        actions: (0..n_steps).map(|k| one_hot(&graph, &actions, k, n_actions(case))).collect(),
        rewards: columns("r_target", n_steps),
        values: columns("v_target", n_steps + 1),
        policies: columns("pi_target", n_steps + 1),
    };
    let nets = Latent {
        representation: maps.body("W_h"),
        dynamics: maps.body("W_d"),
        reward: maps.body("W_r"),
    };
    let heads = Heads { value: maps.body("W_v"), policy: maps.body("W_pi") };
    let scaled = case.name.contains("scaled");
    let losses = partial_losses(&graph, &nets, &heads, &paths, scaled);
    let all = losses.value.iter().chain(&losses.policy).chain(&losses.reward).copied();
    let total = total(&graph, all);
    graph.backward(total);
    let told = |losses: &[Var]| -> Vec<f64> { losses.iter().map(|l| graph.scalar(*l)).collect() };
    json!({
        "l_v": told(&losses.value),
        "l_pi": told(&losses.policy),
        "l_r": told(&losses.reward),
        "total": graph.scalar(total),
        "grads": maps.grads(&graph),
    })
}

/// Values as distributions over bins of the transformed scale, as `MuZero` learns them.
fn categorical(case: &Case) -> Value {
    let logits = input(case, "logits");
    let n = logits.shape[1];
    let bins = Bins { low: number(&case.inputs["min"]), high: number(&case.inputs["max"]), n };
    let targets = input(case, "target_scalar").values;
    let probs: Vec<f64> =
        targets.iter().flat_map(|x| two_hot_as_rlax(bins, signed_hyperbolic(*x, 1e-3))).collect();
    let graph = Graph::new(Params::default());
    let of = graph.variable(logits.batch(), &logits.values);
    let log_probs = graph.log_softmax(of);
    let agreed = graph.mul(graph.input(logits.batch(), &probs), log_probs);
    let loss = graph.affine(graph.mean(graph.sum_items(agreed)), -1.0, 0.0);
    graph.backward(loss);
    let predicted: Vec<f64> = graph.value(log_probs).iter().map(|x| x.exp()).collect();
    let decoded = predicted.chunks(n).map(|p| signed_parabolic(bins.mean(p), 1e-3));
    let shaped = |values: Vec<f64>| Tensor { shape: logits.shape.clone(), values }.json();
    json!({
        "target_probs": shaped(probs),
        "loss": graph.scalar(loss),
        "decoded": decoded.collect::<Vec<f64>>(),
        "grads": { "logits": shaped(graph.grad(of)) },
    })
}

/// The networks of Example 5.1; the memory has one bias, and its other weights see zeros.
fn reward_process(case: &Case) -> Value {
    let mut params = Params::default();
    let mut ids = BTreeMap::new();
    let mut body = |name: &str, curve: Curve| {
        let mut layers = Vec::new();
        let mut own = Vec::new();
        for (layer, curve) in [("1", Curve::Elu), ("2", curve)] {
            let (weight, bias) = (format!("{name}_w{layer}"), format!("{name}_b{layer}"));
            let matrix = input(case, &weight).transposed();
            let (inputs, outputs) = (matrix.shape[0], matrix.shape[1]);
            layers.push(Module::Dense { inputs, outputs, curve });
            let id = params.add(weight.clone(), matrix.shape, matrix.values);
            own.push(id);
            ids.insert(weight, id);
            let id = params.add(bias.clone(), vec![outputs], input(case, &bias).values);
            own.push(id);
            ids.insert(bias, id);
        }
        (Module::Sequence(layers), own)
    };
    let [representation, value, reward] =
        [("h", Curve::Tanh), ("v", Curve::Identity), ("r", Curve::Identity)]
            .map(|(name, curve)| body(name, curve));
    let matrix = input(case, "lstm_w_ih").transposed();
    let (inputs, units) = (matrix.shape[0], matrix.shape[1] / 4);
    let weight = params.add("lstm_w_ih".into(), matrix.shape, matrix.values);
    let zeros = vec![0.0; units * 4 * units];
    let unseen = params.add_fixed("u".into(), vec![units, 4 * units], zeros);
    let bias = params.add("lstm_b".into(), vec![4 * units], input(case, "lstm_b").values);
    let none = params.add_fixed("c".into(), vec![4 * units], vec![0.0; 4 * units]);
    ids.insert("lstm_w_ih".into(), weight);
    ids.insert("lstm_b".into(), bias);
    let memory = Module::Sequence(vec![Module::Lstm { inputs, units }, Module::Last]);
    // As `Module::arrays` has them.
    let order = [weight, bias, unseen, none];
    let graph = Graph::new(params);
    let nets = Latent {
        representation: Body { module: &representation.0, params: &representation.1 },
        dynamics: Body { module: &memory, params: &order },
        reward: Body { module: &reward.0, params: &reward.1 },
    };
    let states = input(case, "s");
    let states = graph.input(states.batch(), &states.values);
    let targets = input(case, "v_target");
    let targets = graph.input(graph.shape(states), &targets.values);
    let unroll = (input(case, "K").values[0], number(&case.inputs["gamma"]));
    let steps = (0..100).find(|k| real(*k) == unroll.0).expect("few steps");
    let value = Body { module: &value.0, params: &value.1 };
    let members = predicted_values(&graph, &nets, value, states, (steps, unroll.1));
    let apart =
        members.iter().map(|v| graph.sum(graph.square(graph.sub(*v, targets)))).collect::<Vec<_>>();
    let loss = total(&graph, apart);
    graph.backward(loss);
    let told: Vec<Vec<f64>> = members.iter().map(|v| graph.value(*v)).collect();
    let grads = ids.iter().map(|(name, id)| {
        let params = graph.params();
        let shape = params.shape(*id).to_vec();
        let values = params.grad(*id).expect("all learn").to_vec();
        let grad = Tensor { shape, values };
        let grad = if grad.shape.len() == 2 { grad.transposed() } else { grad };
        (name.clone(), grad.json())
    });
    json!({
        "k_mpv": told,
        "mu": across(&told, mean),
        "sigma": across(&told, std),
        "loss_5_11": graph.scalar(loss),
        "grads": grads.collect::<serde_json::Map<_, _>>(),
    })
}
