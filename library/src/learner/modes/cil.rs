//! Plans that are chosen by a command (Codevilla et al., 2018).

use ivx_data::{Form, Misfit};
use ivx_nn::{ModeNets, Modes, Net, Optimiser};
use ivx_op::{Part, declare};

use super::{Learning, OfModes};
use crate::learner::Prior;

declare! {
    /// Conditional imitation learning (CIL; Codevilla et al., 2018): a network puts out a plan for each command that a
    /// navigation system can give, and that of the one that was given learns from what was done.
    ///
    /// ```text
    /// 1/T Σ_t |y_t − ŷ_c,t|,  c the command
    /// ```
    ///
    /// The error is absolute, as in learning by cheating (Chen et al., 2019), whose teacher and student are such networks,
    /// too. It learns from data whose targets are plans `[steps, dims]` of places, and whose observations end in the commands:
    /// 1 for that which is given and 0 for others, as a `town` shows them. Who `follows` what it predicts drives by it.
    pub struct Cil = "cil" @ 1, stochastic {
        /// What sees an input, up to the last linear map.
        net: Box<dyn Net> = Part::new("mobilenet_v2");
        /// How many numbers that map ends in.
        features: usize = 128, in 1.0..=1e6;
        /// Widths of the hidden layers upon these and the numbers beside an input.
        merge: Vec<usize> = vec![64_i64, 64], in 1.0..=1e6;
        /// How many commands there are.
        commands: usize = 4, in 1.0..=1e4;
        /// The prior over each parameter.
        prior: Box<dyn Prior> = Part::new("normal");
        /// How the objective is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adam");
        /// How many observations an update looks at; 0 for all.
        batch: usize = 0, in 0.0..;
    }
}

impl OfModes for Cil {
    fn learning(&self) -> Learning<'_> {
        Learning {
            nets: ModeNets { net: &*self.net, features: self.features, merge: &self.merge },
            prior: &*self.prior,
            optimiser: &*self.optimiser,
            batch: self.batch,
            weight: 1.0,
        }
    }

    fn kind(&self, _: &Form) -> Result<Modes, Misfit> {
        Ok(Modes::Commanded(self.commands))
    }

    fn n_modes(&self) -> Vec<usize> {
        vec![1]
    }
}
