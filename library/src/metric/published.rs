//! Published numbers; `published NAME from "FILE"` is written for them.

use ivx_op::{Array, Ctx, Dim, Labels, Op, OpError, declare};

declare! {
    /// Numbers that were published, over the dimensions that they have there. A spec brings them in
    /// from a file, by `published NAME from "FILE"`.
    ///
    /// Where a number is missing there, it is not a number here: arithmetic and reductions with it
    /// are none either, and it decides no claim. Select what is there before reducing.
    pub struct PublishedNumbers = "published" @ 1 -> Array {
        /// The names of the dimensions, outermost first.
        dims: Vec<String>;
        /// The labels of each dimension; numbers as they are written, such as "0.5" or "3".
        labels: Vec<Vec<String>>;
        /// Which dimensions have numbers for labels.
        numeric: Vec<bool>;
        /// The numbers, last dimension fastest; where one is missing, 0.
        values: Vec<f64>;
        /// The places of those that are missing.
        missing: Vec<usize>;
    }
}

impl Op for PublishedNumbers {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let wrong = |what: &str| OpError::Failed(format!("{what} do not fit each other"));
        let n = self.dims.len();
        if self.labels.len() != n || self.numeric.len() != n {
            return Err(wrong("dimensions and labels"));
        }
        let described = self.dims.iter().zip(&self.labels).zip(&self.numeric);
        let dims = described.map(|((name, labels), numeric)| {
            let labels = if *numeric {
                let number =
                    |label: &String| label.parse().map_err(|_| wrong("labels and numbers"));
                Labels::Numbers(labels.iter().map(number).collect::<Result<_, _>>()?)
            } else {
                Labels::Names(labels.clone())
            };
            Ok(Dim::new(name, labels))
        });
        let dims: Vec<Dim> = dims.collect::<Result<_, OpError>>()?;
        let mut values = self.values.clone();
        if values.len() != dims.iter().map(Dim::len).product::<usize>() {
            return Err(wrong("numbers and labels"));
        }
        for place in &self.missing {
            *values.get_mut(*place).ok_or_else(|| wrong("numbers and missing places"))? = f64::NAN;
        }
        Ok(Array { dims, values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CTX: Ctx = Ctx::new("published", 0, None);

    /// `method` (A, B) by `n` (0.5, 3).
    fn published(values: &[f64], missing: &[usize]) -> Result<Array, OpError> {
        let names = |names: [&str; 2]| names.map(str::to_owned).to_vec();
        let labels = vec![names(["A", "B"]), names(["0.5", "3"])];
        let (values, missing) = (values.to_vec(), missing.to_vec());
        let dims = names(["method", "n"]);
        PublishedNumbers { dims, labels, numeric: vec![false, true], values, missing }.run(&CTX)
    }

    #[test]
    fn labels_are_kept_and_gaps_are_not_numbers() {
        let array = published(&[1.0, 2.0, 0.0, 4.0], &[2]).unwrap();
        assert_eq!(array.dims[0], Dim::new("method", Labels::Names(vec!["A".into(), "B".into()])));
        assert_eq!(array.dims[1], Dim::new("n", Labels::Numbers(vec![0.5, 3.0])));
        assert_eq!([array.values[0], array.values[1], array.values[3]], [1.0, 2.0, 4.0]);
        assert!(array.values[2].is_nan());
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        assert!(published(&[1.0], &[]).is_err());
        assert!(published(&[1.0; 4], &[4]).is_err());
        let dims = vec!["a".to_owned()];
        let odd = PublishedNumbers {
            dims,
            labels: vec![],
            numeric: vec![],
            values: vec![1.0],
            missing: vec![],
        };
        assert!(odd.run(&CTX).is_err());
    }
}
