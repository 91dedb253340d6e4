//! A reward curve of a spec's own.

use ivx_op::{Function, Number, declare};

use super::Reward;

declare! {
    /// The reward curve that a function of the spec says: `let f(a: Float) = 1.0 - a * a`, and `reward(f)`.
    pub struct Own = "reward" @ 1 {
        /// The mean reward of an action.
        mean: Function<Number>;
    }
}

impl Reward for Own {
    fn mean(&self, a: f64) -> f64 {
        self.mean.at(&[a])
    }
}
