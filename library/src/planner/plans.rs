//! The plans of an ignorant imitator (§3.2.1), and how probable plans are that were seen.

use ivx_data::form::{failed, model_of_data, same};
use ivx_data::{Dataset, Form};
use ivx_math::moments::{mean, real};
use ivx_nn::{Imitators, Model, singles};
use ivx_op::{Array, Ctx, Dim, Labels, Members, One, Op, OpError, Part, declare, record};
use ivx_world::Luck;
use rand_distr::{Distribution as _, StandardNormal};

use super::imitated::{Imitated, imitating};
use super::search::{Objective, Planner, Space};
use crate::ke::KnowledgeEquivalent;

record! {
    /// Plans where something was seen, the best first.
    pub struct Planned = "Planned" {
        /// Their places.
        plans: Array [row, mode, step, dim];
        /// What each is worth: the knowledge equivalent of its log densities.
        worth: Array [row, mode];
        /// How much models differ about it: the variance of its log densities over members (Eqn. 3.8).
        variance: Array [row, mode];
    }
}

declare! {
    /// The plans that are worth most to an ignorant imitator at each observation (RIP, Eqn. 3.9),
    ///
    /// ```text
    /// a = arg max_a KE[ln q(a | s; θ_1), .., ln q(a | s; θ_K)]
    /// ```
    ///
    /// With one member it is the mode of a deep imitative model (Eqn. 3.5), and with `trajectory_library` a choice among
    /// fixed plans (Eqn. 3.6).
    pub struct Plans = "plans" @ 1, stochastic -> Planned {
        /// The members, models of plans that are equally probable.
        model: Members<Model>;
        /// Where plans are wanted; their targets are not looked at.
        on: One<Dataset>;
        /// How what members say is reduced.
        ke: Box<dyn KnowledgeEquivalent>;
        /// How plans are looked for.
        by: Box<dyn Planner> = Part::new("gradient_plan");
        /// How many: a search each, the first from the plan of the first member's means, the others from samples of it; of
        /// fixed plans the best.
        modes: usize = 1, in 1.0..=100_000.0;
        /// Whether what is searched is the noise that the first member makes a plan of, and not its places.
        latent: bool = false;
    }
    rule model_of_data;
}

declare! {
    /// How probable a model finds the plan of each observation: `ln q(a | s)`, in nats.
    pub struct LogDensity = "log_density" @ 1 -> Array [row] {
        /// An imitative model.
        model: One<Model>;
        /// The data, whose targets are plans.
        on: One<Dataset>;
    }
    rule model_of_data;
}

/// How many observations are looked at together.
const AT_ONCE: usize = 128;

/// Imitative models of one form, opened.
fn opened(models: &[Model], form: &Form) -> Result<Imitators, OpError> {
    models.iter().try_for_each(|model| same(&model.form(), form)).map_err(failed)?;
    Ok(Imitators::of(&imitating(models).map_err(failed)?, form))
}

impl Op for LogDensity {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let (data, form) = (&*self.on, &self.on.form);
        let mut opened = opened(std::slice::from_ref(&*self.model), form)?;
        let (width, len) = (form.input_len(), form.target_len());
        let mut values = Vec::new();
        for (xs, plans) in data.x.chunks(AT_ONCE * width).zip(data.y.chunks(AT_ONCE * len)) {
            ctx.checkpoint(Vec::new)?;
            opened.see(&singles(xs));
            let mut scores = vec![0.0; plans.len() / len];
            opened.scorer.scores(&singles(plans), 1, &mut scores);
            values.extend(scores.into_iter().map(f64::from));
        }
        Ok(Array::series(Dim::new("row", Labels::count(data.len())), values))
    }
}

impl Op for Plans {
    fn run(&self, ctx: &Ctx) -> Result<Planned, OpError> {
        let (data, form) = (&*self.on, &self.on.form);
        let mut opened = opened(&self.model, form)?;
        let (width, len, n) = (form.input_len(), form.target_len(), self.modes);
        self.by.fits(&Space::boundless(len), len).map_err(failed)?;
        let mut found = Found::default();
        let starts = starts(n, len, ctx);
        for xs in data.x.chunks(AT_ONCE * width) {
            ctx.tell(found.rows as u64, data.len() as u64, || format!("{n} modes each"));
            opened.see(&singles(xs));
            self.search(&mut opened, &starts, ctx, &mut found)?;
        }
        let (rows, modes) = (Labels::count(data.len()), Labels::count(n));
        let dims = |more: Vec<Dim>| {
            let own = vec![Dim::new("row", rows.clone()), Dim::new("mode", modes.clone())];
            [own, more].concat()
        };
        let places = ["step", "dim"].into_iter().zip(&form.target);
        let places = places.map(|(name, n)| Dim::new(name, Labels::count(*n))).collect();
        Ok(Planned {
            plans: Array { dims: dims(places), values: found.plans },
            worth: Array { dims: dims(vec![]), values: found.worth },
            variance: Array { dims: dims(vec![]), values: found.variance },
        })
    }
}

#[derive(Default)]
struct Found {
    rows: usize,
    plans: Vec<f64>,
    worth: Vec<f64>,
    variance: Vec<f64>,
}

