//! Classes as vectors.

use ivx_data::{Dataset, Form, form};
use ivx_op::{Ctx, Facts, One, Op, OpError, Shapes, Wrong, declare};

declare! {
    /// Data whose targets are vectors in the place of indices of classes: 1 at the index, and 0 everywhere else.
    pub struct OneHot = "one_hot" @ 1 -> Dataset {
        /// Data whose targets are indices of classes.
        data: One<Dataset>;
    }
    rule has_classes;
    shapes vectors;
}

/// Most numbers that targets become.
const MOST: usize = 1 << 28;

fn has_classes(facts: &Facts<'_>) -> Result<(), Wrong> {
    match form::form(facts, "data") {
        Some(own) if own.classes.is_none() => {
            let message =
                format!("the data are {}, whose targets are no classes", form::told(&own));
            let help = "say so where they are read: `labels: true`".to_owned();
            Err(Wrong { arg: "data", message, help })
        }
        _ => Ok(()),
    }
}

fn vectors(facts: &Facts<'_>) -> Option<Shapes> {
    form::form(facts, "data").as_ref().and_then(apart).map(|form| form.shapes())
}

/// The form of data with vectors for classes.
fn apart(form: &Form) -> Option<Form> {
    let target = [&form.target[..], &[form.classes?]].concat();
    Some(Form { target, classes: None, ..form.clone() })
}

impl Op for OneHot {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        let data = &self.data.0;
        let (Some(form), Some(n)) = (apart(&data.form), data.form.classes) else {
            return Err(OpError::Failed("targets are no classes".to_owned()));
        };
        if n.checked_mul(data.y.len()).is_none_or(|size| size > MOST) {
            let why = format!("{} targets of {n} classes are too many numbers", data.y.len());
            return Err(OpError::Failed(why));
        }
        let mut y = vec![0.0; n * data.y.len()];
        for (row, class) in y.chunks_mut(n.max(1)).zip(&data.y) {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "it is an index"
            )]
            let place = row.get_mut(*class as usize);
            *place
                .ok_or_else(|| OpError::Failed(format!("{class} is no index of {n} classes")))? =
                1.0;
        }
        Ok(Dataset { form, x: data.x.clone(), y })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::split::tests::of_classes;

    #[test]
    fn an_index_becomes_a_vector() {
        let run = |data| OneHot { data: One(data) }.run(&Ctx::new("one_hot", 0, None));
        let found = run(of_classes(&[1, 0, 2])).unwrap();
        assert_eq!(found.y, [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        assert_eq!((found.form.target, found.form.classes), (vec![3], None));
        assert!(run(Dataset::pairs(vec![0.0], vec![0.0])).is_err());
    }
}
