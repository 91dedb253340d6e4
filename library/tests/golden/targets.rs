//! Targets of values beside those of rlax and by hand.

use ivx_library::agent::tabular::{Bootstrap, ExpectedSarsa, QLearning, Sarsa, worth};
use ivx_library::ke::{Bcm, KnowledgeEquivalent, Ma, Wcm};
use ivx_library::planner::equivalents;
use ivx_math::moments::{mean, real};
use ivx_math::off_policy::{Ahead, VTrace, retrace, v_trace};
use ivx_math::order::argmax;
use ivx_math::returns::{Path, advantages, advantages_cut, k_step, lambda_returns};
use ivx_math::two_hot::{Bins, signed_hyperbolic, signed_parabolic};
use serde_json::{Value, json};

use crate::harness::{Case, check_kind, number, numbers, rows};

#[test]
fn golden_value_targets_agree() {
    for kind in ["mc_return", "n_step_returns", "lambda_returns", "gae", "gae_truncation"] {
        check_kind("value_targets", kind, along_a_path);
    }
    for kind in ["q_learning", "sarsa", "expected_sarsa", "double_q", "q_lambda"] {
        check_kind("value_targets", kind, one_step);
    }
    check_kind("value_targets", "ensemble_q_target", of_an_ensemble);
    check_kind("value_targets", "mc_value", by_monte_carlo);
    check_kind("value_targets", "retrace", off_policy);
    check_kind("value_targets", "vtrace", v_traced);
    check_kind("value_targets", "h_transform", rescaled);
    check_kind("value_targets", "two_hot", in_bins);
}

fn ends(value: &Value) -> Vec<bool> {
    numbers(value).into_iter().map(|end| end == 1.0).collect()
}

fn along_a_path(case: &Case, path: &[&str]) -> Option<Value> {
    let inputs = &case.inputs;
    let rewards = numbers(&inputs["r"]);
    let values = match case.kind.as_str() {
        "mc_return" => vec![number(&inputs["bootstrap"]); rewards.len() + 1],
        _ => numbers(&inputs["v"]),
    };
    let ended = if inputs["done"].is_null() { &inputs["terminated"] } else { &inputs["done"] };
    let along = Path { rewards: &rewards, values: &values, ends: &ends(ended) };
    let discount = number(&inputs["gamma"]);
    let lambda = || number(&inputs["lam"]);
    Some(match (case.kind.as_str(), path) {
        ("mc_return", ["returns"]) => json!(lambda_returns(&along, discount, 1.0)),
        ("n_step_returns", ["targets"]) => {
            let k = (1..100).find(|k| real(*k) == number(&inputs["n"]))?;
            json!(k_step(&along, discount, k))
        }
        ("lambda_returns", ["lambda_returns"]) | ("gae", ["value_targets"]) => {
            json!(lambda_returns(&along, discount, lambda()))
        }
        ("lambda_returns", ["td_errors"]) | ("gae", ["advantages"]) => {
            json!(advantages(&along, discount, lambda()))
        }
        ("gae_truncation", ["advantages"]) => {
            let left = numbers(&inputs["v_final_obs"]).into_iter();
            let cut = ends(&inputs["truncated"]).into_iter().zip(left);
            let cut: Vec<Option<f64>> = cut.map(|(cut, v)| cut.then_some(v)).collect();
            json!(advantages_cut(&along, &cut, discount, lambda()))
        }
        _ => return None,
    })
}

fn places(value: &Value) -> Vec<usize> {
    numbers(value).iter().map(|x| place(*x)).collect()
}

fn place(x: f64) -> usize {
    (0..1000).find(|i| real(*i) == x).expect("a place")
}

