//! Adaptive robust imitative planning (§3.2.2).

use std::sync::Arc;

use ivx_data::form::{failed, form as form_of, same, told, wrong};
use ivx_data::{Columns, Dataset, Form, Rollouts, Trajectories};
use ivx_math::moments::real;
use ivx_nn::{Fitted, Imitative, Mixture, Model, Optimiser, PlanLearner, Real as _, Rule, singles};
use ivx_op::{Array, Ctx, Dim, Facts, Labels, One, Op, OpError, Part, Wrong, declare, record};
use ivx_world::{Env, Lanes, Spec};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::actor::{Actor, Driver};
use super::agent::Acting as _;
use super::windows::Placed;
use crate::learner::Prior;
use crate::planner::imitating;

record! {
    /// What became of somebody who asked an expert when they did not know, and learned from what was shown.
    pub struct Adapted = "Adapted" {
        /// What was learned: the members as one model, of which `members_of` are the members.
        model: Model;
        /// How often the expert was asked in each.
        asked: Array [episode];
        /// Each time: the episode, the step, and how much the members differed.
        queries: Array [query, noted];
        /// What the expert showed.
        shown: Dataset;
        /// What was told of each step, and whether it was the expert's (`asked`), for `told_sums` and `driven`; of what was
        /// seen nothing is kept.
        drives: Rollouts;
    }
}

declare! {
    /// Adaptive robust imitative planning (AdaRIP, Algorithm 1): somebody who drives by plans asks the world's expert
    /// where the members differ too much about the best plan, does as it shows, and learns from it before it goes on.
    ///
    /// ```text
    /// Var_k[ln q(â | s; θ_k)] > τ:  ask for a*,  B ← B ∪ {(s, a*)},  θ_k ← learn from B and D
    /// ```
    ///
    /// Of each update half of what is looked at is drawn from what was shown online, `B`, and half from the demonstrations
    /// before, `D`. What the expert shows is followed until its plan's first place; then it is planned, and asked, anew.
    pub struct Adapt = "adapt" @ 1, stochastic -> Adapted {
        /// Who drives: `rip(..)`.
        actor: Box<dyn Actor>;
        /// The demonstrations that its models learned from, `windows` of drives.
        on: One<Dataset>;
        /// The world, which has an expert.
        r#in: Box<dyn Env>;
        /// By which variance the expert is asked, `τ`.
        threshold: One<Array>;
        /// How often it can be asked.
        budget: u64 = 40, in 0.0..=1e6;
        /// How many episodes, one after the other.
        episodes: usize = 10, in 1.0..=1e5;
        /// How many updates each member makes when something was shown.
        updates: u64 = 10, in 0.0..=1e6;
        /// How many observations an update looks at.
        batch: usize = 50, in 2.0..=1e6;
        /// How the objective is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adam");
        /// The prior over each parameter.
        prior: Box<dyn Prior> = Part::new("normal");
        /// The standard deviation of the noise that is added to the places of plans in every update.
        noise: f64 = 0.01, in 0.0..;
        /// What tells where one is, as in `windows`.
        places: Vec<String> = vec!["x", "y"];
        /// What tells where one heads, as in `windows`.
        heading: String = "yaw";
        /// How often it is asked at random instead, whatever the members say: the control of whom it is of use to know
        /// what is not known.
        at_random: f64 = 0.0, in 0.0..=1.0;
        /// Tells apart draws that must differ on one seed.
        stream: String = "adapt";
    }
    rule can_adapt;
}

