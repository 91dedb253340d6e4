//! Optimisers as a spec names them.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Part, Parts, declare, family};

use super::optim::{self, Moments, Pull};
use super::schedule::Schedule;

/// Where in training an update takes place, and what it obeys besides the gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Steps done.
    pub t: u64,
    /// Steps in all.
    pub total: u64,
    /// The pull of the prior over the parameters.
    pub pull: Pull,
}

/// A rule of gradient descent.
pub trait Optimiser: Debug + Send + Sync {
    /// Updates one array of parameters; the gradients are scratch afterwards.
    fn update(
        &self,
        step: &Step,
        params: &mut [f32],
        grads: &mut [f32],
        moments: &mut Moments<f32>,
    );
}

declare! {
    /// Adam whose decay is decoupled from the gradient (Loshchilov and Hutter, 2017).
    ///
    /// A prior pulls beside the Adam step too, as weight decay does, so that it is not scaled
    /// by the second moments.
    pub struct AdamW = "adamw" @ 1 {
        /// Learning rate.
        lr: Box<dyn Schedule> = Part::new("constant").with("value", 1e-3);
        /// Decay of the first moment.
        beta1: f64 = 0.9, in 0.0..=0.999_999;
        /// Decay of the second moment.
        beta2: f64 = 0.999, in 0.0..=0.999_999;
        /// Added to the root of the second moment.
        eps: f64 = 1e-8, in f64::MIN_POSITIVE..;
        /// Pull of every parameter towards 0, times the learning rate.
        weight_decay: f64 = 0.0, in 0.0..;
    }
}

declare! {
    /// Adam (Kingma and Ba, 2014); a prior pulls through the gradient.
    pub struct Adam = "adam" @ 1 {
        /// Learning rate.
        lr: Box<dyn Schedule> = Part::new("constant").with("value", 1e-3);
        /// Decay of the first moment.
        beta1: f64 = 0.9, in 0.0..=0.999_999;
        /// Decay of the second moment.
        beta2: f64 = 0.999, in 0.0..=0.999_999;
        /// Added to the root of the second moment.
        eps: f64 = 1e-8, in f64::MIN_POSITIVE..;
    }
}

declare! {
    /// Gradient descent with momentum (Eqn. 2.20); a prior pulls through the gradient.
    pub struct Sgd = "sgd" @ 1 {
        /// Learning rate.
        lr: Box<dyn Schedule> = Part::new("constant").with("value", 1e-2);
        /// Share of the velocity kept from step to step.
        momentum: f64 = 0.0, in 0.0..=1.0;
    }
}

declare! {
    /// `RMSProp`; a prior pulls through the gradient.
    pub struct RmsProp = "rmsprop" @ 1 {
        /// Learning rate.
        lr: Box<dyn Schedule> = Part::new("constant").with("value", 2.5e-4);
        /// Decay of the averages.
        decay: f64 = 0.95, in 0.0..=0.999_999;
        /// Added to the root.
        eps: f64 = 0.01, in f64::MIN_POSITIVE..;
        /// Whether to divide by the gradient's deviation rather than its magnitude.
        centered: bool = true;
    }
}

impl Optimiser for AdamW {
    fn update(
        &self,
        step: &Step,
        params: &mut [f32],
        grads: &mut [f32],
        moments: &mut Moments<f32>,
    ) {
        let lr = self.lr.at(step.t, step.total);
        let pulls = [step.pull, Pull { strength: self.weight_decay, centre: 0.0 }];
        let rule = optim::Adam { lr, beta1: self.beta1, beta2: self.beta2, eps: self.eps, pulls };
        optim::adam(&rule, step.t, params, grads, moments);
    }
}

