//! A square of cells.

use ivx_op::{Facts, OpError, Wrong, declare};

use super::mdp::named;
use super::{Finite, Mdp};

declare! {
    /// A square of cells with a goal and a trap (Example 2.4). Moves are certain, and walls hold back.
    ///
    /// Entering the goal pays 1, entering the trap -1, and either ends the episode. It starts in any other
    /// cell. States are numbered row after row from the top left.
    pub struct GoalWorld = "goal_world" @ 1 {
        /// How many rows, and how many columns.
        size: usize = 7, in 2.0..=40.0;
        /// Row and column of the goal, from 0.
        goal: Vec<usize> = vec![1_i64, 5], in 0.0..;
        /// Row and column of the trap, from 0.
        trap: Vec<usize> = vec![3_i64, 3], in 0.0..;
    }
    rule places_are_cells;
}

impl Finite for GoalWorld {
    fn columns(&self) -> Option<usize> {
        Some(self.size)
    }

    fn mdp(&self) -> Result<Mdp, OpError> {
        let n = self.size;
        let (goal, trap) =
            cells(n, &self.goal, &self.trap).map_err(|(_, message)| OpError::Failed(message))?;
        let mut entered = vec![None; n * n];
        entered[trap] = Some(-1.0);
        entered[goal] = Some(1.0);
        Ok(Mdp::moving(named(&["UP", "DOWN", "LEFT", "RIGHT"]), &entered, |s, a| {
            let (row, column) = (s / n, s % n);
            let to = match a {
                0 => (row.saturating_sub(1), column),
                1 => ((row + 1).min(n - 1), column),
                2 => (row, column.saturating_sub(1)),
                _ => (row, (column + 1).min(n - 1)),
            };
            (to.0 * n + to.1, 1.0)
        }))
    }
}

/// The states of the goal and of the trap; or which place is wrong, and why.
fn cells(
    size: usize,
    goal: &[usize],
    trap: &[usize],
) -> Result<(usize, usize), (&'static str, String)> {
    let cell = |arg, place: &[usize]| match *place {
        [row, column] if row < size && column < size => Ok(row * size + column),
        _ => Err((arg, format!("{place:?} is no row and column of {size} × {size} cells"))),
    };
    let (goal, trap) = (cell("goal", goal)?, cell("trap", trap)?);
    if goal == trap {
        return Err(("trap", "goal and trap are one cell".to_owned()));
    }
    Ok((goal, trap))
}

fn places_are_cells(facts: &Facts<'_>) -> Result<(), Wrong> {
    match (facts.arg("size"), facts.arg::<Vec<usize>>("goal"), facts.arg::<Vec<usize>>("trap")) {
        (Some(size), Some(goal), Some(trap)) => {
            cells(size, &goal, &trap).map(drop).map_err(|(arg, message)| {
                let help = "give a row and a column from 0, another for each".to_owned();
                Wrong { arg, message, help }
            })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_end_at_walls_goal_and_trap() {
        let mdp = GoalWorld { size: 3, goal: vec![0, 1], trap: vec![1, 1] }.mdp().unwrap();
        let leads = |s, a| mdp.next(s, a).iter().position(|p| *p == 1.0).unwrap();
        // From the middle of the left column: up, down, the wall, the trap.
        assert_eq!([0, 1, 2, 3].map(|a| leads(3, a)), [0, 6, 3, 4]);
        assert_eq!([0, 1, 2, 3].map(|a| mdp.reward(3, a)), [0.0, 0.0, 0.0, -1.0]);
        assert_eq!((leads(2, 2), mdp.reward(2, 2)), (1, 1.0));
        assert_eq!([0, 1, 2, 3].map(|a| (leads(1, a), mdp.reward(1, a))), [(1, 0.0); 4]);
        assert_eq!(mdp.terminal.iter().filter(|end| **end).count(), 2);
        assert_eq!((mdp.start[0], mdp.start[1]), (1.0 / 7.0, 0.0));
    }

    #[test]
    fn a_place_that_is_no_cell_is_refused() {
        let why = |goal: &[usize], trap: &[usize]| {
            let grid = GoalWorld { size: 3, goal: goal.to_vec(), trap: trap.to_vec() };
            grid.mdp().unwrap_err().to_string()
        };
        assert_eq!(why(&[0, 3], &[0, 0]), "[0, 3] is no row and column of 3 × 3 cells");
        assert_eq!(why(&[0, 2], &[0, 2]), "goal and trap are one cell");
    }
}
