//! How far a model's predictions lie from data.

use ivx_data::Misfit;
use ivx_data::form;
use ivx_data::{Dataset, Form};
use ivx_math::moments::mean;
use ivx_nn::Model;
use ivx_op::{Array, Ctx, Facts, One, Op, OpError, Wrong, declare};

declare! {
    /// The root mean squared error of a model on data, over all numbers of the targets.
    pub struct Rmse = "rmse" @ 3 -> Array {
        /// The model.
        model: One<Model>;
        /// The data.
        on: One<Dataset>;
    }
    rule measurable;
}

/// Targets have distances.
fn of_numbers(form: &Form) -> Result<(), Misfit> {
    if form.classes.is_none() {
        return Ok(());
    }
    Err(Misfit::new("classes have no distance from each other".to_owned(), "use `accuracy`"))
}

fn measurable(facts: &Facts<'_>) -> Result<(), Wrong> {
    form::model_of_data(facts)?;
    form::form(facts, "on").map_or(Ok(()), |form| of_numbers(&form).map_err(form::wrong("on")))
}

impl Op for Rmse {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        if self.on.is_empty() {
            return Err(OpError::Failed("there are no data to measure the error on".to_owned()));
        }
        form::same(&self.model.form(), &self.on.form).map_err(form::failed)?;
        of_numbers(&self.on.form).map_err(form::failed)?;
        let predicted = self.model.predict(&self.on.x);
        let squares = predicted.iter().zip(&self.on.y).map(|(p, y)| (p - y).powi(2));
        Ok(Array::scalar(mean(&squares.collect::<Vec<_>>()).sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_one_and_seven() {
        // The line x is wrong by 1 and by 7: √((1 + 49) / 2) = 5.
        let model = || One(Model::Polynomial(vec![0.0, 1.0]));
        let on = One(Dataset::pairs(vec![0.0, 2.0], vec![1.0, -5.0]));
        let ctx = Ctx::new("rmse", 0, None);
        assert_eq!(Rmse { model: model(), on }.run(&ctx), Ok(Array::scalar(5.0)));
        assert!(Rmse { model: model(), on: One(Dataset::default()) }.run(&ctx).is_err());
    }
}
