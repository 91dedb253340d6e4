//! Dynamic programming: values where the environment is known.

use ivx_op::{Array, Ctx, One, Op, OpError, declare};

use crate::env::{Env, Mdp};
use crate::math::order::max;

/// Sweeps end when no value moves by more, relative to the largest (or to 1 if that is smaller).
const TOLERANCE: f64 = 1e-13;
/// So many sweeps that do not end are taken for values that do not exist.
const MOST: usize = 100_000;

declare! {
    /// The optimal value of each action in each state, by iterating Bellman's optimality operator
    /// `q(s, a) ← r(s, a) + γ Σ_s' p(s' | s, a) max_a' q(s', a')` from 0 until nothing moves.
    pub struct ValueIteration = "value_iteration" @ 1 -> Array [state, action] {
        /// The environment.
        r#in: Box<dyn Env>;
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
    }
}

impl Op for ValueIteration {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let mdp = self.r#in.mdp()?;
        let values = fixed_point(&mdp, self.discount, |q| highest_values(&mdp, q))?;
        Ok(Array { dims: mdp.pairs(), values })
    }
}

declare! {
    /// The value of each action in each state if a policy acts from then on (Eqn. 2.31), by iterating
    /// Bellman's evaluation operator from 0 until nothing moves.
    pub struct PolicyValues = "policy_values" @ 1 -> Array [state, action] {
        /// The probability of each action in each state.
        policy: One<Array>;
        /// The environment.
        r#in: Box<dyn Env>;
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
    }
}

impl Op for PolicyValues {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let mdp = self.r#in.mdp()?;
        let policy = mdp.policy(&self.policy)?;
        let values = fixed_point(&mdp, self.discount, |q| expected_values(&mdp, policy, q))?;
        Ok(Array { dims: mdp.pairs(), values })
    }
}

