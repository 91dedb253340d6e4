//! Values of known environments, and ensembles of values that models predict.

use ivx_library::ke::{KnowledgeEquivalent as _, MeanStd};
use ivx_library::planner::equivalents;
use ivx_math::bellman::{Model, backup, evaluation, fixed_point, highest_values, optimality};
use ivx_math::moments::{mean, real, std, uniform};
use ivx_math::mpv::{
    across, along, explicit_model_ensemble, implicit_action_ensemble, implicit_ensemble,
};
use ivx_math::order::{argmax, rescaled};
use ivx_math::returns::Path;
use ivx_world::{Chain, Finite as _};
use serde_json::{Value, json};

use crate::harness::{Case, check_kind, number, numbers};

/// Example 2.6: the environment is ours too, and so are its transitions and rewards.
#[test]
fn golden_bellman_mpv_ive() {
    check_kind("bellman_mpv_ive", "value_iteration", values);
    check_kind("bellman_mpv_ive", "bellman_ive", implicit);
    check_kind("bellman_mpv_ive", "eve_emve", explicit);
    check_kind("bellman_mpv_ive", "mpv_rollout", by_one_rollout);
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

/// The model and the policy of a case.
struct Tables {
    transitions: Vec<f64>,
    rewards: Vec<f64>,
    policy: Vec<f64>,
    v: Vec<f64>,
    terminal: Vec<bool>,
    discount: f64,
}

impl Tables {
    fn of(case: &Case, transitions: &Value, rewards: &Value) -> Self {
        let v = numbers(&case.inputs["v"]);
        Self {
            transitions: flat(transitions),
            rewards: flat(rewards),
            policy: flat(&case.inputs["pi"]),
            terminal: vec![false; v.len()],
            v,
            discount: number(&case.inputs["gamma"]),
        }
    }

    fn model(&self) -> Model<'_> {
        let Self { transitions, rewards, terminal, .. } = self;
        Model { transitions, rewards, terminal }
    }

    fn evaluated(&self, v: &[f64]) -> Vec<f64> {
        evaluation(&self.model(), &self.policy, self.discount, v)
    }

    fn improved(&self, v: &[f64]) -> Vec<f64> {
        optimality(&self.model(), self.discount, v)
    }
}

fn implicit(case: &Case, path: &[&str]) -> Option<Value> {
    let tables = Tables::of(case, &case.inputs["P"], &case.inputs["R"]);
    let (model, discount) = (tables.model(), tables.discount);
    let n_steps = |steps: f64| (1..100).find(|n| real(*n) == steps);
    let n = n_steps(number(&case.inputs["N"]))?;
    let members = implicit_ensemble(|v| tables.evaluated(v), &tables.v, n);
    let optimal = implicit_ensemble(|v| tables.improved(v), &tables.v, n);
    let of_actions = implicit_action_ensemble(&model, discount, &members);
    let settled = |operator: &dyn Fn(&[f64]) -> Vec<f64>| {
        fixed_point(operator, tables.v.len(), 1e-14, 10_000).expect("a contraction settles")
    };
    let of_policy = || settled(&|v| tables.evaluated(v));
    let best = || settled(&|v| tables.improved(v));
    let by_action = |q: &[f64]| json!(q.chunks(model.n_actions()).collect::<Vec<_>>());
    let actions = |q: &[f64]| json!(q.chunks(model.n_actions()).map(argmax).collect::<Vec<_>>());
    let optimistic = |sign: f64| {
        let members: Vec<&[f64]> = members.iter().map(Vec::as_slice).collect();
        json!(equivalents(&members, &MeanStd { beta: sign * number(&case.inputs["beta"]) }))
    };
    let sigma = |members: &[Vec<f64>]| across(members, std);
    Some(match path {
        ["T_pi_v"] => json!(tables.evaluated(&tables.v)),
        ["T_star_v"] => json!(tables.improved(&tables.v)),
        ["k_mpv_0_to_N"] => json!(members),
        ["k_mpv_opt_0_to_N"] => json!(optimal),
        ["v_pi" | "fixed_point"] => json!(of_policy()),
        ["q_pi"] => by_action(&backup(&model, discount, &of_policy())),
        ["v_star"] => json!(best()),
        ["pi_star"] => actions(&backup(&model, discount, &best())),
        ["mu_ive_0_to_N"] => json!(across(&members, mean)),
        ["sigma_ive_0_to_N"] => json!(sigma(&members)),
        ["sigma_ive_1_to_N"] => json!(sigma(&members[1..])),
        ["sigma_ive", steps] => json!(sigma(&members[..=n_steps(steps.parse().ok()?)?])),
        ["normalised_sigma_ive_5"] => json!(rescaled(&sigma(&members[..=5]))),
        ["mu_plus_sigma"] => optimistic(1.0),
        ["mu_minus_sigma"] => optimistic(-1.0),
        ["sigma_ive_opt"] => json!(sigma(&optimal)),
        ["q_k_1_to_N"] => json!(of_actions.iter().map(|q| by_action(q)).collect::<Vec<_>>()),
        ["sigma_ive_q_1_to_N"] => by_action(&sigma(&of_actions)),
        ["mu_ive_q"] => by_action(&across(&of_actions, mean)),
        ["seeking_action"] => actions(&sigma(&of_actions)),
        ["avoiding_action"] => {
            actions(&sigma(&of_actions).iter().map(|s| -s).collect::<Vec<f64>>())
        }
        ["contraction"] => json!(contraction(&tables)),
        _ => return None,
    })
}

