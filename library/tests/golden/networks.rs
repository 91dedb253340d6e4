//! Layers and their gradients, in double precision (torch).

use std::collections::BTreeMap;

use ivx_nn::{BatchNorm, Cell, Curve, Graph, ParamId, Params, Shape, Var, Window};
use serde_json::{Value, json};

use crate::harness::{Case, check, number};

#[test]
fn golden_convolutions_agree() {
    check("nn_conv", |case, path| at(&images(case), path));
}

#[test]
fn golden_recurrent_networks_and_perceptrons_agree() {
    check("nn_recurrent_mlp", |case, path| at(&vectors(case), path));
}

pub(crate) fn at(ours: &Value, path: &[&str]) -> Option<Value> {
    path.iter().try_fold(ours, |value, key| value.get(key)).cloned()
}

/// Nested lists of numbers: their shape, and the numbers one after another.
#[derive(Clone)]
pub(crate) struct Tensor {
    pub(crate) shape: Vec<usize>,
    pub(crate) values: Vec<f64>,
}

impl Tensor {
    pub(crate) fn of(value: &Value) -> Self {
        let Some(items) = value.as_array() else {
            return Self { shape: vec![], values: vec![number(value)] };
        };
        let items: Vec<Self> = items.iter().map(Self::of).collect();
        let inner = items.first().map(|item| item.shape.clone()).unwrap_or_default();
        Self {
            shape: [vec![items.len()], inner].concat(),
            values: items.into_iter().flat_map(|item| item.values).collect(),
        }
    }

    /// Rows and columns exchanged.
    pub(crate) fn transposed(&self) -> Self {
        let (rows, cols) = (self.shape[0], self.shape[1]);
        let values = (0..rows * cols).map(|i| self.values[i % rows * cols + i / rows]).collect();
        Self { shape: vec![cols, rows], values }
    }

    pub(crate) fn json(&self) -> Value {
        let Some((n, inner)) = self.shape.split_first() else { return json!(self.values[0]) };
        let width = self.values.len() / n;
        let items = self.values.chunks_exact(width);
        items.map(|values| Self { shape: inner.to_vec(), values: values.to_vec() }.json()).collect()
    }

    pub(crate) fn batch(&self) -> Shape {
        let mut item = [1; 3];
        item[..self.shape.len() - 1].copy_from_slice(&self.shape[1..]);
        Shape { n: self.shape[0], item }
    }
}

pub(crate) fn input(case: &Case, name: &str) -> Tensor {
    Tensor::of(&case.inputs[name])
}

fn count(case: &Case, name: &str) -> usize {
    let n = case.inputs[name].as_u64().unwrap_or_else(|| panic!("{}: needs `{name}`", case.name));
    usize::try_from(n).expect("counts are small")
}

/// Parameters by name, some of them transposed: torch keeps `[out, in]`, we `[in, out]`.
#[derive(Default)]
struct Named {
    params: Params<f64>,
    ids: BTreeMap<String, (ParamId, Tensor, bool)>,
}

impl Named {
    fn add(&mut self, name: &str, tensor: Tensor) -> ParamId {
        self.insert(name, tensor, false)
    }

    fn add_transposed(&mut self, name: &str, tensor: &Tensor) -> ParamId {
        self.insert(name, tensor.transposed(), true)
    }

    fn insert(&mut self, name: &str, tensor: Tensor, transposed: bool) -> ParamId {
        let id = self.params.add(name.into(), tensor.shape.clone(), tensor.values.clone());
        self.ids.insert(name.into(), (id, tensor, transposed));
        id
    }
}

/// The gradients of everything when the gradient of `y` is `cotangent`.
fn pull(graph: &Graph<f64>, y: Var, cotangent: &[f64]) -> f64 {
    let weights = graph.input(graph.shape(y), cotangent);
    let loss = graph.sum(graph.mul(y, weights));
    graph.backward(loss);
    graph.scalar(loss)
}

fn shaped(graph: &Graph<f64>, var: Var, shape: &[usize]) -> Value {
    Tensor { shape: shape.to_vec(), values: graph.value(var) }.json()
}

