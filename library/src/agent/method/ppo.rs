//! Proximal policy optimisation (Schulman et al., 2017).

use ivx_nn::{Live, Net, Optimiser, Proximity, Steps, Var};
use ivx_op::{Part, declare};

use super::on_policy::{How, Improve};

declare! {
    /// Proximal policy optimisation (Schulman et al., 2017): every `n_steps` steps in each world, the policy goes some
    /// epochs through them in minibatches, and its ratios to the policy that took them are clipped.
    ///
    /// Advantages are generalised (Schulman et al., 2016), bootstrap where an episode was cut off, and are brought to
    /// mean 0 and deviation 1 in each minibatch. Values are clipped as ratios are, if it is so told. Actions are drawn,
    /// also when it is measured.
    pub struct Ppo = "ppo" @ 1 {
        /// The layers up to the last linear maps.
        net: Box<dyn Net> = Part::new("mlp").with("hidden", vec![64_i64, 64]).with("activation", Part::new("tanh"));
        /// Whether the policy and the values share these layers.
        shared: bool = false;
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
        /// The share `λ` of longer paths in advantages.
        trace: f64 = 0.95, in 0.0..=1.0;
        /// How many steps of each world it learns from at once.
        n_steps: usize = 128, in 1.0..=1e6, unit "steps";
        /// How often it goes through them.
        epochs: usize = 4, in 1.0..=1e4;
        /// In how many parts.
        minibatches: usize = 4, in 1.0..=1e6;
        /// How far ratios, and values, may move.
        clip: f64 = 0.2, in 0.0..;
        /// Whether values are clipped.
        clip_values: bool = true;
        /// The weight of the values' loss, half the mean squared error.
        value_weight: f64 = 0.5, in 0.0..;
        /// The weight of the entropy.
        entropy: f64 = 0.01, in 0.0..;
        /// Whether advantages are brought to mean 0 and deviation 1.
        normalise: bool = true;
        /// How the loss is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("clip_norm").with("limit", 0.5).with(
            "optimiser",
            Part::new("adam").with("eps", 1e-5).with("lr", Part::new("constant").with("value", 2.5e-4)),
        );
    }
}

impl Improve for Ppo {
    fn how(&self) -> How<'_> {
        How {
            net: &*self.net,
            shared: self.shared,
            discount: self.discount,
            trace: self.trace,
            n_steps: self.n_steps,
            epochs: self.epochs,
            minibatches: self.minibatches,
            normalises: self.normalise,
            optimiser: &*self.optimiser,
            improve: self,
        }
    }

    fn loss(&self, live: &Live, nets: (Var, Var), old: &Steps) -> [Var; 4] {
        let settings = Proximity {
            clip: self.clip,
            value_weight: self.value_weight,
            entropy_weight: self.entropy,
            clips_values: self.clip_values,
        };
        let found = live.graph.proximal_loss(nets, old, &settings);
        [found.loss, found.policy, found.value, found.entropy]
    }
}
