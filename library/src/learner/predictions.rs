//! What a model predicts for data.

use ivx_data::form::{failed, model_of_data, same, wrong};
use ivx_data::{Dataset, Form, Misfit};
use ivx_math::moments::real;
use ivx_math::policy::greedy;
use ivx_nn::Model;
use ivx_op::{Array, Ctx, Dim, Facts, Labels, One, Op, OpError, Wrong, declare};

declare! {
    /// What a model predicts for each observation: its number, or the class that it finds most probable, the first of
    /// several.
    pub struct Predictions = "predictions" @ 1 -> Array [row] {
        /// The model.
        model: One<Model>;
        /// The data; their targets are not looked at.
        on: One<Dataset>;
    }
    rule one_target_each;
}

declare! {
    /// How probable a model finds each class for each observation.
    pub struct ClassProbabilities = "class_probabilities" @ 1 -> Array [row, class] {
        /// The model.
        model: One<Model>;
        /// The data; their targets are not looked at.
        on: One<Dataset>;
    }
    rule one_class_each;
}

fn has_one_target(form: &Form) -> Result<(), Misfit> {
    if form.target.is_empty() {
        return Ok(());
    }
    let message = format!("an observation has {} targets, and this is of one", form.target_len());
    Err(Misfit::new(message, "use `rmse`, `nll` or `accuracy`, which take targets of any shape"))
}

fn has_one_class(form: &Form) -> Result<(), Misfit> {
    has_one_target(form)?;
    if form.classes.is_some() {
        return Ok(());
    }
    Err(Misfit::new("the targets are numbers and no classes".to_owned(), "use `predictions`"))
}

fn one_target_each(facts: &Facts<'_>) -> Result<(), Wrong> {
    fits(facts, has_one_target)
}

fn one_class_each(facts: &Facts<'_>) -> Result<(), Wrong> {
    fits(facts, has_one_class)
}

fn fits(facts: &Facts<'_>, ask: impl Fn(&Form) -> Result<(), Misfit>) -> Result<(), Wrong> {
    model_of_data(facts)?;
    ivx_data::form::form(facts, "on").map_or(Ok(()), |form| ask(&form).map_err(wrong("on")))
}

/// The observations, by number.
fn rows(data: &Dataset) -> Dim {
    Dim::new("row", Labels::count(data.len()))
}

impl Op for Predictions {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        same(&self.model.form(), &self.on.form).map_err(failed)?;
        has_one_target(&self.on.form).map_err(failed)?;
        let values = match self.on.form.classes {
            None => self.model.predict(&self.on.x),
            Some(n) => {
                let shares = self.model.class_shares(&self.on.x);
                shares.chunks_exact(n).map(|shares| real(greedy(shares))).collect()
            }
        };
        Ok(Array::series(rows(&self.on), values))
    }
}

impl Op for ClassProbabilities {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        same(&self.model.form(), &self.on.form).map_err(failed)?;
        has_one_class(&self.on.form).map_err(failed)?;
        let classes = Dim::new("class", Labels::count(self.on.form.classes.unwrap_or(0)));
        let values = self.model.class_shares(&self.on.x);
        Ok(Array { dims: vec![rows(&self.on), classes], values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learner::{Knn, Learner as _};

    const CTX: Ctx = Ctx::new("predictions", 0, None);

    #[test]
    fn numbers_and_classes_by_hand() {
        let on = Dataset::pairs(vec![0.0, 2.0], vec![9.0, 9.0]);
        let model = One(Model::Polynomial(vec![1.0, 3.0]));
        let found = Predictions { model: model.clone(), on: One(on.clone()) }.run(&CTX).unwrap();
        assert_eq!((found.dims[0].name.as_str(), &found.values[..]), ("row", &[1.0, 7.0][..]));
        let why = ClassProbabilities { model, on: One(on) }.run(&CTX).unwrap_err().to_string();
        assert_eq!(why, "the targets are numbers and no classes");

        let form = Form { classes: Some(3), ..Form::default() };
        let data = Dataset { form, x: vec![0.0, 1.0, 10.0, 11.0], y: vec![2.0, 2.0, 0.0, 1.0] };
        let model = One(Knn { k: 2 }.train(&data, 0, &CTX).unwrap());
        let on = || One(data.pick(&[0, 3]));
        let shares = ClassProbabilities { model: model.clone(), on: on() }.run(&CTX).unwrap();
        assert_eq!(shares.values, [0.0, 0.0, 1.0, 0.5, 0.5, 0.0]);
        assert_eq!(Predictions { model, on: on() }.run(&CTX).unwrap().values, [2.0, 0.0]);
    }
}
