//! What is believed of parameters before any data.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_nn::optim::Pull;
use ivx_op::{Facts, Parts, Wrong, declare, family};

/// A belief about every parameter, independently.
pub trait Prior: Debug + Send + Sync {
    /// The gradient of `scale/n` times the negative log density, by every parameter.
    fn pull(&self, scale: f64, n: f64) -> Pull;

    /// Mean and standard deviation of a normal belief, of which alone there are closed forms.
    fn normal(&self) -> Option<(f64, f64)> {
        None
    }
}

family!(dyn Prior, "Prior", table);

pub(super) fn table() -> &'static Parts<dyn Prior> {
    static TABLE: LazyLock<Parts<dyn Prior>> = LazyLock::new(|| {
        Parts::<dyn Prior>::new()
            .with(|part: Normal| Box::new(part))
            .with(|part: Laplace| Box::new(part))
            .with(|part: Flat| Box::new(part))
    });
    &TABLE
}

declare! {
    /// Independent normal parameters of one mean and standard deviation.
    pub struct Normal = "normal" @ 1 {
        /// The mean.
        mean: f64 = 0.0;
        /// The standard deviation.
        std: f64 = 1.0, in f64::MIN_POSITIVE..;
    }
}

declare! {
    /// Independent Laplacian parameters, with the density `e^{-|θ - mean| / scale} / (2 scale)`.
    ///
    /// The most probable parameters are those under an L1 penalty: what the data say little about
    /// is at the mean.
    pub struct Laplace = "laplace" @ 1 {
        /// The mean.
        mean: f64 = 0.0;
        /// The mean distance from it.
        scale: f64 = 1.0, in f64::MIN_POSITIVE..;
    }
}

declare! {
    /// Every parameter is as probable as every other: no pull at all, and so the maximum likelihood estimate.
    pub struct Flat = "flat" @ 1 {}
}

impl Prior for Flat {
    fn pull(&self, _: f64, _: f64) -> Pull {
        Pull::NONE
    }
}

impl Prior for Normal {
    fn pull(&self, scale: f64, n: f64) -> Pull {
        Pull { l2: scale / (self.std.powi(2) * n), l1: 0.0, centre: self.mean }
    }

    fn normal(&self) -> Option<(f64, f64)> {
        Some((self.mean, self.std))
    }
}

impl Prior for Laplace {
    fn pull(&self, scale: f64, n: f64) -> Pull {
        Pull { l2: 0.0, l1: scale / (n * self.scale), centre: self.mean }
    }
}

/// The rule of closed forms: their `prior` is normal.
pub(super) fn prior_is_normal(facts: &Facts<'_>) -> Result<(), Wrong> {
    match facts.arg::<Box<dyn Prior>>("prior") {
        Some(prior) if prior.normal().is_none() => {
            let help = "say `prior: normal(..)`, or train by `map_estimate`".to_owned();
            Err(Wrong { arg: "prior", message: NOT_NORMAL.to_owned(), help })
        }
        _ => Ok(()),
    }
}

pub(super) const NOT_NORMAL: &str = "only a normal prior has a closed form";

#[cfg(test)]
mod tests {
    use super::*;

    /// The pull at `theta` against central differences of the density.
    #[test]
    fn pulls_are_gradients_of_densities() {
        let normal = |x: f64| 0.5 * ((x - 1.0) / 0.5).powi(2);
        let laplace = |x: f64| (x - 1.0).abs() / 0.5;
        let (scale, n, h) = (9.0, 4.0, 1e-6);
        let check = |prior: &dyn Prior, negative_log: &dyn Fn(f64) -> f64| {
            for theta in [-2.0, 0.9, 3.0] {
                let mut pulled = [0.0_f64];
                ivx_nn::optim::add_pull(prior.pull(scale, n), &[theta], &mut pulled);
                let slope = (negative_log(theta + h) - negative_log(theta - h)) / (2.0 * h);
                assert!((pulled[0] - scale / n * slope).abs() < 1e-6, "{prior:?}");
            }
        };
        check(&Normal { mean: 1.0, std: 0.5 }, &normal);
        check(&Flat {}, &|_| 0.0);
        check(&Laplace { mean: 1.0, scale: 0.5 }, &laplace);
    }
}
