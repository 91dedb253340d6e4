//! Optimisers that see gradients no larger than a limit.

use ivx_op::declare;

use super::optim::{self, Moments};
use super::optimiser::{Optimiser, Step};
use super::params::Params;

declare! {
    /// An optimiser that sees the gradient of the loss scaled down to a norm, if it is above.
    ///
    /// The norm is the Euclidean one of all parameters' gradients together. What the optimiser adds
    /// itself, the pull of a prior and weight decay, is added afterwards and not clipped.
    pub struct ClipNorm = "clip_norm" @ 1 {
        /// What makes the step.
        optimiser: Box<dyn Optimiser>;
        /// The largest norm.
        limit: f64 = 1.0, in f64::MIN_POSITIVE..;
    }
}

declare! {
    /// An optimiser that sees every number of the gradient of the loss within `±limit`.
    ///
    /// What the optimiser adds itself, the pull of a prior and weight decay, is added afterwards
    /// and not clipped.
    pub struct ClipValue = "clip_value" @ 1 {
        /// What makes the step.
        optimiser: Box<dyn Optimiser>;
        /// The largest magnitude of a number.
        limit: f64 = 1.0, in f64::MIN_POSITIVE..;
    }
}

impl Optimiser for ClipNorm {
    fn step(&self, step: &Step, params: &mut Params<f32>, moments: &mut [Moments<f32>]) {
        let norm = optim::global_norm(params.grads());
        optim::clip_global_norm(params.grads_mut(), norm, self.limit);
        self.optimiser.step(step, params, moments);
    }
}

impl Optimiser for ClipValue {
    fn step(&self, step: &Step, params: &mut Params<f32>, moments: &mut [Moments<f32>]) {
        optim::clip_value(params.grads_mut(), self.limit);
        self.optimiser.step(step, params, moments);
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::Part;

    use super::*;
    use crate::optim::Pull;
    use crate::optimiser::optimisers;
    use crate::registry;

    /// Where two arrays at 0 go in one step of descent at the rate 1, by gradients of `a` and `b`.
    fn step(clip: &str, limit: f64, pull: Pull, (a, b): (f32, f32)) -> [f32; 2] {
        let sgd = Part::new("sgd").with("lr", Part::new("constant").with("value", 1.0));
        let part = Part::new(clip).with("optimiser", sgd).with("limit", limit);
        let optimiser = optimisers().build(&registry().complete(&part)).unwrap();
        let mut params = Params::default();
        let ids = [a, b].map(|grad| {
            let id = params.add("p".into(), vec![1], vec![0.0]);
            params.put_grad(id, vec![grad]);
            id
        });
        let mut moments = params.moments();
        optimiser.step(&Step { t: 0, total: 1, pull }, &mut params, &mut moments);
        ids.map(|id| params.value(id)[0])
    }

    #[test]
    fn one_norm_is_of_all_arrays_and_one_limit_of_each_number() {
        // ‖(3, 4)‖ = 5.
        assert_eq!(step("clip_norm", 2.5, Pull::NONE, (3.0, 4.0)), [-1.5, -2.0]);
        assert_eq!(step("clip_value", 3.5, Pull::NONE, (3.0, -4.0)), [-3.0, 3.5]);
        for clip in ["clip_norm", "clip_value"] {
            assert_eq!(step(clip, 5.0, Pull::NONE, (3.0, -4.0)), [-3.0, 4.0], "{clip}");
        }
    }

    #[test]
    fn what_a_prior_adds_is_not_clipped() {
        // A pull of strength 2 towards 8 beside a gradient that is cut to 1.
        let pull = Pull { l2: 2.0, l1: 0.0, centre: 8.0 };
        for clip in ["clip_norm", "clip_value"] {
            assert_eq!(step(clip, 1.0, pull, (3.0, 0.0)), [16.0 - 1.0, 16.0], "{clip}");
        }
    }
}
