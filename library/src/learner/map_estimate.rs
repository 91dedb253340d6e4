//! Maximum a posteriori estimates of a network's parameters.

use ivx_op::{Ctx, OpError, Part, declare};

use super::{Learner, Prior};
use crate::artifact::{Dataset, Model, NetModel};
use crate::nn::{Net, Optimiser, fit};

/// What an action and its reward take in a dataset.
const PAIR_BYTES: u64 = 16;

declare! {
    /// The maximum a posteriori estimate of a network's parameters, by full-batch descent.
    ///
    /// It lowers the negative log-posterior (Eqn. 2.16d), up to the factor `noise²/N`:
    /// `J(θ) = 1/(2N) Σ_i (r_i - f(a_i; θ))² + noise²/(2 N s²) ‖θ - m‖²` under the prior `N(m, s²)`,
    /// and with `noise²/(N s) ‖θ - m‖_1` for a second term under `laplace(m, s)`.
    /// With `adamw` the second term pulls beside the step, decoupled as weight decay is;
    /// with every other optimiser it is part of the gradient. After 0 steps the model is the
    /// initial one.
    pub struct MapEstimate = "map_estimate" @ 1, stochastic {
        /// The architecture.
        net: Box<dyn Net> = Part::new("mlp");
        /// The prior over each parameter.
        prior: Box<dyn Prior> = Part::new("normal");
        /// Standard deviation of the noise in the rewards.
        noise: f64 = 0.1, in 0.0..;
        /// How the objective is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adamw")
            .with("lr", Part::new("linear").with("from", 4e-4).with("to", 0.0));
    }
}

impl Learner for MapEstimate {
    fn train(&self, data: &Dataset, steps: u64, ctx: &Ctx) -> Result<Model, OpError> {
        if data.x.is_empty() {
            return Err(OpError::Failed("there are no data to train on".to_owned()));
        }
        #[expect(clippy::cast_precision_loss, reason = "data count far below 2^53")]
        let n = data.x.len() as f64;
        let pull = self.prior.pull(self.noise, n);
        let initial = self.net.init(&mut ctx.rng("init", &[]));
        let net = fit(initial, data, &*self.optimiser, pull, steps, ctx);
        if net.params.iter().any(|(.., values)| values.iter().any(|x| !x.is_finite())) {
            let message = format!(
                "training diverged within {steps} steps: lower the learning rate or widen the prior"
            );
            return Err(OpError::Failed(message));
        }
        Ok(Model::Net(net))
    }

    fn memory(&self, data_bytes: u64) -> u64 {
        // A parameter, its gradient, two running averages and two copies while the model is put
        // together and encoded; an output, its gradient and one temporary number.
        let (of_param, of_output) = (6 * 4, 3 * 4);
        let n = data_bytes / PAIR_BYTES;
        self.net.n_params() * of_param + self.net.n_outputs() * n * of_output
    }

    fn prior_network(&self, ctx: &Ctx) -> Option<NetModel> {
        Some(self.net.init(&mut ctx.rng("prior", &[])))
    }

