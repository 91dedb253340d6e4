//! Ridge regression.

use std::sync::Arc;

use ivx_data::{Dataset, Form, Misfit};
use ivx_math::affine::ridge;
use ivx_nn::{Fitted, Model};
use ivx_op::{Ctx, OpError, declare};

use super::Learner;
use super::targets::{are_numbers, are_sound};

declare! {
    /// Linear regression with an L2 penalty, in closed form (Hoerl and Kennard, 1970): the weights and the intercept
    /// of least `Σ_n ‖y_n − b − Wᵀ x_n‖² + alpha ‖W‖²`.
    ///
    /// The intercept is not penalised. Inputs of any shape are vectors of their numbers; the penalty is fair where
    /// these are of one scale. Without a penalty it is least squares, of several solutions the least.
    pub struct Ridge = "ridge" @ 1 {
        /// How much the squared weights weigh.
        alpha: f64 = 1.0, in 0.0..;
    }
}

impl Learner for Ridge {
    fn train(&self, data: &Dataset, _: u64, _: &Ctx) -> Result<Model, OpError> {
        are_sound(data)?;
        let form = data.form.clone();
        let fit = ridge(&data.x, form.input_len(), &data.y, form.target_len(), self.alpha);
        Ok(Model::Fitted(Fitted { form, function: Arc::new(fit) }))
    }

    fn fits(&self, form: &Form) -> Result<(), Misfit> {
        are_numbers("ridge", form)
    }

    fn memory(&self, form: &Form, n: u64) -> u64 {
        // The table of centred numbers, once more while it is decomposed.
        2 * 8 * n * (form.input_len() + form.target_len()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_are_taken_and_classes_are_not() {
        // y = 1 + 2 a − b.
        let form = Form { input: vec![2], ..Form::default() };
        let data = Dataset {
            form: form.clone(),
            x: vec![0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 2.0, 3.0],
            y: vec![1.0, 3.0, 0.0, 2.0],
        };
        let ctx = Ctx::new("train", 0, None);
        let model = Ridge { alpha: 0.0 }.train(&data, 0, &ctx).unwrap();
        assert!((model.predict(&[5.0, 1.0])[0] - 10.0).abs() < 1e-12);
        let of_classes = Form { classes: Some(3), ..form };
        let why = Ridge { alpha: 0.0 }.fits(&of_classes).unwrap_err().message;
        assert_eq!(why, "`ridge` learns numbers, and the targets are one of 3 classes");
        let mut broken = data;
        broken.x[3] = f64::NAN;
        let why = Ridge { alpha: 0.0 }.train(&broken, 0, &ctx).unwrap_err().to_string();
        assert_eq!(why, "the input of observation 1 has NaN, which is no number to learn from");
    }
}
