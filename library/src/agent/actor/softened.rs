//! Acting better the more it matters.

use ivx_data::{Columns, Misfit};
use ivx_op::{One, OpError, declare};
use ivx_world::{Acts, Spec};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::Actor;
use crate::agent::agent::{Acting, Agent, Choice, sampled};
use crate::agent::improve::Values;

declare! {
    /// Somebody who draws actions by a softmax of what an agent thinks they are worth, as demonstrators of §4.2.1 do
    /// (Eqns. 4.16, B.1): `π(a|s) ∝ e^{q(s, a) / ν}`.
    pub struct Softened = "softened" @ 1 {
        /// An agent that has values of actions, as one that learned by `dqn`.
        agent: One<Agent>;
        /// The temperature `ν`, in the unit of returns.
        temperature: f64, in f64::MIN_POSITIVE..;
    }
}

impl Actor for Softened {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        self.agent.spec.same(spec)?;
        if matches!(self.agent.acts, Choice::Greedy | Choice::Softened) {
            return Ok(());
        }
        let message = "the agent has no values of one policy".to_owned();
        Err(Misfit::new(message, "use one that learned by `dqn` or `sqil`"))
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting + '_>, Misfit> {
        self.fits(spec)?;
        Ok(Box::new(Soft { values: Values::of(&self.agent), temperature: self.temperature }))
    }
}

struct Soft {
    values: Values,
    temperature: f64,
}

impl Acting for Soft {
    #[expect(clippy::cast_possible_truncation, reason = "logits are drawn by in single precision")]
    fn act(
        &mut self,
        seen: &Columns,
        rng: &mut ChaCha8Rng,
        acts: &mut Acts,
    ) -> Result<(), OpError> {
        let temperature = self.temperature;
        let values = self.values.ask(seen);
        let rows = values.chunks_exact(values.len() / seen.len());
        for (place, row) in acts.places.iter_mut().zip(rows) {
            let logits: Vec<f32> = row.iter().map(|q| (q / temperature) as f32).collect();
            *place = sampled(&logits, rng.random()).0;
        }
        Ok(())
    }
}
