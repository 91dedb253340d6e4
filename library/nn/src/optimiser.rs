//! Optimisers as a spec names them.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Part, Parts, declare, family};

use super::clip::{ClipNorm, ClipValue};
use super::optim::{self, Moments, Pull};
use super::params::Params;
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
    /// Updates every array of parameters that has a gradient, which is scratch afterwards.
    ///
    /// `moments` are those of the same places.
    fn step(&self, step: &Step, params: &mut Params<f32>, moments: &mut [Moments<f32>]);
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
    fn step(&self, step: &Step, params: &mut Params<f32>, moments: &mut [Moments<f32>]) {
        let rule = optim::Adam {
            lr: self.lr.at(step.t, step.total),
            beta1: self.beta1,
            beta2: self.beta2,
            eps: self.eps,
            weight_decay: self.weight_decay,
            pull: step.pull,
        };
        for (params, grads, moments) in params.updates(moments) {
            optim::adam(&rule, step.t, params, grads, moments);
        }
    }
}

impl Optimiser for Adam {
    fn step(&self, step: &Step, params: &mut Params<f32>, moments: &mut [Moments<f32>]) {
        let rule = optim::Adam {
            lr: self.lr.at(step.t, step.total),
            beta1: self.beta1,
            beta2: self.beta2,
            eps: self.eps,
            weight_decay: 0.0,
            pull: Pull::NONE,
        };
        for (params, grads, moments) in params.updates(moments) {
            optim::add_pull(step.pull, params, grads);
            optim::adam(&rule, step.t, params, grads, moments);
        }
    }
}

impl Optimiser for Sgd {
    fn step(&self, step: &Step, params: &mut Params<f32>, moments: &mut [Moments<f32>]) {
        let lr = self.lr.at(step.t, step.total);
        for (params, grads, moments) in params.updates(moments) {
            optim::add_pull(step.pull, params, grads);
            optim::sgd(lr, self.momentum, params, grads, &mut moments.first);
        }
    }
}

impl Optimiser for RmsProp {
    fn step(&self, step: &Step, params: &mut Params<f32>, moments: &mut [Moments<f32>]) {
        let lr = self.lr.at(step.t, step.total);
        let rule = optim::RmsProp { lr, decay: self.decay, eps: self.eps, centered: self.centered };
        for (params, grads, moments) in params.updates(moments) {
            optim::add_pull(step.pull, params, grads);
            optim::rmsprop(&rule, params, grads, moments);
        }
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
            .with(|x: ClipNorm| Box::new(x))
            .with(|x: ClipValue| Box::new(x))
    });
    &TABLE
}

family!(dyn Optimiser, "Optimiser", optimisers);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry;

    const TOWARDS_3: Pull = Pull { l2: 1.0, l1: 0.0, centre: 3.0 };

    fn built(part: &Part) -> Box<dyn Optimiser> {
        optimisers().build(&registry().complete(part)).unwrap()
    }

    /// The parameters after so many steps from `start`, where `slope` is the gradient of each.
    fn descend<const N: usize>(
        part: &Part,
        start: [f32; N],
        steps: u64,
        pull: Pull,
        slope: impl Fn(f32) -> f32,
    ) -> [f32; N] {
        let mut params = Params::default();
        let id = params.add("p".into(), vec![N], start.to_vec());
        let (optimiser, mut moments) = (built(part), params.moments());
        for t in 0..steps {
            let (mut grad, _) = params.take_grad(id).unwrap();
            grad.iter_mut().zip(params.value(id)).for_each(|(g, &p)| *g = slope(p));
            params.put_grad(id, grad);
            optimiser.step(&Step { t, total: steps, pull }, &mut params, &mut moments);
        }
        params.value(id).try_into().unwrap()
    }

    #[test]
    fn coupled_rules_find_the_minimum_of_the_whole_objective() {
        // (θ − 1) + (θ − 3) = 0 at θ = 2.
        let rate = |from: f64| Part::new("linear").with("from", from).with("to", 0.0);
        for (name, lr) in [("sgd", 0.1), ("adam", 0.02), ("rmsprop", 0.01)] {
            let part = Part::new(name).with("lr", rate(lr));
            let [theta] = descend(&part, [0.0], 2000, TOWARDS_3, |p| p - 1.0);
            assert!((theta - 2.0).abs() < 0.01, "{name} ends at {theta}");
        }
    }

    #[test]
    fn only_adamw_keeps_the_pull_out_of_its_normalisation() {
        // At θ = 0 the gradient is −1, the pull towards 3 of strength 1 is −3, and η = 0.1.
        let step = |part: &Part| {
            let part = part.clone().with("lr", Part::new("constant").with("value", 0.1));
            descend(&part, [0.0, 2.0], 1, TOWARDS_3, |_| -1.0)
        };
        let close = |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-6;
        assert!(close(step(&Part::new("adam")), [0.1, 2.1]));
        assert!(close(step(&Part::new("adamw")), [0.1 + 0.3, 2.1 + 0.1]));
        assert!(close(step(&Part::new("adamw").with("weight_decay", 0.5)), [0.4, 2.2 - 0.1]));
    }
}
