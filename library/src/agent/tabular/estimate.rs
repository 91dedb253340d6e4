//! Values estimated from episodes (§2.3.2).

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::{Episode, Rollouts};
use ivx_math::moments::real;
use ivx_math::returns::{Path, k_step, lambda_returns};
use ivx_op::{Array, Ctx, One, Op, OpError, Parts, declare, family};

/// Says what the states of an episode are worth by what followed.
pub trait Estimator: Debug + Send + Sync {
    /// The target of each state but the last: `[T]`.
    ///
    /// - `rewards`: `[T]`, `rewards[t]` is received on leaving `s_t`.
    /// - `values`: `[T + 1]`, what the states are thought to be worth; 0 if terminal.
    fn targets(&self, rewards: &[f64], values: &[f64], discount: f64) -> Vec<f64>;
}

declare! {
    /// Monte-Carlo estimates: targets are the returns of the episode (Eqn. 2.38).
    ///
    /// What an episode that was cut off would have received from there on is left out.
    pub struct MonteCarlo = "monte_carlo" @ 1 {}
}

declare! {
    /// Temporal differences over `k` steps: rewards up to there, and then the value of that state. Over one
    /// it is TD(0) (Eqn. 2.41).
    pub struct Td = "td" @ 1 {
        /// After how many steps the estimate takes over.
        steps: usize = 1, in 1.0..=1e6;
    }
}

declare! {
    /// TD(λ): the average of the targets of `td` over any number of steps, each weighing `λ` times the one
    /// before. At 0 it is TD(0), and at 1 the whole return.
    pub struct TdLambda = "td_lambda" @ 1 {
        /// The weight of one more step.
        lambda: f64 = 0.9, in 0.0..=1.0;
    }
}

impl Estimator for MonteCarlo {
    fn targets(&self, rewards: &[f64], values: &[f64], discount: f64) -> Vec<f64> {
        Td { steps: rewards.len() }.targets(rewards, &vec![0.0; values.len()], discount)
    }
}

impl Estimator for Td {
    fn targets(&self, rewards: &[f64], values: &[f64], discount: f64) -> Vec<f64> {
        k_step(&Path { rewards, values, ends: &[] }, discount, self.steps)
    }
}

impl Estimator for TdLambda {
    fn targets(&self, rewards: &[f64], values: &[f64], discount: f64) -> Vec<f64> {
        lambda_returns(&Path { rewards, values, ends: &[] }, discount, self.lambda)
    }
}

family!(dyn Estimator, "Estimator", estimators);

pub(super) fn estimators() -> &'static Parts<dyn Estimator> {
    static TABLE: LazyLock<Parts<dyn Estimator>> = LazyLock::new(|| {
        Parts::<dyn Estimator>::new()
            .with(|by: MonteCarlo| Box::new(by))
            .with(|by: Td| Box::new(by))
            .with(|by: TdLambda| Box::new(by))
    });
    &TABLE
}

declare! {
    /// What each state is worth to the agent that acted in some episodes, learned from them alone:
    /// `v(s) ← v(s) + rate (target - v(s))`, in the order of the episodes, from 0 (Eqn. 2.36).
    ///
    /// Targets of an episode are made of the values before it. A state that was never left is worth 0.
    pub struct EstimateValues = "estimate_values" @ 1 -> Array [state] {
        /// The episodes.
        from: One<Rollouts>;
        /// What targets are.
        by: Box<dyn Estimator>;
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
        /// How far a value goes to its target; 0 for one over how often it has moved, with which it is the
        /// average of its targets.
        rate: f64 = 0.0, in 0.0..=1.0;
        /// How often it goes through the episodes.
        passes: usize = 1, in 1.0..=1e6;
    }
    rule super::from_is_walked;
}

impl Op for EstimateValues {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let walks = self.from.walks()?;
        let mut values = vec![0.0; walks.n_states];
        let mut n_moves = vec![0_usize; walks.n_states];
        for e in (0..self.passes).flat_map(|_| &walks.episodes) {
            let targets = self.by.targets(&e.rewards, &along(&values, e), self.discount);
            for (s, target) in e.states.iter().zip(targets) {
                n_moves[*s] += 1;
                let rate = if self.rate == 0.0 { 1.0 / real(n_moves[*s]) } else { self.rate };
                values[*s] += rate * (target - values[*s]);
            }
        }
        Ok(Array::series(walks.states(), values))
    }
}

