//! Policies of finite worlds.

use ivx_data::{Columns, Misfit, NOT_FINITE, Values, finite, pairs};
use ivx_math::policy::pick;
use ivx_op::{Array, One, OpError, declare};
use ivx_world::{Actions, Acts, Spec};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::Actor;
use crate::agent::agent::Acting;

declare! {
    /// Somebody who acts by a policy of a finite world.
    pub struct Tabular = "tabular" @ 1 {
        /// The probability of each action in each state.
        policy: One<Array>;
    }
}

impl Actor for Tabular {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        let help = "use a world that is, such as `chain()`, `goal_world()` or `gridworld()`";
        match finite(&spec.sees, &spec.does) {
            Some(_) => Ok(()),
            None => Err(Misfit::new(NOT_FINITE.replace("these episodes are", "this is"), help)),
        }
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting + '_>, Misfit> {
        self.fits(spec)?;
        let (Some((n, width)), Actions::Discrete(actions)) =
            (finite(&spec.sees, &spec.does), &spec.does)
        else {
            unreachable!("it fits");
        };
        let pairs = pairs(n, actions);
        let policy = ivx_world::policy(&self.policy, &pairs)
            .map_err(|error| Misfit::new(error.to_string(), "make it for this world"))?;
        Ok(Box::new(Drawn { policy: policy.to_vec(), width }))
    }
}

struct Drawn {
    policy: Vec<f64>,
    width: usize,
}

impl Acting for Drawn {
    fn act(
        &mut self,
        seen: &Columns,
        rng: &mut ChaCha8Rng,
        acts: &mut Acts,
    ) -> Result<(), OpError> {
        let Values::Index(states) = seen.values(0) else { unreachable!("the world is finite") };
        for (act, state) in acts.places.iter_mut().zip(states) {
            *act = pick(&self.policy[*state as usize * self.width..][..self.width], rng.random());
        }
        Ok(())
    }
}
