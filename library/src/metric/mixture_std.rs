//! The spread of an ensemble's predictive distribution.

use ivx_math::moments::variance;
use ivx_op::{Array, Ctx, Members, Op, OpError, declare};

use super::over_members;

declare! {
    /// The standard deviation of the even mixture of one normal a member (Eqn. 2.22):
    /// √(population variance of the means + noise²).
    pub struct MixtureStd = "mixture_std" @ 2 -> Array [like scores] {
        /// The means, one value a member.
        scores: Members<Array>;
        /// The standard deviation of each normal.
        noise: f64 = 0.0, in 0.0..;
    }
}

impl Op for MixtureStd {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        over_members(&self.scores, |means| (variance(means) + self.noise.powi(2)).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_apart_and_noise_add_up() {
        // Means ±3 have variance 9; with noise 4 that is 25.
        let scores = || Members(vec![Array::scalar(3.0), Array::scalar(-3.0)]);
        let ctx = Ctx::new("mixture_std", 0, None);
        let std = |noise| MixtureStd { scores: scores(), noise }.run(&ctx).unwrap().values;
        assert_eq!(std(0.0), [3.0]);
        assert_eq!(std(4.0), [5.0]);
    }
}
