//! Values of known environments.

use ivx_library::env::{Chain, Env as _};
use ivx_library::math::bellman::{backup, highest_values};
use ivx_library::math::order::argmax;
use serde_json::{Value, json};

use crate::harness::{Case, check_kind, numbers};

/// Example 2.6: the environment is ours too, and so are its transitions and rewards.
#[test]
fn golden_bellman_mpv_ive() {
    check_kind("bellman_mpv_ive", "value_iteration", values);
}

fn values(case: &Case, path: &[&str]) -> Option<Value> {
    let mdp = Chain { cells: 4, slip: 0.1, goal: true }.mdp().ok()?;
    let close = |ours: &[f64], theirs: Vec<f64>| {
        assert!(
            ours.len() == theirs.len()
                && ours.iter().zip(theirs).all(|(a, b)| (a - b).abs() < 1e-15)
        );
    };
    close(&mdp.transitions, flat(&case.inputs["P"]));
    close(&mdp.rewards, flat(&case.inputs["R"]));
    assert_eq!(
        json!(mdp.terminal.iter().map(|end| f64::from(u8::from(*end))).collect::<Vec<_>>()),
        case.inputs["terminal"]
    );

    let discount = case.inputs["gamma"].as_f64()?;
    let mut v = vec![0.0; 4];
    let mut sweeps = Vec::new();
    for _ in 0..4 {
        v = highest_values(&mdp.model(), &backup(&mdp.model(), discount, &v));
        sweeps.push(v.clone());
    }
    let q = backup(&mdp.model(), discount, &v);
    match path {
        ["v_after_each_of_first_4_sweeps"] => Some(json!(sweeps)),
        ["v_star"] => Some(json!(v)),
        ["q_star"] => Some(json!(q.chunks(2).collect::<Vec<_>>())),
        ["pi_star_nonterminal"] => Some(json!(q.chunks(2).take(3).map(argmax).collect::<Vec<_>>())),
        _ => None,
    }
}

/// The numbers of lists in lists, in order.
fn flat(value: &Value) -> Vec<f64> {
    match value.as_array() {
        Some(items) if items.iter().all(Value::is_number) => numbers(value),
        Some(items) => items.iter().flat_map(flat).collect(),
        None => Vec::new(),
    }
}
