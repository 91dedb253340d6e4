//! Choosing among plans that are given.

use ivx_data::Misfit;
use ivx_data::form::failed;
use ivx_op::{Array, One, OpError, declare};
use ivx_world::Luck;

use super::best::Best;
use super::{Objective, Planner, Planning, Space, sized};

declare! {
    /// The best of the plans of a library (Eqn. 3.6), the first of equals. It starts from nowhere.
    pub struct TrajectoryLibrary = "trajectory_library" @ 1 {
        /// The plans, over a first dimension of plans and others of what a plan is made of, such as `plan_library` makes of
        /// data.
        plans: One<Array>;
    }
}

impl Planner for TrajectoryLibrary {
    fn fits(&self, space: &Space, len: usize) -> Result<(), Misfit> {
        // One that is still to be computed has no dimensions.
        if self.plans.dims.is_empty() { Ok(()) } else { fits(&self.plans, space, len) }
    }

    fn open(&self) -> Box<dyn Planning> {
        let plans = self.plans.0.clone();
        Box::new(Choosing { plans, tried: Vec::new(), worth: Vec::new() })
    }

    fn fixed(&self) -> Option<&[f64]> {
        Some(&self.plans.values)
    }
}

fn fits(plans: &Array, space: &Space, len: usize) -> Result<(), Misfit> {
    let n = plans.dims.first().map_or(0, ivx_op::Dim::len);
    let own: usize = plans.dims.iter().skip(1).map(ivx_op::Dim::len).product();
    if n == 0 || own != len {
        let message = format!(
            "the library has {n} plans of {own} numbers, and a plan is to have {len} numbers"
        );
        return Err(Misfit::new(message, "make the library of plans of this length"));
    }
    let is_one = |i: usize, x: f64| match space {
        Space::Continuous { .. } => x.is_finite() && space.clip(i, x) == x,
        Space::Discrete(k) => x >= 0.0 && x.fract() == 0.0 && x < ivx_math::moments::real(*k),
    };
    match plans.values.iter().enumerate().find(|(at, x)| !is_one(at % len, **x)) {
        None => Ok(()),
        Some((at, x)) => {
            let (plan, i) = (at / len, at % len);
            let message =
                format!("number {i} of plan {plan} of the library is {x}, which it cannot be here");
            Err(Misfit::new(message, "make the library of plans that can be done"))
        }
    }
}

struct Choosing {
    plans: Array,
    /// The same for each problem: `[rows, n, len]`.
    tried: Vec<f64>,
    worth: Vec<f64>,
}

impl Planning for Choosing {
    fn plan(
        &mut self,
        of: &mut dyn Objective,
        plans: &mut [f64],
        worth: &mut [f64],
        _: &mut Luck,
    ) -> Result<(), OpError> {
        let (rows, len) = (of.rows(), of.len());
        fits(&self.plans, of.space(), len).map_err(failed)?;
        let own = &self.plans.values;
        let n = own.len() / len;
        let tried = sized(&mut self.tried, rows * own.len());
        tried.chunks_exact_mut(own.len()).for_each(|tried| tried.copy_from_slice(own));
        let tried_worth = sized(&mut self.worth, rows * n);
        of.worth(&self.tried, n, tried_worth);
        let mut best = Best::none(plans, worth, len);
        best.see(&self.tried, &self.worth);
        best.found()
    }
}
