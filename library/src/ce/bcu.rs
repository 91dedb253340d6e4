//! The best reward.

use ivx_math::order::max;
use ivx_math::tail::support;
use ivx_op::declare;

use super::CertaintyEquivalent;

declare! {
    /// Best-case utility (Eqn. 2.3): the highest outcome that is possible. Seeks risk.
    pub struct Bcu = "bcu" @ 1 {}
}

impl CertaintyEquivalent for Bcu {
    fn value(&self, outcomes: &[f64], probabilities: &[f64]) -> f64 {
        let possible: Vec<f64> = support(probabilities).map(|i| outcomes[i]).collect();
        max(&possible)
    }
}
