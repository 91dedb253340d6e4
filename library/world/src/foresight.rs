//! What follows in a world, without being there.

use ivx_data::{Act, Columns};

/// What is known to follow actions in a world, from what is seen of it alone: nothing is drawn, so that where chance
/// decides it is all that may follow, by how probable each is.
pub trait Foresight: Send {
    /// How many numbers say where one is.
    fn width(&self) -> usize;

    /// Where one is who sees a row, written over `state`: `[width]`.
    fn place(&self, seen: &Columns, row: usize, state: &mut [f64]);

    /// Takes an action: what it pays on average, and whether the episode is over for sure. `state` becomes what follows.
    fn step(&mut self, state: &mut [f64], act: Act<'_>) -> (f64, bool);
}
