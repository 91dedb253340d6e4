//! Driving by the plan that a model foretells.

use ivx_data::form::told;
use ivx_data::{Columns, Misfit};
use ivx_nn::Model;
use ivx_op::{One, OpError, declare};
use ivx_world::{Acts, Spec};
use rand_chacha::ChaCha8Rng;

use super::Actor;
use super::wheels::{Eyes, Wheels};
use crate::agent::agent::Acting;

declare! {
    /// Somebody who drives by the plan that a model predicts where they are, as `rip` follows the plan that it found: what was
    /// learned by `cil` is conditional imitation learning (Codevilla et al., 2018).
    pub struct Follows = "follows" @ 1 {
        /// A model of plans that `windows` cut from drives.
        model: One<Model>;
        /// What is seen by the model, as in `windows`.
        sees: Vec<String> = vec!["lidar", "velocity", "command"];
        /// How many steps of the world are between the places of a plan, as in `windows`.
        every: usize = 20, in 1.0..=1e4;
    }
}

impl Actor for Follows {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        let eyes = Eyes::of(spec, &self.sees)?;
        let of = self.model.form();
        eyes.fit(spec, &of, self.every)
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting + '_>, Misfit> {
        self.fits(spec)?;
        let form = self.model.form();
        if form.target.len() != 2 || form.target[1] != 2 || form.classes.is_some() {
            let message = format!("the model is of {}, which are no plans", told(&form));
            return Err(Misfit::new(message, "let it learn from `windows` of two places"));
        }
        let eyes = Eyes::of(spec, &self.sees)?;
        Ok(Box::new(Driver { of: self, eyes, wheels: Wheels::new(self.every), seen: Vec::new() }))
    }
}

struct Driver<'a> {
    of: &'a Follows,
    eyes: Eyes,
    wheels: Wheels,
    seen: Vec<f32>,
}

impl Acting for Driver<'_> {
    fn begin(&mut self) {
        self.wheels.begin();
    }

    fn rest(&mut self, lanes: &[usize]) {
        self.wheels.rest(lanes);
    }

    fn act(&mut self, seen: &Columns, _: &mut ChaCha8Rng, acts: &mut Acts) -> Result<(), OpError> {
        let lanes = self.wheels.awake(seen.len());
        self.eyes.look(seen, lanes, &mut self.seen);
        let xs: Vec<f64> = self.seen.iter().map(|x| f64::from(*x)).collect();
        let plans = self.of.model.predict(&xs);
        self.wheels.follow(&self.eyes, seen, &plans, acts);
        Ok(())
    }
}
