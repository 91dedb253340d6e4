//! Generalised policy improvement: the best action by the best of several policies (Theorem 4.1).

use super::preferred;

/// What was selected in a state, and what it is thought to be worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Selected {
    /// The action.
    pub action: usize,
    /// The policy that is worth most after it.
    pub policy: usize,
    /// How much.
    pub value: f64,
}

/// The action that is worth most by the policy that is worth most after it, where what several members of an ensemble say
/// of each is reduced to one number (Eqn. 4.23).
///
/// ```text
/// argmax_a max_k KE_m q_m^k(s, a)
/// ```
///
/// With the minimum for `reduce` it is the rule of the thesis, pessimistic where members disagree; with one member, plain
/// generalised policy improvement (Eqns. 4.13, 4.15). All policies count alike, so that the agent's own, which the thesis
/// has as the policy 0, must be among them. Of equal actions the first is selected, and of policies that are equal after
/// it the first: the least pair `(a, k)` in the order of words. A value that is not a number is below all others.
///
/// - `values`: `[K, M, A]`, of one state.
/// - `reduce`: of `[M]` values to one, such as a knowledge equivalent.
///
/// # Panics
/// If there is no policy, no member or no action, or there are not as many values.
#[must_use]
pub fn select_action(
    values: &[f64],
    (n_policies, n_members): (usize, usize),
    mut reduce: impl FnMut(&[f64]) -> f64,
) -> Selected {
    assert!(n_policies > 0 && n_members > 0, "there is a policy and a member");
    let n_actions = values.len() / (n_policies * n_members);
    assert!(n_actions > 0, "there is an action");
    assert_eq!(values.len(), n_policies * n_members * n_actions, "one value of each");
    let mut said = vec![0.0; n_members];
    let mut selected = None;
    for action in 0..n_actions {
        for policy in 0..n_policies {
            for (m, said) in said.iter_mut().enumerate() {
                *said = values[(policy * n_members + m) * n_actions + action];
            }
            let value = reduce(&said);
            let is_better =
                |best: &Selected| value > best.value || best.value.is_nan() && !value.is_nan();
            if selected.as_ref().is_none_or(is_better) {
                selected = Some(Selected { action, policy, value });
            }
        }
    }
    selected.expect("there is an action and a policy")
}

/// What generalised policy improvement selects in each state, by successor features of several policies (Eqn. 4.15):
/// `[S]`. Ties as for [`select_action`].
///
/// - `features`: of each policy `[S, A, d]`.
/// - `w`: `[d]`.
///
/// # Panics
/// If there is no policy, or the numbers do not go together.
#[must_use]
pub fn improved_policy(features: &[Vec<f64>], w: &[f64], n_actions: usize) -> Vec<Selected> {
    let values: Vec<Vec<f64>> = features.iter().map(|psi| preferred(psi, w)).collect();
    assert!(!values.is_empty(), "there is a policy");
    let n_states = values[0].len() / n_actions;
    assert!(values.iter().all(|q| q.len() == n_states * n_actions), "one value a pair");
    let row = |s: usize| -> Vec<f64> {
        values.iter().flat_map(|q| &q[s * n_actions..][..n_actions]).copied().collect()
    };
    (0..n_states).map(|s| select_action(&row(s), (values.len(), 1), |said| said[0])).collect()
}

