//! Losses and their gradients, in double precision (torch).

use ivx_math::moments::real;
use ivx_nn::{Graph, Params, Proximity, Shape, Steps, Var};
use serde_json::{Value, json};

use crate::harness::{Case, check, check_kind, number};
use crate::networks::{Tensor, at, input};

#[test]
fn golden_distributions_agree() {
    check("distributions_kl_nll", |case, path| at(&distribution(case), path));
}

#[test]
fn golden_policy_losses_agree() {
    check("policy_losses", |case, path| at(&policy(case), path));
}

#[test]
fn golden_losses_of_errors_agree() {
    check_kind("value_targets", "losses", |case, path| at(&of_errors(case), path));
}

/// A pass whose values are inputs of the case by name.
struct Pass<'a> {
    case: &'a Case,
    graph: Graph<f64>,
}

impl<'a> Pass<'a> {
    fn new(case: &'a Case) -> Self {
        Self { case, graph: Graph::new(Params::default()) }
    }

    /// An input whose gradient is wanted.
    fn of(&self, name: &str) -> Var {
        let tensor = input(self.case, name);
        self.graph.variable(tensor.batch(), &tensor.values)
    }

    /// One item for all.
    fn of_row(&self, name: &str) -> Var {
        let values = input(self.case, name).values;
        self.graph.variable(Shape::vectors(1, values.len()), &values)
    }

    /// The values of a result in the shape of an input.
    fn like(&self, name: &str, values: Vec<f64>) -> Value {
        Tensor { shape: input(self.case, name).shape, values }.json()
    }

    fn value(&self, name: &str, var: Var) -> Value {
        self.like(name, self.graph.value(var))
    }

    fn items(&self, var: Var) -> Value {
        json!(self.graph.value(var))
    }

    fn grads(&self, of: &[(&str, Var)]) -> Value {
        let grads = of
            .iter()
            .map(|(name, var)| ((*name).to_owned(), self.like(name, self.graph.grad(*var))));
        Value::Object(grads.collect())
    }

    /// Whole numbers such as actions.
    fn places(&self, name: &str) -> Var {
        let tensor = input(self.case, name);
        self.graph.input(tensor.batch(), &tensor.values)
    }
}

fn of_errors(case: &Case) -> Value {
    let pass = Pass::new(case);
    let graph = &pass.graph;
    let mean_loss = |of: &dyn Fn(Var, Var) -> Var| {
        let errors = pass.of("td");
        let zeros = graph.affine(errors, 0.0, 0.0);
        let loss = graph.mean(of(errors, zeros));
        graph.backward(loss);
        (graph.scalar(loss), pass.like("td", graph.grad(errors)))
    };
    let (huber, grad_huber) = mean_loss(&|x, y| graph.huber(x, y, 1.0));
    let (half, grad_half) = mean_loss(&|x, y| graph.affine(graph.squared(x, y), 0.5, 0.0));
    json!({
        "huber_delta1_mean": huber, "grad_huber": grad_huber,
        "l2_half_mean": half, "grad_l2": grad_half,
    })
}