/// Noise that plans start from, the same for all rows: none, and for every further mode normal.
fn starts(modes: usize, len: usize, ctx: &Ctx) -> Vec<Vec<f64>> {
    let mut rng = ctx.rng("starts", &[]);
    let mut drawn = || (0..len).map(|_| StandardNormal.sample(&mut rng)).collect();
    (0..modes).map(|mode| if mode == 0 { vec![0.0; len] } else { drawn() }).collect()
}

impl Plans {
    /// Adds the plans for what the models see.
    fn search(
        &self,
        opened: &mut Imitators,
        starts: &[Vec<f64>],
        ctx: &Ctx,
        found: &mut Found,
    ) -> Result<(), OpError> {
        let (rows, len, n) = (opened.scorer.rows(), opened.scorer.len(), self.modes);
        let fixed = self.by.fixed();
        let mut all = vec![0.0; rows * n * len];
        if fixed.is_none() {
            let mut planning = self.by.open();
            let mut luck = Luck::from(ctx.rng("search", &[]));
            for (mode, start) in starts.iter().enumerate() {
                ctx.checkpoint(Vec::new)?;
                let mut plans: Vec<f64> = start.repeat(rows);
                if !self.latent {
                    let mut made = singles(&plans);
                    opened.scorer.plans(0, &mut made, 1);
                    plans = made.into_iter().map(f64::from).collect();
                }
                let mut of = Imitated::new(opened, &*self.ke, None, self.latent);
                let mut worth = vec![0.0; rows];
                planning.plan(&mut of, &mut plans, &mut worth, &mut luck)?;
                for (row, plan) in of.places(&plans, 1).chunks_exact(len).enumerate() {
                    let to = &mut all[(row * n + mode) * len..][..len];
                    to.iter_mut().zip(plan).for_each(|(to, x)| *to = f64::from(*x));
                }
            }
        }
        let (plans, n_plans) = match fixed {
            Some(fixed) => (fixed.repeat(rows), fixed.len() / len),
            None => (all, n),
        };
        if n_plans < n {
            let why =
                format!("there are {n_plans} plans to choose from, and {n} modes are asked for");
            return Err(OpError::Failed(why));
        }
        self.keep(opened, &plans, n_plans, found)
    }

