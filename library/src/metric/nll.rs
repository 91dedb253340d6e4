//! How improbable a model finds what happened.

use ivx_data::Dataset;
use ivx_data::form;
use ivx_math::moments::mean;
use ivx_math::order::max;
use ivx_nn::Model;
use ivx_op::{Array, Ctx, One, Op, OpError, declare};

use super::accuracy::measurable;

declare! {
    /// The negative log-likelihood of classes, averaged over targets (Eqn. 2.15): what `cross_entropy` lowers.
    pub struct Nll = "nll" @ 2 -> Array {
        /// The model.
        model: One<Model>;
        /// The data.
        on: One<Dataset>;
    }
    rule measurable;
}

impl Op for Nll {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        if self.on.is_empty() {
            return Err(OpError::Failed("there are no data to measure it on".to_owned()));
        }
        form::same(&self.model.form(), &self.on.form).map_err(form::failed)?;
        super::accuracy::of_classes(&self.on.form).map_err(form::failed)?;
        let logits = self.model.predict(&self.on.x);
        let rows = logits.chunks_exact(logits.len() / self.on.y.len());
        let each: Vec<f64> = rows.zip(&self.on.y).map(|(row, class)| of_one(row, *class)).collect();
        Ok(Array::scalar(mean(&each)))
    }
}

/// `log Σ e^logit - logit[class]`; one logit is that of the second of two classes.
fn of_one(logits: &[f64], class: f64) -> f64 {
    if let [second] = logits {
        return of_one(&[0.0, *second], class);
    }
    let highest = max(logits);
    let sum: f64 = logits.iter().map(|logit| (logit - highest).exp()).sum();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a class")]
    let logit = logits[class as usize];
    highest + sum.ln() - logit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn likelihoods_by_hand() {
        // Probabilities ¼ and ¾.
        let odds = 3.0_f64.ln();
        assert!((of_one(&[5.0, 5.0 + odds], 0.0) - 4.0_f64.ln()).abs() < 1e-12);
        assert!((of_one(&[odds], 1.0) + 0.75_f64.ln()).abs() < 1e-12);
        assert_eq!(of_one(&[1000.0, 0.0], 1.0), 1000.0);
    }
}
