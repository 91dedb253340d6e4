//! Learning on a scale of the data's own.

use std::sync::Arc;

use ivx_data::{Dataset, Form, Misfit};
use ivx_math::standard::Scale;
use ivx_nn::{Fitted, Model, Scaled as OnScale};
use ivx_op::{Ctx, OpError, declare};

use super::Learner;
use super::targets::are_sound;

declare! {
    /// A learner that sees inputs, and targets that are numbers, with the mean 0 and the standard deviation 1 of the data it
    /// learns from; its models take and answer in the data's own units.
    ///
    /// ```text
    /// f(x) = m_y + s_y g((x − m_x) / s_x),   σ(x) = s_y σ_g((x − m_x) / s_x)
    /// ```
    ///
    /// where `g` is the model of the inner learner. Each number of an input and of a target is on a scale of its own, as
    /// with `standardised`, and what is the same in all data is 0. Noise that the inner learner is told of is on that
    /// scale.
    pub struct Scaled = "scaled" @ 1 {
        /// What learns.
        learner: Box<dyn Learner>;
        /// Whether inputs are scaled.
        inputs: bool = true;
        /// Whether targets are: no scale changes what classes are.
        targets: bool = true;
    }
}

impl Scaled {
    /// A model of data on their own scale, from what `learn` makes of them.
    fn around(
        &self,
        data: &Dataset,
        learn: impl FnOnce(&Dataset) -> Option<Result<Model, OpError>>,
    ) -> Option<Result<Model, OpError>> {
        if let Err(why) = are_sound(data) {
            return Some(Err(why));
        }
        let form = data.form.clone();
        let of = |rows: &[f64], width: usize, wanted: bool| {
            if wanted { Scale::of(rows, width) } else { Scale::none(width) }
        };
        let x = of(&data.x, form.input_len(), self.inputs);
        let y = of(&data.y, form.target_len(), self.targets && form.classes.is_none());
        let near = Dataset { x: x.scaled(&data.x), y: y.scaled(&data.y), form: form.clone() };
        let model = learn(&near)?;
        Some(model.map(|model| {
            Model::Fitted(Fitted { form, function: Arc::new(OnScale { model, x, y }) })
        }))
    }
}

impl Learner for Scaled {
    fn train(&self, data: &Dataset, steps: u64, ctx: &Ctx) -> Result<Model, OpError> {
        self.around(data, |data| Some(self.learner.train(data, steps, ctx))).expect("was learnt")
    }

    fn train_with_prior(
        &self,
        data: &Dataset,
        prior: (f64, &Ctx),
        steps: u64,
        ctx: &Ctx,
    ) -> Option<Result<Model, OpError>> {
        self.around(data, |data| self.learner.train_with_prior(data, prior, steps, ctx))
    }

    /// Anchors would be on another scale than the targets.
    fn fits(&self, form: &Form) -> Result<(), Misfit> {
        if self.targets && self.learner.modes().is_some() {
            let message = "modes are in the units of the data, and these targets are scaled";
            return Err(Misfit::new(message.to_owned(), "say `targets: false`"));
        }
        self.learner.fits(form)
    }

    fn memory(&self, form: &Form, n: u64) -> u64 {
        let observation = 8 * (form.input_len() + form.target_len()) as u64;
        self.learner.memory(form, n) + n * observation
    }

    fn updates_in_a_pass(&self, n: usize) -> u64 {
        self.learner.updates_in_a_pass(n)
    }

    fn makes_networks(&self) -> bool {
        self.learner.makes_networks()
    }

    fn takes_prior_network(&self) -> bool {
        self.learner.takes_prior_network()
    }

    fn says_std(&self) -> bool {
        self.learner.says_std()
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Artifact as _, Part};

    use super::*;
    use crate::learner::{Ridge, learners};
    use crate::registry;

    const CTX: Ctx = Ctx::new("train", 0, None);

    fn built(part: &Part) -> Box<dyn Learner> {
        learners().build(&registry().complete(part)).unwrap()
    }

    fn scaled(learner: Part) -> Part {
        Part::new("scaled").with("learner", learner)
    }

    fn data(x: Vec<f64>, y: Vec<f64>) -> Dataset {
        Dataset { form: Form { input: vec![1], ..Form::default() }, x, y }
    }

