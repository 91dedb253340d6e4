//! Ensembles of action values (Example 2.9).

use ivx_data::{Rollouts, Walks};
use ivx_math::order::max;
use ivx_op::{Array, Ctx, Dim, Labels, One, Op, OpError, Part, declare};
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};

use super::policy::{greedy_policy, n_actions};
use crate::ke::KnowledgeEquivalent;
use crate::planner::equivalents;

declare! {
    /// Several tables of action values, learned from the same episodes and told apart as Remark 2.7 says: by
    /// where they start, and by resampling the steps they see. What was never tried stays where it started.
    ///
    /// Targets are `r + γ max_a' ke_k q_k(s', a')`, made anew before each pass; with `ma` that is Averaged-Q
    /// (Eqn. 2.68).
    pub struct QEnsemble = "q_ensemble" @ 1, stochastic -> Array [member, state, action] {
        /// The episodes.
        from: One<Rollouts>;
        /// How many tables `K`.
        members: usize = 8, in 1.0..=1e4;
        /// How the values of the members are reduced to one for the target.
        target: Box<dyn KnowledgeEquivalent> = Part::new("ma");
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
        /// How far a value goes to its target.
        rate: f64 = 0.1, in 0.0..=1.0;
        /// How often it goes through the steps.
        passes: usize = 100, in 0.0..=1e6;
        /// Standard deviation of the values at the start.
        init: f64 = 1.0, in 0.0..;
        /// Whether each member sees its own resample of the steps, as many with replacement.
        bootstrap: bool = true;
    }
    rule super::from_is_walked;
}

/// One step: the pair of state and action, the reward, and the state that follows; none if it is terminal.
type Step = (usize, f64, Option<usize>);

impl Op for QEnsemble {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let walks = self.from.walks()?;
        let (n_states, actions) = (walks.n_states, &walks.actions);
        let steps = steps(&walks);
        let mut members: Vec<Vec<f64>> = Vec::new();
        let mut seen: Vec<Vec<Step>> = Vec::new();
        for k in 0..self.members {
            let mut init = ctx.rng("init", &[&k.to_string()]);
            let mut draw = || -> f64 { StandardNormal.sample(&mut init) };
            members.push((0..n_states * actions.len()).map(|_| self.init * draw()).collect());
            let mut rng = ctx.rng("bootstrap", &[&k.to_string()]);
            let resampled = (0..steps.len()).map(|_| steps[rng.random_range(0..steps.len())]);
            seen.push(if self.bootstrap { resampled.collect() } else { steps.clone() });
        }
        for _ in 0..self.passes {
            let worth = worth(&members, self.target.as_ref(), actions.len());
            for (q, steps) in members.iter_mut().zip(&seen) {
                for (pair, reward, next) in steps {
                    let target = reward + self.discount * next.map_or(0.0, |s| worth[s]);
                    q[*pair] += self.rate * (target - q[*pair]);
                }
            }
        }
        let mut dims = vec![Dim::new("member", Labels::count(self.members))];
        dims.extend(walks.pairs());
        Ok(Array { dims, values: members.concat() })
    }
}

fn steps(walks: &Walks) -> Vec<Step> {
    let of_one = walks.episodes.iter().flat_map(|e| {
        let last = if e.ended { e.actions.len() - 1 } else { usize::MAX };
        (0..e.actions.len()).map(move |t| {
            let next = if t == last { None } else { Some(e.states[t + 1]) };
            (e.states[t] * walks.actions.len() + e.actions[t], e.rewards[t], next)
        })
    });
    of_one.collect()
}

/// What each state is worth by the best action under a knowledge equivalent of the members.
#[must_use]
pub fn worth(members: &[Vec<f64>], ke: &dyn KnowledgeEquivalent, n_actions: usize) -> Vec<f64> {
    let members: Vec<&[f64]> = members.iter().map(Vec::as_slice).collect();
    equivalents(&members, ke).chunks(n_actions).map(max).collect()
}

declare! {
    /// The policy that takes the action of the highest knowledge equivalent over the members of an ensemble
    /// of action values (Eqn. 2.69): it explores under `bcm`, and is safe under `wcm`.
    pub struct EnsemblePolicy = "ensemble_policy" @ 1 -> Array [state, action] {
        /// The value of each action in each state, by each member.
        q: One<Array>;
        /// How they are reduced.
        ke: Box<dyn KnowledgeEquivalent>;
    }
}

impl Op for EnsemblePolicy {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let n_actions = n_actions(&self.q)?;
        let ([member, state, action], true) = (&self.q.dims[..], self.q.dim("member") == Some(0))
        else {
            let why = "the values are not over `member`, `state` and `action`";
            return Err(OpError::Failed(why.to_owned()));
        };
        let each = state.len() * action.len();
        let members: Vec<&[f64]> = self.q.values.chunks(each.max(1)).collect();
        if member.is_empty() || each == 0 {
            return Err(OpError::Failed("there are no values to act on".to_owned()));
        }
        let values = greedy_policy(&equivalents(&members, self.ke.as_ref()), n_actions, 0.0)?;
        Ok(Array { dims: vec![state.clone(), action.clone()], values })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{UniformPolicy, ValueIteration, walked};
    use super::*;
    use crate::ke::{Bcm, Ma, Wcm};
    use ivx_data::Episode;
    use ivx_world::{Chain, Env};

