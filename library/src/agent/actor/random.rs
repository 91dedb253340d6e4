//! Acting without knowing anything.

use ivx_data::{Columns, Misfit};
use ivx_op::{OpError, declare};
use ivx_world::{Actions, Acts, Spec};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::Actor;
use crate::agent::agent::Acting;

declare! {
    /// Somebody who draws every action evenly: one of all, or each number of a vector between its bounds.
    pub struct Random = "random" @ 1 {}
}

impl Actor for Random {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        match &spec.does {
            Actions::Continuous { low, high } if low.iter().chain(high).any(|x| !x.is_finite()) => {
                let message = "the actions of this world have no bounds to draw them between";
                Err(Misfit::new(message.to_owned(), "use a world with bounds"))
            }
            _ => Ok(()),
        }
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting + '_>, Misfit> {
        self.fits(spec)?;
        Ok(Box::new(Drawn { does: spec.does.clone() }))
    }
}

struct Drawn {
    does: Actions,
}

impl Acting for Drawn {
    fn act(&mut self, _: &Columns, rng: &mut ChaCha8Rng, acts: &mut Acts) -> Result<(), OpError> {
        match &self.does {
            Actions::Discrete(names) => {
                acts.places.iter_mut().for_each(|place| *place = rng.random_range(0..names.len()));
            }
            Actions::Continuous { low, high } => {
                for vector in acts.vectors.chunks_exact_mut(low.len()) {
                    for ((x, low), high) in vector.iter_mut().zip(low).zip(high) {
                        *x = low + (high - low) * rng.random::<f32>();
                    }
                }
            }
        }
        Ok(())
    }
}
