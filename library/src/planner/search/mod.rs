//! Searching for the plan that is worth most (open-loop lookahead, Eqn. 2.67).

mod best;
mod cem;
mod exhaustive;
mod gradient_plan;
mod random_shooting;
mod trajectory_library;

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::{Actions, Misfit};
use ivx_op::{OpError, Parts, family};
use ivx_world::Luck;

pub use cem::Cem;
pub use exhaustive::Exhaustive;
pub use gradient_plan::GradientPlan;
pub use random_shooting::RandomShooting;
pub use trajectory_library::TrajectoryLibrary;

/// What the numbers of a plan may be.
#[derive(Clone, Debug, PartialEq)]
pub enum Space {
    /// Each between bounds of its own, which may be infinite.
    Continuous {
        /// The least of each number.
        low: Vec<f64>,
        /// The most of each.
        high: Vec<f64>,
    },
    /// Each is one of `0..n`.
    Discrete(usize),
}

impl Space {
    /// That of plans of so many actions, one after the other.
    #[must_use]
    pub fn of(does: &Actions, horizon: usize) -> Self {
        let all = |bounds: &[f32]| -> Vec<f64> {
            let one: Vec<f64> = bounds.iter().map(|x| f64::from(*x)).collect();
            one.repeat(horizon)
        };
        match does {
            Actions::Discrete(names) => Self::Discrete(names.len()),
            Actions::Continuous { low, high } => {
                Self::Continuous { low: all(low), high: all(high) }
            }
        }
    }

    /// That of plans of `len` numbers which may be any.
    #[must_use]
    pub fn boundless(len: usize) -> Self {
        Self::Continuous { low: vec![f64::NEG_INFINITY; len], high: vec![f64::INFINITY; len] }
    }

    /// What comes nearest to `x` as number `i` of a plan.
    #[must_use]
    pub fn clip(&self, i: usize, x: f64) -> f64 {
        match self {
            // Not `clamp`, so that what is no number stays so.
            Self::Continuous { low, high } => {
                if x < low[i] {
                    low[i]
                } else if x > high[i] {
                    high[i]
                } else {
                    x
                }
            }
            Self::Discrete(_) => x,
        }
    }

    /// A plan to start from where there is none: the middle between bounds, and otherwise as near to 0 as can be; of
    /// discrete numbers the first.
    #[must_use]
    pub fn middle(&self, len: usize) -> Vec<f64> {
        match self {
            Self::Discrete(_) => vec![0.0; len],
            Self::Continuous { low, high } => {
                let bounds = low.iter().zip(high).enumerate();
                let middle = bounds.map(|(i, (low, high))| match f64::midpoint(*low, *high) {
                    middle if middle.is_finite() => middle,
                    _ => self.clip(i, 0.0),
                });
                middle.collect()
            }
        }
    }
}

/// What plans are worth, for `rows` problems at once. A plan is `len` numbers.
#[expect(clippy::len_without_is_empty, reason = "it is the length of a plan, and not of this")]
pub trait Objective {
    /// For how many problems plans are wanted.
    fn rows(&self) -> usize;

    /// How many numbers a plan has.
    fn len(&self) -> usize;

    /// What they may be.
    fn space(&self) -> &Space;

    /// What `n` plans for each problem are worth, the more the better; what is not a number is never chosen.
    ///
    /// - `plans`: `[rows, n, len]`, in the space.
    /// - `worth`: `[rows, n]`, to be written.
    fn worth(&mut self, plans: &[f64], n: usize, worth: &mut [f64]);

    /// What one plan for each problem is worth, and how that changes with each of its numbers. `false` where there is no
    /// such slope, and nothing is written.
    ///
    /// - `plans`: `[rows, len]`, in the space.
    /// - `worth`: `[rows]`, to be written.
    /// - `slope`: `[rows, len]`, to be written.
    fn slope(&mut self, plans: &[f64], worth: &mut [f64], slope: &mut [f64]) -> bool;
}

/// A way to look for the best plan.
pub trait Planner: Debug + Send + Sync {
    /// Whether it finds plans of `len` such numbers.
    ///
    /// # Errors
    /// Why not.
    fn fits(&self, space: &Space, len: usize) -> Result<(), Misfit>;

    /// It itself, with room to work in.
    fn open(&self) -> Box<dyn Planning>;

    /// The plans that it chooses among, one after the other, where it has some of its own.
    fn fixed(&self) -> Option<&[f64]> {
        None
    }
}

/// A search that can be done again and again. Its buffers are kept, so that no plan after the first of a size allocates.
///
/// What is drawn is the same for all problems, so that what is found for one does not depend on how many there are.
pub trait Planning: Send {
    /// Looks for the best plan of each problem.
    ///
    /// - `plans`: `[rows, len]`, from where to start; they become the best that were found.
    /// - `worth`: `[rows]`, becomes what those are worth.
    ///
    /// # Errors
    /// If what is to be planned does not fit, or no plan for a problem is worth a number.
    fn plan(
        &mut self,
        of: &mut dyn Objective,
        plans: &mut [f64],
        worth: &mut [f64],
        luck: &mut Luck,
    ) -> Result<(), OpError>;
}

family!(dyn Planner, "Planner", planners);

pub(super) fn planners() -> &'static Parts<dyn Planner> {
    static TABLE: LazyLock<Parts<dyn Planner>> = LazyLock::new(|| {
        Parts::<dyn Planner>::new()
            .with(|x: GradientPlan| Box::new(x))
            .with(|x: Cem| Box::new(x))
            .with(|x: RandomShooting| Box::new(x))
            .with(|x: Exhaustive| Box::new(x))
            .with(|x: TrajectoryLibrary| Box::new(x))
    });
    &TABLE
}

/// Makes a buffer so long; what it held is of no use any more.
fn sized(buffer: &mut Vec<f64>, len: usize) -> &mut [f64] {
    buffer.resize(len, 0.0);
    buffer
}

#[cfg(test)]
pub(crate) mod tests;
