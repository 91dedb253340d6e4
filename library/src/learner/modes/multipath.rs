//! Plans about anchors that a network moves (Chai et al., 2019).

use ivx_data::{Form, Misfit};
use ivx_nn::{Anchored, ModeNets, Modes, Net, Optimiser};
use ivx_op::{Array, One, OpError, Part, declare};

use super::{Learning, OfModes, anchored, computed, n_anchors};
use crate::learner::Prior;

declare! {
    /// `MultiPath` (Chai et al., 2019): of fixed plans, the anchors, a network puts out how probable each is, how far it is
    /// moved, and how far what comes is from there, step by step.
    ///
    /// ```text
    /// −ln π_k* − Σ_t ln N(y_t; a_k*,t + μ_k*,t, diag σ_k*,t²),  k* = argmin_k ‖y − a_k‖₂
    /// ```
    ///
    /// `σ` is `ln(1 + e^z) + 0.001` of what the network puts out, and numbers of a place do not correlate. It learns from
    /// data whose targets are plans `[steps, dims]` of places, seen from where they begin. What such a model predicts is the
    /// most probable anchor, moved, and `modes` tells all.
    pub struct MultiPath = "multipath" @ 1, stochastic {
        /// What sees an input, up to the last linear map.
        net: Box<dyn Net> = Part::new("mobilenet_v2");
        /// How many numbers that map ends in.
        features: usize = 128, in 1.0..=1e6;
        /// Widths of the hidden layers upon these and the numbers beside an input.
        merge: Vec<usize> = vec![64_i64, 64], in 1.0..=1e6;
        /// The anchors: plans `[plan, step, dim]`, such as `plan_library` makes of data.
        anchors: One<Array>;
        /// The prior over each parameter.
        prior: Box<dyn Prior> = Part::new("normal");
        /// How the objective is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adam");
        /// How many observations an update looks at; 0 for all.
        batch: usize = 0, in 0.0..;
    }
}

impl OfModes for MultiPath {
    fn learning(&self) -> Learning<'_> {
        Learning {
            nets: ModeNets { net: &*self.net, features: self.features, merge: &self.merge },
            prior: &*self.prior,
            optimiser: &*self.optimiser,
            batch: self.batch,
            weight: 1.0,
        }
    }

    fn kind(&self, form: &Form) -> Result<Modes, Misfit> {
        anchored(Anchored::Moved, &self.anchors, form)
    }

    fn computed(&self, form: &Form) -> Result<Modes, OpError> {
        computed(Anchored::Moved, &self.anchors, form)
    }

    fn n_modes(&self) -> Vec<usize> {
        n_anchors(&self.anchors)
    }
}
