//! Logistic regression.

use std::sync::Arc;

use ivx_data::{Dataset, Form, Misfit};
use ivx_math::logistic::logistic;
use ivx_nn::{Fitted, Model};
use ivx_op::{Ctx, OpError, declare};

use super::Learner;
use super::targets::{are_classes, are_sound, classes};

declare! {
    /// Logistic regression with an L2 penalty: the weights and intercepts of least
    /// `c Σ_n −log p(class_n | x_n) + ½ ‖W‖²`, where `p` is a softmax of `b + Wᵀ x`, of two classes a sigmoid.
    ///
    /// The intercepts are not penalised. Inputs of any shape are vectors of their numbers; the penalty is fair where
    /// these are of one scale. A class that the data do not have is impossible.
    pub struct Logistic = "logistic" @ 1 {
        /// How much the data weigh against the penalty.
        c: f64 = 1.0, in f64::MIN_POSITIVE..;
    }
}

impl Learner for Logistic {
    fn train(&self, data: &Dataset, _: u64, _: &Ctx) -> Result<Model, OpError> {
        are_sound(data)?;
        let form = data.form.clone();
        let n_classes = form.classes.expect("it fits");
        let fit = logistic(&data.x, form.input_len(), &classes(data), n_classes, self.c);
        let fit = fit.map_err(OpError::Failed)?;
        Ok(Model::Fitted(Fitted { form, function: Arc::new(fit) }))
    }

    fn fits(&self, form: &Form) -> Result<(), Misfit> {
        are_classes("logistic", form)
    }

    fn memory(&self, form: &Form, n: u64) -> u64 {
        let n_classes = form.classes.unwrap_or(1);
        // The table of centred inputs and another of its size, and a few of logits.
        8 * n * (2 * form.input_len() + 6 * n_classes) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metric::{Accuracy, Nll};
    use ivx_op::{One, Op as _};

    /// Four heaps at the corners of a square, of two classes: those of the right half, and of three.
    #[test]
    fn heaps_are_told_apart_and_misfits_told() {
        let at = |i: usize| {
            [f64::from(u8::from(i % 4 > 1)) * 4.0, f64::from(u8::from(i % 2 == 1)) * 4.0]
        };
        let near = |i: usize| (ivx_math::moments::real(i) * 0.37).sin();
        let x: Vec<f64> =
            (0..80).flat_map(|i| [at(i)[0] + near(i), at(i)[1] + near(i + 7)]).collect();
        let ctx = Ctx::new("train", 0, None);
        for (n_classes, bound) in [(2, 1.0), (3, 0.99)] {
            let y = (0..80_u32)
                .map(|i| f64::from(if i % 4 > 1 { 1 } else { (i % 2) * (n_classes - 1) }));
            let form = Form {
                input: vec![2],
                target: vec![],
                classes: Some(n_classes as usize),
                ..Form::default()
            };
            let y = if n_classes == 2 {
                (0..80_u32).map(|i| f64::from(u8::from(i % 4 > 1))).collect()
            } else {
                y.collect()
            };
            let data = Dataset { form, x: x.clone(), y };
            let model = Logistic { c: 1.0 }.train(&data, 0, &ctx).unwrap();
            let share = Accuracy { model: One(model.clone()), on: One(data.clone()) }.run(&ctx);
            assert!(share.unwrap().values[0] >= bound);
            // Better than the shares of the classes by far.
            let nll = Nll { model: One(model), on: One(data) }.run(&ctx).unwrap().values[0];
            assert!(nll < 0.2, "{nll}");
        }
        let why = Logistic { c: 1.0 }.fits(&Form::default()).unwrap_err().message;
        assert_eq!(why, "`logistic` tells classes apart, and the targets are numbers");
        let many = Form { target: vec![5], classes: Some(2), ..Form::default() };
        let why = Logistic { c: 1.0 }.fits(&many).unwrap_err().message;
        assert_eq!(why, "`logistic` learns one class an observation, and there are 5");
    }
}
