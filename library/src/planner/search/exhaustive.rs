//! Trying every plan that there is.

use ivx_data::Misfit;
use ivx_data::form::failed;
use ivx_math::moments::real;
use ivx_op::{OpError, declare};
use ivx_world::Luck;

use super::best::Best;
use super::{Objective, Planner, Planning, Space, sized};

declare! {
    /// The best of all plans of discrete actions, the first of equals where a plan is before another as words are in a
    /// lexicon; where there are no more than a million.
    pub struct Exhaustive = "exhaustive" @ 1 {}
}

/// More plans than these are not tried.
const MOST: u128 = 1_000_000;

/// How many are tried at once.
const AT_ONCE: usize = 1024;

impl Planner for Exhaustive {
    fn fits(&self, space: &Space, len: usize) -> Result<(), Misfit> {
        count(space, len).map(drop)
    }

    fn open(&self) -> Box<dyn Planning> {
        Box::new(Trying::default())
    }
}

/// How many plans there are.
fn count(space: &Space, len: usize) -> Result<usize, Misfit> {
    let Space::Discrete(k) = space else {
        let message = "`exhaustive` tries every plan, and of real numbers there is no end of plans";
        let help = "use `cem`, `random_shooting` or `gradient_plan`";
        return Err(Misfit::new(message.to_owned(), help));
    };
    let all = u32::try_from(len).ok().and_then(|len| (*k as u128).checked_pow(len));
    match all {
        Some(n) if n <= MOST => Ok(usize::try_from(n).expect("at most a million")),
        all => {
            let all = all.map(|n| format!(", {n},")).unwrap_or_default();
            let message = format!(
                "there are {k}^{len}{all} plans, and `exhaustive` tries no more than {MOST}"
            );
            Err(Misfit::new(message, "plan fewer steps, or use `cem` or `random_shooting`"))
        }
    }
}

#[derive(Default)]
struct Trying {
    /// `[rows, n, len]`.
    tried: Vec<f64>,
    worth: Vec<f64>,
}

impl Planning for Trying {
    fn plan(
        &mut self,
        of: &mut dyn Objective,
        plans: &mut [f64],
        worth: &mut [f64],
        _: &mut Luck,
    ) -> Result<(), OpError> {
        let (rows, len) = (of.rows(), of.len());
        let all = count(of.space(), len).map_err(failed)?;
        let Space::Discrete(k) = *of.space() else { unreachable!("they were counted") };
        let mut best = Best::none(plans, worth, len);
        for first in (0..all).step_by(AT_ONCE) {
            let n = AT_ONCE.min(all - first);
            let tried = sized(&mut self.tried, rows * n * len);
            for (at, plan) in tried.chunks_exact_mut(len).enumerate() {
                let mut number = first + at % n;
                for x in plan.iter_mut().rev() {
                    *x = real(number % k);
                    number /= k;
                }
            }
            let tried_worth = sized(&mut self.worth, rows * n);
            of.worth(&self.tried, n, tried_worth);
            best.see(&self.tried, &self.worth);
        }
        best.found()
    }
}
