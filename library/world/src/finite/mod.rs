//! Worlds that are tables of states.

mod cells;
mod chain;
mod foreseen;
mod given;
mod goal_world;
mod grid_map;
mod gridworld;
mod mdp;
mod rewarded;

use std::fmt::Debug;

use ivx_data::{Field, Kind, Misfit, Picture};
use ivx_op::{Facts, OpError, Wrong};

pub use chain::Chain;
pub use given::{ComputedMdp, Numbers, WrittenMdp};
pub use goal_world::GoalWorld;
pub use grid_map::GridMap;
pub use gridworld::Gridworld;
pub use mdp::{Mdp, Paid, Transitions, policy};
pub use rewarded::{Rewarded, Taken};

use crate::env::{Env, Row, Spec, World};
use crate::foresight::Foresight;
use crate::luck::Luck;
use cells::Cells;
use foreseen::Foreseen;
use ivx_data::{Act, Actions, End};

/// A finite Markov decision process, as a spec names it.
pub trait Finite: Debug + Send + Sync {
    /// What it does.
    ///
    /// # Errors
    /// If the description is no environment.
    fn mdp(&self) -> Result<Mdp, OpError>;

    /// How many cells a row has, where states are cells of a grid, row after row from the top.
    fn columns(&self) -> Option<usize> {
        None
    }

    /// Whether it ever pays anything.
    fn pays(&self) -> bool {
        true
    }

    /// Whether a state is a cell that nobody comes to.
    fn is_wall(&self, _state: usize) -> bool {
        false
    }
}

/// After how many steps an episode is cut off that does not end by itself.
const LIMIT: u64 = 1000;

impl<T: Finite> Env for T {
    fn spec(&self) -> Result<Spec, Misfit> {
        let mdp = self.mdp().map_err(|error| Misfit::new(error.to_string(), "name another"))?;
        Ok(Spec {
            sees: vec![Field::new("state", &[], Kind::Index(mdp.n_states()))],
            does: Actions::Discrete(mdp.actions.clone()),
            tells: Vec::new(),
            limit: Some(LIMIT),
        })
    }

    fn open(&self) -> Result<Box<dyn World>, OpError> {
        let mdp = self.mdp()?;
        let cells = Cells::of(self, mdp.n_states());
        Ok(Box::new(Walk { mdp, state: 0, cells }))
    }

    fn finite(&self) -> Option<&dyn Finite> {
        Some(self)
    }

    fn foresight(&self) -> Result<Box<dyn Foresight>, Misfit> {
        let mdp = self.mdp().map_err(|error| Misfit::new(error.to_string(), "name another"))?;
        Ok(Box::new(Foreseen::of(&mdp)))
    }

    fn is_drawn(&self) -> bool {
        self.columns().is_some()
    }

    fn pays(&self) -> bool {
        Finite::pays(self)
    }
}

/// A walk through the states of a process.
struct Walk {
    mdp: Mdp,
    state: usize,
    cells: Option<Cells>,
}

impl World for Walk {
    fn reset(&mut self, luck: &mut Luck, row: &mut Row<'_>) {
        self.state = luck.pick(&self.mdp.start);
        row.index(0, self.state);
    }

    fn step(&mut self, act: Act<'_>, luck: &mut Luck, row: &mut Row<'_>) -> (f64, End) {
        let (state, action) = (self.state, act.index());
        self.state = luck.pick(self.mdp.next(state, action));
        let reward = self.mdp.paid(state, action, self.state);
        row.index(0, self.state);
        (reward, if self.mdp.terminal[self.state] { End::Terminal } else { End::No })
    }

    fn draw(&self) -> Option<Picture> {
        Some(self.cells.as_ref()?.picture(&self.mdp, self.state))
    }
}

/// What a world does, if it is a table of states.
///
/// # Errors
/// If it is none.
pub fn mdp(env: &dyn Env) -> Result<Mdp, OpError> {
    env.finite().ok_or_else(|| OpError::Failed(NOT_FINITE.to_owned()))?.mdp()
}

const NOT_FINITE: &str = "this world is no table of states, which this operation takes";

/// The rule that the world `in` is a table of states.
///
/// # Errors
/// If it is none.
pub fn world_is_finite(facts: &Facts<'_>) -> Result<(), Wrong> {
    is_finite(facts, "in")
}

/// The same of `of`.
///
/// # Errors
/// If it is none.
pub fn of_is_finite(facts: &Facts<'_>) -> Result<(), Wrong> {
    is_finite(facts, "of")
}

fn is_finite(facts: &Facts<'_>, arg: &'static str) -> Result<(), Wrong> {
    match facts.arg::<Box<dyn Env>>(arg) {
        Some(world) if world.finite().is_none() => Err(Wrong {
            arg,
            message: NOT_FINITE.to_owned(),
            help: "use one that is, such as `chain()`, `grid_map([..])` or `mdp(..)`; in worlds of any kind \
                   agents are made by `learn` and measured by `evaluate`"
                .to_owned(),
        }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_data::{Columns, Values};

    /// In a chain of three cells without slipping, two steps to the right end an episode and pay 1.
    #[test]
    fn a_walk_steps_through_the_table() {
        let env = Chain { cells: 3, slip: 0.0, goal: true };
        let spec = Env::spec(&env).unwrap();
        assert_eq!(spec.does, Actions::named(&["LEFT", "RIGHT"]));
        let (mut world, mut luck) = (env.open().unwrap(), Luck::numpy(0));
        let mut seen = Columns::zeros(spec.sees, 1);
        let at = |seen: &Columns| {
            let Values::Index(state) = seen.values(0) else { panic!("a place") };
            state[0]
        };
        for _ in 0..20 {
            world.reset(&mut luck, &mut Row::of(&mut seen, 0, &mut []));
            let left = 2 - at(&seen);
            for step in 1..=left {
                let (pays, end) =
                    world.step(Act::Index(1), &mut luck, &mut Row::of(&mut seen, 0, &mut []));
                let last = step == left;
                assert_eq!(end, if last { End::Terminal } else { End::No });
                assert_eq!(pays, if last { 1.0 } else { 0.0 });
            }
            assert_eq!(at(&seen), 2);
        }
    }
}
