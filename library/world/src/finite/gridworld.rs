//! An empty square of cells with wind.

use ivx_op::{OpError, declare};

use super::mdp::named;
use super::{Finite, Mdp, Paid};

declare! {
    /// An empty square of cells (§C.1.1): nothing is paid, and no episode ends by itself. Moves go north, west,
    /// south and east, and walls hold back.
    ///
    /// With the wind's probability an action is ignored, and one of the four drawn evenly takes its place.
    /// States are numbered row after row from the top left; an episode starts at the bottom right (§5.3).
    pub struct Gridworld = "gridworld" @ 1 {
        /// How many rows, and how many columns.
        size: usize = 5, in 2.0..=40.0;
        /// How probably an action is ignored.
        wind: f64 = 0.0, in 0.0..=1.0;
    }
}

impl Finite for Gridworld {
    fn columns(&self) -> Option<usize> {
        Some(self.size)
    }

    fn mdp(&self) -> Result<Mdp, OpError> {
        let n = self.size;
        let n_states = n * n;
        let mut transitions = vec![0.0; n_states * 4 * n_states];
        for s in 0..n_states {
            let (row, column) = (s / n, s % n);
            let leads = [
                row.saturating_sub(1) * n + column,
                row * n + column.saturating_sub(1),
                (row + 1).min(n - 1) * n + column,
                row * n + (column + 1).min(n - 1),
            ];
            for (a, lead) in leads.into_iter().enumerate() {
                let next = &mut transitions[(s * 4 + a) * n_states..][..n_states];
                next[lead] += 1.0 - self.wind;
                for blown in leads {
                    next[blown] += self.wind / 4.0;
                }
            }
        }
        let mut start = vec![0.0; n_states];
        start[n_states - 1] = 1.0;
        Ok(Mdp {
            actions: named(&["N", "W", "S", "E"]),
            transitions,
            rewards: vec![0.0; n_states * 4],
            paid: Paid::Acting,
            terminal: vec![false; n_states],
            start,
        })
    }

    fn pays(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wind_draws_another_action_and_walls_hold_back() {
        // 0 1
        // 2 3
        let next = |wind, s, a| {
            let mdp = Gridworld { size: 2, wind }.mdp().unwrap();
            mdp.next(s, a).to_vec()
        };
        assert_eq!(next(0.0, 0, 3), [0.0, 1.0, 0.0, 0.0]);
        assert_eq!(next(0.0, 0, 0), [1.0, 0.0, 0.0, 0.0]);
        // East from 2 is 3, but for a quarter of ½ each north, west, south and east.
        assert_eq!(next(0.5, 2, 3), [0.125, 0.0, 0.25, 0.625]);
        assert_eq!(next(1.0, 3, 0), next(1.0, 3, 2));
    }
}
