//! Models that were learned from what was seen and done.

use ivx_data::form::told;
use ivx_data::{Actions, Columns, Field, Form, Misfit};
use ivx_nn::Model;
use ivx_op::{Members, declare};
use ivx_world::Spec;

use super::{Simulating, Simulator};

declare! {
    /// Models that were learned of `labelled_transitions`, each of which foretells a plan step by step from what it foretold
    /// before (Eqn. 2.66 without the value of where it ends). None of them knows when an episode is over.
    pub struct LearnedModel = "learned" @ 1 {
        /// The members, equally probable.
        models: Members<Model>;
    }
}

/// What models are learned of: of what was seen and done, how what is seen changes, and what is paid.
pub(super) fn form(sees: &[Field], does: &Actions) -> Form {
    let seen: usize = sees.iter().map(Field::spread).sum();
    Form { input: vec![seen + does.field().spread()], target: vec![seen + 1], ..Form::default() }
}

impl Simulator for LearnedModel {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        let wanted = form(&spec.sees, &spec.does);
        for model in &*self.models {
            let own = model.form();
            if (&own.input, &own.target, own.classes) != (&wanted.input, &wanted.target, None) {
                let message = format!(
                    "the model is of {}, and one of this world is of {}",
                    told(&own),
                    told(&wanted)
                );
                let help = "train it on `labelled_transitions` of episodes in this world";
                return Err(Misfit::new(message, help));
            }
        }
        Ok(())
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Simulating + '_>, Misfit> {
        self.fits(spec)?;
        let does = spec.does.clone();
        let seen = vec![0.0; spec.sees.iter().map(Field::spread).sum()];
        Ok(Box::new(Foretelling { models: &self.models, does, seen, xs: Vec::new() }))
    }
}

struct Foretelling<'a> {
    models: &'a [Model],
    does: Actions,
    /// What is seen where plans begin.
    seen: Vec<f32>,
    /// What goes into a model: `[n, seen + action]`.
    xs: Vec<f64>,
}

impl Simulating for Foretelling<'_> {
    fn n_members(&self) -> usize {
        self.models.len()
    }

    fn begin(&mut self, seen: &Columns, row: usize) {
        seen.spread_rows(&[row], &mut self.seen);
    }

    fn returns(&mut self, plans: &[f64], n: usize, discount: f64, returns: &mut [f64]) {
        let (len, n_seen, n_members) = (plans.len() / n, self.seen.len(), self.models.len());
        let action = self.does.field();
        let (width, step) = (n_seen + action.spread(), action.width());
        returns.fill(0.0);
        self.xs.resize(n * width, 0.0);
        for (m, model) in self.models.iter().enumerate() {
            for x in self.xs.chunks_exact_mut(width) {
                x.iter_mut().zip(&self.seen).for_each(|(x, seen)| *x = f64::from(*seen));
            }
            let mut weight = 1.0;
            for t in 0..len / step {
                for (x, plan) in self.xs.chunks_exact_mut(width).zip(plans.chunks_exact(len)) {
                    write(&self.does, &plan[t * step..][..step], &mut x[n_seen..]);
                }
                let foretold = model.predict(&self.xs);
                let each = self.xs.chunks_exact_mut(width).zip(foretold.chunks_exact(n_seen + 1));
                for ((x, foretold), own) in each.zip(returns.chunks_exact_mut(n_members)) {
                    x.iter_mut().zip(&foretold[..n_seen]).for_each(|(x, change)| *x += change);
                    own[m] += weight * foretold[n_seen];
                }
                weight *= discount;
            }
        }
    }
}

/// Writes an action of a plan as it goes into a model.
fn write(does: &Actions, numbers: &[f64], out: &mut [f64]) {
    match does {
        Actions::Continuous { .. } => out.copy_from_slice(numbers),
        Actions::Discrete(_) => {
            let places = out.iter_mut().enumerate();
            places.for_each(|(place, x)| {
                let is_it = ivx_math::moments::real(place) == numbers[0];
                *x = f64::from(u8::from(is_it));
            });
        }
    }
}
