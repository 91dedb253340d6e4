//! Evenly spaced places.

use ivx_math::moments::real;
use ivx_op::{Facts, OpError, Wrong, declare};

use super::Points;

declare! {
    /// Evenly spaced places, both ends included.
    pub struct Grid = "grid" @ 1 {
        /// The first place.
        low: f64;
        /// The last place.
        high: f64;
        /// How many places.
        points: usize, in 2.0..=1e6;
    }
    rule rises;
}

impl Points for Grid {
    fn places(&self) -> Result<Vec<f64>, OpError> {
        let Self { low, high, points } = *self;
        if low >= high {
            return Err(OpError::Failed(falls(low, high)));
        }
        let last = points - 1;
        // Weighted before dividing, so that whole bounds give decimals such as 0.1 exactly.
        let inner = |i| (low * real(last - i) + high * real(i)) / real(last);
        let place = |i| {
            if i == 0 {
                low
            } else if i == last {
                high
            } else {
                inner(i)
            }
        };
        Ok((0..points).map(place).collect())
    }
}

fn rises(facts: &Facts<'_>) -> Result<(), Wrong> {
    match (facts.arg("low"), facts.arg("high")) {
        (Some(low), Some(high)) if low >= high => {
            let help = "write the lower end first, and two different ends".to_owned();
            Err(Wrong { arg: "high", message: falls(low, high), help })
        }
        _ => Ok(()),
    }
}

fn falls(low: f64, high: f64) -> String {
    format!("the grid must rise, but goes from {low} to {high}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ends_are_included() {
        let grid = Grid { low: -2.0, high: 2.0, points: 1001 };
        let points = grid.points().unwrap();
        assert_eq!((points[0], points[500], points[501], points[1000]), (-2.0, 0.0, 0.004, 2.0));
        assert_eq!(Grid { low: 0.1, high: 0.7, points: 2 }.points().unwrap(), [0.1, 0.7]);
    }

    #[test]
    fn a_falling_grid_is_refused() {
        let message = Grid { low: 1.0, high: -1.0, points: 3 }.points().unwrap_err().to_string();
        assert_eq!(message, "the grid must rise, but goes from 1 to -1");
    }
}
