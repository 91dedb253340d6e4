//! Learning from rewards that were inferred from what others did (§4.3.2).

use ivx_data::form::failed;
use ivx_data::{Columns, Misfit};
use ivx_nn::Live;
use ivx_op::{Ctx, One, OpError, State, declare};
use ivx_world::{Acts, Step};

use super::super::actor::known;
use super::super::agent::Agent;
use super::super::features::{cumulants, preferences};
use super::{Learning, Means, Method, Setting};

declare! {
    /// A method that is paid what an agent infers that a demonstrator is paid, `Φ(s, a)ᵀ w^k` (Eqn. 4.20), and nothing
    /// that the world pays (Table 4.1). What becomes of it is measured by what the world pays.
    pub struct Inferred = "inferred" @ 1 {
        /// An agent that learned by `itd` or `psi_phi`.
        of: One<Agent>;
        /// What the demonstrator is called; nothing where the agent knows one.
        whose: String = "";
        /// How it learns.
        by: Box<dyn Method>;
    }
}

impl Method for Inferred {
    fn fits(&self, setting: &Setting<'_>) -> Result<(), Misfit> {
        if !self.by.is_paid() {
            let message = "what it learns by learns from nothing that is paid";
            return Err(Misfit::new(message.to_owned(), "use one that does, as `dqn`"));
        }
        self.of.spec.same(setting.spec)?;
        self.by.fits(setting)
    }

    fn memory(&self, setting: &Setting<'_>) -> u64 {
        self.by.memory(setting)
    }

    fn is_paid(&self) -> bool {
        false
    }

    fn begin<'a>(
        &'a self,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError> {
        let whose = known(&self.of, &self.whose).map_err(failed)?;
        Ok(Box::new(Paid {
            of: Live::of(&self.of.nets),
            w: preferences(whose),
            by: self.by.begin(setting, ctx)?,
        }))
    }
}

struct Paid<'a> {
    of: Live,
    w: String,
    by: Box<dyn Learning + 'a>,
}

impl Learning for Paid<'_> {
    fn act(&mut self, t: u64, seen: &Columns, acts: &mut Acts) {
        self.by.act(t, seen, acts);
    }

    fn see(&mut self, step: &Step) {
        let graph = &self.of.graph;
        graph.begin();
        let paid = graph.still(|| {
            graph.contract(
                cumulants(&self.of, &step.before, &step.acts.places),
                self.of.array(&self.w),
            )
        });
        let rewards = graph.value(paid).into_iter().map(f64::from).collect();
        self.by.see(&Step { rewards, ..step.clone() });
    }

    fn learn(&mut self, t: u64) {
        self.by.learn(t);
    }

    fn updates(&self) -> u64 {
        self.by.updates()
    }

    fn agent(&self) -> Agent {
        self.by.agent()
    }

    fn losses(&mut self) -> &mut Means {
        self.by.losses()
    }

    fn state(&mut self, state: &mut State) {
        self.by.state(state);
    }
}
