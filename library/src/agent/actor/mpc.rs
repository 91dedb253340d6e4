//! Planning at every step.

use ivx_data::{Actions, Columns, Misfit};
use ivx_math::moments::uniform;
use ivx_op::{Facts, OpError, Part, Wrong, declare};
use ivx_world::{Acts, Luck, Spec};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use super::Actor;
use crate::agent::agent::Acting;
use crate::ke::KnowledgeEquivalent;
use crate::planner::{Objective, Planner, Planning, Simulating, Simulator, Space};

declare! {
    /// Somebody who plans some steps ahead in a model, does the first and plans again (model predictive control, §2.3.3):
    /// a plan is worth the return that is foretold of it (Eqn. 2.67). A search starts from the plan before without what
    /// was done of it, whose last action goes on; the first from actions in the middle of what can be done.
    ///
    /// `gradient_plan` is given central differences over a thousandth of what a number may be, or of 1 where it has no
    /// bounds.
    pub struct Mpc = "mpc" @ 1 {
        /// How plans are found.
        planner: Box<dyn Planner>;
        /// In which model.
        model: Box<dyn Simulator>;
        /// How many steps ahead.
        horizon: usize, in 1.0..=1e4, unit "steps";
        /// After how many steps it plans again.
        every: usize = 1, in 1.0..=1e4, unit "steps";
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
        /// What the members of a model say of a plan together.
        ke: Box<dyn KnowledgeEquivalent> = Part::new("ma");
    }
    rule no_step_without_a_plan;
}

fn no_step_without_a_plan(facts: &Facts<'_>) -> Result<(), Wrong> {
    match facts.arg::<usize>("horizon").zip(facts.arg::<usize>("every")) {
        Some((horizon, every)) if every > horizon => Err(Wrong {
            arg: "every",
            message: format!("a plan of {horizon} steps is over before {every} are done"),
            help: "plan farther, or more often".to_owned(),
        }),
        _ => Ok(()),
    }
}

/// How many numbers of a plan an action is.
fn width(does: &Actions) -> usize {
    does.field().width()
}

impl Actor for Mpc {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        let len = self.horizon * width(&spec.does);
        self.planner.fits(&Space::of(&spec.does, self.horizon), len)?;
        self.model.fits(spec)
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting + '_>, Misfit> {
        self.fits(spec)?;
        let width = width(&spec.does);
        let space = Space::of(&spec.does, self.horizon);
        let model = self.model.open(spec)?;
        let weights = uniform(model.n_members());
        let (start, discount) = (space.middle(self.horizon * width), self.discount);
        let foretold = Foretold {
            model,
            space,
            len: start.len(),
            discount,
            ke: &*self.ke,
            weights,
            returns: Vec::new(),
            probes: Vec::new(),
            found: Vec::new(),
        };
        Ok(Box::new(Controlling {
            foretold,
            planning: self.planner.open(),
            start,
            done: self.every * width,
            every: self.every,
            width,
            age: 0,
            plans: Vec::new(),
        }))
    }
}

struct Controlling<'a> {
    foretold: Foretold<'a>,
    planning: Box<dyn Planning>,
    /// From where the first search starts.
    start: Vec<f64>,
    /// How many numbers of a plan are done before the next.
    done: usize,
    every: usize,
    width: usize,
    /// How many steps there were.
    age: usize,
    /// The plan of each lane.
    plans: Vec<f64>,
}

impl Acting for Controlling<'_> {
    fn begin(&mut self) {
        self.age = 0;
    }

    fn act(
        &mut self,
        seen: &Columns,
        rng: &mut ChaCha8Rng,
        acts: &mut Acts,
    ) -> Result<(), OpError> {
        if self.age == 0 {
            self.plans.clear();
            (0..seen.len()).for_each(|_| self.plans.extend(&self.start));
        }
        let at = self.age % self.every * self.width;
        if at == 0 {
            self.plan(seen, rng)?;
        }
        for (lane, plan) in self.plans.chunks_exact(self.start.len()).enumerate() {
            write(&plan[at..at + self.width], acts, lane);
        }
        self.age += 1;
        Ok(())
    }
}