fn can_adapt(facts: &Facts<'_>) -> Result<(), Wrong> {
    let (actor, env) = (facts.arg::<Box<dyn Actor>>("actor"), facts.arg::<Box<dyn Env>>("in"));
    if let Some(actor) = &actor
        && actor.rip().is_none()
    {
        let message = "who acts has no plans about which models differ".to_owned();
        return Err(Wrong { arg: "actor", message, help: "use `rip(..)`".to_owned() });
    }
    let Some(env) = env else { return Ok(()) };
    if !env.has_expert() {
        let message = "nobody knows what an expert would do in this world".to_owned();
        return Err(Wrong { arg: "in", message, help: "use a `town` or `carnovel`".to_owned() });
    }
    let spec = env.spec().map_err(wrong("in"))?;
    if let Some(actor) = &actor {
        actor.fits(&spec).map_err(wrong("actor"))?;
    }
    let (places, heading): (Vec<String>, String) =
        (facts.arg("places").unwrap_or_default(), facts.arg("heading").unwrap_or_default());
    for (arg, places, heading) in [("places", &places[..], ""), ("heading", &[], &heading[..])] {
        if let Err(message) = Placed::of(&spec.tells, places, heading) {
            return Err(Wrong { arg, message, help: "name what the world tells".to_owned() });
        }
    }
    if heading.is_empty() {
        let message = "a car is driven as it heads, and nothing tells that".to_owned();
        return Err(Wrong {
            arg: "heading",
            message,
            help: "name what the world tells".to_owned(),
        });
    }
    if places.len() != 2 {
        let message = format!("a car is at a place of two numbers, not of {}", places.len());
        return Err(Wrong { arg: "places", message, help: "name two".to_owned() });
    }
    let Some(form) = form_of(facts, "on") else { return Ok(()) };
    if form.target.len() != 2 || form.classes.is_some() {
        let message = format!("the data are {}, and no plans", told(&form));
        return Err(Wrong { arg: "on", message, help: "give `windows` of drives".to_owned() });
    }
    let learned = actor.as_ref().and_then(|actor| actor.rip()?.model.first());
    match learned.map(ivx_nn::Model::form) {
        Some(of) if of.target.len() == 2 => same(&of, &form).map_err(wrong("on")),
        _ => Ok(()),
    }
}

/// What is noted of a query.
const NOTED: [&str; 3] = ["episode", "step", "variance"];

/// How many steps there are between looks whether it is to end.
const LOOKS: usize = 64;

impl Op for Adapt {
    fn run(&self, ctx: &Ctx) -> Result<Adapted, OpError> {
        let spec = self.r#in.spec().map_err(failed)?;
        let rip = self.actor.rip().ok_or_else(|| {
            OpError::Failed("who acts has no plans about which models differ: use `rip(..)`".into())
        })?;
        let [threshold] = self.threshold.values[..] else {
            let n = self.threshold.values.len();
            return Err(OpError::Failed(format!("`threshold` is {n} numbers instead of one")));
        };
        if threshold.is_nan() {
            let why = "`threshold` is no number: nothing would be above it".to_owned();
            return Err(OpError::Failed(why));
        }
        if self.on.is_empty() {
            return Err(OpError::Failed("there are no demonstrations to learn from".to_owned()));
        }
        let models = imitating(&rip.model).map_err(failed)?;
        let form = rip.model[0].form().into_owned();
        same(&form, &self.on.form).map_err(failed)?;
        let place = Placed::of(&spec.tells, &self.places, &self.heading);
        let mut run = Going {
            of: self,
            ctx,
            threshold,
            place: place.map_err(OpError::Failed)?,
            driver: rip.with(&models, &spec).map_err(failed)?,
            learners: Learners::new(self, models, &form),
            hold: rip.every,
            asked: vec![0.0; self.episodes],
            queries: Vec::new(),
            drives: drives(&spec),
        };
        for episode in 0..self.episodes {
            run.drive(episode)?;
        }
        run.done()
    }
}

/// Drives of which only is kept what is told.
fn drives(spec: &Spec) -> Rollouts {
    let own = ["log_density", "variance", "asked"].map(str::to_owned);
    let tells = spec.tells.iter().cloned().chain(own).collect();
    Rollouts::new(Trajectories::new(Vec::new(), spec.does.clone()), tells)
}

/// Where it stands.
struct Going<'a> {
    of: &'a Adapt,
    ctx: &'a Ctx<'a>,
    threshold: f64,
    place: Placed,
    learners: Learners<'a>,
    driver: Driver<'a>,
    /// How many steps what the expert shows is followed.
    hold: usize,
    asked: Vec<f64>,
    queries: Vec<f64>,
    drives: Rollouts,
}

/// What the expert showed, and for how many steps it was followed.
struct Shown {
    rows: Vec<f32>,
    age: usize,
}

