//! The best action under an ensemble.

use ivx_data::Decision;
use ivx_data::form::model_of_pairs;
use ivx_math::moments::uniform;
use ivx_math::mpv::across;
use ivx_nn::Model;
use ivx_op::{Ctx, Members, Op, OpError, declare};
use ivx_world::Points;

use super::choose;
use crate::ke::KnowledgeEquivalent;

declare! {
    /// The action of the highest knowledge equivalent over the members; the first where several
    /// have it.
    pub struct Argmax = "argmax" @ 2 -> Decision {
        /// The members, equally probable.
        model: Members<Model>;
        /// How their predictions are reduced.
        ke: Box<dyn KnowledgeEquivalent>;
        /// The actions to choose from.
        among: Box<dyn Points>;
    }
    rule model_of_pairs;
}

impl Op for Argmax {
    fn run(&self, _: &Ctx) -> Result<Decision, OpError> {
        let candidates = self.among.places()?;
        let members = self.model.iter().map(|model| model.rewards(&candidates));
        let members: Vec<_> = members.collect::<Result<_, _>>()?;
        let members: Vec<&[f64]> = members.iter().map(Vec::as_slice).collect();
        choose(candidates, &equivalents(&members, self.ke.as_ref()))
    }
}

/// The knowledge equivalent at each place, of equally probable members.
///
/// - `members`: `[K][N]`, the scores of each member.
///
/// # Panics
/// If there are no members or they differ in length.
#[must_use]
pub fn equivalents(members: &[&[f64]], ke: &dyn KnowledgeEquivalent) -> Vec<f64> {
    let weights = uniform(members.len());
    across(members, |scores| ke.reduce(scores, &weights))
}

#[cfg(test)]
mod tests {
    use super::super::Greedy;
    use super::*;
    use crate::ke::{Bcm, Ma, Wcm};
    use ivx_world::Grid;

    /// Over {0, 1, 2}, the lines x and 1 − 2x: 0 1 2 and 1 −1 −3.
    fn decide(ke: Box<dyn KnowledgeEquivalent>) -> (f64, f64) {
        let lines = vec![Model::Polynomial(vec![0.0, 1.0]), Model::Polynomial(vec![1.0, -2.0])];
        let among = Box::new(Grid { low: 0.0, high: 2.0, points: 3 });
        let ctx = Ctx::new("argmax", 0, None);
        let decision = Argmax { model: Members(lines), ke, among }.run(&ctx).unwrap();
        (decision.action, decision.believed)
    }

    #[test]
    fn the_knowledge_equivalent_decides() {
        assert_eq!(decide(Box::new(Wcm {})), (0.0, 0.0));
        assert_eq!(decide(Box::new(Ma {})), (0.0, 0.5));
        assert_eq!(decide(Box::new(Bcm {})), (2.0, 2.0));
    }

    #[test]
    fn one_model_decides_alone() {
        let model = ivx_op::One(Model::Polynomial(vec![1.0, -2.0]));
        let among = Box::new(Grid { low: 0.0, high: 2.0, points: 3 });
        let ctx = Ctx::new("greedy", 0, None);
        let decision = Greedy { model, among }.run(&ctx).unwrap();
        assert_eq!((decision.action, decision.believed), (0.0, 1.0));
        assert_eq!(decision.candidates, [0.0, 1.0, 2.0]);
    }
}
