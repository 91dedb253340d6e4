//! Anchors among which a network chooses (Phan-Minh et al., 2020).

use ivx_data::{Form, Misfit};
use ivx_nn::{Anchored, ModeNets, Modes, Net, Optimiser};
use ivx_op::{Array, One, OpError, Part, declare};

use super::{Learning, OfModes, anchored, computed, n_anchors};
use crate::learner::Prior;

declare! {
    /// `CoverNet` with fixed trajectories (Phan-Minh et al., 2020): a network puts out how probable each of some fixed plans is,
    /// the anchors, of which the nearest to what came is the class.
    ///
    /// ```text
    /// −ln π_k*,  k* = argmin_k 1/T Σ_t ‖y_t − a_k,t‖₂
    /// ```
    ///
    /// It learns from data whose targets are plans `[steps, dims]` of places, seen from where they begin. What such a model
    /// predicts is the most probable anchor as it is, and `modes` tells all.
    pub struct CoverNet = "covernet" @ 1, stochastic {
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

impl OfModes for CoverNet {
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
        anchored(Anchored::Chosen, &self.anchors, form)
    }

    fn computed(&self, form: &Form) -> Result<Modes, OpError> {
        computed(Anchored::Chosen, &self.anchors, form)
    }

    fn n_modes(&self) -> Vec<usize> {
        n_anchors(&self.anchors)
    }
}