    fn makes_networks(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learner::learners;
    use crate::registry;

    const CTX: Ctx = Ctx::new("train", 1, None);

    fn learner(hidden: &[i64], lr: f64) -> Part {
        let rate = Part::new("linear").with("from", lr).with("to", 0.0);
        Part::new("map_estimate")
            .with("net", Part::new("mlp").with("hidden", hidden.to_vec()))
            .with("optimiser", Part::new("adamw").with("lr", rate))
    }

    fn train(part: &Part, data: &Dataset, steps: u64) -> Result<Model, OpError> {
        learners().build(&registry().complete(part))?.train(data, steps, &CTX)
    }

    fn data(f: fn(f64) -> f64) -> Dataset {
        let x: Vec<f64> = (0..25).map(|i| f64::from(i) / 12.0 - 1.0).collect();
        Dataset { y: x.iter().map(|&x| f(x)).collect(), x }
    }

    fn rmse(model: &Model, data: &Dataset) -> f64 {
        let errors = model.predict(&data.x).into_iter().zip(&data.y).map(|(f, y)| (f - y).powi(2));
        (errors.sum::<f64>() / 25.0).sqrt()
    }

    #[test]
    fn a_wave_is_learned() {
        let data = data(|x| (3.0 * x).sin());
        let error = |steps| rmse(&train(&learner(&[32, 32], 0.01), &data, steps).unwrap(), &data);
        let (before, after) = (error(0), error(1000));
        assert!(after < 0.02 && before > 0.5, "{before} before, {after} after");
    }

    #[test]
    fn nothing_moves_in_no_steps() {
        let data = data(|x| x);
        let initial = train(&learner(&[4], 0.1), &data, 0).unwrap();
        let net = crate::nn::Mlp { hidden: vec![4], activation: Box::new(crate::nn::Tanh {}) };
        assert_eq!(initial, Model::Net(net.init(&mut CTX.rng("init", &[]))));
        assert_ne!(train(&learner(&[4], 0.1), &data, 1).unwrap(), initial);
    }

    #[test]
    fn a_line_is_found_as_ridge_regression_finds_it() {
        // Without hidden layers f(x) = w x + b, and x has mean 0: w = Σxy / (Σx² + noise²/s²),
        // b = Σy / (N + noise²/s²), with y = 2x + 1 and noise²/s² = 4.
        let data = data(|x| 2.0 * x + 1.0);
        for (optimiser, lr) in [("sgd", 0.5), ("adam", 0.05)] {
            let rate = Part::new("linear").with("from", lr).with("to", 0.0);
            let part = learner(&[], 0.1)
                .with("optimiser", Part::new(optimiser).with("lr", rate))
                .with("prior", Part::new("normal").with("std", 0.5))
                .with("noise", 1.0);
            let f = train(&part, &data, 1000).unwrap().predict(&[0.0, 1.0]);
            let squares: f64 = data.x.iter().map(|x| x * x).sum();
            let (w, b) = (2.0 * squares / (squares + 4.0), 25.0 / 29.0);
            assert!((f[0] - b).abs() < 1e-4 && (f[1] - b - w).abs() < 1e-4, "{optimiser}: {f:?}");
        }
    }

    #[test]
    fn a_laplacian_prior_thresholds_a_line() {
        // As above, but each coefficient is c / s for S(c) = sign(c) max(|c| − λ, 0), with
        // λ = noise²/(N scale) = 0.2: c = Σxy/N and s = Σx²/N for w, Σy/N and 1 for b.
        let data = |slope: f64| {
            let data = data(|x| x);
            Dataset { y: data.x.iter().map(|x| slope * x + 1.0).collect(), ..data }
        };
        let squares = data(0.0).x.iter().map(|x| x * x).sum::<f64>() / 25.0;
        for (optimiser, lr) in [("sgd", 0.5), ("adam", 0.05), ("rmsprop", 0.01)] {
            for slope in [2.0_f64, 0.3] {
                let rate = Part::new("linear").with("from", lr).with("to", 0.0);
                let part = learner(&[], 0.1)
                    .with("optimiser", Part::new(optimiser).with("lr", rate))
                    .with("prior", Part::new("laplace").with("scale", 0.2))
                    .with("noise", 1.0);
                let f = train(&part, &data(slope), 4000).unwrap().predict(&[0.0, 1.0]);
                let w = (slope - 0.2 / squares).max(0.0);
                assert!(slope > 1.0 || w == 0.0);
                let off = (f[0] - 0.8).abs().max((f[1] - f[0] - w).abs());
                assert!(off < 1e-3, "{optimiser}: {f:?} and {w}");
            }
        }
    }

    #[test]
    fn a_strong_prior_holds_adamw_at_its_mean() {
        // Strength 1/(25 · 0.05²) = 16: a step of the learning rate's length away from the mean
        // is pulled back from a distance of 1/16.
        let centred = |mean: f64| {
            let prior = Part::new("normal").with("mean", mean).with("std", 0.05);
            let part = learner(&[4], 0.02).with("prior", prior).with("noise", 1.0);
            let Model::Net(net) = train(&part, &data(|x| x), 500).unwrap() else { unreachable!() };
            net.params.iter().flat_map(|(.., values)| values.clone()).map(f64::from).sum::<f64>()
                / 13.0
        };
        assert!((centred(0.5) - 0.5).abs() < 1.0 / 16.0);
        assert!((centred(-0.5) + 0.5).abs() < 1.0 / 16.0);
    }

    #[test]
    fn what_cannot_be_trained_says_so() {
        let failed = |result: Result<Model, OpError>| result.unwrap_err().to_string();
        assert_eq!(
            failed(train(&learner(&[4], 0.1), &Dataset::default(), 1)),
            "there are no data to train on"
        );
        let diverging = learner(&[], 0.1).with(
            "optimiser",
            Part::new("sgd").with("lr", Part::new("constant").with("value", 1e6)),
        );
        assert!(failed(train(&diverging, &data(|x| x), 100)).contains("diverged"));
    }
}