fn grads(
    graph: &Graph<f64>,
    ids: &BTreeMap<String, (ParamId, Tensor, bool)>,
    of: &[(&str, Var, &[usize])],
) -> Value {
    let mut grads = serde_json::Map::new();
    for (name, (id, tensor, transposed)) in ids {
        let params = graph.params();
        let Some(grad) = params.grad(*id) else { continue };
        let grad = Tensor { shape: tensor.shape.clone(), values: grad.to_vec() };
        let grad = if *transposed { grad.transposed() } else { grad };
        grads.insert(name.clone(), grad.json());
    }
    for (name, var, shape) in of {
        let grad = Tensor { shape: shape.to_vec(), values: graph.grad(*var) };
        grads.insert((*name).to_owned(), grad.json());
    }
    Value::Object(grads)
}

fn images(case: &Case) -> Value {
    let x = input(case, "x");
    let mut named = Named::default();
    let window =
        |kernel| Window { kernel, stride: count(case, "stride"), padding: count(case, "padding") };
    match case.kind.as_str() {
        "conv2d" | "conv_transpose2d" => {
            let w = input(case, "w");
            let window = window(w.shape[2]);
            let (weight, bias) = (named.add("w", w), named.add("b", input(case, "b")));
            let graph = Graph::new(named.params);
            let of = graph.variable(x.batch(), &x.values);
            let y = if case.kind == "conv2d" {
                graph.conv2d(
                    of,
                    weight,
                    Some(bias),
                    (window, count(case, "groups")),
                    Curve::Identity,
                )
            } else {
                graph.conv_transpose2d(of, weight, bias, window)
            };
            backward(case, &graph, &named.ids, (of, &x), y)
        }
        "max_pool" => {
            let graph = Graph::new(named.params);
            let of = graph.variable(x.batch(), &x.values);
            let y = graph.max_pool(of, window(count(case, "k")));
            backward(case, &graph, &named.ids, (of, &x), y)
        }
        "avg_pool" => {
            let graph = Graph::new(named.params);
            let y = graph.global_mean_pool(graph.input(x.batch(), &x.values));
            json!({ "y": shaped(&graph, y, &[x.shape[0], x.shape[1], 1, 1]) })
        }
        "batch_norm" => {
            let channels = x.shape[1];
            let scale = named.add("weight", input(case, "weight"));
            let shift = named.add("bias", input(case, "bias"));
            let mean = named.params.add_fixed("m".into(), vec![channels], vec![0.0; channels]);
            let variance = named.params.add_fixed("v".into(), vec![channels], vec![1.0; channels]);
            let norm = BatchNorm {
                scale,
                shift,
                mean,
                variance,
                momentum: number(&case.inputs["momentum"]),
                eps: number(&case.inputs["eps"]),
            };
            let graph = Graph::new(named.params);
            let of = graph.variable(x.batch(), &x.values);
            let y = graph.batch_norm(of, &norm);
            let mut ours = backward(case, &graph, &named.ids, (of, &x), y);
            ours["running_mean_after"] = json!(graph.params().value(mean));
            ours["running_var_after"] = json!(graph.params().value(variance));
            ours
        }
        "inverted_residual" => inverted_residual(case, &x),
        "impala_residual" => {
            let ids = ["w1", "b1", "w2", "b2"].map(|name| named.add(name, input(case, name)));
            let graph = Graph::new(named.params);
            let of = graph.variable(x.batch(), &x.values);
            let window = Window { kernel: 3, stride: 1, padding: 1 };
            let mut y = of;
            for pair in ids.chunks(2) {
                y = graph.conv2d(
                    graph.curve(y, Curve::Relu),
                    pair[0],
                    Some(pair[1]),
                    (window, 1),
                    Curve::Identity,
                );
            }
            let y = graph.add(y, of);
            backward(case, &graph, &named.ids, (of, &x), y)
        }
        other => panic!("{}: no code for the kind `{other}`", case.name),
    }
}

