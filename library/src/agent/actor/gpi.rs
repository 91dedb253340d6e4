//! Generalised policy improvement over what several agents have learned.

use ivx_data::Misfit;
use ivx_op::{Labelled, Many, Part, declare};
use ivx_world::Spec;

use super::Actor;
use crate::agent::agent::{Acting, Choice};
use crate::agent::improve::{Improving, Values};
use crate::ke::KnowledgeEquivalent;

declare! {
    /// Somebody who takes the action that is worth most by the policy that is worth most after it (generalised policy
    /// improvement, Theorem 4.1), where what the members of an ensemble say of a policy is reduced to one number: the
    /// lowest is Eqn. 4.23.
    ///
    /// Each of `of` is an agent that has values of its own policy (`dqn`) or features of several (`psi_phi`, `itd`), or
    /// several agents that are collected: they are members, beside those that each has itself. Each values features by
    /// its own task.
    pub struct Gpi = "gpi" @ 1 {
        /// Whose policies there are.
        of: Many<Labelled<crate::agent::Agent>>;
        /// What members that disagree are worth.
        ke: Box<dyn KnowledgeEquivalent> = Part::new("wcm");
    }
}

impl Actor for Gpi {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        if self.of.0.is_empty() {
            return Err(Misfit::new("there is no agent".to_owned(), "name one"));
        }
        for agent in self.of.0.iter().flat_map(|of| &of.0.values) {
            agent.spec.same(spec)?;
            if matches!(agent.acts, Choice::Sampled | Choice::Likeliest) {
                let message = "an agent has a policy, and no values of actions".to_owned();
                return Err(Misfit::new(message, "use one that learned by `dqn` or `psi_phi`"));
            }
        }
        Ok(())
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting + '_>, Misfit> {
        self.fits(spec)?;
        let mut all = Vec::new();
        for of in &self.of.0 {
            let members: Vec<Values> = of.0.values.iter().map(Values::of).collect();
            if members.iter().any(|values| values.sizes() != members[0].sizes()) {
                let message = "the agents that are collected do not know equally many policies";
                return Err(Misfit::new(message.to_owned(), "collect agents of one kind"));
            }
            all.push(members);
        }
        let reduce = |said: &[f64]| {
            let weight = 1.0 / ivx_math::moments::real(said.len());
            self.ke.reduce(said, &vec![weight; said.len()])
        };
        Ok(Box::new(Improving::new(all, Box::new(reduce))))
    }
}