/// `r + γ v(s')`, and how far it lies above the value of the action taken.
fn one_step(case: &Case, path: &[&str]) -> Option<Value> {
    let inputs = &case.inputs;
    let next = rows(&inputs[if case.kind == "double_q" { "q_t_value" } else { "q_t" }]);
    let worth: Vec<f64> = match case.kind.as_str() {
        "q_learning" | "q_lambda" => next.iter().map(|q| QLearning {}.value(q, &[], 0)).collect(),
        "sarsa" => {
            let taken = places(&inputs["a_t"]);
            next.iter().zip(taken).map(|(q, a)| Sarsa {}.value(q, &[], a)).collect()
        }
        "expected_sarsa" => {
            let policy = rows(&inputs["pi_t"]);
            next.iter().zip(&policy).map(|(q, pi)| ExpectedSarsa {}.value(q, pi, 0)).collect()
        }
        "double_q" => {
            let chosen = rows(&inputs["q_t_selector"]);
            let chosen = chosen.iter().map(|q| argmax(q).expect("there is an action"));
            next.iter().zip(chosen).map(|(q, a)| Sarsa {}.value(q, &[], a)).collect()
        }
        _ => return None,
    };
    let lambda = inputs["lam"].as_f64().unwrap_or(0.0);
    beside_values(case, path, &targets_ahead(case, &worth, lambda))
}

/// Targets of what was done, and how far they lie above its values.
fn beside_values(case: &Case, path: &[&str], targets: &[f64]) -> Option<Value> {
    match path {
        ["target"] => Some(json!(targets)),
        ["td_error"] => {
            let before = rows(&case.inputs["q_tm1"]);
            let before = before.iter().zip(places(&case.inputs["a_tm1"])).map(|(q, a)| q[a]);
            Some(json!(targets.iter().zip(before).map(|(y, q)| y - q).collect::<Vec<f64>>()))
        }
        _ => None,
    }
}

/// λ-returns, of which those at 0 look one step ahead.
fn targets_ahead(case: &Case, worth: &[f64], lambda: f64) -> Vec<f64> {
    let (rewards, ended) = (numbers(&case.inputs["r_t"]), ends(&case.inputs["done"]));
    let values: Vec<f64> = [0.0].iter().chain(worth).copied().collect();
    let along = Path { rewards: &rewards, values: &values, ends: &ended };
    lambda_returns(&along, number(&case.inputs["gamma"]), lambda)
}

fn of_an_ensemble(case: &Case, path: &[&str]) -> Option<Value> {
    let members = case.inputs["q_t_ensemble"].as_array()?;
    let members: Vec<Vec<f64>> = members.iter().map(|member| rows(member).concat()).collect();
    let n_actions = rows(&case.inputs["q_t_ensemble"][0])[0].len();
    let targets = |ke: &dyn KnowledgeEquivalent| {
        Some(json!(targets_ahead(case, &worth(&members, ke, n_actions), 0.0)))
    };
    let actions = |ke: &dyn KnowledgeEquivalent| {
        let members: Vec<&[f64]> = members.iter().map(Vec::as_slice).collect();
        let values = equivalents(&members, ke);
        Some(json!(values.chunks(n_actions).map(argmax).collect::<Vec<_>>()))
    };
    match path {
        ["averaged_dqn"] => targets(&Ma {}),
        ["min_ensemble"] => targets(&Wcm {}),
        ["max_ensemble"] => targets(&Bcm {}),
        ["explore_action"] => actions(&Bcm {}),
        ["safe_action"] => actions(&Wcm {}),
        _ => None,
    }
}

/// Every visit counts.
fn by_monte_carlo(case: &Case, path: &[&str]) -> Option<Value> {
    let discount = number(&case.inputs["gamma"]);
    let rewards = rows(&case.inputs["rewards_received_after"]);
    let returns: Vec<Vec<f64>> = rewards
        .iter()
        .map(|rewards| {
            let values = vec![0.0; rewards.len() + 1];
            lambda_returns(&Path { rewards, values: &values, ends: &[] }, discount, 1.0)
        })
        .collect();
    match path {
        ["returns"] => Some(json!(returns)),
        ["v"] => {
            let states = rows(&case.inputs["states"]).concat();
            let value = |s: usize| {
                let visits = states.iter().zip(returns.concat()).filter(|(at, _)| **at == real(s));
                mean(&visits.map(|(_, g)| g).collect::<Vec<_>>())
            };
            Some(json!((0..3).map(value).collect::<Vec<_>>()))
        }
        _ => None,
    }
}

