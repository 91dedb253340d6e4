//! Who acts in worlds of any kind.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::{Columns, Misfit};
use ivx_op::{One, Parts, declare, family};
use ivx_world::{Acts, Spec};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::agent::{Acting, Agent};

/// Somebody who acts in worlds that show and take certain things.
pub trait Actor: Debug + Send + Sync {
    /// Whether there can be somebody who acts in such a world.
    ///
    /// # Errors
    /// Why not.
    fn fits(&self, spec: &Spec) -> Result<(), Misfit>;

    /// Somebody who does.
    ///
    /// # Errors
    /// Why there can be nobody.
    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting>, Misfit>;
}

declare! {
    /// An agent as it has learned to act.
    pub struct Trained = "trained" @ 1 {
        /// The agent.
        agent: One<Agent>;
    }
}

declare! {
    /// Somebody who draws every action evenly.
    pub struct Random = "random" @ 1 {}
}

impl Actor for Trained {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        self.agent.spec.same(spec)
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting>, Misfit> {
        self.fits(spec)?;
        Ok(self.agent.open())
    }
}

impl Actor for Random {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        spec.does.n_discrete().map(drop)
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting>, Misfit> {
        Ok(Box::new(Drawn { n: spec.does.n_discrete()? }))
    }
}

struct Drawn {
    n: usize,
}

impl Acting for Drawn {
    fn act(&mut self, _: &Columns, rng: &mut ChaCha8Rng, acts: &mut Acts) {
        acts.places.iter_mut().for_each(|place| *place = rng.random_range(0..self.n));
    }
}

family!(dyn Actor, "Actor", actors);

pub(super) fn actors() -> &'static Parts<dyn Actor> {
    static TABLE: LazyLock<Parts<dyn Actor>> = LazyLock::new(|| {
        Parts::<dyn Actor>::new().with(|x: Trained| Box::new(x)).with(|x: Random| Box::new(x))
    });
    &TABLE
}
