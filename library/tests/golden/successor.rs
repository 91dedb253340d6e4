//! Losses of successor features, cumulants and preferences (torch, JAX), to the tolerance of the file (1e-9).

use ivx_math::policy::boltzmann;
use ivx_math::successor::Preferences;
use ivx_nn::{Graph, Norm, ParamId, Params, PsiPhiLosses, Shape, SuccessorSteps, Var, Weighting};
use serde_json::{Value, json};

use crate::harness::{Case, check, check_wrong, number, numbers, rows};
use crate::networks::{Tensor, at, input};

const TOPIC: &str = "sf_itd_psiphi";

#[test]
fn golden_losses_of_successor_features_agree() {
    check(TOPIC, |case, path| at(&computed(case, false)?, path));
}

/// Each kind with a formula that is nearly right: the gradient of cumulants, the penalty of preferences, half of a square,
/// the action of what follows, the weight of a part, and the unit of a ridge.
#[test]
fn golden_losses_of_successor_features_tell_wrong_ones() {
    let kinds =
        ["sf_td", "itd", "bc_sf", "reward_loss", "q_loss", "psiphi_total", "task_inference"];
    for kind in kinds {
        check_wrong(TOPIC, kind, |case, path| at(&computed(case, true)?, path));
    }
}

fn computed(case: &Case, wrong: bool) -> Option<Value> {
    let computed = match case.kind.as_str() {
        "sf_td" => differences(case, wrong),
        "itd" => differences(case, !wrong),
        "bc_sf" => demonstrators(case, if wrong { 0.1 } else { 0.05 }),
        "reward_loss" => rewards(case, if wrong { 0.5 } else { 1.0 }),
        "q_loss" => values(case, wrong),
        "psiphi_total" => whole(case, wrong),
        "task_inference" => inferred(case, wrong),
        "shift_invariance" => shifted(case),
        _ => return None,
    };
    Some(computed)
}

/// Parameters that are an input of a case.
struct Learned<'a> {
    name: &'a str,
    /// Whether the input has one of each agent, and is not one itself.
    is_each: bool,
    agents: Vec<(ParamId, Tensor)>,
}

/// A pass through `Ψ(s, a) = W[a] s` and the like, whose parameters are inputs of the case.
struct Pass<'a> {
    case: &'a Case,
    graph: Graph<f64>,
    params: Vec<Learned<'a>>,
}

