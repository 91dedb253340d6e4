//! Robust imitative planning (§3.2.1).

use ivx_data::form::{same, told};
use ivx_data::{Columns, Field, Kind, Misfit, Values};
use ivx_nn::{Imitators, Model, Real as _};
use ivx_op::{Members, OpError, Part, declare};
use ivx_town::{Follower, Pose};
use ivx_world::{Acts, Luck, Spec};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use super::Actor;
use crate::agent::agent::Acting;
use crate::agent::windows::{chosen, form};
use crate::ke::KnowledgeEquivalent;
use crate::planner::{Goals, Imitated, Planner, Planning, Space, imitating};

declare! {
    /// Somebody who drives by the plans of imitative models (RIP, Eqn. 3.9): at every step it plans what is worth most by the
    /// knowledge equivalent of their log densities, and a mixture of normals about the goals that are seen for where plans end;
    /// the two controllers of `town`'s cars follow it (Eqn. 3.12). With one model it is a deep imitative model (Rhinehart et
    /// al., 2020).
    ///
    /// Places of a plan are joined by straight lines. The car steers to where it should be a quarter of a second ahead, at the
    /// mean speed of the plan until then; in the first five seconds of a drive at 20 km/h.
    pub struct Rip = "rip" @ 1 {
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
/// The field of how fast the car is.
const SPEED: &str = "velocity";
/// How many steps ahead the car steers to.
const AHEAD: usize = 5;
/// Seconds of a step.
const DT: f64 = 0.05;
/// Steps in which a drive begins, and metres a second until then.
const BEGINS: (usize, f64) = (100, 20.0 / 3.6);

impl Rip {
    /// The fields that models see, that of speeds and that of goals.
    fn fields(&self, spec: &Spec) -> Result<(Vec<usize>, usize, Option<usize>), Misfit> {
        let order = chosen(&spec.sees, &self.sees)?;
        if spec.does.field().width() != 2 || spec.does.n_discrete().is_ok() {
            let message =
                "plans are followed by a pedal and a steering wheel, which this world has not";
            return Err(Misfit::new(message.to_owned(), "use a `town` or `carnovel`"));
        }
        let is_speed = |f: &Field| f.name == SPEED && f.width() > 0 && f.kind == Kind::F32;
        let speed = spec.sees.iter().position(is_speed).ok_or_else(|| {
            let message = "the world does not show how fast the car is".to_owned();
            Misfit::new(message, "use a world that shows `velocity`, forward first")
        })?;
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
        Ok((order, speed, goals.filter(|_| self.goal_std > 0.0)))
    }

    /// Whether noise is searched.
    fn is_latent(&self) -> bool {
        self.latent && self.plan.fixed().is_none()
    }
}

impl Actor for Rip {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        let (order, ..) = self.fields(spec)?;
        let of = self.model.iter().next().map(|model| model.form().into_owned());
        // Of a model that is still to be computed the shapes of data are known, if any.
        let Some(of) = of.filter(|of| of.target.len() == 2) else { return Ok(()) };
        let own = form(&spec.sees, &order, [of.target[0], of.target[1]]);
        if (&of.input, of.beside) != (&own.input, own.beside) {
            let message = format!("the models see {}, and in this world {}", told(&of), told(&own));
            return Err(Misfit::new(
                message,
                "let `sees` be as in the `windows` they learned from",
            ));
        }
        if of.target[0] * self.every < AHEAD {
            let message = format!("plans end before the {AHEAD} steps that the car looks ahead");
            return Err(Misfit::new(message, "let plans be longer"));
        }
        let len = of.target_len();
        self.plan.fits(&Space::boundless(len), len)
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting + '_>, Misfit> {
        self.fits(spec)?;
        let (order, speed, goals) = self.fields(spec)?;
        let models = imitating(&self.model)?;
        let form = self.model.first().map(|model| model.form().into_owned());
        let form = form.ok_or_else(|| Misfit::new("there is no model".to_owned(), "give one"))?;
        self.model.iter().try_for_each(|model| same(&form, &model.form()))?;
        if form.target[1] != 2 {
            let message = format!("plans are of places of two numbers, not of {}", form.target[1]);
            return Err(Misfit::new(message, "cut `windows` of two places"));
        }
        Ok(Box::new(Driver {
            of: self,
            opened: Imitators::of(&models, &form),
            planning: self.plan.open(),
            order,
            goals,
            speed,
            width: form.input_len(),
            lanes: Vec::new(),
            age: 0,
            seen: Vec::new(),
            plans: Vec::new(),
            worth: Vec::new(),
        }))
    }
}

struct Driver<'a> {
    of: &'a Rip,
    opened: Imitators,
    planning: Box<dyn Planning>,
    order: Vec<usize>,
    goals: Option<usize>,
    speed: usize,
    /// How many numbers models see.
    width: usize,
    lanes: Vec<Follower>,
    age: usize,
    seen: Vec<f32>,
    plans: Vec<f64>,
    worth: Vec<f64>,
}