fn off_policy(case: &Case, path: &[&str]) -> Option<Value> {
    let inputs = &case.inputs;
    let (next, policy, actions) =
        (rows(&inputs["q_t"]), rows(&inputs["pi_t"]), places(&inputs["a_t"]));
    let values = next.iter().zip(&policy).map(|(q, pi)| ExpectedSarsa {}.value(q, pi, 0));
    let taken = next.iter().zip(&actions).map(|(q, a)| q[*a]);
    let ratios = policy.iter().zip(&actions).zip(numbers(&inputs["mu_t_of_a_t"]));
    let ahead = Ahead {
        rewards: &numbers(&inputs["r_t"]),
        ends: &ends(&inputs["done"]),
        values: &values.collect::<Vec<f64>>(),
        taken: &taken.collect::<Vec<f64>>(),
        ratios: &ratios.map(|((pi, a), mu)| pi[*a] / mu).collect::<Vec<f64>>(),
    };
    let targets = retrace(&ahead, number(&inputs["gamma"]), number(&inputs["lam"]));
    beside_values(case, path, &targets)
}

fn v_traced(case: &Case, path: &[&str]) -> Option<Value> {
    let inputs = &case.inputs;
    let (rewards, values) = (numbers(&inputs["r"]), numbers(&inputs["v"]));
    let along = Path { rewards: &rewards, values: &values, ends: &ends(&inputs["done"]) };
    let by = VTrace {
        discount: number(&inputs["gamma"]),
        lambda: number(&inputs["lam"]),
        clip: number(&inputs["clip_rho"]),
        advantage_clip: number(&inputs["clip_pg_rho"]),
    };
    let traced = v_trace(&along, &numbers(&inputs["rho"]), &by);
    match path {
        ["errors"] => Some(json!(traced.errors)),
        ["pg_advantage"] => Some(json!(traced.advantages)),
        ["q_estimate"] => Some(json!(traced.action_values)),
        _ => None,
    }
}

fn rescaled(case: &Case, path: &[&str]) -> Option<Value> {
    let eps = number(&case.inputs["eps"]);
    let scaled: Vec<f64> =
        numbers(&case.inputs["x"]).iter().map(|x| signed_hyperbolic(*x, eps)).collect();
    match path {
        ["h"] => Some(json!(scaled)),
        ["h_inv_of_h"] => {
            Some(json!(scaled.iter().map(|y| signed_parabolic(*y, eps)).collect::<Vec<_>>()))
        }
        _ => None,
    }
}

/// rlax adds `1e-5` to what it divides the distance to the upper bin by, so that its distributions miss
/// their numbers a little. Ours do not, and are brought to theirs here.
pub(crate) fn two_hot_as_rlax(bins: Bins, x: f64) -> Vec<f64> {
    let width = (bins.high - bins.low) / real(bins.n - 1);
    let mut probs = bins.two_hot(x);
    let lower = probs.iter().position(|p| *p > 0.0).expect("somewhere");
    if probs[lower] < 1.0 {
        probs[lower] *= width / (width + 1e-5);
        probs[lower + 1] = 1.0 - probs[lower];
    }
    probs
}

fn in_bins(case: &Case, path: &[&str]) -> Option<Value> {
    let inputs = &case.inputs;
    let (low, high) = (number(&inputs["min"]), number(&inputs["max"]));
    let n = place(number(&inputs["num_bins"]));
    let bins = Bins { low, high, n };
    let probs: Vec<Vec<f64>> =
        numbers(&inputs["scalars"]).iter().map(|x| two_hot_as_rlax(bins, *x)).collect();
    match path {
        ["probs"] => Some(json!(probs)),
        ["decoded"] => Some(json!(probs.iter().map(|p| bins.mean(p)).collect::<Vec<f64>>())),
        _ => None,
    }
}
