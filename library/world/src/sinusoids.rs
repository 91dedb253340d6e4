//! The reward curve of Example 2.2.

use std::f64::consts::PI;

use ivx_op::declare;

use super::Reward;

declare! {
    /// The reward curve sin(πa) + 0.2 cos(4πa) − 0.3a (Eqn. 2.17b).
    pub struct Sinusoids = "sinusoids" @ 1 {}
}

impl Reward for Sinusoids {
    fn mean(&self, a: f64) -> f64 {
        (PI * a).sin() + 0.2 * (4.0 * PI * a).cos() - 0.3 * a
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_actions() {
        // At 0: 0.2; at 1/2: 1 + 0.2 − 0.15; at −1/8: −sin(π/8) + 0 + 0.0375.
        let close = |a: f64, r: f64| (Sinusoids {}.mean(a) - r).abs() < 1e-12;
        assert!(close(0.0, 0.2));
        assert!(close(0.5, 1.05));
        assert!(close(-0.125, 0.0375 - (PI / 8.0).sin()));
    }
}