fn distribution(case: &Case) -> Value {
    let pass = Pass::new(case);
    let graph = &pass.graph;
    let scaled = |x, scale| graph.affine(x, scale, 0.0);
    match case.kind.as_str() {
        "gaussian_nll" => {
            let (mu, log_sigma, y) = (pass.of("mu"), pass.of("log_sigma"), pass.of("y"));
            let log_prob = graph.gaussian_log_prob(graph.sub(y, mu), log_sigma);
            let nll = scaled(graph.mean(graph.sum_items(log_prob)), -1.0);
            graph.backward(nll);
            json!({
                "log_prob": pass.value("mu", log_prob),
                "nll": graph.scalar(nll),
                "grads": pass.grads(&[("mu", mu), ("log_sigma", log_sigma), ("y", y)]),
            })
        }
        "gaussian_nll_fixed" => {
            let (mu, y) = (pass.of("mu"), pass.of("y"));
            let log_std = 0.5 * number(&case.inputs["sigma2"]).ln();
            let log_std = graph.input(Shape::vectors(1, 1), &[log_std]);
            let log_prob = graph.gaussian_log_prob(graph.sub(y, mu), log_std);
            let nll = scaled(graph.sum(log_prob), -1.0);
            graph.backward(nll);
            json!({ "nll": graph.scalar(nll), "grads": pass.grads(&[("mu", mu)]) })
        }
        "mvn_log_prob" => {
            let (mu, factor, y) = (pass.of("mu"), pass.of("scale_tril"), pass.of("y"));
            let log_prob = graph.full_gaussian_log_prob(graph.sub(y, mu), factor);
            let nll = scaled(graph.sum(log_prob), -1.0);
            graph.backward(nll);
            json!({
                "log_prob": pass.items(log_prob),
                "nll_sum": graph.scalar(nll),
                "grads": pass.grads(&[("mu", mu), ("scale_tril", factor), ("y", y)]),
            })
        }
        "categorical" => {
            let (p, q) = (pass.of("logits_p"), pass.of("logits_q"));
            let kl = graph.categorical_kl(p, q);
            graph.backward(graph.sum(kl));
            let grads_kl = pass.grads(&[("logits_p", p), ("logits_q", q)]);
            let probs = |x| pass.value("logits_p", graph.exp(graph.log_softmax(x)));
            let again = pass.of("logits_p");
            let entropy = graph.entropy(again);
            graph.backward(graph.sum(entropy));
            json!({
                "p": probs(p),
                "q": probs(q),
                "kl_pq": pass.items(kl),
                "entropy_p": pass.items(entropy),
                "logsumexp_p": log_sum_exp(&pass, p),
                "grads_kl_sum": grads_kl,
                "grads_entropy_sum": pass.grads(&[("logits_p", again)]),
            })
        }
        "gaussian_kl" => {
            let names = ["mu_p", "sigma_p", "mu_q", "sigma_q"];
            let vars = names.map(|name| pass.of(name));
            let log = |x| graph.map(x, f64::ln, |x: f64, _| 1.0 / x);
            let kl = graph.gaussian_kl((vars[0], log(vars[1])), (vars[2], log(vars[3])));
            graph.backward(graph.sum(kl));
            let of: Vec<_> = names.into_iter().zip(vars).collect();
            json!({ "kl": pass.items(kl), "grads": pass.grads(&of) })
        }
        "tanh_normal" => {
            let (mu, sigma, x) = (pass.of("mu"), pass.of("sigma"), pass.of("pre_tanh"));
            let log_std = graph.map(sigma, f64::ln, |x: f64, _| 1.0 / x);
            let log_prob = graph.squashed_log_prob(x, graph.sub(x, mu), log_std);
            json!({
                "action": pass.value("mu", graph.curve(x, ivx_nn::Curve::Tanh)),
                "log_prob": pass.items(graph.sum_items(log_prob)),
            })
        }
        "bce" => {
            let (logits, targets) = (pass.of("logits"), pass.of("targets"));
            let loss = graph.mean(graph.binary_cross_entropy(logits, targets));
            graph.backward(loss);
            json!({ "loss": graph.scalar(loss), "grads": pass.grads(&[("logits", logits)]) })
        }
        "log_softmax" => {
            let logits = pass.of("logits");
            let log_probs = graph.log_softmax(logits);
            json!({
                "log_softmax": pass.value("logits", log_probs),
                "softmax": pass.value("logits", graph.exp(log_probs)),
                "logsumexp": log_sum_exp(&pass, logits),
            })
        }
        "distillation" => distillation(&pass),
        other => panic!("{}: no code for the kind `{other}`", case.name),
    }
}

/// Eqn. 2.57 with squared and with absolute differences of values.
fn distillation(pass: &Pass<'_>) -> Value {
    let graph = &pass.graph;
    let loss = |is_square: bool| {
        let (v, logits) = (pass.of("v"), pass.of("logits"));
        let (v_bar, pi_bar) = (pass.places("v_bar"), pass.places("pi_bar"));
        let log_pi = graph.log_softmax(logits);
        let log_bar = graph.map(pi_bar, f64::ln, |x: f64, _| 1.0 / x);
        let kl = graph.sum_items(graph.mul(pi_bar, graph.sub(log_bar, log_pi)));
        let values = if is_square { graph.squared(v_bar, v) } else { graph.absolute(v_bar, v) };
        let loss = graph.mean(graph.add(values, kl));
        graph.backward(loss);
        (graph.scalar(loss), pass.grads(&[("v", v), ("logits", logits)]))
    };
    let ((loss_sq, grads_sq), (loss_abs, grads_abs)) = (loss(true), loss(false));
    json!({
        "loss_sq": loss_sq, "loss_abs": loss_abs,
        "grads_sq": grads_sq, "grads_abs": grads_abs,
    })
}

/// `ln Σ e^x` of each item is what the softmax takes away.
fn log_sum_exp(pass: &Pass<'_>, logits: Var) -> Value {
    let graph = &pass.graph;
    let shift = graph.sub(logits, graph.log_softmax(logits));
    pass.items(graph.columns(shift, 0, 1))
}

