//! Advantage actor-critic (Mnih et al., 2016), all worlds in step.

use ivx_nn::{Live, Net, Optimiser, Steps, Var};
use ivx_op::{Part, declare};

use super::on_policy::{How, Improve};

declare! {
    /// Advantage actor-critic (Mnih et al., 2016): every `n_steps` steps in each world, one update by the gradient of the
    /// policy (Eqn. 2.50), with advantages over the values, which are learned beside.
    ///
    /// Advantages are generalised, at `trace` 1 over all steps up to the last; they bootstrap where an episode was cut
    /// off. Actions are drawn, also when it is measured.
    pub struct A2c = "a2c" @ 1 {
        /// The layers up to the last linear maps.
        net: Box<dyn Net> = Part::new("mlp").with("hidden", vec![64_i64, 64]).with("activation", Part::new("tanh"));
        /// Whether the policy and the values share these layers.
        shared: bool = false;
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
        /// The share `λ` of longer paths in advantages.
        trace: f64 = 1.0, in 0.0..=1.0;
        /// How many steps of each world it learns from at once.
        n_steps: usize = 5, in 1.0..=1e6, unit "steps";
        /// The weight of the values' loss, half the mean squared error.
        value_weight: f64 = 0.5, in 0.0..;
        /// The weight of the entropy.
        entropy: f64 = 0.01, in 0.0..;
        /// How the loss is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("clip_norm").with("limit", 0.5).with(
            "optimiser",
            Part::new("adam").with("lr", Part::new("constant").with("value", 7e-4)),
        );
    }
}

impl Improve for A2c {
    fn how(&self) -> How<'_> {
        How {
            net: &*self.net,
            shared: self.shared,
            discount: self.discount,
            trace: self.trace,
            n_steps: self.n_steps,
            epochs: 1,
            minibatches: 1,
            normalises: false,
            optimiser: &*self.optimiser,
            improve: self,
        }
    }

    fn loss(&self, live: &Live, (logits, values): (Var, Var), old: &Steps) -> [Var; 4] {
        let graph = &live.graph;
        let policy = graph.policy_gradient_loss(logits, old.actions, old.advantages);
        let entropy = graph.mean(graph.entropy(logits));
        let value = graph.affine(graph.mean(graph.squared(values, old.returns)), 0.5, 0.0);
        let gained = graph.sub(policy, graph.affine(entropy, self.entropy, 0.0));
        let loss = graph.add(gained, graph.affine(value, self.value_weight, 0.0));
        [loss, policy, value, entropy]
    }
}