fn backward(
    case: &Case,
    graph: &Graph<f64>,
    ids: &BTreeMap<String, (ParamId, Tensor, bool)>,
    (of, x): (Var, &Tensor),
    y: Var,
) -> Value {
    let cotangent = input(case, "cotangent");
    pull(graph, y, &cotangent.values);
    json!({
        "y": shaped(graph, y, &cotangent.shape),
        "grads": grads(graph, ids, &[("x", of, &x.shape)]),
    })
}

/// Two passes: by fresh running statistics, and by those of the batch.
fn inverted_residual(case: &Case, x: &Tensor) -> Value {
    let mut named = Named::default();
    let mut norms = Vec::new();
    let mut weights = Vec::new();
    for (conv, norm) in [("conv.0.0", "conv.0.1"), ("conv.1.0", "conv.1.1"), ("conv.2", "conv.3")] {
        let of = |name: &str| Tensor::of(&case.inputs["params"][name]);
        let weight = of(&format!("{conv}.weight"));
        let channels = weight.shape[0];
        weights.push(named.add(&format!("{conv}.weight"), weight));
        let scale = named.add(&format!("{norm}.weight"), of(&format!("{norm}.weight")));
        let shift = named.add(&format!("{norm}.bias"), of(&format!("{norm}.bias")));
        let mean = named.params.add_fixed("m".into(), vec![channels], vec![0.0; channels]);
        let variance = named.params.add_fixed("v".into(), vec![channels], vec![1.0; channels]);
        norms.push(BatchNorm { scale, shift, mean, variance, momentum: 0.1, eps: 1e-5 });
    }
    let graph = Graph::new(named.params);
    let stride = count(case, "stride");
    let pass = |trains: bool| {
        let of = graph.variable(x.batch(), &x.values);
        let mut y = of;
        for (i, (weight, norm)) in weights.iter().zip(&norms).enumerate() {
            let window = match i {
                1 => Window { kernel: 3, stride, padding: 1 },
                _ => Window { kernel: 1, stride: 1, padding: 0 },
            };
            let groups = if i == 1 { graph.shape(y).item[0] } else { 1 };
            y = graph.conv2d(y, *weight, None, (window, groups), Curve::Identity);
            y = if trains { graph.batch_norm(y, norm) } else { graph.batch_norm_fixed(y, norm) };
            y = if i < 2 { graph.curve(y, Curve::Relu6) } else { y };
        }
        let is_residual = graph.shape(y) == graph.shape(of) && stride == 1;
        (of, if is_residual { graph.add(y, of) } else { y })
    };
    let cotangent = input(case, "cotangent");
    graph.begin();
    let (of, y) = pass(false);
    pull(&graph, y, &cotangent.values);
    let y_eval = shaped(&graph, y, &cotangent.shape);
    let grads_eval = grads(&graph, &named.ids, &[("x", of, &x.shape)]);
    graph.begin();
    let (of, y) = pass(true);
    pull(&graph, y, &cotangent.values);
    let by_x = grads(&graph, &BTreeMap::new(), &[("x", of, &x.shape)]);
    json!({
        "y_eval_fresh_stats": y_eval,
        "grads_eval": grads_eval,
        "y_train": shaped(&graph, y, &cotangent.shape),
        "grad_x_train": by_x["x"],
    })
}

fn vectors(case: &Case) -> Value {
    match case.kind.as_str() {
        "gru" | "lstm" => recurrent(case),
        "gru_reset" => gru_reset(case),
        "mlp" => perceptron(case),
        "layer_norm" => {
            let x = input(case, "x");
            let mut named = Named::default();
            let scale = named.add("weight", input(case, "weight"));
            let shift = named.add("bias", input(case, "bias"));
            let graph = Graph::new(named.params);
            let of = graph.variable(x.batch(), &x.values);
            let y = graph.layer_norm(of, scale, shift, number(&case.inputs["eps"]));
            backward(case, &graph, &named.ids, (of, &x), y)
        }
        "mc_dropout" => mc_dropout(case),
        "randomized_prior" => randomised_prior(case),
        other => panic!("{}: no code for the kind `{other}`", case.name),
    }
}