fn policy(case: &Case) -> Value {
    let pass = Pass::new(case);
    let graph = &pass.graph;
    let finish = |loss: Var, of: &[(&str, Var)]| {
        graph.backward(loss);
        (graph.scalar(loss), pass.grads(of))
    };
    match case.kind.as_str() {
        "reinforce" => {
            let logits = pass.of("logits");
            let loss =
                graph.policy_gradient_loss(logits, pass.places("actions"), pass.places("returns"));
            let (loss, grads) = finish(loss, &[("logits", logits)]);
            // Of the sum, and upwards.
            let n = real(graph.shape(logits).n);
            let up = graph.grad(logits).iter().map(|g| -g * n).collect();
            json!({
                "loss": loss, "grads": grads,
                "ascent_direction_2_48_sum": pass.like("logits", up),
            })
        }
        "actor_critic" => {
            let logits = pass.of("logits");
            let steps = (pass.places("actions"), pass.places("advantages"));
            let weight = number(&case.inputs["entropy_coef"]);
            let entropy = pass.items(graph.entropy(logits));
            let (loss, grads) =
                finish(graph.entropic_loss(logits, steps, weight), &[("logits", logits)]);
            json!({ "loss": loss, "grads": grads, "entropy": entropy })
        }
        "exact_pg" => {
            let (logits, q) = (pass.of("logits"), pass.places("q"));
            let advantages = graph.advantages(logits, q);
            let v = graph.columns(graph.sub(q, advantages), 0, 1);
            let (v, advantage) = (pass.items(v), pass.value("q", advantages));
            let loss = graph.expected_loss(logits, advantages);
            let (loss, grads) = finish(loss, &[("logits", logits)]);
            json!({ "loss": loss, "grads": grads, "v": v, "advantage": advantage })
        }
        "ppo" => ppo(&pass),
        "gaussian_pg" => {
            let (mu, log_std) = (pass.of("mu"), pass.of_row("log_std"));
            let actions = pass.places("actions");
            let log_prob =
                graph.sum_items(graph.gaussian_log_prob(graph.sub(actions, mu), log_std));
            let gain = graph.mean(graph.mul(log_prob, pass.places("advantages")));
            let entropy = graph.gaussian_entropy(log_std);
            let weight = number(&case.inputs["ent_coef"]);
            let loss = graph.affine(graph.add(gain, graph.affine(entropy, weight, 0.0)), -1.0, 0.0);
            let entropies = vec![graph.scalar(entropy); graph.shape(mu).n];
            let log_prob = pass.items(log_prob);
            let (loss, grads) = finish(loss, &[("mu", mu), ("log_std", log_std)]);
            json!({ "loss": loss, "grads": grads, "log_prob": log_prob, "entropy": entropies })
        }
        "bc" => {
            let (logits, actions) = (pass.of("logits"), pass.places("actions"));
            let loss = graph.mean(graph.cross_entropy(logits, actions));
            let hits = graph.value(graph.max_items(logits));
            let chosen = graph.value(graph.pick(logits, actions));
            let hits = hits.iter().zip(chosen).filter(|(max, chosen)| **max == *chosen).count();
            let accuracy = real(hits) / real(graph.shape(logits).n);
            let (loss, grads) = finish(loss, &[("logits", logits)]);
            json!({ "loss": loss, "grads": grads, "accuracy": accuracy })
        }
        "epsilon_greedy" => {
            let q = input(case, "q");
            let epsilon = number(&case.inputs["epsilon"]);
            let rows: Vec<&[f64]> = q.values.chunks_exact(q.shape[1]).collect();
            let probs = rows.iter().map(|row| ivx_math::policy::epsilon_greedy(row, epsilon));
            let soft = rows.iter().map(|row| ivx_math::policy::boltzmann(row, 0.5));
            let first = rows.iter().map(|row| ivx_math::policy::greedy(row));
            json!({
                "probs_ties_split": probs.collect::<Vec<_>>(),
                "argmax_first": first.collect::<Vec<_>>(),
                "boltzmann_t0_5": soft.collect::<Vec<_>>(),
            })
        }
        other => panic!("{}: no code for the kind `{other}`", case.name),
    }
}

fn ppo(pass: &Pass<'_>) -> Value {
    let (case, graph) = (pass.case, &pass.graph);
    let setting = |name: &str| number(&case.inputs[name]);
    let is = |name: &str| case.inputs[name].as_bool().expect("yes or no");
    let (logits, values) = (pass.of("logits"), pass.of("v_new"));
    let actions = pass.places("actions");
    let log_probs = graph.cross_entropy(pass.places("old_logits"), actions);
    let log_probs = graph.affine(log_probs, -1.0, 0.0);
    let mut advantages = input(case, "advantages").values;
    if is("normalize_advantages") {
        advantages = ivx_math::policy::normalised(&advantages);
    }
    let advantages = graph.input(Shape::vectors(advantages.len(), 1), &advantages);
    let (old, returns) = (pass.places("v_old"), pass.places("returns"));
    let steps = Steps { actions, log_probs, advantages, values: old, returns };
    let settings = Proximity {
        clip: setting("clip"),
        value_weight: setting("vf_coef"),
        entropy_weight: setting("ent_coef"),
        clips_values: is("clip_vloss"),
    };
    let proximal = graph.proximal_loss((logits, values), &steps, &settings);
    graph.backward(proximal.loss);
    let ratios = graph.value(proximal.ratios);
    let n = real(ratios.len());
    let approx_kl = ratios.iter().map(|r| r - 1.0 - r.ln()).sum::<f64>() / n;
    let clipped = ratios.iter().filter(|r| (**r - 1.0).abs() > settings.clip).count();
    json!({
        "ratio": ratios,
        "pg_loss": graph.scalar(proximal.policy),
        "v_loss": graph.scalar(proximal.value),
        "entropy": graph.scalar(proximal.entropy),
        "loss": graph.scalar(proximal.loss),
        "approx_kl": approx_kl,
        "clipfrac": real(clipped) / n,
        "grads": pass.grads(&[("logits", logits), ("v_new", values)]),
    })
}