impl Optimiser for Adam {
    fn update(
        &self,
        step: &Step,
        params: &mut [f32],
        grads: &mut [f32],
        moments: &mut Moments<f32>,
    ) {
        optim::add_pull(step.pull, params, grads);
        let lr = self.lr.at(step.t, step.total);
        let pulls = [Pull::default(); 2];
        let rule = optim::Adam { lr, beta1: self.beta1, beta2: self.beta2, eps: self.eps, pulls };
        optim::adam(&rule, step.t, params, grads, moments);
    }
}

impl Optimiser for Sgd {
    fn update(
        &self,
        step: &Step,
        params: &mut [f32],
        grads: &mut [f32],
        moments: &mut Moments<f32>,
    ) {
        optim::add_pull(step.pull, params, grads);
        let lr = self.lr.at(step.t, step.total);
        optim::sgd(lr, self.momentum, params, grads, &mut moments.first);
    }
}

impl Optimiser for RmsProp {
    fn update(
        &self,
        step: &Step,
        params: &mut [f32],
        grads: &mut [f32],
        moments: &mut Moments<f32>,
    ) {
        optim::add_pull(step.pull, params, grads);
        let lr = self.lr.at(step.t, step.total);
        let rule = optim::RmsProp { lr, decay: self.decay, eps: self.eps, centered: self.centered };
        optim::rmsprop(&rule, params, grads, moments);
    }
}

/// The optimisers, by name.
pub(crate) fn optimisers() -> &'static Parts<dyn Optimiser> {
    static TABLE: LazyLock<Parts<dyn Optimiser>> = LazyLock::new(|| {
        Parts::<dyn Optimiser>::new()
            .with(|x: AdamW| Box::new(x))
            .with(|x: Adam| Box::new(x))
            .with(|x: Sgd| Box::new(x))
            .with(|x: RmsProp| Box::new(x))
    });
    &TABLE
}

family!(dyn Optimiser, "Optimiser", optimisers);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry;

    /// Where 2000 steps down `(θ - 1)²/2` end, from 0, with a pull of strength 1 towards 3.
    fn end(part: &Part) -> f32 {
        let optimiser = optimisers().build(&registry().complete(part)).unwrap();
        let (mut params, mut moments) = ([0.0_f32], Moments::zeros(1));
        for t in 0..2000 {
            let step = Step { t, total: 2000, pull: Pull { strength: 1.0, centre: 3.0 } };
            let mut grads = [params[0] - 1.0];
            optimiser.update(&step, &mut params, &mut grads, &mut moments);
        }
        params[0]
    }

    #[test]
    fn coupled_rules_find_the_minimum_of_the_whole_objective() {
        // (θ − 1) + (θ − 3) = 0 at θ = 2.
        let rate = |from: f64| Part::new("linear").with("from", from).with("to", 0.0);
        for (name, lr) in [("sgd", 0.1), ("adam", 0.02), ("rmsprop", 0.01)] {
            let theta = end(&Part::new(name).with("lr", rate(lr)));
            assert!((theta - 2.0).abs() < 0.01, "{name} ends at {theta}");
        }
    }

    #[test]
    fn only_adamw_keeps_the_pull_out_of_its_normalisation() {
        // At θ = 0 the gradient is −1, the pull towards 3 of strength 1 is −3, and η = 0.1.
        let step = |part: &Part| {
            let part = part.clone().with("lr", Part::new("constant").with("value", 0.1));
            let optimiser = optimisers().build(&registry().complete(&part)).unwrap();
            let mut params = [0.0_f32, 2.0];
            let step = Step { t: 0, total: 9, pull: Pull { strength: 1.0, centre: 3.0 } };
            optimiser.update(&step, &mut params, &mut [-1.0, -1.0], &mut Moments::zeros(2));
            params
        };
        let close = |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-6;
        assert!(close(step(&Part::new("adam")), [0.1, 2.1]));
        assert!(close(step(&Part::new("adamw")), [0.1 + 0.3, 2.1 + 0.1]));
        assert!(close(step(&Part::new("adamw").with("weight_decay", 0.5)), [0.4, 2.2 - 0.1]));
    }
}
