//! Robust imitative planning (§3.2.1).

use ivx_data::form::same;
use ivx_data::{Columns, Field, Form, Kind, Misfit, Values};
use ivx_nn::{Imitative, Imitators, Model, Real as _};
use ivx_op::{Members, OpError, Part, declare};
use ivx_world::{Acts, Luck, Spec};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use super::Actor;
use super::wheels::{Eyes, Wheels};
use crate::agent::agent::Acting;
use crate::ke::KnowledgeEquivalent;
use crate::planner::{Goals, Imitated, Planner, Planning, Space, imitating};

declare! {
    /// Somebody who drives by the plans of imitative models (RIP, Eqn. 3.9): at every step it plans what is worth most by the
    /// knowledge equivalent of their log densities, and a mixture of normals about the goals that are seen for where plans end;
    /// the two controllers of `town`'s cars follow it (Eqn. 3.12). With one model it is a deep imitative model (Rhinehart et
    /// al., 2020).
    ///
    /// Places of a plan are joined by a cubic curve that begins as the car heads. The car steers to where it should be on it a
    /// quarter of a second ahead, at the mean speed of the plan to its first place.
    pub struct Rip = "rip" @ 2 {
        /// Models of plans that `windows` cut from drives, equally probable.
        model: Members<Model>;
        /// How what they say is reduced.
        ke: Box<dyn KnowledgeEquivalent>;
        /// How plans are looked for.
        plan: Box<dyn Planner> = Part::new("gradient_plan");
        /// Whether what is searched is the noise that the first model makes a plan of, and not its places; of a library it is
        /// its plans.
        latent: bool = true;
        /// The standard deviation about goals; 0 if these do not matter.
        goal_std: f64 = 1.0, in 0.0..;
        /// What is seen by the models, as in `windows`.
        sees: Vec<String> = vec!["lidar", "velocity"];
        /// How many steps of the world are between the places of a plan, as in `windows`.
        every: usize = 20, in 1.0..=1e4;
    }
}

/// The field of points ahead on the route.
const GOALS: &str = "goals";
/// What is told of each plan: what the knowledge equivalent makes of its log densities, without goals, and their variance
/// over members (Eqn. 3.11a).
const TELLS: [&str; 2] = ["log_density", "variance"];

impl Rip {
    /// What is seen, and the field of goals where these matter.
    fn fields(&self, spec: &Spec) -> Result<(Eyes, Option<usize>), Misfit> {
        let eyes = Eyes::of(spec, &self.sees)?;
        let is_goals =
            |f: &Field| f.name == GOALS && f.shape.get(1) == Some(&2) && f.kind == Kind::F32;
        let goals = spec.sees.iter().position(is_goals);
        if self.goal_std > 0.0 && goals.is_none() {
            let message = "the world shows no goals".to_owned();
            return Err(Misfit::new(
                message,
                "write `goal_std: 0.0`, or use a world that shows `goals`",
            ));
        }
        Ok((eyes, goals.filter(|_| self.goal_std > 0.0)))
    }

    /// Whether noise is searched.
    fn is_latent(&self) -> bool {
        self.latent && self.plan.fixed().is_none()
    }
}

impl Actor for Rip {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        let (eyes, _) = self.fields(spec)?;
        let of = self.model.iter().next().map(|model| model.form().into_owned());
        // Of a model that is still to be computed the shapes of data are known, if any.
        let Some(of) = of.filter(|of| of.target.len() == 2) else { return Ok(()) };
        eyes.fit(spec, &of, self.every)?;
        let len = of.target_len();
        self.plan.fits(&Space::boundless(len), len)
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting + '_>, Misfit> {
        let models = imitating(&self.model)?;
        self.with(&models, spec).map(|driver| Box::new(driver) as Box<dyn Acting>)
    }

    fn tells(&self) -> &'static [&'static str] {
        &TELLS
    }

    fn rip(&self) -> Option<&Rip> {
        Some(self)
    }
}

