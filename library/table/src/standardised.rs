//! Data on the scale of other data.

use ivx_data::{Dataset, form};
use ivx_math::standard::Scale;
use ivx_op::{Ctx, Facts, One, Op, OpError, Wrong, declare};

declare! {
    /// Data whose inputs have the mean 0 and the standard deviation 1 of other data: of those that are learnt from, so that
    /// nothing of those that are tested on is known.
    ///
    /// ```text
    /// x' = (x − mean) / std
    /// ```
    ///
    /// Each number of an input is on a scale of its own, and std is that of the observations there are: the sum of squares
    /// is divided by their number. What is the same in all of `by` is 0 there, and elsewhere how far it is from that.
    pub struct Standardised = "standardised" @ 1 -> Dataset {
        /// The data.
        data: One<Dataset>;
        /// The data that say where 0 is and how large 1 is.
        by: One<Dataset>;
        /// Whether targets are put on such a scale too.
        targets: bool = false;
    }
    rule goes_together;
    shapes crate::take::same;
}

fn goes_together(facts: &Facts<'_>) -> Result<(), Wrong> {
    let (Some(data), Some(by)) = (form::form(facts, "data"), form::form(facts, "by")) else {
        return Ok(());
    };
    if data != by {
        let message =
            format!("the data are {}, and `by` is {}", form::told(&data), form::told(&by));
        let help = "standardise by the part that is learnt from: `by: parts.train`".to_owned();
        return Err(Wrong { arg: "by", message, help });
    }
    if facts.arg("targets") == Some(true) && data.classes.is_some() {
        let message = "targets are classes, which have no scale".to_owned();
        let help = "leave `targets` out".to_owned();
        return Err(Wrong { arg: "targets", message, help });
    }
    Ok(())
}

impl Op for Standardised {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        let (data, by) = (&self.data.0, &self.by.0);
        form::same(&by.form, &data.form).map_err(form::failed)?;
        if self.targets && data.form.classes.is_some() {
            return Err(OpError::Failed("targets are classes, which have no scale".to_owned()));
        }
        if by.is_empty() {
            return Err(OpError::Failed("`by` has no observation to take a mean of".to_owned()));
        }
        let x = Scale::of(&by.x, data.form.input_len()).scaled(&data.x);
        let y = if self.targets {
            Scale::of(&by.y, data.form.target_len()).scaled(&data.y)
        } else {
            data.y.clone()
        };
        Ok(Dataset { form: data.form.clone(), x, y })
    }
}

#[cfg(test)]
mod tests {
    use ivx_data::Form;

    use super::*;

    fn data(x: Vec<f64>, y: Vec<f64>, width: usize) -> Dataset {
        Dataset { form: Form { input: vec![width], ..Form::default() }, x, y }
    }

    fn run(data: &Dataset, by: &Dataset, targets: bool) -> Result<Dataset, OpError> {
        let (data, by) = (One(data.clone()), One(by.clone()));
        Standardised { data, by, targets }.run(&Ctx::new("standardised", 0, None))
    }

    #[test]
    fn the_scale_is_that_of_what_is_learnt_from() {
        // 1 and 3 have the mean 2 and the deviation 1; 0.1 and 0.1 are the same.
        let train = data(vec![1.0, 0.1, 3.0, 0.1], vec![0.0, 4.0], 2);
        let test = data(vec![5.0, 0.6], vec![6.0], 2);
        assert_eq!(run(&train, &train, false).unwrap().x, [-1.0, 0.0, 1.0, 0.0]);
        let scaled = run(&test, &train, true).unwrap();
        assert_eq!((scaled.x, scaled.y), (vec![3.0, 0.5], vec![2.0]));
        assert_eq!(run(&test, &train, false).unwrap().y, [6.0]);
    }

    #[test]
    fn what_does_not_go_together_is_refused() {
        let train = data(vec![1.0, 3.0], vec![0.0, 4.0], 1);
        assert!(run(&train, &data(vec![], vec![], 1), false).is_err());
        assert!(run(&train, &Dataset::pairs(vec![1.0], vec![1.0]), false).is_err());
        let mut classes = train.clone();
        classes.form.classes = Some(5);
        assert!(run(&classes, &classes, true).is_err() && run(&classes, &classes, false).is_ok());
    }
}
