//! The worst reward.

use ivx_math::order::min;
use ivx_math::tail::support;
use ivx_op::declare;

use super::CertaintyEquivalent;

declare! {
    /// Worst-case utility (Eqn. 2.3): the lowest outcome that is possible. Averse to risk.
    pub struct Wcu = "wcu" @ 1 {}
}

impl CertaintyEquivalent for Wcu {
    fn value(&self, outcomes: &[f64], probabilities: &[f64]) -> f64 {
        let possible: Vec<f64> = support(probabilities).map(|i| outcomes[i]).collect();
        min(&possible)
    }
}
