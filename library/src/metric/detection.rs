//! How well numbers tell what is about to happen.

use ivx_math::detect::{Auroc as Area, rate_above};
use ivx_op::{
    Array, AxisNames, Ctx, Dim, Labels, MISSING, Named, Op, OpError, declare, is_missing,
};

use super::broadcast::broadcast;
use super::reduce::Groups;

declare! {
    /// The area under the receiver operating characteristic: how probably a score of what happened is above one of what did
    /// not, ties half.
    ///
    /// What is missing is left out. It is missing itself where nothing happened, or everything.
    pub struct Auroc = "auroc" @ 1 -> Array [reduce x] {
        /// The scores.
        x: Named<Array>;
        /// 1 where it happened, and 0 where it did not.
        happened: Named<Array>;
        /// The axes and dimensions that vanish.
        over: AxisNames;
    }
}

declare! {
    /// The ends of the interval that holds the area of `auroc` so often as `confidence`, by DeLong, DeLong and Clarke-Pearson
    /// (1988); where no pair is the wrong way round, or each is, by Clopper and Pearson.
    pub struct AurocInterval = "auroc_interval" @ 1 -> Array [reduce x to end] {
        /// The scores.
        x: Named<Array>;
        /// 1 where it happened, and 0 where it did not.
        happened: Named<Array>;
        /// The axes and dimensions that vanish.
        over: AxisNames;
        /// How often.
        confidence: f64 = 0.95, in 0.001..=0.999;
    }
}

declare! {
    /// The share of what happened among scores above their quantile at `q`.
    ///
    /// What is missing is left out, and it is missing itself where nothing is above.
    pub struct RateAbove = "rate_above" @ 1 -> Array [reduce x] {
        /// The scores.
        x: Named<Array>;
        /// 1 where it happened, and 0 where it did not.
        happened: Named<Array>;
        /// The axes and dimensions that vanish.
        over: AxisNames;
        /// Which share of scores lies below.
        q: f64 = 0.8, in 0.0..=1.0;
    }
}

/// What `of` makes of the scores and outcomes of each group that vanishes along `over`.
///
/// # Errors
/// If they are not of each other, or an outcome is neither 0 nor 1.
pub(super) fn judged(
    (x, happened): (&Named<Array>, &Named<Array>),
    over: &AxisNames,
    of: impl Fn(&[f64], &[bool]) -> Vec<f64>,
) -> Result<(Vec<Dim>, Vec<f64>), OpError> {
    let [x, happened] = [x, happened].map(|port| Array::stack(&port.0).map_err(OpError::Failed));
    let (x, happened) = (x?, happened?);
    let scores = broadcast(&x, &happened, |x, _| x)?;
    let outcomes = broadcast(&x, &happened, |_, happened| happened)?;
    let wrong = outcomes.values.iter().find(|x| !is_missing(**x) && **x != 0.0 && **x != 1.0);
    if let Some(wrong) = wrong {
        let why = format!("what happened is 0 or 1, and not {wrong}");
        return Err(OpError::Failed(why));
    }
    let groups = Groups::of(&scores, &over.0)?;
    let mut values = Vec::new();
    for start in &groups.starts {
        let [scores, outcomes] = [&scores, &outcomes].map(|of| groups.gather(of, *start));
        let there =
            scores.iter().zip(&outcomes).filter(|(x, y)| !is_missing(**x) && !is_missing(**y));
        let (scores, outcomes): (Vec<f64>, Vec<bool>) = there.map(|(x, y)| (*x, *y > 0.0)).unzip();
        values.extend(of(&scores, &outcomes));
    }
    Ok((groups.kept.iter().map(|&d| scores.dims[d].clone()).collect(), values))
}

fn area(scores: &[f64], happened: &[bool]) -> Option<Area> {
    let some = happened.iter().any(|it| *it) && happened.iter().any(|it| !it);
    some.then(|| Area::delong(scores, happened))
}

