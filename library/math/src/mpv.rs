//! Model-predicted values, and the implicit and explicit ensembles of values (§5.1 and §5.2).
//!
//! An ensemble is a list of members, each with a value for every state (or for every action in it).

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::bellman::{Model, backup, evaluation};
use super::policy::pick;
use super::returns::Path;

/// The implicit ensemble of values (Eqn. 5.5): the model-predicted values over 0 to `n` steps (Eqn. 5.1), each
/// the operator of the one before.
///
/// ```text
/// v^0 = v,  v^k = T v^{k-1}
/// ```
///
/// The operator is one that the model induces: the evaluation of a policy, or optimality (Eqn. C.3).
///
/// - `values`: `[S]`; the ensemble is `[n + 1][S]`.
#[must_use]
pub fn implicit_ensemble(
    operator: impl Fn(&[f64]) -> Vec<f64>,
    values: &[f64],
    n: usize,
) -> Vec<Vec<f64>> {
    std::iter::successors(Some(values.to_vec()), |v| Some(operator(v))).take(n + 1).collect()
}

/// The same of action values: an action is taken first, and then the operator goes on (Eqn. C.4a).
///
/// ```text
/// q^k(s, a) = r(s, a) + γ Σ_s' p(s' | s, a) v^{k-1}(s')
/// ```
///
/// There is none over 0 steps.
///
/// - `implicit`: `[n + 1][S]`, of the values of states; the ensemble is `[n][S * A]`, over 1 to `n` steps.
#[must_use]
pub fn implicit_action_ensemble(
    model: &Model<'_>,
    discount: f64,
    implicit: &[Vec<f64>],
) -> Vec<Vec<f64>> {
    let before = implicit.iter().take(implicit.len().saturating_sub(1));
    before.map(|v| backup(model, discount, v)).collect()
}

/// The explicit ensemble of models (Eqn. 5.4): what each predicts over one step with the same values.
///
/// - `values`: `[S]`; the ensemble is `[N][S]`.
#[must_use]
pub fn explicit_model_ensemble(
    models: &[Model<'_>],
    policy: &[f64],
    discount: f64,
    values: &[f64],
) -> Vec<Vec<f64>> {
    models.iter().map(|model| evaluation(model, policy, discount, values)).collect()
}

/// The implicit ensemble where a path of `N` steps starts, by that path alone (Eqns. 5.2, 5.6): `[N + 1]`.
///
/// ```text
/// v̂^k = Σ_{i<k} γ^i r^{i+1} + γ^k v(s^k)
/// ```
///
/// # Panics
/// If the numbers of rewards and values do not go together.
#[must_use]
pub fn along(path: &Path<'_>, discount: f64) -> Vec<f64> {
    assert_eq!(path.values.len(), path.rewards.len() + 1, "a value more than rewards");
    let (mut sum, mut weight) = (0.0, 1.0);
    let mut members = vec![path.values[0]];
    for (t, reward) in path.rewards.iter().enumerate() {
        sum += weight * reward;
        weight *= if path.ends.get(t).is_some_and(|end| *end) { 0.0 } else { discount };
        members.push(sum + weight * path.values[t + 1]);
    }
    members
}

/// What a policy does in a model from a state on.
#[derive(Clone, Copy, Debug)]
pub struct Rollout<'a> {
    /// Where it happens.
    pub model: Model<'a>,
    /// The probability of each action in each state: `[S, A]`.
    pub policy: &'a [f64],
    /// What each state is thought to be worth: `[S]`.
    pub values: &'a [f64],
    /// What a reward one step later is worth.
    pub discount: f64,
    /// Where it starts.
    pub state: usize,
    /// What is done first (Eqn. C.4b), if not by the policy.
    pub action: Option<usize>,
}

