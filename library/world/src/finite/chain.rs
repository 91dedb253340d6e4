//! A row of cells.

use ivx_op::{OpError, declare};

use super::mdp::named;
use super::{Finite, Mdp};

declare! {
    /// A row of cells to walk along (Examples 2.5 and 2.6). RIGHT moves one cell, LEFT may slip and stay.
    ///
    /// With a goal, entering the last cell pays 1 and ends the episode; it starts in any other cell.
    /// Without, nothing is paid and no episode ends.
    pub struct Chain = "chain" @ 1 {
        /// How many cells.
        cells: usize = 4, in 2.0..=1e3;
        /// How probably LEFT stays.
        slip: f64 = 0.1, in 0.0..=1.0;
        /// Whether the last cell is a goal.
        goal: bool = true;
    }
}

impl Finite for Chain {
    fn mdp(&self) -> Result<Mdp, OpError> {
        let mut entered = vec![None; self.cells];
        if self.goal {
            entered[self.cells - 1] = Some(1.0);
        }
        Ok(Mdp::moving(named(&["LEFT", "RIGHT"]), &entered, |s, a| match a {
            0 => (s.saturating_sub(1), 1.0 - self.slip),
            _ => ((s + 1).min(self.cells - 1), 1.0),
        }))
    }

    fn pays(&self) -> bool {
        self.goal
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn left_slips_and_ends_are_walls() {
        let chain = |goal| Chain { cells: 3, slip: 0.25, goal }.mdp().unwrap();
        let mdp = chain(true);
        assert_eq!(mdp.next(0, 0), [1.0, 0.0, 0.0]);
        assert_eq!(mdp.next(1, 0), [0.75, 0.25, 0.0]);
        assert_eq!(mdp.next(1, 1), [0.0, 0.0, 1.0]);
        assert_eq!(mdp.rewards, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        assert_eq!(
            (&mdp.terminal[..], &mdp.start[..]),
            (&[false, false, true][..], &[0.5, 0.5, 0.0][..])
        );
        let endless = chain(false);
        assert_eq!(endless.next(2, 0), [0.0, 0.75, 0.25]);
        assert!(endless.rewards.iter().all(|r| *r == 0.0) && !endless.terminal[2]);
    }
}
