//! Bellman's operators on finite state spaces (Definitions 2.1 to 2.4).
//!
//! They are induced by a model: the true environment, or one that was learned of it.

use super::order::max;

/// What follows an action in a state, and what it pays.
#[derive(Clone, Copy, Debug)]
pub struct Model<'a> {
    /// `p(s' | s, a)`: `[S, A, S]`.
    pub transitions: &'a [f64],
    /// The expected reward of each action in each state: `[S, A]`.
    pub rewards: &'a [f64],
    /// Which states end an episode, so that they are worth 0: `[S]`.
    pub terminal: &'a [bool],
}

impl<'a> Model<'a> {
    /// How many states there are.
    #[must_use]
    pub fn n_states(&self) -> usize {
        self.terminal.len()
    }

    /// How many actions there are.
    #[must_use]
    pub fn n_actions(&self) -> usize {
        self.rewards.len() / self.n_states()
    }

    /// How probably each state follows: `[S]`.
    #[must_use]
    pub fn next(&self, state: usize, action: usize) -> &'a [f64] {
        let n = self.n_states();
        &self.transitions[(state * self.n_actions() + action) * n..][..n]
    }

    /// The reward of an action.
    #[must_use]
    pub fn reward(&self, state: usize, action: usize) -> f64 {
        self.rewards[state * self.n_actions() + action]
    }
}

/// What each action is worth if the states that follow are worth `values`; a terminal state is worth 0.
///
/// ```text
/// q(s, a) = r(s, a) + γ Σ_s' p(s' | s, a) v(s')
/// ```
///
/// # Panics
/// If there is not one value a state.
#[must_use]
pub fn backup(model: &Model<'_>, discount: f64, values: &[f64]) -> Vec<f64> {
    assert_eq!(values.len(), model.n_states(), "one value a state");
    let worth = values.iter().zip(model.terminal).map(|(v, end)| if *end { 0.0 } else { *v });
    let worth: Vec<f64> = worth.collect();
    let follow = model.transitions.chunks(model.n_states()).zip(model.rewards).zip(0..);
    let q = follow.map(|((next, reward), pair): (_, usize)| {
        if model.terminal[pair / model.n_actions()] {
            return 0.0;
        }
        reward + discount * next.iter().zip(&worth).map(|(p, v)| p * v).sum::<f64>()
    });
    q.collect()
}

/// What each state is worth by its best action: `[S]`.
///
/// - `q`: `[S, A]`.
#[must_use]
pub fn highest_values(model: &Model<'_>, q: &[f64]) -> Vec<f64> {
    q.chunks(model.n_actions()).map(max).collect()
}

/// What each state is worth under a policy (Eqn. 2.32c): `[S]`.
///
/// - `policy`, `q`: `[S, A]`.
#[must_use]
pub fn expected_values(model: &Model<'_>, policy: &[f64], q: &[f64]) -> Vec<f64> {
    let rows = q.chunks(model.n_actions()).zip(policy.chunks(model.n_actions()));
    rows.map(|(q, policy)| q.iter().zip(policy).map(|(q, p)| q * p).sum()).collect()
}

/// Bellman's evaluation operator on values of states (Eqns. 2.58, 2.63): `[S]`.
///
/// ```text
/// T^π v(s) = E_π,m[R_1 + γ v(S_1) | S_0 = s]
/// ```
///
/// # Panics
/// If there is not one value a state.
#[must_use]
pub fn evaluation(model: &Model<'_>, policy: &[f64], discount: f64, values: &[f64]) -> Vec<f64> {
    expected_values(model, policy, &backup(model, discount, values))
}

/// Bellman's optimality operator on values of states (Eqns. 2.61, 2.64): `[S]`.
///
/// ```text
/// T^* v(s) = max_a E_m[R_1 + γ v(S_1) | S_0 = s, A_0 = a]
/// ```
///
/// # Panics
/// If there is not one value a state.
#[must_use]
pub fn optimality(model: &Model<'_>, discount: f64, values: &[f64]) -> Vec<f64> {
    highest_values(model, &backup(model, discount, values))
}

/// The values that an operator leaves as they are (Eqns. 2.60, 2.62), from 0 on; `None` if `most` sweeps
/// do not settle them.
///
/// They are settled if none moves by more than `tolerance`, relative to the largest (or to 1 if that is
/// smaller).
#[must_use]
pub fn fixed_point(
    operator: impl Fn(&[f64]) -> Vec<f64>,
    n: usize,
    tolerance: f64,
    most: usize,
) -> Option<Vec<f64>> {
    let mut values = vec![0.0; n];
    for _ in 0..most {
        let next = operator(&values);
        let apart = values.iter().zip(&next).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let largest = next.iter().map(|v| v.abs()).fold(1.0, f64::max);
        values = next;
        if apart <= tolerance * largest {
            return Some(values);
        }
    }
    None
}