/// A draw of the implicit ensemble of a state by one rollout for all members (Eqn. 5.6): `[n + 1]`.
///
/// # Panics
/// If a state has no action or an action no state that may follow.
#[must_use]
pub fn one_rollout(from: &Rollout<'_>, n: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let n_actions = from.model.n_actions();
    let worth = |s: usize| if from.model.terminal[s] { 0.0 } else { from.values[s] };
    let (mut state, mut first) = (from.state, from.action);
    let (mut rewards, mut values) = (vec![], vec![from.values[state]]);
    for _ in 0..n {
        let act = &from.policy[state * n_actions..][..n_actions];
        let action = first.take().unwrap_or_else(|| pick(act, rng.random()));
        let ended = from.model.terminal[state];
        rewards.push(if ended { 0.0 } else { from.model.reward(state, action) });
        state = pick(from.model.next(state, action), rng.random());
        values.push(if ended { 0.0 } else { worth(state) });
    }
    along(&Path { rewards: &rewards, values: &values, ends: &[] }, from.discount)
}

/// A draw of the implicit ensemble of a state by a rollout for each member, none of which knows of the
/// others: `[n + 1]`.
///
/// # Panics
/// If a state has no action or an action no state that may follow.
#[must_use]
pub fn independent_rollouts(from: &Rollout<'_>, n: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    (0..=n).map(|k| one_rollout(from, k, rng)[k]).collect()
}