/// The cell whose parameters bear torch's names with this ending.
fn cell(case: &Case, named: &mut Named, ending: &str) -> Cell {
    let of = |name: &str| Tensor::of(&case.inputs["params"][name]);
    let mut weight = |name: String| named.add_transposed(&name, &of(&name));
    let input_weight = weight(format!("weight_ih{ending}"));
    let state_weight = weight(format!("weight_hh{ending}"));
    let mut bias = |name: String| named.add(&name, of(&name));
    Cell {
        input_weight,
        input_bias: bias(format!("bias_ih{ending}")),
        state_weight,
        state_bias: bias(format!("bias_hh{ending}")),
    }
}

fn recurrent(case: &Case) -> Value {
    let (xs, h0, cotangent) = (input(case, "x"), input(case, "h0"), input(case, "cotangent"));
    let mut named = Named::default();
    let cell = cell(case, &mut named, "_l0");
    let is_lstm = case.kind == "lstm";
    let c0 = if is_lstm { input(case, "c0") } else { h0.clone() };
    let graph = Graph::new(named.params);
    let (n, n_steps, width) = (xs.shape[0], xs.shape[1], xs.shape[2]);
    let of = graph.variable(Shape::vectors(n, n_steps * width), &xs.values);
    let (h, c) = (graph.variable(h0.batch(), &h0.values), graph.variable(c0.batch(), &c0.values));
    let mut state = (h, c);
    let mut outputs = Vec::new();
    for t in 0..n_steps {
        let x_t = graph.columns(of, t * width, width);
        state = if is_lstm {
            graph.lstm(x_t, state, &cell)
        } else {
            (graph.gru(x_t, state.0, &cell), c)
        };
        outputs.push(state.0);
    }
    let y = graph.concat(&outputs);
    let loss = pull(&graph, y, &cotangent.values);
    let lead = |shape: &[usize]| [&[1], shape].concat();
    let states = [("h0", h, lead(&h0.shape)), ("c0", c, lead(&c0.shape))];
    let mut of: Vec<(&str, Var, &[usize])> = vec![("x", of, &xs.shape)];
    of.extend(states.iter().take(if is_lstm { 2 } else { 1 }).map(|(a, b, c)| (*a, *b, &c[..])));
    let c_n = if is_lstm { shaped(&graph, state.1, &c0.shape) } else { Value::Null };
    json!({
        "y": shaped(&graph, y, &cotangent.shape),
        "loss": loss,
        "c_n": c_n,
        "grads": grads(&graph, &named.ids, &of),
    })
}

/// The state is 0 before each step that begins an episode.
fn gru_reset(case: &Case) -> Value {
    let (x, done) = (input(case, "x"), input(case, "done_before_step"));
    let mut named = Named::default();
    let cell = cell(case, &mut named, "");
    let units = named.params.shape(cell.state_weight)[0];
    let graph = Graph::new(named.params);
    let (n, n_steps, width) = (x.shape[0], x.shape[1], x.shape[2]);
    let of = graph.input(Shape::vectors(n, n_steps * width), &x.values);
    let going = graph.input(done.batch(), &done.values.iter().map(|d| 1.0 - d).collect::<Vec<_>>());
    let mut h = graph.input(Shape::vectors(n, units), &vec![0.0; n * units]);
    let mut outputs = Vec::new();
    for t in 0..n_steps {
        h = graph.mul(h, graph.columns(going, t, 1));
        h = graph.gru(graph.columns(of, t * width, width), h, &cell);
        outputs.push(h);
    }
    let y = graph.concat(&outputs);
    json!({ "y": shaped(&graph, y, &[n, n_steps, units]) })
}