    /// Keeps the best of some plans for each row, with what they are worth.
    ///
    /// # Errors
    /// If one of them is worth no number.
    fn keep(
        &self,
        opened: &mut Imitators,
        plans: &[f64],
        n: usize,
        found: &mut Found,
    ) -> Result<(), OpError> {
        let (rows, len) = (opened.scorer.rows(), opened.scorer.len());
        let models = opened.scorer.models();
        let mut of = Imitated::new(opened, &*self.ke, None, false);
        let mut worth = vec![0.0; rows * n];
        of.worth(plans, n, &mut worth);
        let scores = of.scores(plans, n);
        let variance = |item: usize| {
            let own: Vec<f64> =
                scores[item * models..][..models].iter().map(|x| f64::from(*x)).collect();
            let centre = mean(&own);
            own.iter().map(|x| (x - centre).powi(2)).sum::<f64>() / real(models)
        };
        for row in 0..rows {
            let mut order: Vec<usize> = (row * n..(row + 1) * n).collect();
            if let Some(item) = order.iter().find(|item| worth[**item].is_nan()) {
                let (row, plan) = (found.rows + row, item % n);
                let why = format!("plan {plan} of row {row} is worth no number");
                return Err(OpError::Failed(why));
            }
            order.sort_by(|i, j| worth[*j].total_cmp(&worth[*i]));
            for item in order.into_iter().take(self.modes) {
                found.plans.extend(&plans[item * len..][..len]);
                found.worth.push(worth[item]);
                found.variance.push(variance(item));
            }
        }
        found.rows += rows;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ivx_nn::{Fitted, Imitative, Mlp, PlanNets, Tanh};

    use super::super::{GradientPlan, TrajectoryLibrary};
    use super::*;
    use crate::ke::{Bcm, Ma, Wcm};

    fn data() -> Dataset {
        let form = Form { input: vec![2], target: vec![3, 2], ..Form::default() };
        let numbers = |n: usize, by: f64| (0..n).map(|i| (real(i) * by).sin()).collect();
        Dataset { form, x: numbers(8, 0.9), y: numbers(24, 0.4) }
    }

    fn members(n: u64) -> Vec<Model> {
        let net = Mlp { hidden: vec![4], activation: Box::new(Tanh {}) };
        let nets = PlanNets { net: &net, features: 4, merge: &[], units: 6, head: &[5] };
        let of = |k: u64| {
            let ctx = Ctx::new("train", 0, Some(k));
            let drawn = Imitative::drawn(&nets, &data().form, &mut ctx.rng("init", &[])).unwrap();
            Model::Fitted(Fitted { form: data().form, function: Arc::new(drawn) })
        };
        (0..n).map(of).collect()
    }

    fn planned(
        ke: Box<dyn KnowledgeEquivalent>,
        by: Box<dyn Planner>,
        modes: usize,
        latent: bool,
    ) -> Planned {
        let (model, on) = (Members(members(3)), One(data()));
        Plans { model, on, ke, by, modes, latent }.run(&Ctx::new("plans", 0, None)).unwrap()
    }

    fn climb(steps: usize) -> Box<dyn Planner> {
        Box::new(GradientPlan { steps, rate: 0.1 })
    }

    /// What each member says of plans of each row, by the operation that says it of data.
    fn said(plans: &[f64], modes: usize) -> Vec<Vec<f64>> {
        let of = |model: &Model| {
            let own = data();
            let x = own.x.chunks_exact(2).flat_map(|x| x.repeat(modes)).collect();
            let on = One(Dataset { x, y: plans.to_vec(), ..own });
            let op = LogDensity { model: One(model.clone()), on };
            op.run(&Ctx::new("log_density", 0, None)).unwrap().values
        };
        members(3).iter().map(of).collect()
    }

    #[test]
    fn plans_are_worth_what_members_say_and_come_best_first() {
        let kes: [Box<dyn KnowledgeEquivalent>; 3] =
            [Box::new(Wcm {}), Box::new(Ma {}), Box::new(Bcm {})];
        for ke in kes {
            let name = format!("{ke:?}");
            let found = planned(ke, climb(20), 3, false);
            let sizes: Vec<usize> = found.plans.dims.iter().map(Dim::len).collect();
            assert_eq!(sizes, [4, 3, 3, 2]);
            let said = said(&found.plans.values, 3);
            for (i, worth) in found.worth.values.iter().enumerate() {
                let own: Vec<f64> = said.iter().map(|scores| scores[i]).collect();
                let expected = match name.as_str() {
                    "Wcm" => own.iter().copied().fold(f64::INFINITY, f64::min),
                    "Ma" => mean(&own),
                    _ => own.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                };
                assert!((worth - expected).abs() < 1e-4, "{name} {i}: {worth} {expected}");
                let spread = ivx_math::moments::std(&own).powi(2);
                let variance = found.variance.values[i];
                assert!((variance - spread).abs() < 1e-3 * (1.0 + spread), "{variance} {spread}");
            }
            let rows = found.worth.values.chunks_exact(3);
            assert!(rows.clone().all(|row| row[0] >= row[1] && row[1] >= row[2]), "{name}");
        }
    }

    #[test]
    fn to_climb_is_worth_more_in_places_and_in_noise() {
        for latent in [false, true] {
            let worth = |steps| planned(Box::new(Wcm {}), climb(steps), 3, latent).worth.values;
            let (short, long) = (worth(1), worth(60));
            let gain = long.iter().zip(&short).map(|(long, short)| long - short);
            assert!(gain.clone().all(|gain| gain >= 0.0) && gain.sum::<f64>() > 0.5, "{latent}");
        }
    }

    #[test]
    fn of_fixed_plans_the_best_are_chosen() {
        let sizes = [("plan", 5), ("step", 3), ("dim", 2)];
        let dims = sizes.map(|(name, n)| Dim::new(name, Labels::count(n))).to_vec();
        let values: Vec<f64> = (0..30).map(|i| (real(i) * 1.7).cos()).collect();
        let fixed = || TrajectoryLibrary {
            plans: One(Array { dims: dims.clone(), values: values.clone() }),
        };
        let found = planned(Box::new(Wcm {}), Box::new(fixed()), 2, false);
        let all = said(&values.repeat(4), 5);
        for row in 0..4 {
            let worst = |plan: usize| {
                all.iter().map(|scores| scores[row * 5 + plan]).fold(f64::INFINITY, f64::min)
            };
            let best = (0..5).max_by(|i, j| worst(*i).total_cmp(&worst(*j))).unwrap();
            assert_eq!(found.plans.values[row * 12..][..6], values[best * 6..][..6]);
        }
        let (model, on) = (Members(members(3)), One(data()));
        let (ke, by) = (Box::new(Wcm {}), Box::new(fixed()));
        let many = Plans { model, on, ke, by, modes: 6, latent: false };
        let why = many.run(&Ctx::new("plans", 0, None)).unwrap_err().to_string();
        assert_eq!(why, "there are 5 plans to choose from, and 6 modes are asked for");
        // Plans of another length, or of what are no numbers, are none of these models.
        for (steps, wrong, expected) in [(5, 0.0, "plans of 10 numbers"), (3, f64::NAN, "is NaN")] {
            let sizes = [("plan", 3), ("step", steps), ("dim", 2)];
            let dims = sizes.map(|(name, n)| Dim::new(name, Labels::count(n))).to_vec();
            let by =
                TrajectoryLibrary { plans: One(Array { dims, values: vec![wrong; 6 * steps] }) };
            let (model, on) = (Members(members(3)), One(data()));
            let (ke, by) = (Box::new(Wcm {}), Box::new(by));
            let other = Plans { model, on, ke, by, modes: 1, latent: false };
            let why = other.run(&Ctx::new("plans", 0, None)).unwrap_err().to_string();
            assert!(why.contains(expected), "{why}");
        }
    }
}
