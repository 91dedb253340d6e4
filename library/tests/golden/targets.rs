//! Targets of values beside those of rlax and by hand.

use ivx_library::agent::{Bootstrap, ExpectedSarsa, QLearning, Sarsa, worth};
use ivx_library::ke::{Bcm, KnowledgeEquivalent, Ma, Wcm};
use ivx_library::math::moments::{mean, real};
use ivx_library::math::order::argmax;
use ivx_library::math::returns::{Path, advantages, advantages_cut, k_step, lambda_returns};
use ivx_library::planner::equivalents;
use serde_json::{Value, json};

use crate::harness::{Case, check_kind, number, numbers, rows};

#[test]
fn golden_value_targets_agree() {
    for kind in ["mc_return", "n_step_returns", "lambda_returns", "gae", "gae_truncation"] {
        check_kind("value_targets", kind, along_a_path);
    }
    for kind in ["q_learning", "sarsa", "expected_sarsa", "double_q"] {
        check_kind("value_targets", kind, one_step);
    }
    check_kind("value_targets", "ensemble_q_target", of_an_ensemble);
    check_kind("value_targets", "mc_value", by_monte_carlo);
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

/// `r + γ v(s')`, and how far it lies above the value of the action taken.
fn one_step(case: &Case, path: &[&str]) -> Option<Value> {
    let inputs = &case.inputs;
    let places = |value: &Value| -> Vec<usize> {
        numbers(value).iter().map(|x| (0..9).find(|i| real(*i) == *x).expect("a place")).collect()
    };
    let next = rows(&inputs[if case.kind == "double_q" { "q_t_value" } else { "q_t" }]);
    let worth: Vec<f64> = match case.kind.as_str() {
        "q_learning" => next.iter().map(|q| QLearning {}.value(q, &[], 0)).collect(),
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
    let targets = one_step_targets(case, &worth);
    match path {
        ["target"] => Some(json!(targets)),
        ["td_error"] => {
            let before = rows(&inputs["q_tm1"]);
            let before = before.iter().zip(places(&inputs["a_tm1"])).map(|(q, a)| q[a]);
            Some(json!(targets.iter().zip(before).map(|(y, q)| y - q).collect::<Vec<f64>>()))
        }
        _ => None,
    }
}

fn one_step_targets(case: &Case, worth: &[f64]) -> Vec<f64> {
    let (rewards, ended) = (numbers(&case.inputs["r_t"]), ends(&case.inputs["done"]));
    let values: Vec<f64> = [0.0].iter().chain(worth).copied().collect();
    let along = Path { rewards: &rewards, values: &values, ends: &ended };
    k_step(&along, number(&case.inputs["gamma"]), 1)
}

fn of_an_ensemble(case: &Case, path: &[&str]) -> Option<Value> {
    let members = case.inputs["q_t_ensemble"].as_array()?;
    let members: Vec<Vec<f64>> = members.iter().map(|member| rows(member).concat()).collect();
    let n_actions = rows(&case.inputs["q_t_ensemble"][0])[0].len();
    let targets = |ke: &dyn KnowledgeEquivalent| {
        Some(json!(one_step_targets(case, &worth(&members, ke, n_actions))))
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
