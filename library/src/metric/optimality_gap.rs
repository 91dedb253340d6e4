//! How far runs fall short of a target.

use ivx_math::several::shortfall;
use ivx_op::{Array, AxisNames, Ctx, GroupBy, Named, Op, OpError, declare};

use super::reduce::reduce;

declare! {
    /// How far scores fall short of a target, on average; what is above it does not count (Agarwal et al., 2021).
    pub struct OptimalityGap = "optimality_gap" @ 1 -> Array [reduce x] {
        /// The scores.
        x: Named<Array>;
        /// The axes and dimensions that vanish.
        over: AxisNames;
        /// What a run should reach.
        target: f64 = 1.0;
        /// The field of an axis that vanishes, as in `task.scene`: one result for each of its values.
        by: GroupBy = Vec::<i64>::new();
    }
}

impl Op for OptimalityGap {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let x = Array::stack(&self.x.0).map_err(OpError::Failed)?;
        reduce(&x, &self.over.0, |scores| shortfall(scores, self.target))
    }
}
