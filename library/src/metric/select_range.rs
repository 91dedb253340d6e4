//! Selection by a range; `x[dim: from..to]` is written for it.

use ivx_op::{Array, Ctx, Labels, One, Op, OpError, declare};

declare! {
    /// The numbers at the labels of a dimension that lie within a range: from its first on, and below its last.
    pub struct SelectRange = "select_range" @ 1 -> Array [like x] {
        /// From what.
        x: One<Array>;
        /// The dimension, whose labels are numbers.
        dim: String;
        /// The first; where empty, from the lowest on.
        from: Vec<f64> = Vec::<f64>::new();
        /// What all are below; where empty, to the highest.
        to: Vec<f64> = Vec::<f64>::new();
    }
}

impl Op for SelectRange {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let failed = |why: String| OpError::Failed(why);
        let missing = || failed(format!("there is no dimension `{}`", self.dim));
        let d = self.x.dim(&self.dim).ok_or_else(missing)?;
        let Labels::Numbers(labels) = &self.x.dims[d].labels else {
            return Err(failed(format!("the labels of `{}` are not numbers", self.dim)));
        };
        let holds =
            |x: f64| self.from.iter().all(|from| *from <= x) && self.to.iter().all(|to| x < *to);
        let inside = labels.iter().enumerate().filter(|(_, x)| holds(**x));
        let places: Vec<usize> = inside.map(|(place, _)| place).collect();
        if places.is_empty() {
            let end = |end: &[f64]| end.first().map_or_else(String::new, f64::to_string);
            let range = format!("{}..{}", end(&self.from), end(&self.to));
            return Err(failed(format!("no label of `{}` lies in {range}", self.dim)));
        }
        Ok(self.x.picked(d, &places))
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::Dim;

    use super::*;

    fn range(from: &[f64], to: &[f64]) -> Result<Array, String> {
        let ke = Dim::new("ke", Labels::Names(vec!["WCM".into(), "MA".into()]));
        let step = Dim::new("step", Labels::Numbers(vec![0.0, 50.0, 100.0]));
        let x = Array { dims: vec![ke, step], values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0] };
        let (x, dim) = (One(x), "step".to_owned());
        let range = SelectRange { x, dim, from: from.to_vec(), to: to.to_vec() };
        range.run(&Ctx::new("select_range", 0, None)).map_err(|error| error.to_string())
    }

    #[test]
    fn a_range_ends_below_its_last_label() {
        let found = range(&[], &[100.0]).unwrap();
        assert_eq!(found.values, [1.0, 2.0, 4.0, 5.0]);
        assert_eq!(found.dims[1].labels, Labels::Numbers(vec![0.0, 50.0]));
        assert_eq!(range(&[50.0], &[]).unwrap().values, [2.0, 3.0, 5.0, 6.0]);
        assert_eq!(range(&[50.0], &[50.1]).unwrap().values, [2.0, 5.0]);
        let why = range(&[101.0], &[200.0]).unwrap_err();
        assert_eq!(why, "no label of `step` lies in 101..200");
    }
}
