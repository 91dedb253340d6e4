//! Point estimates of linear models, in closed form.

use ivx_data::Dataset;
use ivx_math::linear_gaussian::{Regression, least_squares, posterior, powers};
use ivx_nn::Model;
use ivx_op::{Ctx, OpError, Part, declare};
use nalgebra::DVector;

use super::prior::{NOT_NORMAL, prior_is_normal};
use super::{Features, Learner, Prior};

declare! {
    /// Maximum likelihood in closed form (Eqn. 2.15): least squares.
    ///
    /// Where several models fit equally well, the one with the smallest coefficients. Directions
    /// whose singular value is below max(n, coefficients) × 2⁻⁵² of the largest count as free.
    pub struct LinearMle = "linear_mle" @ 2 {
        /// What the model is linear in.
        features: Box<dyn Features>;
    }
}

declare! {
    /// The most probable model in closed form (Eqn. 2.16), for Gaussian noise and prior.
    pub struct LinearMap = "linear_map" @ 1 {
        /// What the model is linear in.
        features: Box<dyn Features>;
        /// The belief about each coefficient before the data.
        prior: Box<dyn Prior> = Part::new("normal").with("mean", 0.0).with("std", 1.0);
        /// Standard deviation of the noise.
        noise: f64 = 0.1, in f64::MIN_POSITIVE..;
    }
    rule prior_is_normal;
}

impl Learner for LinearMle {
    fn train(&self, data: &Dataset, _: u64, _: &Ctx) -> Result<Model, OpError> {
        if data.x.is_empty() {
            return Err(OpError::Failed(
                "maximum likelihood needs data, and there are none".into(),
            ));
        }
        let design = powers(&data.x, self.features.degree());
        let theta = least_squares(&design, &DVector::from_column_slice(&data.y));
        Ok(Model::Polynomial(theta.as_slice().to_vec()))
    }
}

impl Learner for LinearMap {
    fn train(&self, data: &Dataset, _: u64, _: &Ctx) -> Result<Model, OpError> {
        let regression = regression(data, self.features.degree(), self.prior.as_ref(), self.noise)?;
        Ok(Model::Polynomial(posterior(&regression).mean.as_slice().to_vec()))
    }
}

/// The regression problem that data, features, prior and noise pose.
///
/// # Errors
/// If the prior is not normal.
pub(crate) fn regression(
    data: &Dataset,
    degree: usize,
    prior: &dyn Prior,
    noise: f64,
) -> Result<Regression, OpError> {
    let normal = prior.normal().ok_or_else(|| OpError::Failed(NOT_NORMAL.to_owned()));
    let (prior_mean, prior_std) = normal?;
    Ok(Regression {
        design: powers(&data.x, degree),
        targets: DVector::from_column_slice(&data.y),
        noise,
        prior_mean,
        prior_std,
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Laplace, Normal, Polynomial};
    use super::*;
    use ivx_math::moments::mean;
    use ivx_op::Op as _;
    use ivx_world::{Interval, Reward as _, Sample, Sinusoids};

    fn mle(degree: usize) -> LinearMle {
        LinearMle { features: Box::new(Polynomial { degree }) }
    }

    fn map(degree: usize) -> LinearMap {
        let prior = Box::new(Normal { mean: 0.0, std: 1.0 });
        LinearMap { features: Box::new(Polynomial { degree }), prior, noise: 0.1 }
    }

    const CTX: Ctx = Ctx::new("train", 0, None);

    #[test]
    fn a_line_through_two_points() {
        let data = Dataset::pairs(vec![0.0, 2.0], vec![1.0, 5.0]);
        let predicted = mle(1).train(&data, 0, &CTX).unwrap().predict(&[3.0]);
        assert!((predicted[0] - 7.0).abs() < 1e-12);
    }

    #[test]
    fn the_prior_shrinks() {
        // Two equal data of noise 1 against one prior of spread 1: 2·3 / (2 + 1).
        let data = Dataset::pairs(vec![0.0, 0.0], vec![3.0, 3.0]);
        let model = LinearMap { noise: 1.0, ..map(0) }.train(&data, 0, &CTX).unwrap();
        assert!((model.predict(&[0.0])[0] - 2.0).abs() < 1e-12);
    }

    #[test]
    fn without_data_only_the_prior_remains() {
        let none = Dataset::default();
        assert!(mle(2).train(&none, 0, &CTX).is_err());
        assert_eq!(map(2).train(&none, 0, &CTX).unwrap().predict(&[0.5]), [0.0]);
    }

    #[test]
    fn another_prior_than_a_normal_one_is_refused() {
        let prior = Box::new(Laplace { mean: 0.0, scale: 1.0 });
        let learner = LinearMap { prior, ..map(1) };
        let refused = learner.train(&Dataset::default(), 0, &CTX).unwrap_err();
        assert_eq!(refused.to_string(), NOT_NORMAL);
    }

    #[test]
    fn map_generalises_better_than_mle_between_the_points() {
        let grid: Vec<f64> = (0..41).map(|i| -0.8 + 0.04 * f64::from(i)).collect();
        let rmse = |model: &Model| {
            let errors = model.predict(&grid).into_iter().zip(&grid);
            let errors = errors.map(|(y, &x)| (y - Sinusoids {}.mean(x)).powi(2));
            mean(&errors.collect::<Vec<_>>()).sqrt()
        };
        let better = (0..50).filter(|&seed| {
            let from = Box::new(Interval { low: -1.0, high: 1.0 });
            let reward = Box::new(Sinusoids {});
            let sample = Sample { reward, n: 25, noise: 0.1, from, stream: "main".into() };
            let data = sample.run(&Ctx::new("sample", seed, None)).unwrap();
            let (mle, map) = (mle(20).train(&data, 0, &CTX), map(20).train(&data, 0, &CTX));
            rmse(&map.unwrap()) < rmse(&mle.unwrap())
        });
        assert!(better.count() >= 45);
    }
}
