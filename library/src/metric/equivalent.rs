//! Knowledge equivalents of measures.

use ivx_math::moments::uniform;
use ivx_op::{Array, Ctx, Members, Op, OpError, declare};

use super::over_members;
use crate::ke::KnowledgeEquivalent;

declare! {
    /// The knowledge equivalent over members, at each coordinate.
    pub struct Equivalent = "equivalent" @ 1 -> Array [like scores] {
        /// One value a member; members are equally probable.
        scores: Members<Array>;
        /// How they are reduced.
        ke: Box<dyn KnowledgeEquivalent>;
    }
}

impl Op for Equivalent {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let weights = uniform(self.scores.len());
        over_members(&self.scores, |scores| self.ke.reduce(scores, &weights))
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Dim, Labels};

    use super::*;
    use crate::ke::{Ma, Wcm};

    fn row(values: &[f64]) -> Array {
        let labels = Labels::Numbers(values.to_vec().iter().map(|x| x.abs()).collect());
        Array::series(Dim::new("x", labels), values.to_vec())
    }

    #[test]
    fn members_are_reduced_at_each_coordinate() {
        let members = || Members(vec![row(&[1.0, -2.0]), row(&[-1.0, 2.0])]);
        let ctx = Ctx::new("equivalent", 0, None);
        let worst = Equivalent { scores: members(), ke: Box::new(Wcm {}) }.run(&ctx).unwrap();
        assert_eq!(worst, Array { values: vec![-1.0, -2.0], ..row(&[1.0, 2.0]) });
        let mean = Equivalent { scores: members(), ke: Box::new(Ma {}) }.run(&ctx).unwrap();
        assert_eq!(mean.values, [0.0, 0.0]);
    }

    #[test]
    fn members_must_share_their_dimensions() {
        let scores = Members(vec![row(&[1.0]), row(&[1.0, 2.0])]);
        let ctx = Ctx::new("equivalent", 0, None);
        assert!(Equivalent { scores, ke: Box::new(Ma {}) }.run(&ctx).is_err());
    }
}