#[cfg(test)]
pub(crate) mod tests {
    use nalgebra::{DMatrix, DVector};
    use rand::RngExt as _;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::policy::greedy;

    /// A model that owns its numbers, of five states and three actions.
    pub(crate) struct Random {
        transitions: Vec<f64>,
        rewards: Vec<f64>,
        pub(crate) policy: Vec<f64>,
        /// Values of states that have nothing to do with it.
        pub(crate) values: Vec<f64>,
    }

    impl Random {
        pub(crate) fn of(i: u64) -> Self {
            let mut rng = ivx_op::Ctx::new("", 0, None).rng("model", &[&i.to_string()]);
            Self {
                transitions: (0..15).flat_map(|_| distribution(5, &mut rng)).collect(),
                rewards: (0..15).map(|_| rng.random::<f64>() - 0.5).collect(),
                policy: (0..5).flat_map(|_| distribution(3, &mut rng)).collect(),
                values: (0..5).map(|_| rng.random::<f64>() * 4.0 - 2.0).collect(),
            }
        }

        pub(crate) fn model(&self) -> Model<'_> {
            Model { transitions: &self.transitions, rewards: &self.rewards, terminal: &[false; 5] }
        }

        /// Of the policy, by `(I - γ P^π) v = r^π`.
        pub(crate) fn solved(&self, discount: f64) -> Vec<f64> {
            let model = self.model();
            let entry = |s: usize, to: usize| {
                let follow = (0..3).map(|a| self.policy[s * 3 + a] * model.next(s, a)[to]);
                f64::from(u8::from(s == to)) - discount * follow.sum::<f64>()
            };
            let rewards = expected_values(&model, &self.policy, &self.rewards);
            let system = DMatrix::from_fn(5, 5, entry).lu();
            let v = system.solve(&DVector::from_vec(rewards)).expect("a contraction has one");
            v.iter().copied().collect()
        }
    }

    fn distribution(n: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let row: Vec<f64> = (0..n).map(|_| rng.random::<f64>().powi(3)).collect();
        let total: f64 = row.iter().sum();
        row.iter().map(|p| p / total).collect()
    }

    pub(crate) fn apart(a: &[f64], b: &[f64]) -> f64 {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn by_hand() {
        // Two states, in the second of which an episode ends; the second action pays 3 and goes there.
        let transitions = [0.5, 0.5, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0];
        let rewards = [1.0, 3.0, 9.0, 9.0];
        let model =
            Model { transitions: &transitions, rewards: &rewards, terminal: &[false, true] };
        assert_eq!(backup(&model, 0.5, &[8.0, 7.0]), [3.0, 3.0, 0.0, 0.0]);
        assert_eq!(optimality(&model, 0.5, &[4.0, 7.0]), [3.0, 0.0]);
        // ¼ (1 + ½·½·4) + ¾·3.
        assert_eq!(evaluation(&model, &[0.25, 0.75, 0.5, 0.5], 0.5, &[4.0, 7.0]), [2.75, 0.0]);
        assert_eq!((model.next(0, 1), model.reward(0, 1)), (&[0.0, 1.0][..], 3.0));
    }

    #[test]
    fn evaluation_ends_at_the_solution_of_the_linear_system() {
        for i in 0..50 {
            let random = Random::of(i);
            let operator = |v: &[f64]| evaluation(&random.model(), &random.policy, 0.9, v);
            let found = fixed_point(operator, 5, 1e-13, 1000).unwrap();
            assert!(apart(&found, &random.solved(0.9)) < 1e-10);
        }
    }

    #[test]
    fn optimality_ends_at_the_best_of_all_policies() {
        for i in 0..10 {
            let random = Random::of(i);
            let best =
                fixed_point(|v| optimality(&random.model(), 0.9, v), 5, 1e-13, 1000).unwrap();
            // Every one of the 3^5 policies that are certain.
            let mut highest = vec![f64::NEG_INFINITY; 5];
            for code in 0..3_usize.pow(5) {
                let (mut policy, mut code) = (vec![0.0; 15], code);
                for row in policy.chunks_mut(3) {
                    row[code % 3] = 1.0;
                    code /= 3;
                }
                let v = Random { policy, ..Random::of(i) }.solved(0.9);
                highest.iter_mut().zip(v).for_each(|(high, v)| *high = high.max(v));
            }
            assert!(apart(&best, &highest) < 1e-10);
        }
    }

    #[test]
    fn operators_contract_by_the_discount() {
        for i in 0..50 {
            let (random, other) = (Random::of(i), Random::of(i + 1000).values);
            let model = random.model();
            let before = 0.8 * apart(&random.values, &other) + 1e-15;
            let optimal = |v: &[f64]| optimality(&model, 0.8, v);
            let evaluated = |v: &[f64]| evaluation(&model, &random.policy, 0.8, v);
            let moved = apart(&optimal(&random.values), &optimal(&other));
            assert!(moved > 0.0 && moved <= before);
            assert!(apart(&evaluated(&random.values), &evaluated(&other)) <= before);
        }
    }

    #[test]
    fn acting_greedily_on_values_is_no_worse() {
        for i in 0..50 {
            let random = Random::of(i);
            let before = random.solved(0.9);
            let mut policy = vec![0.0; 15];
            for (s, q) in backup(&random.model(), 0.9, &before).chunks(3).enumerate() {
                policy[s * 3 + greedy(q)] = 1.0;
            }
            let after = Random { policy, ..random }.solved(0.9);
            assert!(before.iter().zip(&after).all(|(b, a)| *a >= b - 1e-12), "Eqn. 2.33b");
            assert!(apart(&before, &after) > 0.01);
        }
    }

    /// `v̄` of a lookahead of `k` steps from `v̂` (Eqn. 2.65).
    fn ahead(random: &Random, discount: f64, k: usize) -> Vec<f64> {
        let step = |v: Vec<f64>, _| evaluation(&random.model(), &random.policy, discount, &v);
        (0..k).fold(random.values.clone(), step)
    }

    #[test]
    fn planning_in_the_true_model_improves_estimates_of_values() {
        // Desideratum (a) of Eqn. 2.56 in the largest norm, where each step takes a share of the discount.
        let mut wrong = [0; 2];
        for i in 0..100 {
            let mut random = Random::of(i);
            let truth = random.solved(0.9);
            let before = apart(&random.values, &truth);
            for k in 1..6 {
                let after = apart(&ahead(&random, 0.9, k), &truth);
                assert!(
                    after <= 0.9_f64.powi(k.try_into().unwrap()) * before + 1e-12,
                    "{i} by {k}"
                );
            }
            // From estimates that are nearly right, forgetting the discount or planning in another model leads away.
            random.values = truth.iter().map(|v| v + 1e-3).collect();
            let led_away = |by: &Random, discount| apart(&ahead(by, discount, 1), &truth) > 1e-3;
            let other = Random { values: random.values.clone(), ..Random::of(i + 1000) };
            wrong[0] += usize::from(led_away(&random, 1.0));
            wrong[1] += usize::from(led_away(&other, 0.9));
        }
        assert!(wrong[0] > 90 && wrong[1] == 100, "{wrong:?}");
    }

    #[test]
    fn planning_in_the_true_model_improves_policies() {
        // Desideratum (b) of Eqn. 2.56: the greedy policy on exact lookahead from what the baseline is worth is nowhere worse.
        let mut wrong = [0; 2];
        for i in 0..100 {
            let random = Random::of(i);
            let before = random.solved(0.9);
            // How much is gained, or lost, where that is least, by who looks ahead in some model and takes `choose`.
            let least = |model: &Random, k: usize, choose: &dyn Fn(&[f64]) -> usize| {
                let step = |v: Vec<f64>, _| optimality(&model.model(), 0.9, &v);
                let values = (1..k).fold(before.clone(), step);
                let mut policy = vec![0.0; 15];
                for (s, q) in backup(&model.model(), 0.9, &values).chunks(3).enumerate() {
                    policy[s * 3 + choose(q)] = 1.0;
                }
                let after = Random { policy, ..Random::of(i) }.solved(0.9);
                let gains = after.iter().zip(&before).map(|(after, before)| after - before);
                gains.fold(f64::INFINITY, f64::min)
            };
            for k in 1..6 {
                assert!(least(&random, k, &greedy) >= -1e-12, "{i} by {k}");
            }
            let worst = |q: &[f64]| greedy(&q.iter().map(|q| -q).collect::<Vec<_>>());
            wrong[0] += usize::from(least(&random, 2, &worst) < 0.0);
            wrong[1] += usize::from(least(&Random::of(i + 1000), 2, &greedy) < 0.0);
        }
        assert!(wrong[0] == 100 && wrong[1] > 50, "{wrong:?}");
    }

    #[test]
    fn values_that_do_not_settle_are_none() {
        assert_eq!(fixed_point(|v| vec![v[0] + 1.0], 1, 1e-13, 100), None);
    }
}
