//! Performance profiles.

use ivx_math::moments::mean;
use ivx_op::{Array, AxisNames, Ctx, Dim, Labels, Named, Op, OpError, declare};

use super::reduce::Groups;

declare! {
    /// The share of scores above each threshold (Agarwal et al., 2021): over tasks one profile a run, which `curve` shows as
    /// their mean with its interval; over runs and tasks one profile of all.
    pub struct PerformanceProfile = "performance_profile" @ 1 -> Array [reduce x to threshold] {
        /// The scores.
        x: Named<Array>;
        /// The axes that vanish.
        over: AxisNames;
        /// The thresholds.
        at: Vec<f64>;
    }
}

impl Op for PerformanceProfile {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let x = Array::stack(&self.x.0).map_err(OpError::Failed)?;
        let groups = Groups::of(&x, &self.over.0)?;
        let values = groups.starts.iter().flat_map(|start| {
            let scores = groups.gather(&x, *start);
            let above = |threshold: f64| {
                let one = |x: &f64| match *x {
                    x if x.is_nan() => f64::NAN,
                    x => f64::from(u8::from(x > threshold)),
                };
                mean(&scores.iter().map(one).collect::<Vec<_>>())
            };
            self.at.iter().map(|threshold| above(*threshold)).collect::<Vec<_>>()
        });
        let values = values.collect();
        let dims = groups.kept.iter().map(|d| x.dims[*d].clone());
        let threshold = Dim::new("threshold", Labels::Numbers(self.at.clone()));
        Ok(Array { dims: dims.chain([threshold]).collect(), values })
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::Gathered;

    use super::*;

    #[test]
    fn the_share_above_each_threshold() {
        let dims = vec![Dim::new("#0", Labels::count(4))];
        let values = [0.0, 0.5, 0.5, 2.0].map(Array::scalar).to_vec();
        let x = Named(Gathered { dims, values, name: String::new() });
        let over = AxisNames(vec!["#0".to_owned()]);
        let op = PerformanceProfile { x, over, at: vec![-1.0, 0.0, 0.5, 3.0] };
        let found = op.run(&Ctx::new("", 0, None)).expect("there are scores");
        assert_eq!(found.values, [1.0, 0.75, 0.25, 0.0]);
        assert_eq!(found.dims[0].labels, Labels::Numbers(vec![-1.0, 0.0, 0.5, 3.0]));
    }
}
