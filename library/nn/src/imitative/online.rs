//! How imitative models go on learning while somebody drives by them.

use ivx_data::Form;
use rand_chacha::ChaCha8Rng;

use super::Imitative;
use super::train::log_density;
use crate::descend::{Descent, Rule};
use crate::live::Live;

/// An imitative model that learns, update by update.
#[derive(Debug)]
pub struct PlanLearner<'a> {
    model: Imitative,
    live: Live,
    descent: Descent<'a>,
}

impl<'a> PlanLearner<'a> {
    /// One that begins as a model.
    #[must_use]
    pub fn new(model: Imitative, rule: Rule<'a>) -> Self {
        let live = Live::of(&model.nets);
        let descent = Descent::new(&live, &[""], rule);
        Self { model, live, descent }
    }

    /// Lowers `−1/N Σ_i ln q(a_i | s_i; θ)` of some observations, with the pull of the prior, by one update.
    ///
    /// # Panics
    /// If these are not of the form that the model is of.
    pub fn learn(&mut self, form: &Form, data: (&[f32], &[f32]), dropout: &mut ChaCha8Rng) {
        self.descent.lower(&self.live, |live| {
            let log_q = log_density(live, form, data, dropout);
            live.graph.affine(live.graph.mean(log_q), -1.0, 0.0)
        });
    }

    /// What it has learned.
    pub fn model(&mut self) -> &Imitative {
        self.live.put_into(&mut self.model.nets);
        &self.model
    }
}
