//! Plans that a network makes (Cui et al., 2019).

use ivx_data::{Dataset, Form, Misfit};
use ivx_nn::{ModeNets, Model, Modes, Net, Optimiser};
use ivx_op::{Ctx, OpError, Part, declare};

use super::{Learning, updates_in_a_pass};
use crate::learner::{Learner, Prior};

declare! {
    /// Multiple-trajectory prediction (MTP; Cui et al., 2019): a network puts out a few plans and how probable each is, and
    /// of these only the nearest to what came learns from it, besides all probabilities.
    ///
    /// ```text
    /// −ln π_m* + α/T Σ_t ‖y_t − ŷ_m*,t‖₂,  m* = argmin_m 1/T Σ_t ‖y_t − ŷ_m,t‖₂
    /// ```
    ///
    /// The distance is the mean displacement, as the paper has it, and neither its square nor a smooth one; that modes are
    /// told apart by angles first, which the paper has too, is left out. It learns from data whose targets are plans
    /// `[steps, dims]` of places, seen from where they begin. What such a model predicts is the most probable plan, and
    /// `modes` tells all.
    pub struct Mtp = "mtp" @ 1, stochastic {
        /// What sees an input, up to the last linear map.
        net: Box<dyn Net> = Part::new("mobilenet_v2");
        /// How many numbers that map ends in.
        features: usize = 128, in 1.0..=1e6;
        /// Widths of the hidden layers upon these and the numbers beside an input.
        merge: Vec<usize> = vec![64_i64, 64], in 1.0..=1e6;
        /// How many plans.
        modes: usize = 3, in 1.0..=1e5;
        /// How much the distance counts beside the probability, `α`.
        weight: f64 = 1.0, in 0.0..;
        /// The prior over each parameter.
        prior: Box<dyn Prior> = Part::new("normal");
        /// How the objective is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adam");
        /// How many observations an update looks at; 0 for all.
        batch: usize = 0, in 0.0..;
    }
}

impl Mtp {
    fn learning(&self) -> Learning<'_> {
        Learning {
            nets: ModeNets { net: &*self.net, features: self.features, merge: &self.merge },
            prior: &*self.prior,
            optimiser: &*self.optimiser,
            batch: self.batch,
            weight: self.weight,
        }
    }
}

impl Learner for Mtp {
    fn train(&self, data: &Dataset, steps: u64, ctx: &Ctx) -> Result<Model, OpError> {
        self.learning().train(Modes::Made(self.modes), data, steps, ctx)
    }

    fn fits(&self, form: &Form) -> Result<(), Misfit> {
        self.learning().nets.modules(form, &Modes::Made(self.modes)).map(drop)
    }

    fn memory(&self, form: &Form, n: u64) -> u64 {
        self.learning().memory(&Modes::Made(self.modes), form, n)
    }

    fn updates_in_a_pass(&self, n: usize) -> u64 {
        updates_in_a_pass(n, self.batch)
    }

    fn makes_networks(&self) -> bool {
        true
    }

    fn modes(&self) -> Option<Vec<usize>> {
        Some(vec![self.modes])
    }
}