/// The policy that is certain of one action in each state: `[S, A]`.
///
/// # Panics
/// If there is no such action.
#[must_use]
pub fn certain_policy(actions: &[usize], n_actions: usize) -> Vec<f64> {
    assert!(actions.iter().all(|a| *a < n_actions), "there is no such action");
    let mut policy = vec![0.0; actions.len() * n_actions];
    policy.chunks_mut(n_actions).zip(actions).for_each(|(row, action)| row[*action] = 1.0);
    policy
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Coins, Random, TASKS, apart, best, values};
    use super::super::{Process, successor_features};
    use super::*;
    use crate::order::{max, min};
    use crate::policy::greedy;

    #[test]
    fn of_equals_the_first_action_and_then_the_first_policy() {
        let of = |values: &[f64]| {
            let selected = select_action(values, (2, 1), |said| said[0]);
            (selected.action, selected.policy)
        };
        assert_eq!(of(&[1.0, 3.0, 3.0, 2.0]), (0, 1));
        assert_eq!(of(&[1.0, 3.0, 1.0, 3.0]), (1, 0));
        assert_eq!(of(&[f64::NAN, 3.0, f64::NAN, 4.0]), (1, 1));
        assert_eq!(of(&[f64::NAN; 4]), (0, 0));
    }

    #[test]
    fn members_are_reduced_before_policies_and_actions_compete() {
        // Two policies, two members, two actions.
        let values = [9.0, 1.0, 0.0, 2.0, 1.5, 0.0, 3.0, 8.0];
        let selected = |reduce: fn(&[f64]) -> f64| select_action(&values, (2, 2), reduce);
        // Lowest of members: 0 and 1 of the first policy, 1.5 and 0 of the second.
        assert_eq!(selected(min), Selected { action: 0, policy: 1, value: 1.5 });
        assert_eq!(selected(max), Selected { action: 0, policy: 0, value: 9.0 });
        // 4.5, 1.5, 2.25 and 4.
        let mean = |said: &[f64]| said.iter().sum::<f64>() / 2.0;
        assert_eq!(selected(mean), Selected { action: 0, policy: 0, value: 4.5 });
        assert_eq!(selected(|said| said[1]), Selected { action: 1, policy: 1, value: 8.0 });
    }

    /// Example 4.3: for a task in which every colour costs 1, each of three policies that seek one is bad, and together
    /// they avoid all.
    #[test]
    fn policies_that_seek_colours_avoid_them_together() {
        let coins = Coins::new();
        let (process, features) = (coins.process(), coins.features(0.9));
        let w = [-1.0, -1.0, -1.0];
        let reward = preferred(process.cumulants, &w);
        let selected = improved_policy(&features, &w, 4);
        let actions: Vec<usize> = selected.iter().map(|s| s.action).collect();
        let improved = values(&process, &reward, &certain_policy(&actions, 4), 0.9);
        let (optimal, _) = best(&process, &reward, 0.9);
        // Entering a coin costs 1, and all else nothing.
        assert_eq!(improved, reward_outside(&process, &reward));
        assert_eq!(improved, optimal);
        for (features, w_k) in features.iter().zip(&TASKS) {
            // From the cell in the middle each reaches the coin that it seeks with its second action.
            let (own, q) = (preferred(features, w_k), preferred(features, &w));
            let action = greedy(&own[4 * 4..][..4]);
            assert!((q[4 * 4 + action] + 0.9).abs() < 1e-15);
        }
        // In the middle of the upper row, right is the green coin. To the left the first two policies end their way with
        // the third action, and the third, which seeks the yellow coin, with the fifth.
        let Selected { action, policy, value } = selected[1];
        assert_eq!((action, policy), (2, 2));
        assert!((value + 0.9_f64.powi(4)).abs() < 1e-15);
    }

    fn reward_outside(process: &Process<'_>, reward: &[f64]) -> Vec<f64> {
        let ended = process.terminal.iter().flat_map(|end| [*end; 4]);
        ended.zip(reward).map(|(end, r)| if end { 0.0 } else { *r }).collect()
    }

    /// In how many of 1 000 random processes the policy that `pick` makes of the values of three policies is somewhere
    /// worse than one of them, and in how many somewhere better than all.
    fn worse_and_better(pick: impl Fn(&[Vec<f64>], &[f64]) -> Vec<usize>) -> (usize, usize) {
        let (mut worse, mut better) = (0, 0);
        for i in 0..1000 {
            let mut random = Random::of(i);
            let tasks: Vec<Vec<f64>> = (0..3).map(|_| random.numbers(3, 1.0)).collect();
            let w = random.numbers(3, 1.0);
            let process = random.process();
            let features = tasks.iter().map(|task| {
                let (_, policy) = best(&process, &preferred(process.cumulants, task), 0.9);
                successor_features(&process, &policy, 0.9).unwrap()
            });
            let features: Vec<Vec<f64>> = features.collect();
            let policy = certain_policy(&pick(&features, &w), 3);
            let reward = preferred(process.cumulants, &w);
            let improved = values(&process, &reward, &policy, 0.9);
            let of_each: Vec<Vec<f64>> = features.iter().map(|psi| preferred(psi, &w)).collect();
            let highest = (0..improved.len()).map(|pair| max(&[0, 1, 2].map(|k| of_each[k][pair])));
            let highest: Vec<f64> = highest.collect();
            let differences = || improved.iter().zip(&highest).map(|(q, high)| q - high);
            worse += usize::from(differences().any(|d| d < -1e-9));
            better += usize::from(differences().any(|d| d > 1e-9));
            let (optimal, _) = best(&process, &reward, 0.9);
            assert!(improved.iter().zip(&optimal).all(|(q, best)| *q <= best + 1e-9));
        }
        (worse, better)
    }

    /// Theorem 4.1, and Lemma 4.1.
    #[test]
    fn improvement_dominates_every_policy() {
        let actions = |selected: Vec<Selected>| selected.iter().map(|s| s.action).collect();
        let (worse, better) = worse_and_better(|psi, w| actions(improved_policy(psi, w, 3)));
        assert_eq!(worse, 0);
        assert!(better > 500, "strictly better in {better}");
        // The worst policy after each action, and the best action of the first alone, dominate nothing.
        let by_worst = |psi: &[Vec<f64>], w: &[f64]| -> Vec<usize> {
            let q: Vec<Vec<f64>> = psi.iter().map(|psi| preferred(psi, w)).collect();
            let low = |pair: usize| min(&[0, 1, 2].map(|k| q[k][pair]));
            let row = |s: usize| greedy(&[0, 1, 2].map(|a| low(s * 3 + a)));
            (0..5).map(row).collect()
        };
        assert!(worse_and_better(by_worst).0 > 100);
        assert!(worse_and_better(|psi, w| actions(improved_policy(&psi[..1], w, 3))).0 > 100);
    }

    #[test]
    fn one_policy_is_improved_as_in_policy_iteration() {
        for i in 0..50 {
            let mut random = Random::of(i);
            let w = random.numbers(3, 1.0);
            let process = random.process();
            let reward = preferred(process.cumulants, &w);
            let (optimal, policy) = best(&process, &reward, 0.9);
            let features = successor_features(&process, &policy, 0.9).unwrap();
            let selected = improved_policy(&[features], &w, 3);
            let actions: Vec<usize> = selected.iter().map(|s| s.action).collect();
            assert_eq!(certain_policy(&actions, 3), policy);
            let found: Vec<f64> = selected.iter().map(|s| s.value).collect();
            let highest: Vec<f64> = optimal.chunks(3).map(max).collect();
            assert!(apart(&found, &highest) < 1e-10);
        }
    }
}
