//! How target networks follow.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_nn::Follow;
use ivx_op::{Parts, declare, family};

/// How the networks that targets are reckoned with follow those that learn.
pub trait Target: Debug + Send + Sync {
    /// The rule, by updates.
    fn rule(&self) -> Follow;
}

declare! {
    /// They are copied after every so many updates, and stay as they are in between (Mnih et al., 2015).
    pub struct Copied = "copied" @ 1 {
        /// How many.
        every: u64, in 1.0.., unit "updates";
    }
}

declare! {
    /// They go a share of the way after every update: `θ⁻ ← (1 - τ) θ⁻ + τ θ` (Lillicrap et al., 2016).
    pub struct Averaged = "averaged" @ 1 {
        /// The share `τ`.
        share: f64 = 0.005, in 0.0..=1.0;
    }
}

impl Target for Copied {
    fn rule(&self) -> Follow {
        Follow::Copy(self.every)
    }
}

impl Target for Averaged {
    fn rule(&self) -> Follow {
        Follow::Average(self.share)
    }
}

pub(super) fn targets() -> &'static Parts<dyn Target> {
    static TABLE: LazyLock<Parts<dyn Target>> = LazyLock::new(|| {
        Parts::<dyn Target>::new().with(|x: Copied| Box::new(x)).with(|x: Averaged| Box::new(x))
    });
    &TABLE
}

family!(dyn Target, "Target", targets);
