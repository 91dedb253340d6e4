//! Policies: the probability of each action in each state.

use ivx_math::moments::real;
use ivx_math::order::argmax;
use ivx_math::policy::boltzmann;
use ivx_op::{Array, Ctx, One, Op, OpError, declare};
use ivx_world::{Env, world_is_finite};

declare! {
    /// The policy of a random agent: every action is equally probable.
    pub struct UniformPolicy = "uniform_policy" @ 1 -> Array [state, action] {
        /// The environment.
        r#in: Box<dyn Env>;
    }
    rule world_is_finite;
}

impl Op for UniformPolicy {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let mdp = ivx_world::mdp(&*self.r#in)?;
        let values = vec![1.0 / real(mdp.n_actions()); mdp.rewards.len()];
        Ok(Array { dims: mdp.pairs(), values })
    }
}

declare! {
    /// The policy that takes the action of the highest value (Eqn. 2.33a); the first where several have it.
    pub struct GreedyPolicy = "greedy_policy" @ 1 -> Array [like q] {
        /// The value of each action; the last dimension is `action`.
        q: One<Array>;
        /// How often it takes any action instead, evenly.
        epsilon: f64 = 0.0, in 0.0..=1.0;
    }
}

impl Op for GreedyPolicy {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let values = greedy_policy(&self.q.values, n_actions(&self.q)?, self.epsilon)?;
        Ok(Array { dims: self.q.dims.clone(), values })
    }
}

declare! {
    /// The policy that takes actions with probability proportional to `e^(q(s, a) / temperature)`.
    pub struct BoltzmannPolicy = "boltzmann_policy" @ 1 -> Array [like q] {
        /// The value of each action; the last dimension is `action`.
        q: One<Array>;
        /// How little values count.
        temperature: f64 = 1.0, in f64::MIN_POSITIVE..;
    }
}

impl Op for BoltzmannPolicy {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let rows = self.q.values.chunks(n_actions(&self.q)?);
        let values = rows.flat_map(|q| boltzmann(q, self.temperature)).collect();
        Ok(Array { dims: self.q.dims.clone(), values })
    }
}

/// How many actions an array has values of.
pub(super) fn n_actions(q: &Array) -> Result<usize, OpError> {
    match q.dims.last() {
        Some(dim) if dim.name == "action" && !dim.is_empty() => Ok(dim.len()),
        _ => Err(OpError::Failed("the last dimension of the values is not `action`".to_owned())),
    }
}

/// The probability of each action, all but `epsilon` for the first of the highest value.
///
/// # Errors
/// If a value is not a number.
pub(super) fn greedy_policy(
    q: &[f64],
    n_actions: usize,
    epsilon: f64,
) -> Result<Vec<f64>, OpError> {
    if q.iter().any(|q| q.is_nan()) {
        return Err(OpError::Failed("the value of an action is not a number".to_owned()));
    }
    let mut policy = vec![epsilon / real(n_actions); q.len()];
    for (q, row) in q.chunks(n_actions).zip(policy.chunks_mut(n_actions)) {
        row[argmax(q).expect("there is an action")] += 1.0 - epsilon;
    }
    Ok(policy)
}

#[cfg(test)]
mod tests {
    use ivx_op::{Dim, Labels};

    use super::*;
    use ivx_world::Chain;

    const CTX: Ctx = Ctx::new("", 0, None);

    fn q(values: &[f64]) -> One<Array> {
        let dim = |name, n: u8| Dim::new(name, Labels::Numbers((0..n).map(f64::from).collect()));
        One(Array { dims: vec![dim("state", 2), dim("action", 2)], values: values.to_vec() })
    }

    #[test]
    fn the_first_of_the_best_is_taken() {
        let policy = |epsilon, values: &[f64]| GreedyPolicy { q: q(values), epsilon }.run(&CTX);
        assert_eq!(policy(0.0, &[1.0, 2.0, 3.0, 3.0]).unwrap().values, [0.0, 1.0, 1.0, 0.0]);
        assert_eq!(policy(0.5, &[1.0, 2.0, 3.0, 3.0]).unwrap().values, [0.25, 0.75, 0.75, 0.25]);
        let why = policy(0.0, &[1.0, f64::NAN, 3.0, 3.0]).unwrap_err().to_string();
        assert_eq!(why, "the value of an action is not a number");
        let why = GreedyPolicy { q: One(Array::scalar(1.0)), epsilon: 0.0 }.run(&CTX);
        assert!(why.unwrap_err().to_string().contains("`action`"));
    }

    #[test]
    fn states_have_policies_of_their_own() {
        let policy = BoltzmannPolicy { q: q(&[0.0, 2.0, 1.0, 1.0]), temperature: 2.0 };
        let policy = policy.run(&CTX).unwrap().values;
        assert!((policy[1] / policy[0] - std::f64::consts::E).abs() < 1e-12);
        assert_eq!(policy[2..], [0.5, 0.5]);
        let r#in = Box::new(Chain { cells: 2, slip: 0.1, goal: true });
        assert_eq!(UniformPolicy { r#in }.run(&CTX).unwrap().values, [0.5; 4]);
    }
}
