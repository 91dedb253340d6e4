//! One interval.

use ivx_op::{OpError, declare};

use super::Region;

declare! {
    /// The numbers from `low` to `high`.
    pub struct Interval = "interval" @ 1 {
        /// Where it starts.
        low: f64;
        /// Where it ends.
        high: f64;
    }
}

impl Region for Interval {
    fn intervals(&self) -> Result<Vec<(f64, f64)>, OpError> {
        let Self { low, high } = *self;
        if low > high {
            return Err(OpError::Failed(format!(
                "the interval ends at {high}, before it starts at {low}"
            )));
        }
        Ok(vec![(low, high)])
    }
}
