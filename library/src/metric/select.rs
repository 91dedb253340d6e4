//! Selection by label; `x[dim: label]` is written for it.

use ivx_op::{Array, Ctx, One, Op, OpError, declare};

declare! {
    /// The numbers at one label of a dimension, which vanishes; or at several, which remain.
    pub struct Select = "select" @ 1 -> Array [like x] {
        /// From what.
        x: One<Array>;
        /// The dimension.
        dim: String;
        /// The labels, in the order wanted; numbers as they are written, such as "0.5" or "3".
        at: Vec<String>;
        /// Whether the dimension remains even with one label.
        keep: bool = false;
    }
}

impl Op for Select {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let missing = || OpError::Failed(format!("there is no dimension `{}`", self.dim));
        let d = self.x.dim(&self.dim).ok_or_else(missing)?;
        let places = self.places(d)?;

        let mut picked = self.x.picked(d, &places);
        if places.len() == 1 && !self.keep {
            picked.dims.remove(d);
        }
        Ok(picked)
    }
}

impl Select {
    /// Where the labels lie along dimension `d`.
    fn places(&self, d: usize) -> Result<Vec<usize>, OpError> {
        let labels = &self.x.dims[d].labels;
        let known: Vec<String> = (0..labels.len()).map(|i| labels.text(i)).collect();
        let place = |label: &String| {
            let place = known.iter().position(|other| other == label);
            place.ok_or_else(|| {
                let known = known.join(", ");
                OpError::Failed(format!("`{}` has no label `{label}`; it has: {known}", self.dim))
            })
        };
        if self.at.is_empty() {
            return Err(OpError::Failed(format!("no label of `{}` is selected", self.dim)));
        }
        self.at.iter().map(place).collect()
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Dim, Labels};

    use super::*;

    /// `ke` (WCM, MA) by `x` (0.5, 3).
    fn select(dim: &str, at: &[&str], keep: bool) -> Result<Array, String> {
        let ke = Dim::new("ke", Labels::Names(vec!["WCM".into(), "MA".into()]));
        let x = Dim::new("x", Labels::Numbers(vec![0.5, 3.0]));
        let x = One(Array { dims: vec![ke, x], values: vec![1.0, 2.0, 3.0, 4.0] });
        let at = at.iter().map(|&label| label.to_owned()).collect();
        let ctx = Ctx::new("select", 0, None);
        let selected = Select { x, dim: dim.to_owned(), at, keep }.run(&ctx);
        selected.map_err(|error| error.to_string())
    }

    #[test]
    fn one_label_takes_the_dimension_away() {
        let x = Dim::new("x", Labels::Numbers(vec![0.5, 3.0]));
        assert_eq!(select("ke", &["MA"], false), Ok(Array::series(x, vec![3.0, 4.0])));
        assert_eq!(select("x", &["3"], false).unwrap().values, [2.0, 4.0]);
        let kept = select("x", &["0.5"], true).unwrap();
        assert_eq!((kept.dims.len(), kept.dims[1].len(), kept.values), (2, 1, vec![1.0, 3.0]));
    }

    #[test]
    fn several_labels_are_taken_in_their_order() {
        let swapped = select("ke", &["MA", "WCM"], false).unwrap();
        assert_eq!(swapped.dims[0].labels.text(0), "MA");
        assert_eq!(swapped.values, [3.0, 4.0, 1.0, 2.0]);
    }

    #[test]
    fn unknown_labels_are_answered_with_the_known() {
        let unknown = select("ke", &["BCM"], false).unwrap_err();
        assert_eq!(unknown, "`ke` has no label `BCM`; it has: WCM, MA");
        assert_eq!(select("y", &["0"], false).unwrap_err(), "there is no dimension `y`");
        assert_eq!(select("x", &[], false).unwrap_err(), "no label of `x` is selected");
    }
}
