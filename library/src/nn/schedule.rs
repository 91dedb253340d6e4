//! How a learning rate changes as training goes on.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Parts, declare, family};

/// A number that depends on how far training is.
pub trait Schedule: Debug + Send + Sync {
    /// The value at step `t` of `total`, counted from 0.
    fn at(&self, t: u64, total: u64) -> f64;
}

declare! {
    /// The same value at every step.
    pub struct Constant = "constant" @ 1 {
        /// The value.
        value: f64, in 0.0..;
    }
}

declare! {
    /// A straight line over the whole training.
    ///
    /// At step `t` of `T`: `from + (to - from) min(t, T) / T`.
    pub struct Linear = "linear" @ 1 {
        /// The value at step 0.
        from: f64, in 0.0..;
        /// The value after the last step.
        to: f64, in 0.0..;
    }
}

impl Schedule for Constant {
    fn at(&self, _: u64, _: u64) -> f64 {
        self.value
    }
}

impl Schedule for Linear {
    #[expect(clippy::cast_precision_loss, reason = "steps count far below 2^53")]
    fn at(&self, t: u64, total: u64) -> f64 {
        let done = if total == 0 { 0.0 } else { t.min(total) as f64 / total as f64 };
        self.from + (self.to - self.from) * done
    }
}

/// The schedules, by name.
pub(crate) fn schedules() -> &'static Parts<dyn Schedule> {
    static TABLE: LazyLock<Parts<dyn Schedule>> = LazyLock::new(|| {
        Parts::<dyn Schedule>::new().with(|x: Constant| Box::new(x)).with(|x: Linear| Box::new(x))
    });
    &TABLE
}

family!(dyn Schedule, "Schedule", schedules);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_ends_at_the_last_step_and_stays() {
        // From 4 to 2 over 4 steps: half a unit a step.
        let line = Linear { from: 4.0, to: 2.0 };
        assert_eq!([0, 1, 4, 9].map(|t| line.at(t, 4)), [4.0, 3.5, 2.0, 2.0]);
        assert_eq!(line.at(0, 0), 4.0);
        assert_eq!(Constant { value: 0.5 }.at(3, 4), 0.5);
    }
}