/// What the states of an episode are worth; where it ended, 0.
pub(super) fn along(values: &[f64], e: &Episode) -> Vec<f64> {
    let mut along: Vec<f64> = e.states.iter().map(|s| values[*s]).collect();
    if e.ended {
        *along.last_mut().expect("an episode has a state") = 0.0;
    }
    along
}

#[cfg(test)]
mod tests {
    use super::super::{PolicyValues, walked};
    use super::*;
    use ivx_data::Walks;
    use ivx_math::bellman::expected_values;
    use ivx_world::Chain;

    const REWARDS: [f64; 3] = [1.0, 0.0, 2.0];
    const VALUES: [f64; 4] = [9.0, 9.0, 8.0, 4.0];

    #[test]
    fn targets_by_hand() {
        let of = |by: &dyn Estimator| by.targets(&REWARDS, &VALUES, 0.5);
        // Without the last value: 2, 0 + ½·2, 1 + ½·1.
        assert_eq!(of(&MonteCarlo {}), [1.5, 1.0, 2.0]);
        assert_eq!(of(&Td { steps: 1 }), [1.0 + 4.5, 4.0, 2.0 + 2.0]);
        // 1 + ½·0 + ¼·8;  0 + ½·2 + ¼·4;  2 + ½·4.
        assert_eq!(of(&Td { steps: 2 }), [3.0, 2.0, 4.0]);
        // 2 + ½·4 = 4;  ½(½·8 + ½·4) = 3;  1 + ½(½·9 + ½·3) = 4.
        assert_eq!(of(&TdLambda { lambda: 0.5 }), [4.0, 3.0, 4.0]);
        assert_eq!(of(&TdLambda { lambda: 0.0 }), of(&Td { steps: 1 }));
        assert_eq!(of(&TdLambda { lambda: 1.0 }), of(&Td { steps: 99 }));
    }

    #[test]
    fn every_estimator_finds_the_values_of_a_random_walk() {
        let r#in = || Box::new(Chain { cells: 5, slip: 0.1, goal: true });
        let mdp = ivx_world::mdp(&*r#in()).unwrap();
        let policy = || One(Array { dims: mdp.pairs(), values: vec![0.5; 10] });
        let ctx = Ctx::new("estimate", 0, None);
        let q = PolicyValues { policy: policy(), r#in: r#in(), discount: 0.9 };
        let exact = expected_values(&mdp.model(), &[0.5; 10], &q.run(&ctx).unwrap().values);
        let rollouts = walked(policy(), r#in(), (1000, "main"));
        let apart = |by: Box<dyn Estimator>, rate| {
            let from = One(rollouts.clone());
            let found = EstimateValues { from, by, discount: 0.9, rate, passes: 4 }.run(&ctx);
            let found = found.unwrap().values;
            found.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        // Knowing nothing errs by the value next to the goal.
        assert!(exact[3] > 0.6, "{exact:?}");
        let errors = [
            apart(Box::new(MonteCarlo {}), 0.0),
            apart(Box::new(Td { steps: 1 }), 0.002),
            apart(Box::new(Td { steps: 3 }), 0.002),
            apart(Box::new(TdLambda { lambda: 0.8 }), 0.002),
        ];
        assert!(errors.iter().all(|e| *e < 0.06), "{errors:?}");
    }

    #[test]
    fn an_average_is_over_every_visit() {
        let e = Episode {
            states: vec![0, 0, 1],
            actions: vec![0, 0],
            rewards: vec![2.0, 4.0],
            ended: true,
        };
        let walks = Walks { n_states: 2, actions: vec!["a".into()], episodes: vec![e] };
        let from = One(Rollouts::from(walks));
        let by = Box::new(MonteCarlo {});
        let found = EstimateValues { from, by, discount: 0.5, rate: 0.0, passes: 1 };
        // Returns 2 + ½·4 = 4 and 4.
        assert_eq!(found.run(&Ctx::new("", 0, None)).unwrap().values, [4.0, 0.0]);
    }
}
