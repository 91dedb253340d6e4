//! Learning with a number for everything in a square of 5 × 5 cells, and where policies lead in it.

use ivx_library::agent::tabular::loss::{Steps, expected_sarsa_loss, td_errors, transition_loss};
use ivx_math::markov_chain::{hits, induced, occupancy};
use ivx_math::moments::real;
use ivx_math::tabular::{Transition, most_likely, transition_counts};
use ivx_nn::{Graph, Params};
use ivx_world::{Finite as _, Gridworld};
use serde_json::{Value, json};

use crate::harness::{Case, check, number, numbers, rows, text};

const SIZES: (usize, usize) = (25, 4);

#[test]
fn golden_gridworld_tabular() {
    check("gridworld_tabular", |case, path| match case.kind.as_str() {
        "reach_prob" => reached(case, path),
        "tabular_mle" => most_likely_model(case, path),
        "tabular_esarsa" => expected_sarsa(case, path),
        "tabular_model" => model_loss(case, path),
        _ => None,
    });
}

fn place(x: f64) -> usize {
    (0..1000).find(|i| real(*i) == x).expect("a whole number")
}

fn reached(case: &Case, path: &[&str]) -> Option<Value> {
    let inputs = &case.inputs;
    let n = place(number(&inputs["n"]));
    let mdp = Gridworld { size: n, wind: number(&inputs["wind_prob"]) }.mdp().expect("it is one");
    let chain = induced(&mdp.model(), &rows(&inputs["policy"]).concat());
    let ends = (place(number(&inputs["start"])), place(number(&inputs["target"])));
    let at = |curve: Vec<f64>| {
        let steps = numbers(&inputs["l"]).into_iter();
        Some(json!(steps.map(|l| curve[place(l)]).collect::<Vec<f64>>()))
    };
    match path {
        ["occupancy_prob_at_step_l"] => at(occupancy(&chain, ends, 150)),
        ["hit_by_step_l"] => at(hits(&chain, ends, 150)),
        ["P_pi_row_start"] => Some(json!(chain[ends.0 * n * n..][..n * n])),
        _ => None,
    }
}

/// Rows of state, action, perhaps a reward, and the state that followed.
fn transitions(rows: &[Vec<f64>]) -> Vec<Transition> {
    let transition = |row: &Vec<f64>| Transition {
        state: place(row[0]),
        action: place(row[1]),
        reward: if row.len() == 4 { row[2] } else { 0.0 },
        next: place(row[row.len() - 1]),
        ended: false,
    };
    rows.iter().map(transition).collect()
}

fn most_likely_model(case: &Case, path: &[&str]) -> Option<Value> {
    let batch = transitions(&rows(&case.inputs["transitions_s_a_s2"]));
    let counts = transition_counts(SIZES, &batch);
    match path {
        ["total_kept"] => Some(json!(counts.iter().sum::<f64>())),
        ["state_action_counts"] => {
            let n_tried: Vec<f64> = counts.chunks(25).map(|row| row.iter().sum()).collect();
            Some(json!(n_tried.chunks(4).collect::<Vec<_>>()))
        }
        ["p_hat_visited"] => {
            let likely = most_likely(&counts, &vec![0.0; counts.len()], 25);
            let possible = likely.iter().enumerate().filter(|(_, p)| **p > 0.0);
            let entry = |(i, p): (usize, &f64)| json!([i / 100, i / 25 % 4, i % 25, p]);
            Some(Value::Array(possible.map(entry).collect()))
        }
        _ => None,
    }
}

/// The steps as the learners see them.
fn steps(rows: &[Vec<f64>]) -> Steps<f64> {
    let mut steps = Steps::default();
    for row in rows {
        steps.states.push(row[0]);
        steps.actions.push(row[1]);
        steps.pairs.push(row[0] * real(SIZES.1) + row[1]);
        steps.rewards.push(if row.len() == 4 { row[2] } else { 0.0 });
        steps.next.push(row[row.len() - 1]);
        steps.goes_on.push(1.0);
    }
    steps
}

fn expected_sarsa(case: &Case, path: &[&str]) -> Option<Value> {
    let inputs = &case.inputs;
    assert_eq!(text(&inputs["policy"]), "uniform");
    let mut params = Params::default();
    let shape = || vec![SIZES.0, SIZES.1];
    let q = params.add("q".to_owned(), shape(), rows(&inputs["Q"]).concat());
    let policy = params.add_fixed("policy".to_owned(), shape(), vec![0.25; SIZES.0 * SIZES.1]);
    let (graph, steps) = (Graph::new(params), steps(&rows(&inputs["batch_s_a_r_s2"])));
    let discount = number(&inputs["gamma"]);
    let errors = td_errors(&graph, [q, policy], discount, &steps);
    let loss = expected_sarsa_loss(&graph, [q, policy], discount, &steps);
    let (errors, value) = (graph.value(errors), graph.scalar(loss));
    graph.backward(loss);
    let params = graph.params();
    match path {
        ["td"] => Some(json!(errors)),
        ["loss"] => Some(json!(value)),
        ["grad"] => Some(json!(params.grad(q)?.chunks(SIZES.1).collect::<Vec<_>>())),
        _ => None,
    }
}

/// Only the rows of what was tried are told.
fn model_loss(case: &Case, path: &[&str]) -> Option<Value> {
    let row = |key: &str| {
        let (state, action) = key.split_once(',')?;
        Some((state.parse::<usize>().ok()? * 4 + action.parse::<usize>().ok()?) * 25)
    };
    let mut logits = vec![0.0; 25 * 4 * 25];
    for (key, values) in case.inputs["logits_rows"].as_object()? {
        logits[row(key)?..][..25].copy_from_slice(&numbers(values));
    }
    let mut params = Params::default();
    let logits = params.add("logits".to_owned(), vec![25 * 4, 25], logits);
    let graph = Graph::new(params);
    let loss = transition_loss(&graph, logits, &steps(&rows(&case.inputs["batch_s_a_s2"])));
    let value = graph.scalar(loss);
    graph.backward(loss);
    let params = graph.params();
    match path {
        ["nll"] => Some(json!(value)),
        ["grad_rows", key] => Some(json!(params.grad(logits)?[row(key)?..][..25])),
        _ => None,
    }
}