impl<'a> Pass<'a> {
    /// - `one`, `each`: names of parameters, of one and of several agents.
    fn new(case: &'a Case, one: &[&'a str], each: &[&'a str]) -> Self {
        let mut params = Params::default();
        let mut learned = |name: &'a str, is_each: bool| {
            let value = &case.inputs[name];
            let all = if is_each {
                &value.as_array().expect("one of each agent")[..]
            } else {
                std::slice::from_ref(value)
            };
            let agents = all.iter().enumerate().map(|(k, value)| {
                let Tensor { shape, values } = Tensor::of(value);
                (params.add(format!("{name}.{k}"), shape, values), Tensor::of(value))
            });
            Learned { name, is_each, agents: agents.collect() }
        };
        let mut all: Vec<Learned<'_>> = one.iter().map(|name| learned(name, false)).collect();
        all.extend(each.iter().map(|name| learned(name, true)));
        Self { case, graph: Graph::new(params), params: all }
    }

    fn learned(&self, name: &str) -> &Learned<'a> {
        self.params.iter().find(|of| of.name == name).expect("a parameter")
    }

    fn of(&self, name: &str, k: usize) -> ParamId {
        self.learned(name).agents[k].0
    }

    fn column(&self, values: &[f64]) -> Var {
        self.graph.input(Shape::vectors(values.len(), 1), values)
    }

    /// What a network makes of all actions in states.
    fn all(&self, states: &str, net: &str, k: usize) -> Var {
        let tensor = input(self.case, states);
        let states = self.graph.input(tensor.batch(), &tensor.values);
        self.graph.linear_back(states, self.of(net, k))
    }

    /// Of the actions that were taken in them.
    fn taken(&self, (states, acts): (&str, &str), net: &str, k: usize) -> Var {
        let d = input(self.case, net).shape;
        let acts = self.column(&numbers(&self.case.inputs[acts]));
        self.graph.gather(self.all(states, net, k), acts, d[d.len() - 2])
    }

    fn weights(&self, name: &str, k: usize) -> Var {
        self.graph.parameter(self.of(name, k))
    }

    fn discounts(&self) -> Var {
        let discount = number(&self.case.inputs["gamma"]);
        let done = numbers(&self.case.inputs["done"]);
        self.column(&done.iter().map(|done| discount * (1.0 - done)).collect::<Vec<_>>())
    }

    fn paid(&self) -> Var {
        self.column(&numbers(&self.case.inputs["r_next"]))
    }

    /// The loss, and its gradients by parameters of these names; zeros where there are none.
    fn finish(&self, loss: Var, names: &[&str]) -> (f64, Value) {
        self.graph.backward(loss);
        let grads = names.iter().map(|name| {
            let Learned { is_each, agents, .. } = self.learned(name);
            let grads = agents.iter().map(|(id, tensor)| {
                let params = self.graph.params();
                let none = || vec![0.0; tensor.values.len()];
                let values = params.grad(*id).map_or_else(none, <[f64]>::to_vec);
                Tensor { shape: tensor.shape.clone(), values }.json()
            });
            let mut grads: Vec<Value> = grads.collect();
            let grads = if *is_each { json!(grads) } else { grads.remove(0) };
            ((*name).to_owned(), grads)
        });
        (self.graph.scalar(loss), Value::Object(grads.collect()))
    }
}

/// Eqns. 4.11 and 4.18, with what follows by the network itself or by its copy.
fn differences(case: &Case, is_inverse: bool) -> Value {
    let names = ["W_psi", "W_psi_target", "U_phi"];
    let next = if case.name.contains("target") { names[1] } else { names[0] };
    let norms = [
        ("sq_sum", Norm::Squares),
        ("sq_mean", Norm::MeanSquare),
        ("l2", Norm::Length),
        ("l1", Norm::Absolute),
    ];
    let mut computed = json!({});
    for (name, norm) in norms {
        let pass = Pass::new(case, &names, &[]);
        let steps = SuccessorSteps {
            features: pass.taken(("s", "a"), "W_psi", 0),
            cumulants: pass.taken(("s", "a"), "U_phi", 0),
            next: pass.taken(("s_next", "a_next"), next, 0),
            discounts: pass.discounts(),
        };
        let errors = pass.graph.value(pass.graph.successor_errors(&steps));
        let n = numbers(&case.inputs["a"]).len();
        computed["delta"] = Tensor { shape: vec![n, errors.len() / n], values: errors }.json();
        let loss = if is_inverse {
            pass.graph.inverse_loss(&steps, norm)
        } else {
            pass.graph.successor_loss(&steps, norm)
        };
        let (loss, grads) = pass.finish(loss, &["W_psi", "U_phi"]);
        computed["loss"][name] = json!(loss);
        computed["grads"][name] = grads;
    }
    computed
}

/// Eqn. 4.17, and with the penalty of Alg. 2.
fn demonstrators(case: &Case, sparsity: f64) -> Value {
    let names = ["W_psi", "U_phi", "w"];
    let loss = |weight: f64| {
        let pass = Pass::new(case, &names, &[]);
        let (features, w) = (pass.all("s", "W_psi", 0), pass.weights("w", 0));
        let q = pass.graph.contract(features, w);
        let (n, values) = (pass.graph.shape(q).n, pass.graph.value(q));
        let q = Tensor { shape: vec![n, values.len() / n], values }.json();
        let acts = pass.column(&numbers(&case.inputs["a"]));
        let loss = pass.graph.demonstrator_loss(features, w, acts);
        let loss = pass.graph.add(loss, pass.graph.sparsity_loss(w, weight));
        (q, pass.finish(loss, &names))
    };
    let ((q, (plain, grads)), (_, (sparse, sparse_grads))) = (loss(0.0), loss(sparsity));
    json!({
        "q": q, "loss": plain, "loss_plus_l1": sparse, "lambda_w": sparsity,
        "grads": grads, "grads_with_l1": sparse_grads,
    })
}

