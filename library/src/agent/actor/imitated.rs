//! Acting as somebody who was seen.

use ivx_data::Misfit;
use ivx_op::{One, declare};
use ivx_world::Spec;

use super::Actor;
use crate::agent::agent::{Acting, Agent};
use crate::agent::improve::{Improving, Values};

declare! {
    /// Somebody who acts as a demonstrator would: by the action that is worth most by its successor features and
    /// preferences (Eqn. 4.19), as an agent has learned them, on average over members.
    pub struct Imitated = "imitated" @ 1 {
        /// An agent that learned by `itd` or `psi_phi`.
        agent: One<Agent>;
        /// What the demonstrator is called.
        whose: String = "";
    }
}

impl Imitated {
    /// The place of the demonstrator, counted from 1.
    fn place(&self) -> Result<usize, Misfit> {
        known(&self.agent, &self.whose)
    }
}

/// The place of a demonstrator that an agent knows, counted from 1; without a name, of the only one.
pub(crate) fn known(agent: &Agent, whose: &str) -> Result<usize, Misfit> {
    let place = match agent.knows.iter().position(|name| name == whose) {
        None if whose.is_empty() && agent.knows.len() == 1 => Some(0),
        place => place,
    };
    place.map(|k| k + 1).ok_or_else(|| {
        let names: Vec<String> = agent.knows.iter().map(|name| format!("`{name}`")).collect();
        let message = match &names[..] {
            [] => "the agent has not learned what others do".to_owned(),
            _ if whose.is_empty() => "the agent knows several".to_owned(),
            _ => format!("the agent does not know `{whose}`"),
        };
        let help = match &names[..] {
            [] => "use one that learned by `itd` or `psi_phi`".to_owned(),
            _ => format!("say whose: it knows {}", names.join(", ")),
        };
        Misfit::new(message, &help)
    })
}

impl Actor for Imitated {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        self.agent.spec.same(spec)
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting + '_>, Misfit> {
        self.fits(spec)?;
        let values = Values::imitated(&self.agent, self.place()?);
        let reduce = Box::new(ivx_math::moments::mean);
        Ok(Box::new(Improving::new(vec![vec![values]], reduce)))
    }
}
