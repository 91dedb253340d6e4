//! Agents as they have learned to act.

use ivx_data::Misfit;
use ivx_op::{One, declare};
use ivx_world::Spec;

use super::Actor;
use crate::agent::agent::{Acting, Agent};

declare! {
    /// An agent as it has learned to act.
    pub struct Trained = "trained" @ 1 {
        /// The agent.
        agent: One<Agent>;
    }
}

impl Actor for Trained {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        self.agent.spec.same(spec)
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting + '_>, Misfit> {
        self.fits(spec)?;
        Ok(self.agent.open())
    }
}
