//! What plans are worth to an ignorant imitator (Eqn. 3.9).

use ivx_data::Misfit;
use ivx_math::moments::uniform;
use ivx_nn::{Imitative, Imitators, Model, Real as _};

use super::search::{Objective, Space};
use crate::ke::KnowledgeEquivalent;

/// How many numbers a place has at most where there are goals.
const MOST_DIMS: usize = 8;

/// Where plans should end: a mixture of normals about some places, all as probable.
#[derive(Clone, Debug)]
pub struct Goals {
    /// The places, `[rows, goals, dims]`.
    pub places: Vec<f64>,
    /// How many numbers a place is.
    pub dims: usize,
    /// The standard deviation about each.
    pub std: f64,
}

impl Goals {
    /// `ln 1/G Σ_g N(place; goal_g, std² I)` of the goals of a row, whose slope is added.
    fn log_likelihood(&self, (row, rows): (usize, usize), place: &[f64], slope: &mut [f64]) -> f64 {
        let goals = &self.places[row * self.places.len() / rows..][..self.places.len() / rows];
        let precision = self.std.powi(-2);
        let far = |goal: &[f64]| -> f64 {
            goal.iter().zip(place).map(|(goal, x)| (x - goal).powi(2)).sum::<f64>() * precision
        };
        let nearest = goals.chunks_exact(self.dims).map(far).fold(f64::INFINITY, f64::min);
        let (mut sum, mut n) = (0.0, 0.0);
        for goal in goals.chunks_exact(self.dims) {
            sum += (-0.5 * (far(goal) - nearest)).exp();
            n += 1.0;
        }
        for goal in goals.chunks_exact(self.dims) {
            let share = (-0.5 * (far(goal) - nearest)).exp() / sum;
            let pulls = slope.iter_mut().zip(place.iter().zip(goal));
            pulls.for_each(|(slope, (x, goal))| *slope += share * (goal - x) * precision);
        }
        #[expect(clippy::cast_precision_loss, reason = "places have few numbers")]
        let dims = self.dims as f64;
        let scale = 0.5 * dims * (std::f64::consts::TAU * self.std.powi(2)).ln();
        -0.5 * nearest + (sum / n).ln() - scale
    }
}

/// The imitative models that learned functions are.
///
/// # Errors
/// If one of them is none.
pub(crate) fn imitating(models: &[Model]) -> Result<Vec<&Imitative>, Misfit> {
    let why = || {
        let message = "the model scores no plans: use one that `imitative` learned".to_owned();
        Misfit::new(message, "use models that `imitative` learned")
    };
    let own = |model| Imitative::within(model).map(|(own, _)| own).ok_or_else(why);
    models.iter().map(own).collect()
}

/// The knowledge equivalent of what several imitative models say of plans, with what goals say beside it. A plan is its
/// places, or the noise that the first model makes it of (`latent`).
///
/// Nothing is allocated after the first plans of a size, if the knowledge equivalent allocates nothing.
#[derive(Debug)]
pub struct Imitated<'a> {
    opened: &'a mut Imitators,
    ke: &'a dyn KnowledgeEquivalent,
    goals: Option<Goals>,
    latent: bool,
    space: Space,
    weights: Vec<f64>,
    plans: Vec<f32>,
    noise: Vec<f32>,
    scores: Vec<f32>,
    charges: Vec<f32>,
    slope: Vec<f32>,
    of_one: Vec<f64>,
    charge: Vec<f64>,
}

impl<'a> Imitated<'a> {
    /// That of models which have seen where they are.
    ///
    /// # Panics
    /// If goals have more than 8 numbers each.
    #[must_use]
    pub fn new(
        opened: &'a mut Imitators,
        ke: &'a dyn KnowledgeEquivalent,
        goals: Option<Goals>,
        latent: bool,
    ) -> Self {
        assert!(goals.as_ref().is_none_or(|goals| goals.dims <= MOST_DIMS), "goals are places");
        let (len, models) = (opened.scorer.len(), opened.scorer.models());
        let space = Space::boundless(len);
        Self {
            opened,
            ke,
            goals,
            latent,
            space,
            weights: uniform(models),
            plans: Vec::new(),
            noise: Vec::new(),
            scores: Vec::new(),
            charges: Vec::new(),
            slope: Vec::new(),
            of_one: vec![0.0; models],
            charge: vec![0.0; models],
        }
    }

    /// The places of plans: what they are, or what the first model makes of them.
    pub fn places(&mut self, plans: &[f64], n: usize) -> &[f32] {
        self.plans.clear();
        self.plans.extend(plans.iter().map(|x| f32::of(*x)));
        if self.latent {
            self.noise.clone_from(&self.plans);
            self.opened.scorer.plans(0, &mut self.plans, n);
        }
        &self.plans
    }