impl Going<'_> {
    fn n_queries(&self) -> usize {
        self.queries.len() / NOTED.len()
    }

    fn drive(&mut self, episode: usize) -> Result<(), OpError> {
        let of = self.of;
        let stream = format!("adapt {}", of.stream);
        let mut lanes = Lanes::open(&*of.r#in, 1, self.ctx, (&stream, episode as u64))?;
        let width = lanes.spec().tells.len();
        let mut rng = self.ctx.rng("actions", &[&of.stream, &episode.to_string()]);
        let mut chance = self.ctx.rng("chance", &[&of.stream, &episode.to_string()]);
        let mut shown: Option<Shown> = None;
        self.driver.begin();
        let mut own = Trajectories::new(Vec::new(), lanes.spec().does.clone());
        own.seen = Columns::zeros(Vec::new(), 1);
        own.episodes.push((0, ivx_data::End::No));
        for t in 0.. {
            if t % LOOKS == 0 {
                let (done, all) = (episode as u64, of.episodes as u64);
                self.ctx.tell(done, all, || format!("asked {} times", self.n_queries()));
                self.ctx.checkpoint(Vec::new)?;
            }
            rng.set_stream(t as u64);
            rng.set_word_pos(0);
            let mut plan = self.driver.plan(lanes.seen(), &mut rng)?;
            let variance = self.driver.variance(0);
            shown = shown.filter(|shown| shown.age < self.hold);
            let is_lost = match of.at_random {
                0.0 => variance > self.threshold,
                share => chance.random::<f64>() < share,
            };
            if shown.is_none() && is_lost && (self.n_queries() as u64) < of.budget {
                let steps = plan.len() / 2 * self.hold;
                let rows = lanes.shown(0, steps + self.hold, &format!("{stream} shown {t}"));
                let rows = rows.ok_or_else(|| {
                    OpError::Failed("nobody knows what an expert would do in this world".into())
                })?;
                // Near the end of a drive there is no whole plan to learn, and then nobody is asked.
                if rows.len() / width > steps {
                    self.asked[episode] += 1.0;
                    self.queries.extend([real(episode), real(t), variance]);
                    let target = self.plan_of(&rows, &rows[..width], 0, plan.len() / 2);
                    self.learners.add(self.driver.seen(), &target);
                    self.learners.learn(self.n_queries(), self.ctx)?;
                    let form = self.learners.form.clone();
                    self.driver.learn(&self.learners.models(), &form);
                    shown = Some(Shown { rows, age: 0 });
                }
            }
            if let Some(shown) = &mut shown {
                let now: Vec<f32> = match t {
                    0 => shown.rows[..width].to_vec(),
                    _ => lanes.stepped().told[..width].to_vec(),
                };
                plan = self.plan_of(&shown.rows, &now, shown.age, plan.len() / 2);
                shown.age += 1;
            }
            let (seen, acts) = lanes.choose();
            self.driver.follow(seen, &plan, acts);
            let step = lanes.step()?;
            self.drives.told.extend(&step.told[..width]);
            self.driver.tell(0, &mut self.drives.told);
            self.drives.told.push(if shown.is_some() { 1.0 } else { 0.0 });
            self.drives.rewards.push(step.rewards[0]);
            step.acts.get(0).append(&mut own.acts);
            own.seen.resize(own.seen.len() + 1);
            own.episodes[0] = (own.episodes[0].0 + 1, step.ends[0]);
            if lanes.finished().count() > 0 {
                break;
            }
        }
        self.drives.paths.append(&own);
        Ok(())
    }

    /// The plan that what the expert showed is, seen from `now` after `age` steps of it.
    fn plan_of(&self, rows: &[f32], now: &[f32], age: usize, steps: usize) -> Vec<f64> {
        let mut plan = Vec::new();
        let last = rows.len() / now.len() - 1;
        for k in 1..=steps {
            let then = &rows[(age + k * self.hold).min(last) * now.len()..][..now.len()];
            self.place.moved(now, then, &mut plan);
        }
        plan
    }

    fn done(mut self) -> Result<Adapted, OpError> {
        let episode = Dim::new("episode", Labels::count(self.of.episodes));
        let noted = Dim::new("noted", Labels::Names(NOTED.map(str::to_owned).to_vec()));
        let query = Dim::new("query", Labels::count(self.n_queries()));
        let form = self.learners.form.clone();
        let learned = self.learners.models();
        if !learned.iter().all(|model| model.networks().are_finite()) {
            let why = "what was learned diverged: lower the learning rate".to_owned();
            return Err(OpError::Failed(why));
        }
        let members = learned.into_iter().map(|model| {
            Model::Fitted(Fitted { form: form.clone(), function: Arc::new(model.clone()) })
        });
        let function = Arc::new(Mixture { members: members.collect(), noise: 0.0 });
        let (x, y) = &self.learners.shown;
        let numbers = |xs: &[f32]| xs.iter().map(|x| f64::from(*x)).collect();
        Ok(Adapted {
            asked: Array::series(episode, self.asked),
            queries: Array { dims: vec![query, noted], values: self.queries },
            shown: Dataset { x: numbers(x), y: numbers(y), form: form.clone() },
            model: Model::Fitted(Fitted { form, function }),
            drives: self.drives,
        })
    }
}