    /// Inputs have the mean 20 and the deviation 10, targets 300 and 100: on their scale both are −1 and 1. The slope
    /// there is 2/(2 + 1), that of the penalty 1.
    #[test]
    fn a_line_by_hand() {
        let data = data(vec![10.0, 30.0], vec![200.0, 400.0]);
        let model = built(&scaled(Part::new("ridge"))).train(&data, 0, &CTX).unwrap();
        let found = model.predict(&[20.0, 30.0, 50.0]);
        for (found, expected) in found.iter().zip([300.0, 300.0 + 200.0 / 3.0, 500.0]) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
        assert_eq!(Model::decode(&model.encode()).as_ref(), Some(&model));
        let units = Part::new("scaled")
            .with("learner", Part::new("ridge"))
            .with("inputs", false)
            .with("targets", false);
        let plain = Ridge { alpha: 1.0 }.train(&data, 0, &CTX).unwrap();
        let same = built(&units).train(&data, 0, &CTX).unwrap();
        assert_eq!(same.predict(&[17.0]), plain.predict(&[17.0]));
    }

    fn network() -> Part {
        let rate = Part::new("linear").with("from", 0.02).with("to", 0.0);
        Part::new("map_estimate")
            .with("net", Part::new("mlp").with("hidden", vec![8_i64]))
            .with("optimiser", Part::new("adamw").with("lr", rate))
    }

    /// In other units everything is the same in these: powers of two keep every digit.
    #[test]
    fn units_do_not_matter() {
        let x: Vec<f64> = (0..16).map(|i| f64::from(i) / 8.0 - 1.0).collect();
        let y: Vec<f64> = x.iter().map(|x| (2.0 * x).sin()).collect();
        let far = |values: &[f64], unit: f64| values.iter().map(|x| unit * x).collect::<Vec<_>>();
        let (own, other) = (data(x.clone(), y.clone()), data(far(&x, 1024.0), far(&y, 0.25)));
        let gaussian = network().with("loss", Part::new("gaussian_nll"));
        for part in
            [network(), gaussian.clone(), Part::new("ensemble").with("learner", scaled(network()))]
        {
            let learner = built(&if part.name == "ensemble" { part } else { scaled(part) });
            let ctx = Ctx::new("train", 0, Some(1));
            let of = |data: &Dataset| learner.train(data, 50, &ctx).unwrap();
            let (near, far_off) = (of(&own), of(&other));
            assert_eq!(far(&near.predict(&x), 0.25), far_off.predict(&other.x));
            let stds = near.stds(&x).map(|stds| far(&stds, 0.25));
            assert_eq!(stds, far_off.stds(&other.x));
        }
        assert!(built(&scaled(gaussian)).says_std() && !built(&scaled(network())).says_std());
    }

    /// Temperatures around 300 are nothing a network learns as they are.
    #[test]
    fn a_network_learns_what_it_could_not() {
        let x: Vec<f64> = (0..40).map(|i| f64::from(i) + 300.0).collect();
        let y: Vec<f64> = x.iter().map(|x| 1e3 + 50.0 * (x / 8.0).sin()).collect();
        let data = data(x, y);
        let error = |part: &Part| {
            let model = built(part).train(&data, 500, &CTX).unwrap();
            let errors =
                model.predict(&data.x).into_iter().zip(&data.y).map(|(f, y)| (f - y).powi(2));
            (errors.sum::<f64>() / 40.0).sqrt()
        };
        let (plain, scaled) = (error(&network()), error(&scaled(network())));
        assert!(scaled < 15.0 && plain > 500.0, "{scaled} {plain}");
    }

    #[test]
    fn classes_have_no_scale() {
        let form = Form { input: vec![1], target: vec![], classes: Some(2), ..Form::default() };
        let data =
            Dataset { form, x: vec![100.0, 101.0, 109.0, 110.0], y: vec![0.0, 0.0, 1.0, 1.0] };
        let model = built(&scaled(Part::new("logistic"))).train(&data, 0, &CTX).unwrap();
        let shares = model.class_shares(&[100.0, 110.0]);
        assert!(shares[0] > 0.7 && shares[3] > 0.7, "{shares:?}");
        let nothing = Dataset { x: vec![], y: vec![], ..data };
        assert!(built(&scaled(Part::new("logistic"))).train(&nothing, 0, &CTX).is_err());
    }
}