    /// What each model says of plans, `[rows, n, models]`.
    pub fn scores(&mut self, plans: &[f64], n: usize) -> &[f32] {
        self.places(plans, n);
        let models = self.weights.len();
        self.scores.resize(self.opened.scorer.rows() * n * models, 0.0);
        self.opened.scorer.scores(&self.plans, n, &mut self.scores);
        &self.scores
    }

    /// What the knowledge equivalent makes of the log densities of a plan a row, without goals, and their variance.
    pub(crate) fn said(&mut self, plans: &[f64]) -> Vec<[f64; 2]> {
        self.scores(plans, 1);
        let Self { scores, of_one, ke, weights, .. } = self;
        let rows = scores.chunks_exact(weights.len()).map(|scores| {
            of_one.iter_mut().zip(scores).for_each(|(to, x)| *to = f64::from(*x));
            [ke.reduce(of_one, weights), ivx_math::moments::std(of_one).powi(2)]
        });
        rows.collect()
    }

    /// Adds what goals say of each plan to its worth, and where they pull to the slope of its places.
    fn add_goals(&mut self, n: usize, worth: &mut [f64], slopes: bool) {
        let Some(goals) = &self.goals else { return };
        let (rows, len) = (self.opened.scorer.rows(), self.opened.scorer.len());
        let mut place = [0.0; MOST_DIMS];
        let mut pull = [0.0; MOST_DIMS];
        let (place, pull) = (&mut place[..goals.dims], &mut pull[..goals.dims]);
        for (item, worth) in worth.iter_mut().enumerate() {
            let last = (item + 1) * len - goals.dims;
            place.iter_mut().zip(&self.plans[last..]).for_each(|(to, x)| *to = f64::from(*x));
            pull.fill(0.0);
            *worth += goals.log_likelihood((item / n, rows), place, pull);
            if slopes {
                self.slope[last..].iter_mut().zip(&*pull).for_each(|(to, x)| *to += f32::of(*x));
            }
        }
    }
}

impl Objective for Imitated<'_> {
    fn rows(&self) -> usize {
        self.opened.scorer.rows()
    }

    fn len(&self) -> usize {
        self.opened.scorer.len()
    }

    fn space(&self) -> &Space {
        &self.space
    }

    fn worth(&mut self, plans: &[f64], n: usize, worth: &mut [f64]) {
        self.scores(plans, n);
        for (scores, worth) in self.scores.chunks_exact(self.weights.len()).zip(&mut *worth) {
            self.of_one.iter_mut().zip(scores).for_each(|(to, x)| *to = f64::from(*x));
            *worth = self.ke.reduce(&self.of_one, &self.weights);
        }
        self.add_goals(n, worth, false);
    }

    fn slope(&mut self, plans: &[f64], worth: &mut [f64], slope: &mut [f64]) -> bool {
        self.scores(plans, 1);
        self.charges.resize(self.scores.len(), 0.0);
        let models = self.weights.len();
        let rows = self.scores.chunks_exact(models).zip(self.charges.chunks_exact_mut(models));
        for ((scores, charges), worth) in rows.zip(&mut *worth) {
            self.of_one.iter_mut().zip(scores).for_each(|(to, x)| *to = f64::from(*x));
            *worth = self.ke.reduce(&self.of_one, &self.weights);
            self.ke.slope(&self.of_one, &self.weights, &mut self.charge);
            charges.iter_mut().zip(&self.charge).for_each(|(to, x)| *to = f32::of(*x));
        }
        self.slope.resize(slope.len(), 0.0);
        self.opened.scorer.slope(&self.charges, &mut self.slope);
        self.add_goals(1, worth, true);
        if self.latent {
            self.opened.scorer.plans_back(0, &self.noise, &mut self.slope);
        }
        slope.iter_mut().zip(&self.slope).for_each(|(to, x)| *to = f64::from(*x));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two goals, one of them near: `ln ½ (N(0) + N(2))`, and far from all of them no underflow.
    #[test]
    fn goals_are_a_mixture() {
        let goals = Goals { places: vec![9.0, 9.0, 1.0, 3.0], dims: 1, std: 1.0 };
        let mut slope = [0.0];
        let found = goals.log_likelihood((1, 2), &[1.0], &mut slope);
        let normal = |d: f64| (-0.5 * d * d).exp() / std::f64::consts::TAU.sqrt();
        assert!((found - (0.5 * (normal(0.0) + normal(2.0))).ln()).abs() < 1e-12);
        let share = normal(2.0) / (normal(0.0) + normal(2.0));
        assert!((slope[0] - 2.0 * share).abs() < 1e-12);
        let mut slope = [0.0];
        let far = goals.log_likelihood((1, 2), &[1e3], &mut slope);
        assert!(far.is_finite() && (slope[0] + 997.0).abs() < 1e-9, "{far} {slope:?}");
    }
}