/// The action values that a backup of their own state values leaves as they are.
fn fixed_point(
    mdp: &Mdp,
    discount: f64,
    values: impl Fn(&[f64]) -> Vec<f64>,
) -> Result<Vec<f64>, OpError> {
    let mut q = vec![0.0; mdp.rewards.len()];
    for _ in 0..MOST {
        let next = backup(mdp, discount, &values(&q));
        let apart = q.iter().zip(&next).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let largest = next.iter().map(|q| q.abs()).fold(1.0, f64::max);
        q = next;
        if apart <= TOLERANCE * largest {
            return Ok(q);
        }
    }
    let why = "there may be none where rewards do not end and the discount is 1";
    Err(OpError::Failed(format!("the values did not settle in {MOST} sweeps: {why}")))
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
pub fn backup(mdp: &Mdp, discount: f64, values: &[f64]) -> Vec<f64> {
    assert_eq!(values.len(), mdp.n_states(), "one value a state");
    let worth = values.iter().zip(&mdp.terminal).map(|(v, end)| if *end { 0.0 } else { *v });
    let worth: Vec<f64> = worth.collect();
    let follow = mdp.transitions.chunks(mdp.n_states()).zip(&mdp.rewards).zip(0..);
    let q = follow.map(|((next, reward), pair): (_, usize)| {
        if mdp.terminal[pair / mdp.n_actions()] {
            return 0.0;
        }
        reward + discount * next.iter().zip(&worth).map(|(p, v)| p * v).sum::<f64>()
    });
    q.collect()
}

/// What each state is worth by its best action: `[S]`.
#[must_use]
pub fn highest_values(mdp: &Mdp, q: &[f64]) -> Vec<f64> {
    q.chunks(mdp.n_actions()).map(max).collect()
}

/// What each state is worth under a policy (Eqn. 2.32c): `[S]`.
#[must_use]
pub fn expected_values(mdp: &Mdp, policy: &[f64], q: &[f64]) -> Vec<f64> {
    let rows = q.chunks(mdp.n_actions()).zip(policy.chunks(mdp.n_actions()));
    rows.map(|(q, policy)| q.iter().zip(policy).map(|(q, p)| q * p).sum()).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use rand::RngExt as _;

    use super::super::policy::greedy_policy;
    use super::*;
    use crate::env::{Chain, GoalWorld};

    const CTX: Ctx = Ctx::new("", 0, None);

    /// Five states, the last of them terminal, and three actions.
    pub(in super::super) fn random(i: u64) -> Mdp {
        let mut rng = CTX.rng("mdp", &[&i.to_string()]);
        let (n_states, actions) = (5, vec!["a", "b", "c"]);
        let mut transitions = Vec::new();
        for _ in 0..n_states * actions.len() {
            let row: Vec<f64> = (0..n_states).map(|_| rng.random::<f64>().powi(3)).collect();
            let total: f64 = row.iter().sum();
            transitions.extend(row.iter().map(|p| p / total));
        }
        let rewards =
            (0..n_states * 3).map(|i| if i < 12 { rng.random::<f64>() - 0.5 } else { 0.0 });
        let rewards = rewards.collect();
        let terminal = vec![false, false, false, false, true];
        Mdp { actions, transitions, rewards, terminal, start: vec![0.25, 0.25, 0.25, 0.25, 0.0] }
    }

    fn apart(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn operators_contract_by_the_discount() {
        for i in 0..50 {
            let mdp = random(i);
            let mut rng = CTX.rng("values", &[&i.to_string()]);
            let mut draw =
                || (0..15).map(|_| rng.random::<f64>() * 4.0 - 2.0).collect::<Vec<f64>>();
            let (a, b) = (draw(), draw());
            let policy = vec![1.0 / 3.0; 15];
            let optimal = |q: &[f64]| backup(&mdp, 0.8, &highest_values(&mdp, q));
            let evaluated = |q: &[f64]| backup(&mdp, 0.8, &expected_values(&mdp, &policy, q));
            assert!(apart(&optimal(&a), &optimal(&b)) <= 0.8 * apart(&a, &b) + 1e-15);
            assert!(apart(&evaluated(&a), &evaluated(&b)) <= 0.8 * apart(&a, &b) + 1e-15);
            assert!(apart(&optimal(&a), &optimal(&b)) > 0.0);
        }
    }

    #[test]
    fn acting_greedily_on_values_is_no_worse() {
        for i in 0..50 {
            let mdp = random(i);
            let values = |policy: &[f64]| {
                let q = fixed_point(&mdp, 0.9, |q| expected_values(&mdp, policy, q)).unwrap();
                (expected_values(&mdp, policy, &q), q)
            };
            let (before, q) = values(&[1.0 / 3.0; 15]);
            let (after, _) = values(&greedy_policy(&q, 3, 0.0).unwrap());
            let best = fixed_point(&mdp, 0.9, |q| highest_values(&mdp, q)).unwrap();
            let best = highest_values(&mdp, &best);
            assert!(before.iter().zip(&after).all(|(b, a)| *a >= b - 1e-12), "Eqn. 2.33b");
            assert!(after.iter().zip(&best).all(|(a, b)| *a <= b + 1e-12));
            assert!(apart(&before, &best) > 0.01);
        }
    }

    #[test]
    fn two_steps_by_hand() {
        // From the middle of three cells, evenly: v = ½·1 + ½γ v_0 and v_0 = ½γ v + ½γ v_0, with γ = ½:
        // v_0 = v/3, so v = ½ + v/12 = 6/11.
        let r#in = || Box::new(Chain { cells: 3, slip: 0.0, goal: true });
        let mdp = r#in().mdp().unwrap();
        let policy = One(Array { dims: mdp.pairs(), values: vec![0.5; 6] });
        let q = PolicyValues { policy, r#in: r#in(), discount: 0.5 }.run(&CTX).unwrap();
        let expected = [1.0 / 11.0, 3.0 / 11.0, 1.0 / 11.0, 1.0, 0.0, 0.0];
        assert!(apart(&q.values, &expected) < 1e-12, "{q:?}");
    }

    #[test]
    fn the_goal_is_worth_a_discount_a_step() {
        let r#in = Box::new(GoalWorld { size: 3, goal: vec![0, 0], trap: vec![1, 1] });
        let mdp = r#in.mdp().unwrap();
        let q = ValueIteration { r#in, discount: 0.5 }.run(&CTX).unwrap();
        let v = highest_values(&mdp, &q.values);
        assert_eq!(v, [0.0, 1.0, 0.5, 1.0, 0.0, 0.25, 0.5, 0.25, 0.125]);
    }

    #[test]
    fn values_that_do_not_exist_are_told() {
        let mut mdp = random(0);
        mdp.terminal[4] = false;
        mdp.rewards.fill(1.0);
        let why = fixed_point(&mdp, 1.0, |q| highest_values(&mdp, q)).unwrap_err().to_string();
        assert!(why.starts_with("the values did not settle in 100000 sweeps"), "{why}");
    }
}
