//! How a learning rate changes as training goes on.

use std::f64::consts::PI;
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

declare! {
    /// Half a cosine over the whole training (Loshchilov and Hutter, 2016).
    ///
    /// At step `t` of `T`: `to + (from - to) (1 + cos(π min(t, T) / T)) / 2`.
    pub struct Cosine = "cosine" @ 1 {
        /// The value at step 0.
        from: f64, in 0.0..;
        /// The value after the last step.
        to: f64, in 0.0..;
    }
}

declare! {
    /// A straight line up from 0, and then another schedule.
    ///
    /// At step `t` of `T`, of which the first `W` are for warming up: `t / W` times the value at which
    /// `then` begins, and from step `W` on that of `then`, which counts its own steps: `t - W` of
    /// `T - W`. So it ends where it would without warming up, if `W` is not above `T`.
    pub struct WarmUp = "warm_up" @ 1 {
        /// How many steps it takes.
        steps: u64, in 0.0.., unit "updates";
        /// What comes after.
        then: Box<dyn Schedule>;
    }
}

impl Schedule for Constant {
    fn at(&self, _: u64, _: u64) -> f64 {
        self.value
    }
}

impl Schedule for Linear {
    fn at(&self, t: u64, total: u64) -> f64 {
        self.from + (self.to - self.from) * share(t, total)
    }
}

impl Schedule for Cosine {
    fn at(&self, t: u64, total: u64) -> f64 {
        self.to + (self.from - self.to) * f64::midpoint(1.0, (PI * share(t, total)).cos())
    }
}

impl Schedule for WarmUp {
    fn at(&self, t: u64, total: u64) -> f64 {
        let rest = total.saturating_sub(self.steps);
        match t.checked_sub(self.steps) {
            Some(t) => self.then.at(t, rest),
            None => self.then.at(0, rest) * share(t, self.steps),
        }
    }
}

/// How much of `total` is done; nothing of nothing.
#[expect(clippy::cast_precision_loss, reason = "steps count far below 2^53")]
fn share(t: u64, total: u64) -> f64 {
    if total == 0 { 0.0 } else { t.min(total) as f64 / total as f64 }
}

/// The schedules, by name.
pub(crate) fn schedules() -> &'static Parts<dyn Schedule> {
    static TABLE: LazyLock<Parts<dyn Schedule>> = LazyLock::new(|| {
        Parts::<dyn Schedule>::new()
            .with(|x: Constant| Box::new(x))
            .with(|x: Linear| Box::new(x))
            .with(|x: Cosine| Box::new(x))
            .with(|x: WarmUp| Box::new(x))
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

    #[test]
    fn a_cosine_is_flat_at_its_ends() {
        // From 4 to 2: cos 0, π/3, π/2, π = 1, 1/2, 0, −1.
        let cosine = Cosine { from: 4.0, to: 2.0 };
        for (t, expected) in [(0, 4.0), (2, 3.5), (3, 3.0), (6, 2.0), (9, 2.0)] {
            assert!((cosine.at(t, 6) - expected).abs() < 1e-12, "at {t}");
        }
        assert_eq!(cosine.at(0, 0), 4.0);
    }

    #[test]
    fn what_comes_after_warming_up_has_the_rest_of_the_steps() {
        let line = || Box::new(Linear { from: 4.0, to: 2.0 });
        let warm = WarmUp { steps: 2, then: line() };
        assert_eq!([0, 1, 2, 4, 6, 9].map(|t| warm.at(t, 6)), [0.0, 2.0, 4.0, 3.0, 2.0, 2.0]);
        // A training that ends while it warms up, and one without.
        assert_eq!([0, 1].map(|t| warm.at(t, 1)), [0.0, 2.0]);
        let cold = WarmUp { steps: 0, then: line() };
        assert_eq!([0, 1, 4].map(|t| cold.at(t, 4)), [4.0, 3.5, 2.0]);
    }
}
