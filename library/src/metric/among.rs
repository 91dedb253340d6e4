//! How often something is so among what is of a kind, as a recovery is among failures (§3.3).

use ivx_math::interval::wilson;
use ivx_op::{Array, AxisNames, Ctx, Dim, Labels, MISSING, Named, Op, OpError, declare};

use super::detection::judged;

declare! {
    /// The share of what is so among what is of a kind, such as of good ends where another failed (the recovery score of §3.3).
    ///
    /// What is missing is left out, and it is missing itself where nothing is of the kind.
    pub struct ShareAmong = "share_among" @ 1 -> Array [reduce x] {
        /// Above 0 where it is so.
        x: Named<Array>;
        /// 1 for what is of the kind, and 0 for what is not.
        among: Named<Array>;
        /// The axes and dimensions that vanish.
        over: AxisNames;
    }
}

declare! {
    /// The ends of Wilson's interval of `share_among`, which holds the truth so often as `confidence`.
    pub struct ShareAmongInterval = "share_among_interval" @ 1 -> Array [reduce x to end] {
        /// Above 0 where it is so.
        x: Named<Array>;
        /// 1 for what is of the kind, and 0 for what is not.
        among: Named<Array>;
        /// The axes and dimensions that vanish.
        over: AxisNames;
        /// How often.
        confidence: f64 = 0.95, in 0.001..=0.999;
    }
}

/// How many are so, and how many there are, of what is of the kind.
fn counted(x: &[f64], among: &[bool]) -> (usize, usize) {
    let of = || x.iter().zip(among).filter(|(_, among)| **among);
    (of().filter(|(x, _)| **x > 0.0).count(), of().count())
}

impl Op for ShareAmong {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let of = |x: &[f64], among: &[bool]| match counted(x, among) {
            (_, 0) => vec![MISSING],
            (k, n) => vec![ivx_math::moments::real(k) / ivx_math::moments::real(n)],
        };
        let (dims, values) = judged((&self.x, &self.among), &self.over, of)?;
        Ok(Array { dims, values })
    }
}

impl Op for ShareAmongInterval {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let of = |x: &[f64], among: &[bool]| match counted(x, among) {
            (_, 0) => vec![MISSING; 2],
            (k, n) => {
                let (low, high) = wilson(k, n, self.confidence);
                vec![low, high]
            }
        };
        let (mut dims, values) = judged((&self.x, &self.among), &self.over, of)?;
        dims.push(Dim::new("end", Labels::Names(["low", "high"].map(str::to_owned).to_vec())));
        Ok(Array { dims, values })
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Gathered, is_missing};

    use super::*;

    fn drives(values: &[f64]) -> Named<Array> {
        let dim = Dim::new("trial", Labels::count(values.len()));
        let values = vec![Array::series(dim, values.to_vec())];
        Named(Gathered { dims: Vec::new(), values, name: String::new() })
    }

    fn over() -> AxisNames {
        AxisNames(vec!["trial".to_owned()])
    }

    #[test]
    fn recoveries_are_counted_where_the_other_failed() {
        let (x, failed) = ([1.0, 0.0, 1.0, 1.0, MISSING], [1.0, 1.0, 0.0, 1.0, 1.0]);
        let ctx = Ctx::new("share_among", 0, None);
        let share = |among: &[f64]| {
            ShareAmong { x: drives(&x), among: drives(among), over: over() }.run(&ctx).unwrap()
        };
        assert_eq!(share(&failed), Array::scalar(2.0 / 3.0));
        assert!(is_missing(share(&[0.0; 5]).values[0]));
        let (x, among) = (drives(&x), drives(&failed));
        let ends = ShareAmongInterval { x, among, over: over(), confidence: 0.95 };
        let (low, high) = wilson(2, 3, 0.95);
        assert_eq!(ends.run(&ctx).unwrap().values, [low, high]);
    }
}