/// How far apart evaluation leaves values that are 1 apart everywhere, which is as far as it can.
fn contraction(tables: &Tables) -> f64 {
    let above: Vec<f64> = tables.v.iter().map(|v| v + 1.0).collect();
    let (v, above) = (tables.evaluated(&tables.v), tables.evaluated(&above));
    v.iter().zip(above).map(|(v, above)| above - v).fold(0.0, f64::max)
}

fn explicit(case: &Case, path: &[&str]) -> Option<Value> {
    let values: Vec<Vec<f64>> = case.inputs["v_ensemble"].as_array()?.iter().map(numbers).collect();
    let models = case.inputs["P_ensemble"].as_array()?.iter();
    let models = models.zip(case.inputs["R_ensemble"].as_array()?);
    let models: Vec<Tables> = models.map(|(p, r)| Tables::of(case, p, r)).collect();
    let Tables { policy, v, discount, .. } = models.first()?;
    let models: Vec<Model<'_>> = models.iter().map(Tables::model).collect();
    let predicted = explicit_model_ensemble(&models, policy, *discount, v);
    Some(match path {
        ["sigma_eve"] => json!(across(&values, std)),
        ["mu_eve"] => json!(across(&values, mean)),
        ["emve"] => json!(predicted),
        ["sigma_emve"] => json!(across(&predicted, std)),
        _ => return None,
    })
}

fn by_one_rollout(case: &Case, path: &[&str]) -> Option<Value> {
    let (rewards, values) = (numbers(&case.inputs["r_1_to_N"]), numbers(&case.inputs["v_0_to_N"]));
    let rollout = Path { rewards: &rewards, values: &values, ends: &[] };
    let discount = number(&case.inputs["gamma"]);
    let members = along(&rollout, discount);
    let optimistic = |sign: f64| {
        let beta = sign * number(&case.inputs["beta"]);
        json!(MeanStd { beta }.reduce(&members, &uniform(members.len())))
    };
    Some(match path {
        ["mpv_0_to_N"] => json!(members),
        ["mu"] => json!(mean(&members)),
        ["sigma"] => json!(std(&members)),
        ["u_plus"] => optimistic(1.0),
        ["u_minus"] => optimistic(-1.0),
        ["sigma_k1_to_5"] => json!(std(&members[1..])),
        ["as_printed_C2a_WRONG"] => json!(as_printed(&rollout, discount)),
        _ => return None,
    })
}

/// Eqn. C.2a word for word, which is not Eqn. 5.2: it leaves out the first reward, and one discount of the
/// others.
fn as_printed(rollout: &Path<'_>, discount: f64) -> Vec<f64> {
    let late = Path { rewards: &rollout.rewards[1..], values: &rollout.values[1..], ends: &[] };
    let late = along(&Path { values: &vec![0.0; late.values.len()], ..late }, discount);
    let values = rollout.values[1..].iter().zip(1..);
    late.iter().zip(values).map(|(sum, (v, k))| sum + discount.powi(k) * v).collect()
}
