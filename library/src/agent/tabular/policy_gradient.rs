//! Policies learned by following the gradient of what they return (§2.3.2).

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::Episode;
use ivx_math::moments::real;
use ivx_math::policy::boltzmann;
use ivx_math::returns::{Path, advantages, lambda_returns};
use ivx_op::{Array, Ctx, Op, OpError, Parts, declare, family};
use ivx_world::{Env, world_pays};

use super::estimate::along;
use super::walk::{Luck, episode};

/// Says how much better than expected the actions of an episode were.
pub trait Critic: Debug + Send + Sync {
    /// The advantage of each action: `[T]`.
    ///
    /// - `values`: what the states are thought to be worth, learned beside the policy; 0 where it ended.
    fn advantages(&self, rewards: &[f64], values: &[f64], discount: f64) -> Vec<f64>;
}

declare! {
    /// REINFORCE (Williams, 1992): what was received from there on (Eqn. 2.47).
    pub struct Reinforce = "reinforce" @ 1 {}
}

declare! {
    /// Actor and critic: generalised advantages (Schulman et al., 2016) over values that are learned beside
    /// the policy (Eqns. 2.48 to 2.50).
    pub struct ActorCritic = "actor_critic" @ 1 {
        /// The weight of one more step; at 0 they are the errors of TD(0).
        lambda: f64 = 0.95, in 0.0..=1.0;
    }
}

impl Critic for Reinforce {
    fn advantages(&self, rewards: &[f64], values: &[f64], discount: f64) -> Vec<f64> {
        lambda_returns(
            &Path { rewards, values: &vec![0.0; values.len()], ends: &[] },
            discount,
            1.0,
        )
    }
}

impl Critic for ActorCritic {
    fn advantages(&self, rewards: &[f64], values: &[f64], discount: f64) -> Vec<f64> {
        advantages(&Path { rewards, values, ends: &[] }, discount, self.lambda)
    }
}

family!(dyn Critic, "Critic", critics);

pub(super) fn critics() -> &'static Parts<dyn Critic> {
    static TABLE: LazyLock<Parts<dyn Critic>> = LazyLock::new(|| {
        Parts::<dyn Critic>::new()
            .with(|by: Reinforce| Box::new(by))
            .with(|by: ActorCritic| Box::new(by))
    });
    &TABLE
}

declare! {
    /// A policy `π(a | s) ∝ e^θ(s, a)` learned by acting on it: after each episode it climbs
    /// `Σ_t A_t ln π(a_t | s_t) + entropy H(π(· | s_t))` (Eqn. 2.45), from equal probabilities.
    ///
    /// Values of the states, for critics that use them, go at a rate of their own towards what was received
    /// from there on, whatever `lambda` the critic has; an episode that was cut off goes on with the value
    /// of its last state.
    pub struct PolicyGradient = "policy_gradient" @ 2, stochastic -> Array [state, action] {
        /// What advantages `A_t` are.
        by: Box<dyn Critic>;
        /// The environment.
        r#in: Box<dyn Env>;
        /// How many episodes.
        episodes: usize, in 0.0..=1e6;
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
        /// How far a step climbs.
        rate: f64 = 0.1, in 0.0..;
        /// How far a value goes to its target.
        value_rate: f64 = 0.1, in 0.0..=1.0;
        /// What the entropy of the policy is worth.
        entropy: f64 = 0.0, in 0.0..;
        /// After so many steps an episode is cut off.
        limit: usize = 100, in 1.0..=1e6, unit "steps";
    }
    rule world_pays;
}

impl Op for PolicyGradient {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let mdp = ivx_world::mdp(&*self.r#in)?;
        let n = mdp.n_actions();
        let mut theta = vec![0.0; mdp.rewards.len()];
        let mut policy = vec![1.0 / real(n); theta.len()];
        let mut values = vec![0.0; mdp.n_states()];
        for i in 0..self.episodes {
            let mut luck = Luck::of(ctx, i);
            let e = episode(&mdp, self.limit, &mut luck, |s| &policy[s * n..][..n]);
            let before = along(&values, &e);
            let advantages = self.by.advantages(&e.rewards, &before, self.discount);
            let rates = (self.rate, self.entropy);
            climb((&mut theta, &policy, n), &e, &advantages, rates);
            for &s in &e.states[..e.actions.len()] {
                policy[s * n..][..n].copy_from_slice(&boltzmann(&theta[s * n..][..n], 1.0));
            }
            let path = Path { rewards: &e.rewards, values: &before, ends: &[] };
            for (s, target) in e.states.iter().zip(lambda_returns(&path, self.discount, 1.0)) {
                values[*s] += self.value_rate * (target - values[*s]);
            }
        }
        Ok(Array { dims: mdp.pairs(), values: policy })
    }
}

