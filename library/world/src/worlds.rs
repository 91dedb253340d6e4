//! Worlds that are stepped together.

use ivx_data::Columns;
use ivx_op::OpError;

use crate::env::{Row, World};
use crate::lanes::Step;
use crate::luck::Luck;

/// Worlds side by side, one a lane, of which none depends on another. Their luck, and the rows that they write, are by
/// lane.
pub trait Worlds: Send {
    /// Starts an episode in each of `lanes`.
    ///
    /// # Errors
    /// If one cannot: what they are now is unknown.
    fn reset(
        &mut self,
        lanes: &[usize],
        luck: &mut [Luck],
        seen: &mut Columns,
    ) -> Result<(), OpError>;

    /// Takes the action of each of `lanes`: what is seen after it, what it pays, whether the episode is over, and what
    /// the world tells besides.
    ///
    /// # Errors
    /// If one cannot: what they are now is unknown.
    fn step(&mut self, lanes: &[usize], luck: &mut [Luck], step: &mut Step) -> Result<(), OpError>;

    /// What the world of a lane would tell if its expert acted ([`World::shown`]).
    fn shown(&self, _lane: usize, _steps: usize, _luck: &mut Luck) -> Option<Vec<f32>> {
        None
    }
}

/// Each on its own, one after the other.
impl Worlds for Vec<Box<dyn World>> {
    fn reset(
        &mut self,
        lanes: &[usize],
        luck: &mut [Luck],
        seen: &mut Columns,
    ) -> Result<(), OpError> {
        for &lane in lanes {
            // What a world tells is of steps.
            self[lane].reset(&mut luck[lane], &mut Row::of(seen, lane, &mut []));
        }
        Ok(())
    }

    fn step(&mut self, lanes: &[usize], luck: &mut [Luck], step: &mut Step) -> Result<(), OpError> {
        let Step { acts, rewards, after, ends, told, .. } = step;
        // Most tell nothing, and a division takes a tenth of a step.
        let width = if told.is_empty() { 0 } else { told.len() / rewards.len() };
        for &lane in lanes {
            let mut row = Row::of(after, lane, &mut told[lane * width..][..width]);
            let (reward, end) = self[lane].step(acts.get(lane), &mut luck[lane], &mut row);
            (rewards[lane], ends[lane]) = (reward, end);
        }
        Ok(())
    }

    fn shown(&self, lane: usize, steps: usize, luck: &mut Luck) -> Option<Vec<f32>> {
        self[lane].shown(steps, luck)
    }
}