    const CTX: Ctx = Ctx::new("q_ensemble", 2, None);

    fn ensemble(from: Walks, passes: usize, members: usize, bootstrap: bool) -> Array {
        let (target, discount, rate, init) = (Box::new(Ma {}), 0.9, 0.5, 1.0);
        let from = One(from.into());
        let all = QEnsemble { from, members, target, discount, rate, passes, init, bootstrap };
        all.run(&CTX).unwrap()
    }

    fn chain() -> Box<dyn Env> {
        Box::new(Chain { cells: 4, slip: 0.0, goal: true })
    }

    fn tried() -> Walks {
        let policy = One(UniformPolicy { r#in: chain() }.run(&CTX).unwrap());
        walked(policy, chain(), (100, "main")).walks().unwrap()
    }

    #[test]
    fn every_member_finds_the_best_values_of_what_was_tried() {
        let best = ValueIteration { r#in: chain(), discount: 0.9 }.run(&CTX).unwrap().values;
        let apart = |passes| {
            let found = ensemble(tried(), passes, 3, true).values;
            let errors = found
                .chunks(8)
                .flat_map(|q| q.iter().zip(&best).take(6).map(|(a, b)| (a - b).abs()));
            errors.fold(0.0, f64::max)
        };
        assert!(apart(0) > 0.5 && apart(60) < 0.01, "{} {}", apart(0), apart(60));
    }

    #[test]
    fn what_was_never_tried_stays_where_it_started() {
        let e = Episode { states: vec![2, 3], actions: vec![1], rewards: vec![1.0], ended: true };
        let actions = vec!["LEFT".to_owned(), "RIGHT".to_owned()];
        let from = || Walks { n_states: 4, actions: actions.clone(), episodes: vec![e.clone()] };
        let (before, after) = (ensemble(from(), 0, 4, true), ensemble(from(), 50, 4, true));
        for k in 0..4 {
            let (before, after) = (&before.values[8 * k..][..8], &after.values[8 * k..][..8]);
            assert_eq!((&before[..5], &before[6..]), (&after[..5], &after[6..]));
            assert!((after[5] - 1.0).abs() < 1e-9 && before[5] != after[5]);
        }
        assert_ne!(before.values[..8], before.values[8..16]);
        // Member 1 starts and resamples alike in a larger ensemble.
        assert_eq!(before.values[8..16], ensemble(from(), 0, 9, true).values[8..16]);
        // A step that pays now 1 and now nothing: whose resample ends with which differs.
        let idle = Episode { rewards: vec![0.0], ..e.clone() };
        let both = || Walks {
            episodes: (0..4).flat_map(|_| [e.clone(), idle.clone()]).collect(),
            ..from()
        };
        let learned = |bootstrap| {
            let found = ensemble(both(), 20, 6, bootstrap).values;
            (0..6).map(|k| found[8 * k + 5]).collect::<Vec<f64>>()
        };
        let alike = |all: Vec<f64>| all.iter().all(|q| (q - all[0]).abs() < 1e-3);
        assert!(alike(learned(false)) && !alike(learned(true)));
    }

    #[test]
    fn the_knowledge_equivalent_explores_or_is_safe() {
        // One state; members say 0 and 5 of one action, and 2 of the other.
        let dim = |name, n: u8| Dim::new(name, Labels::Numbers((0..n).map(f64::from).collect()));
        let dims = vec![dim("member", 2), dim("state", 1), dim("action", 2)];
        let q = || One(Array { dims: dims.clone(), values: vec![0.0, 2.0, 5.0, 2.0] });
        let policy = |ke: Box<dyn KnowledgeEquivalent>| EnsemblePolicy { q: q(), ke }.run(&CTX);
        assert_eq!(policy(Box::new(Bcm {})).unwrap().values, [1.0, 0.0]);
        assert_eq!(policy(Box::new(Wcm {})).unwrap().values, [0.0, 1.0]);
        // (0 + 5) / 2 > 2, and its worth is the target.
        assert_eq!(policy(Box::new(Ma {})).unwrap().values, [1.0, 0.0]);
        assert_eq!(worth(&[vec![0.0, 2.0], vec![5.0, 2.0]], &Ma {}, 2), [2.5]);
        let one = One(Array::series(dim("action", 2), vec![0.0, 1.0]));
        assert!(EnsemblePolicy { q: one, ke: Box::new(Ma {}) }.run(&CTX).is_err());
    }
}
