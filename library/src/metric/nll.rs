//! How improbable a model finds what happened.

use std::f64::consts::TAU;

use ivx_data::form;
use ivx_data::{Dataset, Form};
use ivx_math::moments::mean;
use ivx_math::order::max;
use ivx_nn::Model;
use ivx_op::{Array, Ctx, Facts, One, Op, OpError, Wrong, declare};

use crate::learner::spread::{says_std, stds};

declare! {
    /// The negative log-likelihood in nats, averaged over targets (Eqn. 2.15).
    ///
    /// Of classes it is what `cross_entropy` lowers. Of numbers it is what `gaussian_nll` lowers, summed over those of a
    /// target: `½ ln 2πσ² + (y − μ)² / 2σ²`, by the mean and the standard deviation that a network trained so puts
    /// out, or a `mixture` has.
    pub struct Nll = "nll" @ 2 -> Array {
        /// The model.
        model: One<Model>;
        /// The data.
        on: One<Dataset>;
    }
    rule measurable;
}

/// The rule that `on` is such as `model` was trained on, and that this says a distribution of its targets.
fn measurable(facts: &Facts<'_>) -> Result<(), Wrong> {
    form::model_of_data(facts)?;
    match facts.shapes("model") {
        Some(model) if Form::of(model).is_some_and(|form| form.classes.is_none()) => {
            says_std(model).map_err(form::wrong("model"))
        }
        _ => Ok(()),
    }
}

impl Op for Nll {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        if self.on.is_empty() {
            return Err(OpError::Failed("there are no data to measure it on".to_owned()));
        }
        form::same(&self.model.form(), &self.on.form).map_err(form::failed)?;
        if self.on.form.classes.is_none() {
            return self.of_numbers();
        }
        let logits = self.model.predict(&self.on.x);
        let rows = logits.chunks_exact(logits.len() / self.on.y.len());
        let each: Vec<f64> = rows.zip(&self.on.y).map(|(row, class)| of_one(row, *class)).collect();
        Ok(Array::scalar(mean(&each)))
    }
}

impl Nll {
    fn of_numbers(&self) -> Result<Array, OpError> {
        let data = &self.on;
        let stds = stds(&self.model, &data.x).map_err(form::failed)?;
        if let Some(i) = stds.iter().position(|std| *std == 0.0) {
            let row = i / data.form.target_len();
            let why =
                format!("the standard deviation of observation {row} is 0: give the members noise");
            return Err(OpError::Failed(why));
        }
        let means = self.model.predict(&data.x);
        let each =
            data.y.iter().zip(means.iter().zip(&stds)).map(|(y, (mean, std))| {
                0.5 * TAU.ln() + std.ln() + 0.5 * ((y - mean) / std).powi(2)
            });
        let width = data.form.target.last().copied().unwrap_or(1);
        let each: Vec<f64> = each.collect();
        let of_target: Vec<f64> = each.chunks_exact(width).map(|each| each.iter().sum()).collect();
        Ok(Array::scalar(mean(&of_target)))
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
        // What is thought impossible and happens is infinitely so.
        assert_eq!(of_one(&[0.0, f64::NEG_INFINITY], 1.0), f64::INFINITY);
        assert_eq!(of_one(&[0.0, f64::NEG_INFINITY], 0.0), 0.0);
    }
}
