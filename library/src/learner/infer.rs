//! Exact Bayesian inference.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::form::{self, data_of_pairs};
use ivx_data::{Dataset, Posterior};
use ivx_math::linear_gaussian;
use ivx_op::{Array, Ctx, Dim, Labels, One, Op, OpError, Part, Parts, declare, family};
use ivx_world::{Points, curve};

use super::linear::regression;
use super::prior::prior_is_normal;
use super::{Features, Prior};

/// Turns data into a belief about parameters.
pub trait Inference: Debug + Send + Sync {
    /// The posterior.
    ///
    /// # Errors
    /// If there is none; the message says why.
    fn infer(&self, data: &Dataset) -> Result<Posterior, OpError>;
}

family!(dyn Inference, "Inference", table);

pub(super) fn table() -> &'static Parts<dyn Inference> {
    static TABLE: LazyLock<Parts<dyn Inference>> =
        LazyLock::new(|| Parts::<dyn Inference>::new().with(|part: LinearBayes| Box::new(part)));
    &TABLE
}

declare! {
    /// Linear regression with Gaussian noise and a Gaussian prior.
    pub struct LinearBayes = "linear_bayes" @ 1 {
        /// What the model is linear in.
        features: Box<dyn Features>;
        /// The belief about each coefficient before the data.
        prior: Box<dyn Prior> = Part::new("normal").with("mean", 0.0).with("std", 1.0);
        /// Standard deviation of the noise.
        noise: f64 = 0.1, in f64::MIN_POSITIVE..;
    }
    rule prior_is_normal;
}

impl Inference for LinearBayes {
    fn infer(&self, data: &Dataset) -> Result<Posterior, OpError> {
        let regression = regression(data, self.features.degree(), self.prior.as_ref(), self.noise)?;
        let belief = linear_gaussian::posterior(&regression);
        Ok(Posterior {
            mean: belief.mean.as_slice().to_vec(),
            root: belief.root.transpose().as_slice().to_vec(),
            noise: self.noise,
            log_evidence: belief.log_evidence,
        })
    }
}

declare! {
    /// The exact belief about a model's parameters after seeing data (Eqn. 2.13).
    pub struct Infer = "infer" @ 1 -> Posterior {
        /// The model before the data.
        model: Box<dyn Inference>;
        /// The data.
        on: One<Dataset>;
    }
    rule data_of_pairs;
}

impl Op for Infer {
    fn run(&self, _: &Ctx) -> Result<Posterior, OpError> {
        form::pairs("this operation", &self.on.form).map_err(form::failed)?;
        self.model.infer(&self.on)
    }
}

declare! {
    /// The mean of the posterior predictive distribution (Eqn. 2.14).
    pub struct PredictiveMean = "predictive_mean" @ 1 -> Array [x] {
        /// The belief.
        posterior: One<Posterior>;
        /// The actions.
        at: Box<dyn Points>;
    }
}

impl Op for PredictiveMean {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let points = self.at.points()?;
        let means = self.posterior.mean_at(&points);
        Ok(curve(points, means))
    }
}

declare! {
    /// The standard deviation of the posterior predictive distribution (Eqn. 2.14).
    pub struct PredictiveStd = "predictive_std" @ 1 -> Array [x] {
        /// The belief.
        posterior: One<Posterior>;
        /// The actions.
        at: Box<dyn Points>;
        /// Whether the noise of a new observation counts: with it, risk and ignorance; without,
        /// ignorance alone.
        noise: bool = true;
    }
}

impl Op for PredictiveStd {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let points = self.at.points()?;
        let noise = if self.noise { self.posterior.noise } else { 0.0 };
        let ignorance = self.posterior.variance_at(&points);
        let stds = ignorance.iter().map(|variance| (variance + noise.powi(2)).sqrt()).collect();
        Ok(curve(points, stds))
    }
}

declare! {
    /// The posterior standard deviation of each coefficient.
    pub struct PosteriorStd = "posterior_std" @ 1 -> Array [coefficient] {
        /// The belief.
        posterior: One<Posterior>;
    }
}

impl Op for PosteriorStd {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let places = 0..self.posterior.mean.len();
        let stds = places.map(|i| self.posterior.covariance(i, i).sqrt()).collect();
        Ok(Array::series(coefficients(&self.posterior), stds))
    }
}

declare! {
    /// The density of each coefficient at places, whatever the others are (Figure 2.1).
    pub struct PosteriorDensity = "posterior_density" @ 1 -> Array [coefficient, x] {
        /// The belief.
        posterior: One<Posterior>;
        /// The values a coefficient may have.
        at: Box<dyn Points>;
    }
}

