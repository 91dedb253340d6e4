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
        // Most tell nothing, and a division takes a tenth of a step.
        let width = if step.told.is_empty() { 0 } else { step.told.len() / step.rewards.len() };
        for &lane in lanes {
            let told = &mut step.told[lane * width..][..width];
            let mut row = Row::of(&mut step.after, lane, told);
            let (reward, end) = self[lane].step(step.acts.get(lane), &mut luck[lane], &mut row);
            (step.rewards[lane], step.ends[lane]) = (reward, end);
        }
        Ok(())
    }
}
