//! Dynamic programming: values where the environment is known.

use ivx_math::bellman::{Model, backup, expected_values, fixed_point, highest_values};
use ivx_op::{Array, Ctx, One, Op, OpError, declare};
use ivx_world::{Env, world_pays};

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
    rule world_pays;
}

impl Op for ValueIteration {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let mdp = ivx_world::mdp(&*self.r#in)?;
        let model = mdp.model();
        let values = settled(&model, self.discount, |q| highest_values(&model, q))?;
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
    rule world_pays;
}

impl Op for PolicyValues {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let mdp = ivx_world::mdp(&*self.r#in)?;
        let policy = mdp.policy(&self.policy)?;
        let model = mdp.model();
        let values = settled(&model, self.discount, |q| expected_values(&model, policy, q))?;
        Ok(Array { dims: mdp.pairs(), values })
    }
}

/// The action values that a backup of their own state values leaves as they are.
fn settled(
    model: &Model<'_>,
    discount: f64,
    values: impl Fn(&[f64]) -> Vec<f64>,
) -> Result<Vec<f64>, OpError> {
    let sweep = |q: &[f64]| backup(model, discount, &values(q));
    fixed_point(sweep, model.rewards.len(), TOLERANCE, MOST).ok_or_else(|| {
        let why = "there may be none where rewards do not end and the discount is 1";
        OpError::Failed(format!("the values did not settle in {MOST} sweeps: {why}"))
    })
}

#[cfg(test)]
mod tests {
    use rand::RngExt as _;

    use super::*;
    use ivx_world::{Chain, GoalWorld, Mdp, Paid};

    const CTX: Ctx = Ctx::new("", 0, None);

    /// Five states, the last of them terminal, and three actions.
    fn random(i: u64) -> Mdp {
        let mut rng = CTX.rng("mdp", &[&i.to_string()]);
        let (n_states, actions) = (5, ["a", "b", "c"].map(str::to_owned).to_vec());
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
        let start = vec![0.25, 0.25, 0.25, 0.25, 0.0];
        Mdp { actions, transitions, rewards, paid: Paid::Acting, terminal, start }
    }

    fn apart(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn two_steps_by_hand() {
        // From the middle of three cells, evenly: v = ½·1 + ½γ v_0 and v_0 = ½γ v + ½γ v_0, with γ = ½:
        // v_0 = v/3, so v = ½ + v/12 = 6/11.
        let r#in = || Box::new(Chain { cells: 3, slip: 0.0, goal: true });
        let mdp = ivx_world::mdp(&*r#in()).unwrap();
        let policy = One(Array { dims: mdp.pairs(), values: vec![0.5; 6] });
        let q = PolicyValues { policy, r#in: r#in(), discount: 0.5 }.run(&CTX).unwrap();
        let expected = [1.0 / 11.0, 3.0 / 11.0, 1.0 / 11.0, 1.0, 0.0, 0.0];
        assert!(apart(&q.values, &expected) < 1e-12, "{q:?}");
    }

    #[test]
    fn the_goal_is_worth_a_discount_a_step() {
        let r#in = Box::new(GoalWorld { size: 3, goal: vec![0, 0], trap: vec![1, 1] });
        let mdp = ivx_world::mdp(&*r#in).unwrap();
        let q = ValueIteration { r#in, discount: 0.5 }.run(&CTX).unwrap();
        let v = highest_values(&mdp.model(), &q.values);
        assert_eq!(v, [0.0, 1.0, 0.5, 1.0, 0.0, 0.25, 0.5, 0.25, 0.125]);
    }

    #[test]
    fn values_that_do_not_exist_are_told() {
        let mut mdp = random(0);
        mdp.terminal[4] = false;
        mdp.rewards.fill(1.0);
        let model = mdp.model();
        let why = settled(&model, 1.0, |q| highest_values(&model, q)).unwrap_err().to_string();
        assert!(why.starts_with("the values did not settle in 100000 sweeps"), "{why}");
    }
}