impl Op for Auroc {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let of = |scores: &[f64], happened: &[bool]| {
            vec![area(scores, happened).map_or(MISSING, |area| area.estimate)]
        };
        let (dims, values) = judged((&self.x, &self.happened), &self.over, of)?;
        Ok(Array { dims, values })
    }
}

impl Op for AurocInterval {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let of = |scores: &[f64], happened: &[bool]| match area(scores, happened) {
            Some(area) => {
                let (low, high) = area.interval(self.confidence);
                vec![low, high]
            }
            None => vec![MISSING; 2],
        };
        let (mut dims, values) = judged((&self.x, &self.happened), &self.over, of)?;
        dims.push(Dim::new("end", Labels::Names(["low", "high"].map(str::to_owned).to_vec())));
        Ok(Array { dims, values })
    }
}

impl Op for RateAbove {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let of = |scores: &[f64], happened: &[bool]| {
            let rate =
                if scores.is_empty() { f64::NAN } else { rate_above(scores, happened, self.q) };
            vec![if rate.is_nan() { MISSING } else { rate }]
        };
        let (dims, values) = judged((&self.x, &self.happened), &self.over, of)?;
        Ok(Array { dims, values })
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::Gathered;

    use super::*;

    /// Two scenes a seed and task, of two tasks.
    fn scenes(values: [f64; 4]) -> Named<Array> {
        let task = Dim::new("task", Labels::count(2));
        let scene = || Dim::new("scene", Labels::count(2));
        let each = values.chunks(2).map(|pair| Array::series(scene(), pair.to_vec()));
        Named(Gathered { dims: vec![task], values: each.collect(), name: String::new() })
    }

    fn over() -> AxisNames {
        AxisNames(vec!["task".to_owned(), "scene".to_owned()])
    }

    fn ctx() -> Ctx<'static> {
        Ctx::new("auroc", 0, None)
    }

    fn area(x: [f64; 4], happened: [f64; 4]) -> Result<Array, OpError> {
        Auroc { x: scenes(x), happened: scenes(happened), over: over() }.run(&ctx())
    }

    #[test]
    fn pairs_are_counted_by_hand() {
        // 3 above 2 and 1, and 1 below and beside them: (1 + 1 + 0 + ½) / 4.
        assert_eq!(area([3.0, 2.0, 1.0, 1.0], [1.0, 0.0, 1.0, 0.0]).unwrap(), Array::scalar(0.625));
        // Without the missing one it is 3 above 2 and 1.
        let found = area([3.0, 2.0, MISSING, 1.0], [1.0, 0.0, 1.0, 0.0]).unwrap();
        assert_eq!(found, Array::scalar(1.0));
        assert!(is_missing(area([1.0; 4], [1.0; 4]).unwrap().values[0]), "nothing to tell apart");
        let why = area([1.0; 4], [1.0, 0.5, 0.0, 0.0]).unwrap_err().to_string();
        assert_eq!(why, "what happened is 0 or 1, and not 0.5");
    }

    #[test]
    fn an_interval_holds_the_estimate_and_a_task_stands_by_itself() {
        let (x, happened) = ([4.0, 1.0, 3.0, 2.0], [1.0, 0.0, 0.0, 1.0]);
        let ends = AurocInterval {
            x: scenes(x),
            happened: scenes(happened),
            over: over(),
            confidence: 0.95,
        };
        let found = ends.run(&ctx()).unwrap();
        assert_eq!(found.dims.len(), 1);
        assert!(found.values[0] < 0.75 && 0.75 < found.values[1], "{:?}", found.values);
        let over = AxisNames(vec!["scene".to_owned()]);
        let each = Auroc { x: scenes(x), happened: scenes(happened), over }.run(&ctx()).unwrap();
        assert_eq!(each.values, [1.0, 0.0]);
    }

    #[test]
    fn rates_are_of_the_highest() {
        let (x, happened) = (scenes([4.0, 1.0, 3.0, 2.0]), scenes([1.0, 0.0, 0.0, 1.0]));
        let rate = RateAbove { x, happened, over: over(), q: 0.5 }.run(&ctx()).unwrap();
        assert_eq!(rate, Array::scalar(0.5));
    }
}