/// The members, which learn.
struct Learners<'a> {
    of: &'a Adapt,
    form: Form,
    each: Vec<PlanLearner<'a>>,
    /// What was demonstrated before: inputs and plans.
    before: (Vec<f32>, Vec<f32>),
    /// What was shown online.
    shown: (Vec<f32>, Vec<f32>),
}

impl<'a> Learners<'a> {
    fn new(of: &'a Adapt, models: Vec<&Imitative>, form: &Form) -> Self {
        let pull = of.prior.pull(1.0, real(of.on.len().max(1)));
        let rule = Rule { optimiser: &*of.optimiser, pull, steps: u64::MAX };
        Self {
            of,
            form: form.clone(),
            each: models.into_iter().map(|model| PlanLearner::new(model.clone(), rule)).collect(),
            before: (singles(&of.on.x), singles(&of.on.y)),
            shown: (Vec::new(), Vec::new()),
        }
    }

    fn add(&mut self, seen: &[f32], plan: &[f64]) {
        self.shown.0.extend(seen);
        self.shown.1.extend(plan.iter().map(|x| f32::of(*x)));
    }

    /// Lets each member make its updates, by draws of its own.
    fn learn(&mut self, query: usize, ctx: &Ctx) -> Result<(), OpError> {
        for (k, member) in self.each.iter_mut().enumerate() {
            for update in 0..self.of.updates {
                ctx.checkpoint(Vec::new)?;
                let names =
                    [self.of.stream.clone(), k.to_string(), query.to_string(), update.to_string()];
                let mut rng = ctx.rng("updates", &names.each_ref().map(String::as_str));
                let (mut xs, mut plans) = (Vec::new(), Vec::new());
                let half = self.of.batch / 2;
                let sources = [(&self.shown, half), (&self.before, self.of.batch - half)];
                for (from, n) in sources {
                    draw(&self.form, from, n, &mut rng, (&mut xs, &mut plans));
                }
                for place in &mut plans {
                    let drawn: f64 = StandardNormal.sample(&mut rng);
                    *place += f32::of(self.of.noise * drawn);
                }
                member.learn(&self.form, (&xs, &plans), &mut rng);
            }
        }
        Ok(())
    }

    fn models(&mut self) -> Vec<&Imitative> {
        self.each.iter_mut().map(PlanLearner::model).collect()
    }
}

/// Appends so many observations, drawn evenly with repetitions.
fn draw(
    form: &Form,
    (xs, plans): &(Vec<f32>, Vec<f32>),
    n: usize,
    rng: &mut ChaCha8Rng,
    (x, plan): (&mut Vec<f32>, &mut Vec<f32>),
) {
    let (width, len) = (form.input_len(), form.target_len());
    for _ in 0..n {
        let i = rng.random_range(0..plans.len() / len);
        x.extend(&xs[i * width..][..width]);
        plan.extend(&plans[i * len..][..len]);
    }
}
