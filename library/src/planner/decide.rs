//! The optimal policy of a choice.

use ivx_math::moments::real;
use ivx_math::order::max;
use ivx_op::{Array, Ctx, Op, OpError, Part, declare};
use ivx_world::Problem;

use super::utility::utilities;
use crate::ce::CertaintyEquivalent;
use crate::ke::KnowledgeEquivalent;

/// Utilities that differ by no more, relative to the best (or to 1 if that is smaller), are equal.
const TIE: f64 = 1e-12;

declare! {
    /// The optimal policy: the probability of each action, split evenly among the best (Example 2.1).
    ///
    /// Utilities within 1e-12 of the best, relative to it or to 1, count as equally good.
    pub struct Decide = "decide" @ 1 -> Array [action] {
        /// The choice.
        problem: Box<dyn Problem>;
        /// How risk is reduced.
        ce: Box<dyn CertaintyEquivalent> = Part::new("eu");
        /// How ignorance is reduced.
        ke: Box<dyn KnowledgeEquivalent> = Part::new("ma");
    }
}

impl Op for Decide {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let utilities = utilities(self.problem.as_ref(), self.ce.as_ref(), self.ke.as_ref())?;
        Ok(Array { values: policy(&utilities.values), dims: utilities.dims })
    }
}

/// The probability of each action under the optimal policy: even among the best.
#[must_use]
pub fn policy(utilities: &[f64]) -> Vec<f64> {
    let best = max(utilities);
    let tie = TIE * best.abs().max(1.0);
    let is_best: Vec<bool> = utilities.iter().map(|u| best - u <= tie).collect();
    let n_best = is_best.iter().filter(|best| **best).count();
    is_best.iter().map(|best| if *best { 1.0 / real(n_best) } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ce::{Eu, Wcu};
    use crate::ke::{Bcm, Ma, Wcm};
    use ivx_world::{Belief, BeliefOver, Boxes, Discrete, Lottery};

    fn lottery(outcomes: &[f64]) -> Box<dyn Lottery> {
        let probabilities = ivx_math::moments::uniform(outcomes.len());
        Box::new(Discrete { outcomes: outcomes.to_vec(), probabilities })
    }

    fn belief(models: Vec<Box<dyn Lottery>>) -> Box<dyn Belief> {
        Box::new(BeliefOver { models, weights: vec![] })
    }

    /// Figure 2.2c: the left box is risky, the right one unknown.
    fn decide(ce: Box<dyn CertaintyEquivalent>, ke: Box<dyn KnowledgeEquivalent>) -> Vec<f64> {
        let left = belief(vec![lottery(&[-1.0, 1.0])]);
        let right = belief(vec![lottery(&[-1.0]), lottery(&[0.0]), lottery(&[1.0])]);
        let problem = Box::new(Boxes { left, right });
        let ctx = Ctx::new("decide", 0, None);
        let policy = Decide { problem, ce, ke }.run(&ctx).unwrap();
        assert_eq!(policy.dims[0].labels.text(1), "RIGHT");
        policy.values
    }

    #[test]
    fn risk_and_ignorance_are_traded() {
        assert_eq!(decide(Box::new(Eu {}), Box::new(Ma {})), [0.5, 0.5]);
        assert_eq!(decide(Box::new(Eu {}), Box::new(Bcm {})), [0.0, 1.0]);
        assert_eq!(decide(Box::new(Eu {}), Box::new(Wcm {})), [1.0, 0.0]);
        assert_eq!(decide(Box::new(Wcu {}), Box::new(Ma {})), [0.0, 1.0]);
    }

    #[test]
    fn rounding_does_not_break_a_tie() {
        assert_eq!(policy(&[0.1 + 0.2, 0.3, -1.0]), [0.5, 0.5, 0.0]);
        assert_eq!(policy(&[0.3, 0.3 + 1e-9]), [0.0, 1.0]);
    }
}
