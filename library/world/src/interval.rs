//! One interval.

use ivx_op::{Facts, OpError, Wrong, declare};

use super::Region;

declare! {
    /// The numbers from `low` to `high`.
    pub struct Interval = "interval" @ 1 {
        /// Where it starts.
        low: f64;
        /// Where it ends.
        high: f64;
    }
    rule starts_first;
}

impl Region for Interval {
    fn intervals(&self) -> Result<Vec<(f64, f64)>, OpError> {
        let Self { low, high } = *self;
        if low > high {
            return Err(OpError::Failed(backwards(low, high)));
        }
        Ok(vec![(low, high)])
    }
}

fn starts_first(facts: &Facts<'_>) -> Result<(), Wrong> {
    match (facts.arg("low"), facts.arg("high")) {
        (Some(low), Some(high)) if low > high => {
            let help = "write the lower end first".to_owned();
            Err(Wrong { arg: "high", message: backwards(low, high), help })
        }
        _ => Ok(()),
    }
}

fn backwards(low: f64, high: f64) -> String {
    format!("the interval ends at {high}, before it starts at {low}")
}
