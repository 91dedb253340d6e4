//! Action values learned by acting (§2.3.2).

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_math::order::max;
use ivx_op::{Array, Ctx, Op, OpError, Parts, declare, family};
use ivx_world::{Env, world_pays};

use super::policy::greedy_policy;
use super::walk::Luck;

/// Says what the state after an action is worth.
pub trait Bootstrap: Debug + Send + Sync {
    /// Its value, from those of its actions, the probabilities with which the agent takes them, and the
    /// action that it takes.
    fn value(&self, q: &[f64], policy: &[f64], action: usize) -> f64;
}

declare! {
    /// SARSA: the value of the action taken next (Eqn. 2.41b).
    pub struct Sarsa = "sarsa" @ 1 {}
}

declare! {
    /// Expected SARSA: the values of all actions, as probable as the agent takes them.
    pub struct ExpectedSarsa = "expected_sarsa" @ 1 {}
}

declare! {
    /// Q-learning: the highest value of an action, whatever the agent does (Eqn. 2.44).
    pub struct QLearning = "q_learning" @ 1 {}
}

impl Bootstrap for Sarsa {
    fn value(&self, q: &[f64], _: &[f64], action: usize) -> f64 {
        q[action]
    }
}

impl Bootstrap for ExpectedSarsa {
    fn value(&self, q: &[f64], policy: &[f64], _: usize) -> f64 {
        q.iter().zip(policy).map(|(q, p)| q * p).sum()
    }
}

impl Bootstrap for QLearning {
    fn value(&self, q: &[f64], _: &[f64], _: usize) -> f64 {
        max(q)
    }
}

family!(dyn Bootstrap, "Bootstrap", bootstraps);

pub(super) fn bootstraps() -> &'static Parts<dyn Bootstrap> {
    static TABLE: LazyLock<Parts<dyn Bootstrap>> = LazyLock::new(|| {
        Parts::<dyn Bootstrap>::new()
            .with(|by: Sarsa| Box::new(by))
            .with(|by: ExpectedSarsa| Box::new(by))
            .with(|by: QLearning| Box::new(by))
    });
    &TABLE
}

declare! {
    /// The value of each action in each state, learned by acting on it: the agent takes the action of the
    /// highest value so far, or any with probability `epsilon`, and after each step
    /// `q(s, a) ← q(s, a) + rate (r + γ v(s') - q(s, a))`, from 0.
    pub struct Control = "control" @ 2, stochastic -> Array [state, action] {
        /// What the next state is worth.
        by: Box<dyn Bootstrap>;
        /// The environment.
        r#in: Box<dyn Env>;
        /// How many episodes.
        episodes: usize, in 0.0..=1e6;
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
        /// How far a value goes to its target.
        rate: f64 = 0.1, in 0.0..=1.0;
        /// How often any action is taken.
        epsilon: f64 = 0.1, in 0.0..=1.0;
        /// After so many steps an episode is cut off.
        limit: usize = 100, in 1.0..=1e6, unit "steps";
    }
    rule world_pays;
}

impl Op for Control {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let mdp = ivx_world::mdp(&*self.r#in)?;
        let n = mdp.n_actions();
        let mut q = vec![0.0; mdp.rewards.len()];
        let policy = |q: &[f64], s: usize| greedy_policy(&q[s * n..][..n], n, self.epsilon);
        for i in 0..self.episodes {
            let mut luck = Luck::of(ctx, i);
            let mut state = luck.start(&mdp);
            let mut action = luck.act(&policy(&q, state)?);
            for _ in 0..self.limit {
                let next = luck.step(&mdp, state, action);
                let reward = mdp.paid(state, action, next);
                let probabilities = policy(&q, next)?;
                let follows = luck.act(&probabilities);
                let worth = self.by.value(&q[next * n..][..n], &probabilities, follows);
                let worth = if mdp.terminal[next] { 0.0 } else { worth };
                let pair = state * n + action;
                q[pair] += self.rate * (reward + self.discount * worth - q[pair]);
                (state, action) = (next, follows);
                if mdp.terminal[state] {
                    break;
                }
            }
        }
        Ok(Array { dims: mdp.pairs(), values: q })
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::One;

    use super::super::{PolicyValues, ValueIteration};
    use super::*;
    use ivx_math::bellman::expected_values;
    use ivx_world::GoalWorld;

    const CTX: Ctx = Ctx::new("control", 1, None);

    fn world() -> Box<dyn Env> {
        Box::new(GoalWorld { size: 4, goal: vec![0, 3], trap: vec![1, 2] })
    }

    fn learned(by: Box<dyn Bootstrap>, epsilon: f64) -> Vec<f64> {
        let (episodes, discount, rate, limit) = (2000, 0.9, 0.2, 100);
        let control = Control { by, r#in: world(), episodes, discount, rate, epsilon, limit };
        control.run(&CTX).unwrap().values
    }

    /// What the policy is worth, averaged over where episodes start.
    fn worth(policy: &[f64]) -> f64 {
        let mdp = ivx_world::mdp(&*world()).unwrap();
        let dims = mdp.pairs();
        let given = One(Array { dims, values: policy.to_vec() });
        let q = PolicyValues { policy: given, r#in: world(), discount: 0.9 }.run(&CTX).unwrap();
        let v = expected_values(&mdp.model(), policy, &q.values);
        v.iter().zip(&mdp.start).map(|(v, p)| v * p).sum()
    }

    #[test]
    fn bootstraps_by_hand() {
        let (q, policy) = ([1.0, 3.0], [0.75, 0.25]);
        assert_eq!(Sarsa {}.value(&q, &policy, 0), 1.0);
        assert_eq!(ExpectedSarsa {}.value(&q, &policy, 0), 1.5);
        assert_eq!(QLearning {}.value(&q, &policy, 0), 3.0);
    }

    #[test]
    fn every_agent_finds_nearly_the_best_policy() {
        let best = ValueIteration { r#in: world(), discount: 0.9 }.run(&CTX).unwrap().values;
        let best = worth(&greedy_policy(&best, 4, 0.0).unwrap());
        let random = worth(&[0.25; 64]);
        assert!(best > random + 0.5, "{best} {random}");
        let agents: [Box<dyn Bootstrap>; 3] =
            [Box::new(Sarsa {}), Box::new(ExpectedSarsa {}), Box::new(QLearning {})];
        for by in agents {
            let name = format!("{by:?}");
            let found = worth(&greedy_policy(&learned(by, 0.1), 4, 0.0).unwrap());
            assert!(found > best - 0.05, "{name}: {found} of {best}");
        }
    }

    #[test]
    fn q_learning_knows_the_best_values_whatever_it_does() {
        let best = ValueIteration { r#in: world(), discount: 0.9 }.run(&CTX).unwrap().values;
        let apart =
            |q: Vec<f64>| q.iter().zip(&best).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // Moves are certain, so that values settle at a constant rate; SARSA's are those of a random agent.
        let (off, on) =
            (apart(learned(Box::new(QLearning {}), 1.0)), apart(learned(Box::new(Sarsa {}), 1.0)));
        assert!(off < 0.01 && on > 0.5, "{off} {on}");
    }
}
