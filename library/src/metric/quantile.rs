//! Quantiles.

use ivx_math::order;
use ivx_op::{Array, AxisNames, Ctx, GroupBy, Named, Op, OpError, declare};

use super::reduce::reduce_rest;

declare! {
    /// A quantile, linear between neighbours (type 7); infinite between a number and an infinity.
    pub struct Quantile = "quantile" @ 2 -> Array [reduce x] {
        /// What to reduce.
        x: Named<Array>;
        /// Which share lies below.
        q: f64, in 0.0..=1.0;
        /// The axes and dimensions that vanish.
        over: AxisNames;
        /// The field of an axis that vanishes, as in `task.scene`: one result for each of its values.
        by: GroupBy = Vec::<i64>::new();
        /// Whether it is made of what is there where some of it is missing, because a node failed.
        skip_missing: bool = false;
    }
}

impl Op for Quantile {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let x = Array::stack(&self.x.0).map_err(OpError::Failed)?;
        reduce_rest(&x, (&self.over.0, self.skip_missing), |xs| order::quantile(xs, self.q))
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Dim, Gathered, Labels};

    use super::*;

    #[test]
    fn a_quarter_of_the_way() {
        let seed = Dim::new("#0", Labels::Numbers(vec![0.0, 1.0, 2.0]));
        let values = [3.0, 1.0, 2.0].map(Array::scalar).to_vec();
        let x = Named(Gathered { dims: vec![seed], values, name: String::new() });
        let over = AxisNames(vec!["#0".to_owned()]);
        let ctx = Ctx::new("quantile", 0, None);
        assert_eq!(
            Quantile { x, q: 0.25, over, by: GroupBy, skip_missing: false }.run(&ctx).unwrap(),
            Array::scalar(1.5)
        );
    }
}