/// Eqn. 4.21a.
fn rewards(case: &Case, scale: f64) -> Value {
    let names = ["W_psi", "U_phi", "w"];
    let mut computed = json!({});
    for (name, norm) in [("sq", Norm::Squares), ("l1", Norm::Absolute)] {
        let pass = Pass::new(case, &names, &[]);
        let (cumulants, w) = (pass.taken(("s", "a"), "U_phi", 0), pass.weights("w", 0));
        let residual = pass.graph.sub(pass.graph.contract(cumulants, w), pass.paid());
        computed["residual"] = json!(pass.graph.value(residual));
        let loss = pass.graph.reward_loss(cumulants, w, pass.paid(), norm);
        let (loss, grads) = pass.finish(pass.graph.affine(loss, scale, 0.0), &names);
        computed["loss"][name] = json!(loss);
        computed["grads"][name] = grads;
    }
    computed
}

/// The targets of Eqn. 4.21b; the wrong ones are of the action that was taken next, and not of the best.
fn targets(pass: &Pass<'_>, net: &str, w: Var, wrong: bool) -> Var {
    let after = (pass.paid(), pass.discounts());
    let next =
        if wrong { pass.taken(("s_next", "a_next"), net, 0) } else { pass.all("s_next", net, 0) };
    pass.graph.preferred_targets(next, w, after)
}

/// Eqn. 4.21b.
fn values(case: &Case, wrong: bool) -> Value {
    let pass = Pass::new(case, &["W_psi", "W_psi_target", "w"], &[]);
    let (features, w) = (pass.taken(("s", "a"), "W_psi", 0), pass.weights("w", 0));
    let targets = targets(&pass, "W_psi_target", w, wrong);
    let errors = pass.graph.sub(pass.graph.contract(features, w), targets);
    let delta = pass.graph.value(errors);
    let loss = pass.graph.preferred_loss(features, w, targets, Norm::Squares);
    let (loss, grads) = pass.finish(loss, &["W_psi"]);
    // Were preferences to learn by it too.
    let pass = Pass::new(case, &["W_psi", "W_psi_target", "w"], &[]);
    let (features, w) = (pass.taken(("s", "a"), "W_psi", 0), pass.weights("w", 0));
    let targets = self::targets(&pass, "W_psi_target", w, wrong);
    let errors = pass.graph.sub(pass.graph.contract(features, w), targets);
    let (_, of_w) = pass.finish(pass.graph.mean_norm(errors, Norm::Squares), &["w"]);
    json!({ "delta": delta, "loss_sq": loss, "grads_psi_only": grads, "grads_if_w_trained": of_w })
}

/// Eqn. 4.22 and Alg. 3: demonstrations of several agents, and the same steps as those of the agent itself.
fn whole(case: &Case, wrong: bool) -> Value {
    let (alike, by_feature) =
        (whole_by(case, Weighting::Alike), whole_by(case, Weighting::ByFeature));
    let (alike, by_feature) = if wrong { (by_feature, alike) } else { (alike, by_feature) };
    let mut computed = alike.0;
    computed["total_4_22"] = json!(alike.1);
    computed["total_alg3_scaled"] = json!(by_feature.1);
    computed["grads_4_22"] = alike.2;
    computed["grads_alg3"] = by_feature.2;
    computed
}

