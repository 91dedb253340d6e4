//! How probable it is that one method does better than another.

use ivx_math::moments::mean;
use ivx_op::{Array, AxisNames, Ctx, Named, Op, OpError, declare};

use super::broadcast::broadcast;
use super::reduce::reduce;

declare! {
    /// The probability that a run of `x` scores above one of `y`, ties half (Mann and Whitney's U over the number of
    /// pairs): of one task, or of each. Its mean over tasks is the probability of improvement of Agarwal et al. (2021).
    pub struct Improvement = "probability_of_improvement" @ 1 -> Array [reduce x] {
        /// The scores of one method.
        x: Named<Array>;
        /// Those of the other.
        y: Named<Array>;
        /// The axis of runs.
        over: AxisNames;
    }
}

impl Op for Improvement {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let x = Array::stack(&self.x.0).map_err(OpError::Failed)?;
        let mut y = Array::stack(&self.y.0).map_err(OpError::Failed)?;
        let mut over = self.over.0.clone();
        // Each run of one with each of the other.
        for dim in y.dims.iter_mut().filter(|dim| self.over.0.contains(&dim.name)) {
            dim.name = format!("other {}", dim.name);
            over.push(dim.name.clone());
        }
        let above = |x: f64, y: f64| match x.partial_cmp(&y) {
            Some(std::cmp::Ordering::Greater) => 1.0,
            Some(std::cmp::Ordering::Equal) => 0.5,
            Some(std::cmp::Ordering::Less) => 0.0,
            None => f64::NAN,
        };
        reduce(&broadcast(&x, &y, above)?, &over, mean)
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Dim, Gathered, Labels};

    use super::*;

    #[test]
    fn each_run_meets_each_other() {
        let runs = |values: &[f64]| {
            let dims = vec![Dim::new("#0", Labels::count(values.len()))];
            let values = values.iter().copied().map(Array::scalar).collect();
            Named(Gathered { dims, values, name: String::new() })
        };
        let over = AxisNames(vec!["#0".to_owned()]);
        let op = Improvement { x: runs(&[1.0, 3.0]), y: runs(&[1.0, 2.0]), over };
        // 1 = 1, 1 < 2, 3 > 1, 3 > 2.
        let found = op.run(&Ctx::new("", 0, None)).expect("there are runs");
        assert_eq!(found, Array::scalar(2.5 / 4.0));
    }
}
