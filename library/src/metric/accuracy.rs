//! How often a model names the right class.

use ivx_data::Misfit;
use ivx_data::form;
use ivx_data::{Dataset, Form};
use ivx_nn::Model;
use ivx_op::{Array, Ctx, Facts, One, Op, OpError, Wrong, declare};

declare! {
    /// The share of targets whose class a model gives the largest logit; the first where several have it.
    ///
    /// Of sequences of targets each counts.
    pub struct Accuracy = "accuracy" @ 1 -> Array {
        /// The model.
        model: One<Model>;
        /// The data.
        on: One<Dataset>;
    }
    rule measurable;
}

/// Targets are right or wrong.
pub(super) fn of_classes(form: &Form) -> Result<(), Misfit> {
    if form.classes.is_some() {
        return Ok(());
    }
    Err(Misfit::new("the targets are numbers and no classes".to_owned(), "use `rmse`"))
}

/// The rule that `on` has classes and is such as `model` was trained on.
pub(super) fn measurable(facts: &Facts<'_>) -> Result<(), Wrong> {
    form::model_of_data(facts)?;
    form::form(facts, "on").map_or(Ok(()), |form| of_classes(&form).map_err(form::wrong("on")))
}

impl Op for Accuracy {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        if self.on.is_empty() {
            let why = "there are no data to measure the accuracy on";
            return Err(OpError::Failed(why.to_owned()));
        }
        form::same(&self.model.form(), &self.on.form).map_err(form::failed)?;
        of_classes(&self.on.form).map_err(form::failed)?;
        let logits = self.model.predict(&self.on.x);
        let each = logits.len() / self.on.y.len();
        let named = logits.chunks_exact(each).map(|logits| match logits {
            [logit] => usize::from(*logit > 0.0),
            logits => {
                (1..logits.len()).fold(0, |best, i| if logits[i] > logits[best] { i } else { best })
            }
        });
        #[expect(clippy::cast_precision_loss, reason = "classes are few")]
        let right = named.zip(&self.on.y).filter(|(class, y)| *class as f64 == **y).count();
        #[expect(clippy::cast_precision_loss, reason = "data count far below 2^53")]
        let share = right as f64 / self.on.y.len() as f64;
        Ok(Array::scalar(share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_nn::{Curve, Module};
    use ivx_nn::{Head, NetModel};

    #[test]
    fn two_of_three_are_right() {
        // Logits (x, 1): class 0 above 1, class 1 below, and 0 where they are equal.
        let module = Module::Dense { inputs: 1, outputs: 2, curve: Curve::Identity };
        let form = Form { classes: Some(2), ..Form::default() };
        let arrays = vec![
            ("bias".into(), vec![2], vec![0.0, 1.0]),
            ("weight".into(), vec![1, 2], vec![1.0, 0.0]),
        ];
        let net = NetModel::new(module, form, Head::Logits, 0.0, arrays);
        let data =
            |y: &[f64]| Dataset { form: net.form.clone(), x: vec![2.0, 1.0, -1.0], y: y.to_vec() };
        let accuracy = |on| {
            let model = One(Model::Net(net.clone()));
            Accuracy { model, on: One(on) }.run(&Ctx::new("accuracy", 0, None))
        };
        assert_eq!(accuracy(data(&[0.0, 0.0, 1.0])), Ok(Array::scalar(1.0)));
        assert_eq!(accuracy(data(&[0.0, 1.0, 1.0])), Ok(Array::scalar(2.0 / 3.0)));
        let why = accuracy(Dataset::pairs(vec![1.0], vec![1.0])).unwrap_err().to_string();
        assert_eq!(
            why,
            "the model is of numbers with 2 classes, and the data are numbers with numbers"
        );
    }
}