/// One number for each place, of what all members say there.
///
/// Of an ensemble of values, `mean` makes its `μ` (Eqn. 5.8a) and `std` its `σ` (Eqn. 5.7).
///
/// # Panics
/// If there are no members or they differ in length.
#[must_use]
pub fn across(members: &[impl AsRef<[f64]>], reduce: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let column = |i| members.iter().map(|member| member.as_ref()[i]).collect::<Vec<f64>>();
    (0..members[0].as_ref().len()).map(|i| reduce(&column(i))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::bellman::tests::{Random, apart};
    use super::super::bellman::{expected_values, fixed_point, optimality};
    use super::super::moments::{mean, std};
    use super::super::returns::k_step;
    use super::*;

    const DISCOUNT: f64 = 0.9;

    fn ensemble(random: &Random, values: &[f64], n: usize) -> Vec<Vec<f64>> {
        let operator = |v: &[f64]| evaluation(&random.model(), &random.policy, DISCOUNT, v);
        implicit_ensemble(operator, values, n)
    }

    #[test]
    fn between_the_value_function_and_the_model() {
        for i in 0..20 {
            let random = Random::of(i);
            let implicit = ensemble(&random, &random.values, 300);
            assert_eq!(implicit[0], random.values);
            // After k steps the values count γ^k, and then only the model does (Remark 5.1).
            let other = ensemble(&random, &Random::of(i + 1000).values, 300);
            for (k, weight) in [(1, 0.9), (10, 0.349), (300, 1e-12)] {
                assert!(apart(&implicit[k], &other[k]) <= weight * apart(&implicit[0], &other[0]));
            }
            assert!(apart(&implicit[300], &random.solved(DISCOUNT)) < 1e-10);
        }
    }

    #[test]
    fn values_that_go_with_the_model_agree_with_it() {
        for i in 0..20 {
            let random = Random::of(i);
            let consistent = across(&ensemble(&random, &random.solved(DISCOUNT), 20), std);
            assert!(consistent.iter().all(|sigma| *sigma < 1e-13), "Remark 5.3");
            assert!(across(&ensemble(&random, &random.values, 20), std).iter().all(|s| *s > 0.01));
            let optimal = |v: &[f64]| optimality(&random.model(), DISCOUNT, v);
            let best = fixed_point(optimal, 5, 1e-14, 1000).unwrap();
            assert!(across(&implicit_ensemble(optimal, &best, 20), std).iter().all(|s| *s < 1e-11));
        }
    }

    #[test]
    fn what_the_policy_does_first_changes_nothing() {
        let random = Random::of(0);
        let implicit = ensemble(&random, &random.values, 5);
        let actions = implicit_action_ensemble(&random.model(), DISCOUNT, &implicit);
        assert_eq!(actions.len(), 5);
        for (q, v) in actions.iter().zip(&implicit[1..]) {
            assert!(apart(&expected_values(&random.model(), &random.policy, q), v) < 1e-15);
        }
    }

    #[test]
    fn each_member_is_a_target_over_its_steps() {
        let path = Path { rewards: &[1.0, 0.0, 2.0], values: &[9.0, 9.0, 8.0, 4.0], ends: &[] };
        // 9;  1 + ½·9;  1 + ¼·8;  1 + ¼·2 + ⅛·4.
        assert_eq!(along(&path, 0.5), [9.0, 5.5, 3.0, 2.0]);
        let ended = Path { ends: &[false, true, false], ..path };
        assert_eq!(along(&ended, 0.5), [9.0, 5.5, 1.0, 1.0]);
        for path in [path, ended] {
            (0..4).for_each(|k| assert_eq!(along(&path, 0.5)[k], k_step(&path, 0.5, k)[0]));
        }
    }

    #[test]
    fn rollouts_are_right_on_average() {
        let random = Random::of(3);
        let (n, n_draws) = (4, 40_000);
        let implicit = ensemble(&random, &random.values, n);
        let actions = implicit_action_ensemble(&random.model(), DISCOUNT, &implicit);
        let mut rng = ivx_op::Ctx::new("", 0, None).rng("rollouts", &[]);
        for (state, action) in [(0, None), (3, Some(2))] {
            let (model, values) = (random.model(), &random.values);
            let policy = &random.policy;
            let from = Rollout { model, policy, values, discount: DISCOUNT, state, action };
            let draws: Vec<Vec<f64>> =
                (0..n_draws).map(|_| one_rollout(&from, n, &mut rng)).collect();
            let apart_draws: Vec<Vec<f64>> =
                (0..n_draws).map(|_| independent_rollouts(&from, n, &mut rng)).collect();
            for k in 1..=n {
                let exact = match action {
                    None => implicit[k][state],
                    Some(action) => actions[k - 1][state * 3 + action],
                };
                for draws in [&draws, &apart_draws] {
                    let draws: Vec<f64> = draws.iter().map(|members| members[k]).collect();
                    let error = std(&draws) / 200.0;
                    assert!((mean(&draws) - exact).abs() < 4.0 * error, "{k} steps from {state}");
                }
            }
            // What one rollout shares correlates its members.
            let product = |draws: &[Vec<f64>]| {
                let centred = |k: usize| {
                    let members: Vec<f64> = draws.iter().map(|members| members[k]).collect();
                    let centre = mean(&members);
                    members.into_iter().map(|x| x - centre).collect::<Vec<f64>>()
                };
                let (a, b) = (centred(3), centred(4));
                let both: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a * b).collect();
                mean(&both) / (std(&a) * std(&b))
            };
            assert!(product(&draws) > 0.3 && product(&apart_draws).abs() < 0.03);
        }
    }

    #[test]
    fn nothing_follows_a_terminal_state() {
        let model = Model {
            transitions: &[0.0, 1.0, 0.0, 1.0],
            rewards: &[2.0, 9.0],
            terminal: &[false, true],
        };
        let (policy, values) = (&[1.0, 1.0][..], &[5.0, 7.0][..]);
        let from = Rollout { model, policy, values, discount: 0.5, state: 0, action: None };
        let mut rng = ivx_op::Ctx::new("", 0, None).rng("rollouts", &[]);
        let exact = implicit_ensemble(|v| evaluation(&model, policy, 0.5, v), values, 2);
        assert_eq!(across(&exact, |members| members[2]), [2.0, 0.0]);
        assert_eq!(one_rollout(&from, 2, &mut rng), [5.0, 2.0, 2.0]);
        let ended = Rollout { state: 1, ..from };
        assert_eq!(one_rollout(&ended, 2, &mut rng), [7.0, 0.0, 0.0]);
    }

    #[test]
    fn each_model_predicts_one_step() {
        let (a, b) = (Random::of(0), Random::of(1));
        let members =
            explicit_model_ensemble(&[a.model(), b.model()], &a.policy, DISCOUNT, &a.values);
        assert_eq!(members[0], ensemble(&a, &a.values, 1)[1]);
        assert_eq!(members[1], evaluation(&b.model(), &a.policy, DISCOUNT, &a.values));
    }
}