/// A step up the objective of one episode; `∂ ln π(a) / ∂ θ(b)` is `[a = b] - π(b)`.
///
/// - `n`: how many actions there are.
fn climb(
    (theta, policy, n): (&mut [f64], &[f64], usize),
    e: &Episode,
    advantages: &[f64],
    (rate, entropy): (f64, f64),
) {
    for ((&s, &a), advantage) in e.states.iter().zip(&e.actions).zip(advantages) {
        let pi = &policy[s * n..][..n];
        let h: f64 = pi.iter().filter(|p| **p > 0.0).map(|p| -p * p.ln()).sum();
        for (b, (theta, p)) in theta[s * n..][..n].iter_mut().zip(pi).enumerate() {
            let score = if a == b { 1.0 - p } else { -p };
            let of_entropy = if *p > 0.0 { -p * (p.ln() + h) } else { 0.0 };
            *theta += rate * (advantage * score + entropy * of_entropy);
        }
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::One;

    use super::super::{PolicyValues, ValueIteration};
    use super::*;
    use ivx_math::bellman::expected_values;
    use ivx_world::GoalWorld;

    const CTX: Ctx = Ctx::new("policy_gradient", 1, None);

    fn world() -> Box<dyn Env> {
        Box::new(GoalWorld { size: 4, goal: vec![0, 3], trap: vec![1, 2] })
    }

    /// What a policy is worth, averaged over where episodes start.
    fn worth(policy: &[f64]) -> f64 {
        let mdp = ivx_world::mdp(&*world()).unwrap();
        let given = One(Array { dims: mdp.pairs(), values: policy.to_vec() });
        let q = PolicyValues { policy: given, r#in: world(), discount: 0.9 }.run(&CTX).unwrap();
        let v = expected_values(&mdp.model(), policy, &q.values);
        v.iter().zip(&mdp.start).map(|(v, p)| v * p).sum()
    }

    fn learned(by: Box<dyn Critic>, episodes: usize, entropy: f64) -> Vec<f64> {
        let (discount, rate, value_rate, limit) = (0.9, 0.2, 0.1, 100);
        let learn = PolicyGradient {
            by,
            r#in: world(),
            episodes,
            discount,
            rate,
            value_rate,
            entropy,
            limit,
        };
        learn.run(&CTX).unwrap().values
    }

    #[test]
    fn advantages_by_hand() {
        let (rewards, values) = ([1.0, 2.0], [3.0, 4.0, 6.0]);
        // 1 + ½·2, 2; and with values 1 + ½·4 − 3, 2 + ½·6 − 4.
        assert_eq!(Reinforce {}.advantages(&rewards, &values, 0.5), [2.0, 2.0]);
        assert_eq!(ActorCritic { lambda: 0.0 }.advantages(&rewards, &values, 0.5), [0.0, 1.0]);
        assert_eq!(ActorCritic { lambda: 1.0 }.advantages(&rewards, &values, 0.5), [0.5, 1.0]);
    }

    #[test]
    fn a_step_climbs_along_the_central_difference() {
        let theta = [0.3, -0.2, 0.5];
        let e = Episode { states: vec![0, 0], actions: vec![1], ..Episode::default() };
        let objective = |theta: &[f64]| {
            let pi = boltzmann(theta, 1.0);
            let h: f64 = pi.iter().map(|p| -p * p.ln()).sum();
            1.7 * pi[1].ln() + 0.4 * h
        };
        let mut climbed = theta;
        climb((&mut climbed, &boltzmann(&theta, 1.0), 3), &e, &[1.7], (1.0, 0.4));
        for i in 0..3 {
            let at = |h: f64| {
                let mut theta = theta;
                theta[i] += h;
                objective(&theta)
            };
            let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
            assert!((climbed[i] - theta[i] - slope).abs() < 1e-8, "{i}");
        }
    }

    #[test]
    fn both_find_policies_near_the_best() {
        let best = ValueIteration { r#in: world(), discount: 0.9 }.run(&CTX).unwrap().values;
        let best = worth(&super::super::policy::greedy_policy(&best, 4, 0.0).unwrap());
        let random = worth(&[0.25; 64]);
        for by in
            [Box::new(Reinforce {}) as Box<dyn Critic>, Box::new(ActorCritic { lambda: 0.95 })]
        {
            let name = format!("{by:?}");
            let found = worth(&learned(by, 4000, 0.0));
            let margin = random + 0.8 * (best - random);
            assert!(found > margin, "{name}: {found}, best {best}, random {random}");
        }
    }

    #[test]
    fn entropy_keeps_policies_open() {
        let least = |entropy| {
            let policy = learned(Box::new(Reinforce {}), 500, entropy);
            policy.into_iter().fold(1.0, f64::min)
        };
        assert!(least(0.5) > 2.0 * least(0.0), "{} {}", least(0.5), least(0.0));
    }
}