fn perceptron(case: &Case) -> Value {
    let x = input(case, "x");
    let mut named = Named::default();
    let mut layer =
        |w: &str, b: &str| (named.add_transposed(w, &input(case, w)), named.add(b, input(case, b)));
    let ((w1, b1), (w2, b2)) = (layer("w1", "b1"), layer("w2", "b2"));
    let graph = Graph::new(named.params);
    let of = graph.variable(x.batch(), &x.values);
    let hidden = |curve| graph.linear(of, w1, b1, curve);
    let hidden = match case.name.as_str() {
        "mlp_relu" => hidden(Curve::Relu),
        "mlp_relu6" => hidden(Curve::Relu6),
        "mlp_tanh" => hidden(Curve::Tanh),
        "mlp_elu" => hidden(Curve::Elu),
        "mlp_sigmoid" => hidden(Curve::Sigmoid),
        "mlp_softplus" => hidden(Curve::Softplus),
        "mlp_silu" => graph.silu(hidden(Curve::Identity)),
        "mlp_gelu" => graph.gelu(hidden(Curve::Identity)),
        other => panic!("no code for `{other}`"),
    };
    let y = graph.linear(hidden, w2, b2, Curve::Identity);
    backward(case, &graph, &named.ids, (of, &x), y)
}

fn mc_dropout(case: &Case) -> Value {
    let (x, masks) = (input(case, "x"), input(case, "keep_masks"));
    let mut named = Named::default();
    let mut layer =
        |w: &str, b: &str| (named.add_transposed(w, &input(case, w)), named.add(b, input(case, b)));
    let ((w1, b1), (w2, b2)) = (layer("w1", "b1"), layer("w2", "b2"));
    let graph = Graph::new(named.params);
    let (n, rate) = (x.shape[0], number(&case.inputs["p_drop"]));
    let samples = masks.values.chunks_exact(masks.values.len() / masks.shape[0]).map(|mask| {
        let of = graph.input(x.batch(), &x.values);
        let hidden = graph.linear(of, w1, b1, Curve::Relu);
        let mask = graph.input(graph.shape(hidden), mask);
        let hidden = graph.dropout(hidden, mask, rate);
        graph.value(graph.linear(hidden, w2, b2, Curve::Identity))
    });
    let samples: Vec<Vec<f64>> = samples.collect();
    let moment = |f: &dyn Fn(&[f64]) -> f64| -> Vec<f64> {
        (0..n).map(|i| f(&samples.iter().map(|sample| sample[i]).collect::<Vec<_>>())).collect()
    };
    let mean = moment(&ivx_math::moments::mean);
    let variance = moment(&|xs| ivx_math::moments::std(xs).powi(2));
    let noise = number(&case.inputs["noise_var"]);
    let column = |xs: &[f64]| xs.iter().map(|x| vec![*x]).collect::<Vec<_>>();
    json!({
        "samples": samples.iter().map(|sample| column(sample)).collect::<Vec<_>>(),
        "mean": column(&mean),
        "var_epistemic": column(&variance),
        "var_total": column(&variance.iter().map(|v| v + noise).collect::<Vec<_>>()),
    })
}

fn randomised_prior(case: &Case) -> Value {
    let x = input(case, "x");
    let mut named = Named::default();
    let weight = named.add_transposed("w_train", &input(case, "w_train"));
    let fixed = input(case, "w_prior").transposed();
    let prior = named.params.add_fixed("prior".into(), fixed.shape.clone(), fixed.values);
    let zero = named.params.add_fixed("zero".into(), vec![1], vec![0.0]);
    let graph = Graph::new(named.params);
    let of = graph.input(x.batch(), &x.values);
    let learned = graph.linear(of, weight, zero, Curve::Identity);
    let scale = number(&case.inputs["prior_scale"]);
    let prior = graph.affine(graph.linear(of, prior, zero, Curve::Identity), scale, 0.0);
    let y = graph.add(learned, prior);
    let target = number(&case.inputs["target"]);
    let loss = graph.mean(graph.square(graph.affine(y, 1.0, -target)));
    graph.backward(loss);
    json!({
        "y": shaped(&graph, y, &[x.shape[0], 1]),
        "loss": graph.scalar(loss),
        "grads": grads(&graph, &named.ids, &[]),
    })
}