fn whole_by(case: &Case, weighting: Weighting) -> (Value, f64, Value) {
    let one = ["W_ego", "W_ego_target", "w_ego", "U_phi"];
    let pass = Pass::new(case, &one, &["W_others", "W_others_target", "w_others"]);
    let graph = &pass.graph;
    let agents = numbers(&case.inputs["agent_of_sample"]);
    let acts = numbers(&case.inputs["a"]);
    let others = (0..pass.learned("W_others").agents.len()).map(|k| {
        let steps = SuccessorSteps {
            features: pass.taken(("s", "a"), "W_others", k),
            cumulants: pass.taken(("s", "a"), "U_phi", 0),
            next: pass.taken(("s_next", "a_next"), "W_others_target", k),
            discounts: pass.discounts(),
        };
        let own: Vec<usize> =
            (0..agents.len()).filter(|i| agents[*i] == ivx_math::moments::real(k)).collect();
        let of = |x: Var| graph.items(x, &own);
        let features = of(pass.all("s", "W_others", k));
        let bc =
            graph.demonstrator_loss(features, pass.weights("w_others", k), of(pass.column(&acts)));
        let steps = SuccessorSteps {
            features: of(steps.features),
            cumulants: of(steps.cumulants),
            next: of(steps.next),
            discounts: of(steps.discounts),
        };
        (bc, graph.inverse_loss(&steps, Norm::Squares))
    });
    let others: Vec<(Var, Var)> = others.collect();
    let (cumulants, w) = (pass.taken(("s", "a"), "U_phi", 0), pass.weights("w_ego", 0));
    let features = pass.taken(("s", "a"), "W_ego", 0);
    let targets = targets(&pass, "W_ego_target", w, false);
    let next = pass.taken(("s_next", "a_next"), "W_ego_target", 0);
    let steps = SuccessorSteps { features, cumulants, next, discounts: pass.discounts() };
    let losses = PsiPhiLosses {
        others,
        reward: graph.reward_loss(cumulants, w, pass.paid(), Norm::Squares),
        value: graph.preferred_loss(features, w, targets, Norm::Squares),
        features: graph.successor_loss(&steps, Norm::Squares),
    };
    let loss = graph.psi_phi_loss(&losses, graph.shape(features).width(), weighting);
    let scalar = |var: Var| graph.scalar(var);
    let each = losses
        .others
        .iter()
        .enumerate()
        .map(|(k, (bc, itd))| (k.to_string(), json!({"bc": scalar(*bc), "itd": scalar(*itd)})));
    let parts = json!({
        "per_agent": Value::Object(each.collect()),
        "reward": scalar(losses.reward),
        "q": scalar(losses.value),
        "td_psi": scalar(losses.features),
    });
    let (loss, grads) = pass.finish(loss, &["W_others", "w_others", "W_ego", "w_ego", "U_phi"]);
    (parts, loss, grads)
}

/// Alg. 3, line 5; the wrong ridge is that of each step.
fn inferred(case: &Case, wrong: bool) -> Value {
    let paid = numbers(&case.inputs["r"]);
    let seen = |name: &str| {
        let cumulants = rows(&case.inputs[name]);
        let mut seen = Preferences::new(cumulants[0].len());
        for (cumulant, reward) in cumulants.iter().zip(&paid) {
            seen.see(cumulant, *reward);
        }
        seen
    };
    let scale = if wrong { ivx_math::moments::real(paid.len()) } else { 1.0 };
    json!({
        "w_lstsq": seen("phi").infer(0.0),
        "w_ridge": seen("phi").infer(scale * number(&case.inputs["ridge"])),
        "w_min_norm_rank_deficient": seen("phi_rank_deficient").infer(0.0),
    })
}

/// Eqn. B.3.
fn shifted(case: &Case) -> Value {
    let (q, shifts) = (rows(&case.inputs["q"]), rows(&case.inputs["shift"]));
    let soft = |rows: &[Vec<f64>]| -> Vec<Vec<f64>> {
        rows.iter().map(|row| boltzmann(row, 1.0)).collect()
    };
    let moved = q.iter().zip(&shifts).map(|(row, f)| row.iter().map(|q| q + f[0]).collect());
    json!({ "softmax_q": soft(&q), "softmax_shifted": soft(&moved.collect::<Vec<_>>()) })
}
