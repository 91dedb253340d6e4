//! What is paid in a new task, with all else known (§4.3.4).

use ivx_data::form::failed;
use ivx_data::{Columns, Misfit};
use ivx_math::successor::Preferences;
use ivx_nn::{Live, Real as _, Schedule};
use ivx_op::{Ctx, One, OpError, Part, State, declare};
use ivx_world::{Acts, Spec, Step};

use super::super::agent::{Agent, Choice, TORSO, look};
use super::super::explore::Explore;
use super::super::features::{TASK, cumulants, policies};
use super::super::improve::{best, worth};
use super::{Learning, Means, Method, Setting};

declare! {
    /// Which preferences a new task has, of an agent that knows cumulants and successor features (§4.3.4): by least
    /// squares over all that was paid in it,
    ///
    /// ```text
    /// w = argmin Σ (Φ(s, a)ᵀ w - r')² + ridge ‖w - w_old‖²
    /// ```
    ///
    /// after every step. Nothing else changes. It acts by the best of all policies that it knows (Eqn. 4.23), and by the
    /// preferences that it had as long as nothing contradicts them. The thesis is silent about what is not told by what
    /// was paid; that it stays as it was is ours.
    pub struct NewTask = "preferences" @ 2 {
        /// An agent that learned by `psi_phi`.
        of: One<Agent>;
        /// What the square of a change weighs beside squares of errors, summed over steps.
        ridge: f64 = 0.01, in f64::MIN_POSITIVE..;
        /// The probability of an action drawn evenly while it learns, which falls, if it does, over the steps it learns for.
        epsilon: Box<dyn Schedule> = Part::new("constant").with("value", 0.0);
    }
}

impl NewTask {
    fn heard(&self) -> Result<usize, Misfit> {
        if let Choice::Improved(heard) = self.of.acts {
            return Ok(heard);
        }
        let message = "the agent has no successor features of its own".to_owned();
        Err(Misfit::new(message, "use one that learned by `psi_phi`"))
    }
}

impl Method for NewTask {
    fn fits(&self, setting: &Setting<'_>) -> Result<(), Misfit> {
        self.of.spec.same(setting.spec)
    }

    fn memory(&self, _: &Setting<'_>) -> u64 {
        0
    }

    fn begin<'a>(
        &'a self,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError> {
        let heard = self.heard().map_err(failed)?;
        let nets = &self.of.nets;
        let (_, shape, old) = nets.array(TASK).expect("its own preferences");
        Ok(Box::new(Learner {
            how: self,
            heard,
            old: old.iter().map(|w| f64::from(*w)).collect(),
            seen: Preferences::new(shape[0]),
            changed: false,
            updates: 0,
            policies: policies(nets),
            live: Live::of(nets),
            spec: setting.spec.clone(),
            explore: Explore {
                epsilon: &*self.epsilon,
                over: setting.steps.unwrap_or(1),
                warm_up: 0,
                rng: ctx.rng("explore", &[]),
            },
            losses: Means::new(&["error"]),
            tried: Vec::new(),
            values: Vec::new(),
        }))
    }
}

struct Learner<'a> {
    how: &'a NewTask,
    heard: usize,
    old: Vec<f64>,
    /// What was seen, and how much more it paid than the old preferences say.
    seen: Preferences,
    changed: bool,
    updates: u64,
    policies: Vec<Vec<String>>,
    live: Live,
    spec: Spec,
    explore: Explore<'a>,
    losses: Means,
    tried: Vec<Option<usize>>,
    values: Vec<f64>,
}

impl Learning for Learner<'_> {
    fn act(&mut self, t: u64, seen: &Columns, acts: &mut Acts) {
        let Ok(n) = self.spec.does.n_discrete() else { unreachable!("it fits") };
        let Self { live, policies, values, heard, explore, tried, .. } = self;
        explore.tried(t, n, seen.len(), tried);
        live.graph.begin();
        let z = live.graph.still(|| live.pass(TORSO, look(live, seen)));
        worth(live, policies, Some(TASK), z, values);
        let lowest = |said: &[f64]| ivx_math::order::min(&said[..*heard]);
        let sizes = (policies.len(), policies[0].len());
        let rows = values.chunks_exact(values.len() / seen.len());
        for (act, (tried, values)) in acts.places.iter_mut().zip(tried.iter().zip(rows)) {
            *act = tried.unwrap_or_else(|| best(values, sizes, &lowest));
        }
    }

    fn see(&mut self, step: &Step) {
        let Self { live, old, seen, .. } = self;
        let graph = &live.graph;
        graph.begin();
        let cumulants = graph.value(cumulants(live, &step.before, &step.acts.places));
        let mut errors = 0.0;
        for (phi, reward) in cumulants.chunks_exact(old.len()).zip(&step.rewards) {
            let phi: Vec<f64> = phi.iter().map(|x| f64::from(*x)).collect();
            let said: f64 = phi.iter().zip(&*old).map(|(x, w)| x * w).sum();
            seen.see(&phi, reward - said);
            errors += (reward - said).powi(2);
        }
        self.losses.add(&[errors / ivx_math::moments::real(step.rewards.len())]);
        self.changed = true;
    }

    fn learn(&mut self, _: u64) {
        if !std::mem::take(&mut self.changed) {
            return;
        }
        let change = self.seen.infer(self.how.ridge);
        let place = self.live.group(&[TASK])[0];
        let mut params = self.live.graph.params();
        let own = params.value_mut(place).iter_mut();
        own.zip(self.old.iter().zip(change)).for_each(|(w, (old, more))| *w = f32::of(old + more));
        drop(params);
        self.updates += 1;
    }

    fn updates(&self) -> u64 {
        self.updates
    }

    fn agent(&self) -> Agent {
        let (nets, knows) = (self.live.networks(), self.how.of.knows.clone());
        Agent { acts: Choice::Improved(self.heard), nets, spec: self.spec.clone(), knows }
    }

    fn losses(&mut self) -> &mut Means {
        &mut self.losses
    }

    fn state(&mut self, state: &mut State) {
        state.within("live", |state| self.live.state(state));
        state.within("losses", |state| self.losses.state(state));
        state.reals("products", &mut self.seen.products);
        state.reals("paid", &mut self.seen.paid);
        state.count("updates", &mut self.updates);
    }
}
