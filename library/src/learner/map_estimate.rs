//! Maximum a posteriori estimates of a network's parameters.

use ivx_data::Misfit;
use ivx_data::form::of_one_shape;
use ivx_data::{Dataset, Form};
use ivx_nn::{Loss, Net, Optimiser, Training, Turns};
use ivx_nn::{Model, NetModel, PRIOR};
use ivx_op::{Ctx, OpError, Part, declare};

use super::{Learner, Prior};

declare! {
    /// The maximum a posteriori estimate of a network's parameters, by gradient descent.
    ///
    /// It lowers the negative log-posterior (Eqn. 2.16d), up to a factor: under the prior `N(m, s²)`
    /// `J(θ) = 1/N Σ_i loss(y_i, f(x_i; θ)) + c/(2 N s²) ‖θ - m‖²`, and with `c/(N s) ‖θ - m‖_1` for a second
    /// term under `laplace(m, s)`. There `c` is how many times the negative log-likelihood the loss is:
    /// `noise²` for `squared`.
    /// With `adamw` the second term pulls beside the step, decoupled as weight decay is;
    /// with every other optimiser it is part of the gradient. After 0 steps the model is the
    /// initial one. The network ends in a linear map to what the loss takes.
    pub struct MapEstimate = "map_estimate" @ 2, stochastic {
        /// The architecture, up to the last linear map.
        net: Box<dyn Net> = Part::new("mlp");
        /// The prior over each parameter.
        prior: Box<dyn Prior> = Part::new("normal");
        /// What outputs are measured by.
        loss: Box<dyn Loss> = Part::new("squared");
        /// How the objective is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adamw")
            .with("lr", Part::new("linear").with("from", 4e-4).with("to", 0.0));
        /// How many observations an update looks at; 0 for all.
        batch: usize = 0, in 0.0..;
        /// How far inputs are moved against the network in adversarial training, as a share of the range that each number
        /// of an input has in the data; 0 for none. The loss is that of inputs as they are plus that of moved ones,
        /// `x' = x + ε sign(∇_x loss)` (Goodfellow, Shlens and Szegedy, 2015).
        adversarial: f64 = 0.0, in 0.0..;
    }
}

impl Learner for MapEstimate {
    fn train(&self, data: &Dataset, steps: u64, ctx: &Ctx) -> Result<Model, OpError> {
        let initial = self.initial(&data.form, "init", ctx)?;
        self.fit(initial, data, steps, ctx)
    }

    fn train_with_prior(
        &self,
        data: &Dataset,
        (scale, drawn): (f64, &Ctx),
        steps: u64,
        ctx: &Ctx,
    ) -> Option<Result<Model, OpError>> {
        if !self.takes_prior_network() {
            return None;
        }
        let with_prior = || {
            let mut net = self.initial(&data.form, "init", ctx)?;
            let prior = self.initial(&data.form, "prior", drawn)?.nets;
            net.nets.add(PRIOR, prior);
            net.prior_scale = scale;
            self.fit(net, data, steps, ctx)
        };
        Some(with_prior())
    }

    fn fits(&self, form: &Form) -> Result<(), Misfit> {
        of_one_shape(form)?;
        ivx_nn::headed(&*self.net, &form.input, &self.loss.outputs(form)?).map(drop)
    }

    fn memory(&self, form: &Form, n: u64) -> u64 {
        // A parameter, its gradient, two running averages and two copies while the model is put
        // together and encoded; an output, its gradient and one temporary number.
        // Adversarial training goes through the network three times.
        let passes = if self.adversarial > 0.0 { 3 } else { 1 };
        let (of_param, of_output) = (6 * 4, passes * 3 * 4);
        let module =
            self.loss.outputs(form).and_then(|to| ivx_nn::headed(&*self.net, &form.input, &to));
        let Ok(module) = module else { return 0 };
        let at_once = if self.batch == 0 { n } else { n.min(self.batch as u64) };
        let outputs = module.n_outputs(&form.input);
        let observation = (form.input_len() + form.target_len()) as u64;
        // Data in single precision, and those of the batch.
        let data = n.saturating_mul(observation * 8);
        let outputs = outputs.saturating_mul(at_once * of_output);
        (module.n_params() * of_param).saturating_add(outputs).saturating_add(data)
    }

    fn updates_in_a_pass(&self, n: usize) -> u64 {
        if n == 0 { 1 } else { Turns::new(n, self.batch).in_a_pass() }
    }

    fn makes_networks(&self) -> bool {
        true
    }

    fn takes_prior_network(&self) -> bool {
        self.adversarial == 0.0
    }

    fn says_std(&self) -> bool {
        self.loss.head().says_std()
    }
}

impl MapEstimate {
    fn initial(&self, form: &Form, purpose: &str, ctx: &Ctx) -> Result<NetModel, OpError> {
        ivx_nn::init(&*self.net, &*self.loss, form, &mut ctx.rng(purpose, &[]))
            .map_err(|misfit| OpError::Failed(misfit.message))
    }

    fn fit(&self, net: NetModel, data: &Dataset, steps: u64, ctx: &Ctx) -> Result<Model, OpError> {
        if data.is_empty() {
            return Err(OpError::Failed("there are no data to train on".to_owned()));
        }
        net.module().accepts(&data.x).map_err(OpError::Failed)?;
        #[expect(clippy::cast_precision_loss, reason = "data count far below 2^53")]
        let n = data.len() as f64;
        let pull = self.prior.pull(self.loss.scale(), n);
        let (loss, optimiser) = (&*self.loss, &*self.optimiser);
        let how = Training {
            loss,
            optimiser,
            pull,
            batch: self.batch,
            adversarial: self.adversarial,
            steps,
        };
        let net = ivx_nn::fit(net, data, &how, ctx)?;
        if !net.nets.are_finite() {
            let message = format!(
                "training diverged within {steps} steps: lower the learning rate or widen the prior"
            );
            return Err(OpError::Failed(message));
        }
        Ok(Model::Net(net))
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
        Dataset::pairs(x.clone(), x.iter().map(|&x| f(x)).collect())
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
        let net = ivx_nn::Mlp { hidden: vec![4], activation: Box::new(ivx_nn::Tanh {}) };
        let loss = ivx_nn::Squared { noise: 0.1 };
        let drawn = ivx_nn::init(&net, &loss, &Form::default(), &mut CTX.rng("init", &[])).unwrap();
        assert_eq!(initial, Model::Net(drawn));
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
                .with("loss", Part::new("squared").with("noise", 1.0));
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
                    .with("loss", Part::new("squared").with("noise", 1.0));
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
            let loss = Part::new("squared").with("noise", 1.0);
            let part = learner(&[4], 0.02).with("prior", prior).with("loss", loss);
            let Model::Net(net) = train(&part, &data(|x| x), 500).unwrap() else { unreachable!() };
            net.nets
                .arrays
                .iter()
                .flat_map(|(.., values)| values.clone())
                .map(f64::from)
                .sum::<f64>()
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
        let form = Form { input: vec![1, 2, 2], ..Form::default() };
        let images = Dataset { form, x: vec![0.0; 4], y: vec![0.0] };
        let why = failed(train(&learner(&[4], 0.1), &images, 1));
        assert_eq!(why, "`mlp` takes vectors and sequences, not images of 1 × 2 × 2");
    }
}