impl Acting for Driver<'_> {
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
            self.lanes = vec![Follower::default(); seen.len()];
        }
        self.look(seen);
        let places = self.plan(seen, rng)?;
        let Values::F32(speeds) = seen.values(self.speed) else {
            unreachable!("speeds are numbers")
        };
        let lanes = self.lanes.iter_mut().zip(acts.vectors.chunks_exact_mut(2));
        let plans = places.chunks_exact(places.len() / seen.len());
        for (lane, ((follower, act), plan)) in lanes.zip(plans).enumerate() {
            let point = |step: usize| along(plan, step, self.of.every);
            let moves = (0..AHEAD).map(|i| {
                let (a, b) = (point(i), point(i + 1));
                (b[0] - a[0]).hypot(b[1] - a[1])
            });
            #[expect(clippy::cast_precision_loss, reason = "five")]
            let planned = moves.sum::<f64>() / AHEAD as f64 / DT;
            let target = if self.age < BEGINS.0 { BEGINS.1 } else { planned };
            let speed = f64::from(speeds[lane * speeds.len() / seen.len()]);
            let does = follower.follow(&Pose::default(), speed, target, point(AHEAD));
            act.copy_from_slice(&[does.throttle - does.brake, does.steer].map(f32::of));
        }
        self.age += 1;
        Ok(())
    }
}

impl Driver<'_> {
    fn look(&mut self, seen: &Columns) {
        self.seen.resize(seen.len() * self.width, 0.0);
        for (lane, row) in self.seen.chunks_exact_mut(self.width).enumerate() {
            let mut rest = row;
            for &field in &self.order {
                let (own, others) = rest.split_at_mut(seen.fields()[field].spread());
                seen.spread(field, lane, own);
                rest = others;
            }
        }
        self.opened.see(&self.seen);
    }

    /// The best plan of each lane, `[lanes, steps, 2]`.
    fn plan(&mut self, seen: &Columns, rng: &mut ChaCha8Rng) -> Result<Vec<f64>, OpError> {
        let len = self.opened.scorer.len();
        let goals = self.goals.map(|field| {
            let Values::F32(all) = seen.values(field) else { unreachable!("goals are numbers") };
            let places = all.iter().map(|x| f64::from(*x)).collect();
            Goals { places, dims: 2, std: self.of.goal_std }
        });
        self.plans.clear();
        self.plans.resize(seen.len() * len, 0.0);
        self.worth.resize(seen.len(), 0.0);
        if !self.of.is_latent() {
            let mut means = vec![0.0; seen.len() * len];
            self.opened.scorer.plans(0, &mut means, 1);
            self.plans.iter_mut().zip(means).for_each(|(to, x)| *to = f64::from(x));
        }
        let mut luck = Luck::from(ChaCha8Rng::from_rng(rng));
        let mut of = Imitated::new(&mut self.opened, &*self.of.ke, goals, self.of.is_latent());
        self.planning.plan(&mut of, &mut self.plans, &mut self.worth, &mut luck)?;
        Ok(of.places(&self.plans, 1).iter().map(|x| f64::from(*x)).collect())
    }
}

/// Where a plan is after some steps of the world: on straight lines between its places, from where the car is; in the end
/// at the last.
fn along(plan: &[f64], step: usize, every: usize) -> [f64; 2] {
    let place = |i: usize| if i == 0 { [0.0; 2] } else { [plan[2 * i - 2], plan[2 * i - 1]] };
    let (before, rest) = (step / every, step % every);
    if rest == 0 || before >= plan.len() / 2 {
        return place(before.min(plan.len() / 2));
    }
    #[expect(clippy::cast_precision_loss, reason = "steps are few")]
    let share = rest as f64 / every as f64;
    let (a, b) = (place(before), place(before + 1));
    [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_is_followed_on_straight_lines() {
        let plan = [4.0, 0.0, 8.0, 2.0];
        assert_eq!(along(&plan, 0, 20), [0.0, 0.0]);
        assert_eq!(along(&plan, 5, 20), [1.0, 0.0]);
        assert_eq!(along(&plan, 30, 20), [6.0, 1.0]);
        assert_eq!(along(&plan, 40, 20), [8.0, 2.0]);
        assert_eq!(along(&plan, 55, 20), [8.0, 2.0]);
    }
}
