//! Anchors among which a network chooses (Phan-Minh et al., 2020).

use ivx_data::{Dataset, Form, Misfit};
use ivx_nn::{Anchored, ModeNets, Model, Net, Optimiser};
use ivx_op::{Array, Ctx, One, OpError, Part, declare};

use super::{Learning, anchored, computed, n_anchors, updates_in_a_pass};
use crate::learner::{Learner, Prior};

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

impl CoverNet {
    fn learning(&self) -> Learning<'_> {
        Learning {
            nets: ModeNets { net: &*self.net, features: self.features, merge: &self.merge },
            prior: &*self.prior,
            optimiser: &*self.optimiser,
            batch: self.batch,
            weight: 1.0,
        }
    }
}

impl Learner for CoverNet {
    fn train(&self, data: &Dataset, steps: u64, ctx: &Ctx) -> Result<Model, OpError> {
        let modes = computed(Anchored::Chosen, &self.anchors, &data.form)?;
        self.learning().train(modes, data, steps, ctx)
    }

    fn fits(&self, form: &Form) -> Result<(), Misfit> {
        let modes = anchored(Anchored::Chosen, &self.anchors, form)?;
        self.learning().nets.modules(form, &modes).map(drop)
    }

    fn memory(&self, form: &Form, n: u64) -> u64 {
        let modes = anchored(Anchored::Chosen, &self.anchors, form);
        modes.map_or(0, |modes| self.learning().memory(&modes, form, n))
    }

    fn updates_in_a_pass(&self, n: usize) -> u64 {
        updates_in_a_pass(n, self.batch)
    }

    fn makes_networks(&self) -> bool {
        true
    }

    fn modes(&self) -> Option<Vec<usize>> {
        Some(n_anchors(&self.anchors))
    }
}
