//! Climbing the slope of what a plan is worth.

use ivx_data::Misfit;
use ivx_data::form::failed;
use ivx_op::{OpError, declare};
use ivx_world::Luck;

use super::best::Best;
use super::{Objective, Planner, Planning, Space, sized};

declare! {
    /// Gradient ascent on a plan of real numbers (planning with value gradients, §2.3.3; Eqn. 3.5), by the steps of Adam
    /// (Kingma and Ba, 2015) with `β₁ = 0.9`, `β₂ = 0.999` and `ε = 1e-8`, each brought back between the bounds. The best
    /// plan on the way is kept, that of the start among them, so that no plan becomes worse.
    pub struct GradientPlan = "gradient_plan" @ 1 {
        /// How many steps.
        steps: usize = 10, in 1.0..=1e6;
        /// How far a step goes, about, in units of a plan's numbers.
        rate: f64 = 0.1, in f64::MIN_POSITIVE..;
    }
}

const BETA1: f64 = 0.9;
const BETA2: f64 = 0.999;
const EPSILON: f64 = 1e-8;

impl Planner for GradientPlan {
    fn fits(&self, space: &Space, _: usize) -> Result<(), Misfit> {
        match space {
            Space::Continuous { .. } => Ok(()),
            Space::Discrete(_) => {
                let message = "`gradient_plan` climbs a slope, and discrete actions have none";
                let help = "use `cem`, `random_shooting` or `exhaustive`";
                Err(Misfit::new(message.to_owned(), help))
            }
        }
    }

    fn open(&self) -> Box<dyn Planning> {
        let rate = self.rate;
        Box::new(Climbing { steps: self.steps, rate, ..Climbing::default() })
    }
}

#[derive(Default)]
struct Climbing {
    steps: usize,
    rate: f64,
    /// Where one is: `[rows, len]`, and what that is worth.
    at: Vec<f64>,
    worth: Vec<f64>,
    slope: Vec<f64>,
    /// The means of slopes and of their squares.
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Planning for Climbing {
    fn plan(
        &mut self,
        of: &mut dyn Objective,
        plans: &mut [f64],
        worth: &mut [f64],
        _: &mut Luck,
    ) -> Result<(), OpError> {
        let (rows, len) = (of.rows(), of.len());
        let climber = GradientPlan { steps: self.steps, rate: self.rate };
        climber.fits(of.space(), len).map_err(failed)?;
        for moments in [&mut self.first, &mut self.second] {
            sized(moments, rows * len).fill(0.0);
        }
        sized(&mut self.worth, rows);
        sized(&mut self.slope, rows * len);
        let at = sized(&mut self.at, rows * len);
        at.iter_mut().zip(&*plans).enumerate().for_each(|(i, (at, start))| {
            *at = of.space().clip(i % len, *start);
        });
        let mut best = Best::none(plans, worth, len);
        let (mut decay1, mut decay2) = (1.0, 1.0);
        for _ in 0..self.steps {
            if !of.slope(&self.at, &mut self.worth, &mut self.slope) {
                let why = "`gradient_plan` climbs a slope, and what these plans are worth has none";
                return Err(OpError::Failed(why.to_owned()));
            }
            best.see(&self.at, &self.worth);
            (decay1, decay2) = (decay1 * BETA1, decay2 * BETA2);
            let moments = self.first.iter_mut().zip(&mut self.second);
            let each = self.at.iter_mut().zip(&self.slope).zip(moments).enumerate();
            for (i, ((x, slope), (first, second))) in each {
                *first = BETA1 * *first + (1.0 - BETA1) * slope;
                *second = BETA2 * *second + (1.0 - BETA2) * slope * slope;
                let (mean, square) = (*first / (1.0 - decay1), *second / (1.0 - decay2));
                *x = of.space().clip(i % len, *x + self.rate * mean / (square.sqrt() + EPSILON));
            }
        }
        of.worth(&self.at, 1, &mut self.worth);
        best.see(&self.at, &self.worth);
        best.found()
    }
}