impl Controlling<'_> {
    /// Plans for each lane, by luck of its own, so that no lane depends on those behind it.
    fn plan(&mut self, seen: &Columns, rng: &mut ChaCha8Rng) -> Result<(), OpError> {
        let len = self.start.len();
        for (lane, plan) in self.plans.chunks_exact_mut(len).enumerate() {
            if self.age > 0 {
                go_on(plan, self.done, self.width);
            }
            self.foretold.model.begin(seen, lane);
            let mut luck = Luck::from(ChaCha8Rng::from_rng(rng));
            let planned = self.planning.plan(&mut self.foretold, plan, &mut [0.0], &mut luck);
            planned.map_err(|error| {
                let t = self.age;
                OpError::Failed(format!("at step {t} of the episode in lane {lane}: {error}"))
            })?;
        }
        Ok(())
    }
}

/// Takes away what was done of a plan, and lets its last action go on.
fn go_on(plan: &mut [f64], done: usize, width: usize) {
    let len = plan.len();
    for i in 0..len {
        plan[i] = plan[(i + done).min(len - width + i % width)];
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "worlds take single precision, and a place is one"
)]
fn write(action: &[f64], acts: &mut Acts, lane: usize) {
    if acts.places.is_empty() {
        let own = &mut acts.vectors[lane * action.len()..][..action.len()];
        own.iter_mut().zip(action).for_each(|(act, x)| *act = *x as f32);
    } else {
        acts.places[lane] = action[0] as usize;
    }
}

/// What plans are foretold to return from where one is.
struct Foretold<'a> {
    model: Box<dyn Simulating + 'a>,
    space: Space,
    len: usize,
    discount: f64,
    ke: &'a dyn KnowledgeEquivalent,
    weights: Vec<f64>,
    /// Of each plan what each member says.
    returns: Vec<f64>,
    /// Plans beside one, and what they are worth.
    probes: Vec<f64>,
    found: Vec<f64>,
}

impl Objective for Foretold<'_> {
    fn rows(&self) -> usize {
        1
    }

    fn len(&self) -> usize {
        self.len
    }

    fn space(&self) -> &Space {
        &self.space
    }

    fn worth(&mut self, plans: &[f64], n: usize, worth: &mut [f64]) {
        let n_members = self.weights.len();
        self.returns.resize(n * n_members, 0.0);
        self.model.returns(plans, n, self.discount, &mut self.returns);
        for (worth, said) in worth.iter_mut().zip(self.returns.chunks_exact(n_members)) {
            *worth = self.ke.reduce(said, &self.weights);
        }
    }

    fn slope(&mut self, plans: &[f64], worth: &mut [f64], slope: &mut [f64]) -> bool {
        let Space::Continuous { low, high } = &self.space else { return false };
        let (len, n) = (self.len, 2 * self.len + 1);
        self.probes.clear();
        (0..n).for_each(|_| self.probes.extend(plans));
        for i in 0..len {
            let range = high[i] - low[i];
            let step = 1e-3 * if range.is_finite() { range } else { 1.0 };
            for (probe, by) in [(2 * i, -step), (2 * i + 1, step)] {
                self.probes[probe * len + i] = self.space.clip(i, plans[i] + by);
            }
        }
        let (probes, mut found) =
            (std::mem::take(&mut self.probes), std::mem::take(&mut self.found));
        found.resize(n, 0.0);
        self.worth(&probes, n, &mut found);
        worth[0] = found[2 * len];
        for (i, slope) in slope.iter_mut().enumerate() {
            let apart = probes[(2 * i + 1) * len + i] - probes[2 * i * len + i];
            *slope = if apart > 0.0 { (found[2 * i + 1] - found[2 * i]) / apart } else { 0.0 };
        }
        (self.probes, self.found) = (probes, found);
        true
    }
}

#[cfg(test)]
mod tests;