impl Op for PosteriorDensity {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let points = self.at.points()?;
        let mut values = Vec::with_capacity(self.posterior.mean.len() * points.len());
        for (i, mean) in self.posterior.mean.iter().enumerate() {
            let std = self.posterior.covariance(i, i).sqrt();
            values.extend(points.iter().map(|x| normal_density((x - mean) / std) / std));
        }
        let x = Dim::new("x", Labels::Numbers(points));
        Ok(Array { dims: vec![coefficients(&self.posterior), x], values })
    }
}

/// The density of the standard normal distribution.
fn normal_density(z: f64) -> f64 {
    (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt()
}

fn coefficients(posterior: &Posterior) -> Dim {
    Dim::new("coefficient", Labels::count(posterior.mean.len()))
}

declare! {
    /// The log density of the data under the model before it saw them.
    pub struct LogEvidence = "log_evidence" @ 1 -> Array {
        /// The belief.
        posterior: One<Posterior>;
    }
}

impl Op for LogEvidence {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        Ok(Array::scalar(self.posterior.log_evidence))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Normal, Polynomial};
    use super::*;
    use ivx_math::moments::mean;
    use ivx_world::{Grid, Interval, Sample, Sinusoids};

    const CTX: Ctx = Ctx::new("infer", 0, None);

    fn infer(degree: usize, noise: f64, data: Dataset) -> One<Posterior> {
        let prior = Box::new(Normal { mean: 0.0, std: 1.0 });
        let model =
            Box::new(LinearBayes { features: Box::new(Polynomial { degree }), prior, noise });
        One(Infer { model, on: One(data) }.run(&CTX).unwrap())
    }

    fn sampled(n: usize, seed: i64) -> Dataset {
        let from = Box::new(Interval { low: -1.0, high: 1.0 });
        let sample =
            Sample { reward: Box::new(Sinusoids {}), n, noise: 0.1, from, stream: "main".into() };
        sample.run(&Ctx::new("sample", seed, None)).unwrap()
    }

    fn stds(posterior: &One<Posterior>, low: f64, high: f64, noise: bool) -> Vec<f64> {
        let at = Box::new(Grid { low, high, points: 5 });
        PredictiveStd { posterior: posterior.clone(), at, noise }.run(&CTX).unwrap().values
    }

    #[test]
    fn a_constant_seen_twice() {
        // Prior 1, two data of noise 1: precision 3, mean 2·3/3; predictive variance 1/3 + 1.
        let posterior = infer(0, 1.0, Dataset::pairs(vec![0.0, 1.0], vec![3.0, 3.0]));
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        let at = Box::new(Grid { low: 0.0, high: 1.0, points: 2 });
        let mean = PredictiveMean { posterior: posterior.clone(), at }.run(&CTX).unwrap();
        close(mean.values[1], 2.0);
        close(stds(&posterior, 0.0, 1.0, true)[1], (4.0_f64 / 3.0).sqrt());
        close(stds(&posterior, 0.0, 1.0, false)[1], (1.0_f64 / 3.0).sqrt());
        let std = PosteriorStd { posterior: posterior.clone() }.run(&CTX).unwrap();
        close(std.values[0], (1.0_f64 / 3.0).sqrt());
        // y ~ N(0, [[2, 1], [1, 2]]): determinant 3, (3, 3) at squared distance 6.
        let evidence = LogEvidence { posterior }.run(&CTX).unwrap();
        close(evidence.values[0], -std::f64::consts::TAU.ln() - 0.5 * 3.0_f64.ln() - 3.0);
    }

    #[test]
    fn densities_integrate_to_one_and_peak_at_the_mean() {
        // The belief of the test above: normal with mean 2 and variance 1/3.
        let posterior = infer(0, 1.0, Dataset::pairs(vec![0.0, 1.0], vec![3.0, 3.0]));
        let at = Box::new(Grid { low: -2.0, high: 6.0, points: 801 });
        let density = PosteriorDensity { posterior, at }.run(&CTX).unwrap();
        assert_eq!(density.dims.iter().map(Dim::len).collect::<Vec<_>>(), [1, 801]);
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
        close(density.values.iter().sum::<f64>() * 0.01, 1.0);
        close(density.values[400], (3.0 / std::f64::consts::TAU).sqrt());
        close(density.values[300], density.values[400] * (-1.5_f64).exp());
    }

    #[test]
    fn ignorance_is_higher_off_the_data() {
        for seed in 0..10 {
            let posterior = infer(20, 0.1, sampled(25, seed));
            let inside = mean(&stds(&posterior, -0.8, 0.8, true));
            assert!(mean(&stds(&posterior, 1.2, 1.5, true)) > 3.0 * inside);
        }
    }

    #[test]
    fn more_data_leave_less_ignorance() {
        let std = |n| stds(&infer(5, 0.1, sampled(n, 0)), -1.0, 1.0, false);
        for (few, many) in std(10).iter().zip(std(100)) {
            assert!(many < *few);
        }
    }
}
