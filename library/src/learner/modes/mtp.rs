//! Plans that a network makes (Cui et al., 2019).

use ivx_data::{Form, Misfit};
use ivx_nn::{ModeNets, Modes, Net, Optimiser};
use ivx_op::{Part, declare};

use super::{Learning, OfModes};
use crate::learner::Prior;

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

impl OfModes for Mtp {
    fn learning(&self) -> Learning<'_> {
        Learning {
            nets: ModeNets { net: &*self.net, features: self.features, merge: &self.merge },
            prior: &*self.prior,
            optimiser: &*self.optimiser,
            batch: self.batch,
            weight: self.weight,
        }
    }

    fn kind(&self, _: &Form) -> Result<Modes, Misfit> {
        Ok(Modes::Made(self.modes))
    }

    fn n_modes(&self) -> Vec<usize> {
        vec![self.modes]
    }
}