impl Rip {
    /// Who drives by other models in the place of its own.
    ///
    /// # Errors
    /// Why nobody can.
    pub(crate) fn with(&self, models: &[&Imitative], spec: &Spec) -> Result<Driver<'_>, Misfit> {
        self.fits(spec)?;
        let (eyes, goals) = self.fields(spec)?;
        let form = self.model.first().map(|model| model.form().into_owned());
        let form = form.ok_or_else(|| Misfit::new("there is no model".to_owned(), "give one"))?;
        self.model.iter().try_for_each(|model| same(&form, &model.form()))?;
        if form.target[1] != 2 {
            let message = format!("plans are of places of two numbers, not of {}", form.target[1]);
            return Err(Misfit::new(message, "cut `windows` of two places"));
        }
        Ok(Driver {
            of: self,
            opened: Imitators::of(models, &form),
            planning: self.plan.open(),
            wheels: Wheels::new(self.every),
            eyes,
            goals,
            seen: Vec::new(),
            plans: Vec::new(),
            worth: Vec::new(),
            told: Vec::new(),
        })
    }
}

/// Somebody who drives by the plans of imitative models.
pub(crate) struct Driver<'a> {
    of: &'a Rip,
    opened: Imitators,
    planning: Box<dyn Planning>,
    wheels: Wheels,
    eyes: Eyes,
    goals: Option<usize>,
    seen: Vec<f32>,
    plans: Vec<f64>,
    worth: Vec<f64>,
    /// Of each lane, also of those that rest.
    told: Vec<[f32; TELLS.len()]>,
}

impl Acting for Driver<'_> {
    fn begin(&mut self) {
        self.wheels.begin();
    }

    fn rest(&mut self, lanes: &[usize]) {
        self.wheels.rest(lanes);
    }

    fn act(
        &mut self,
        seen: &Columns,
        rng: &mut ChaCha8Rng,
        acts: &mut Acts,
    ) -> Result<(), OpError> {
        let places = self.plan(seen, rng)?;
        self.follow(seen, &places, acts);
        Ok(())
    }

    fn tell(&self, lane: usize, told: &mut Vec<f32>) {
        told.extend(self.told[lane]);
    }
}

impl Driver<'_> {
    /// Drives by other models from now on.
    pub(crate) fn learn(&mut self, models: &[&Imitative], form: &Form) {
        self.opened = Imitators::of(models, form);
    }

    /// Follows plans of the lanes that go on, `[lanes, steps, 2]`.
    pub(crate) fn follow(&mut self, seen: &Columns, places: &[f64], acts: &mut Acts) {
        self.wheels.follow(&self.eyes, seen, places, acts);
    }

    /// What models saw last, lane by lane.
    pub(crate) fn seen(&self) -> &[f32] {
        &self.seen
    }

    /// How much models differ about the plan of a lane (Eqn. 3.11a).
    pub(crate) fn variance(&self, lane: usize) -> f64 {
        f64::from(self.told[lane][1])
    }

    /// The best plan of each lane that goes on, `[lanes, steps, 2]`.
    pub(crate) fn plan(
        &mut self,
        seen: &Columns,
        rng: &mut ChaCha8Rng,
    ) -> Result<Vec<f64>, OpError> {
        let lanes = self.wheels.awake(seen.len());
        self.eyes.look(seen, lanes, &mut self.seen);
        self.opened.see(&self.seen);
        let (len, n) = (self.opened.scorer.len(), lanes.len());
        let goals = self.goals.map(|field| {
            let Values::F32(all) = seen.values(field) else { unreachable!("goals are numbers") };
            let width = all.len() / seen.len();
            let own = lanes.iter().flat_map(|lane| &all[lane * width..][..width]);
            Goals { places: own.map(|x| f64::from(*x)).collect(), dims: 2, std: self.of.goal_std }
        });
        self.plans.clear();
        self.plans.resize(n * len, 0.0);
        self.worth.resize(n, 0.0);
        if !self.of.is_latent() {
            let mut means = vec![0.0; n * len];
            self.opened.scorer.plans(0, &mut means, 1);
            self.plans.iter_mut().zip(means).for_each(|(to, x)| *to = f64::from(x));
        }
        let mut luck = Luck::from(ChaCha8Rng::from_rng(rng));
        let mut of = Imitated::new(&mut self.opened, &*self.of.ke, goals, self.of.is_latent());
        self.planning.plan(&mut of, &mut self.plans, &mut self.worth, &mut luck)?;
        let places = of.places(&self.plans, 1).iter().map(|x| f64::from(*x)).collect();
        self.told.resize(seen.len(), [0.0; TELLS.len()]);
        for (lane, said) in lanes.iter().zip(of.said(&self.plans)) {
            self.told[*lane] = said.map(f32::of);
        }
        Ok(places)
    }
}
