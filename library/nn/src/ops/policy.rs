//! Losses that improve policies.

use crate::graph::{Graph, Var};
use crate::real::Real;

/// How far proximal policy optimisation goes (Schulman et al., 2017).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proximity {
    /// How far ratios and values may move.
    pub clip: f64,
    /// Weight of the values' loss.
    pub value_weight: f64,
    /// Weight of the entropy.
    pub entropy_weight: f64,
    /// Whether values are clipped as ratios are.
    pub clips_values: bool,
}

/// What a step of an old policy was, one number an item.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    /// The actions taken, counted from 0.
    pub actions: Var,
    /// The logarithms of their probabilities then.
    pub log_probs: Var,
    /// Their advantages.
    pub advantages: Var,
    /// The values of their states then.
    pub values: Var,
    /// The returns after them.
    pub returns: Var,
}

/// The parts of a proximal loss; scalars but for the ratios.
#[derive(Clone, Copy, Debug)]
pub struct Proximal {
    /// The ratio of each action's probability to that of the old policy.
    pub ratios: Var,
    /// Of the policy.
    pub policy: Var,
    /// Of the values.
    pub value: Var,
    /// The mean entropy.
    pub entropy: Var,
    /// All of them.
    pub loss: Var,
}

impl<F: Real> Graph<F> {
    /// `-1/N Σ w ln π(a)` (Eqn. 2.48): a scalar to lower. The weights are returns or advantages.
    pub fn policy_gradient_loss(&self, logits: Var, actions: Var, weights: Var) -> Var {
        let log_probs = self.affine(self.cross_entropy(logits, actions), -1.0, 0.0);
        self.affine(self.mean(self.mul(log_probs, self.stop_gradient(weights))), -1.0, 0.0)
    }

    /// The same with a bonus of `weight` for the entropy (Eqn. 2.50).
    pub fn entropic_loss(
        &self,
        logits: Var,
        (actions, advantages): (Var, Var),
        weight: f64,
    ) -> Var {
        let loss = self.policy_gradient_loss(logits, actions, advantages);
        let bonus = self.affine(self.mean(self.entropy(logits)), -weight, 0.0);
        self.add(loss, bonus)
    }

    /// `-1/N Σ_i Σ_a π(a) A(a)` for the advantages `A = q - Σ_a π(a) q(a)` of known action
    /// values (Eqn. 2.46): a scalar to lower. No gradient passes through the advantages.
    pub fn expected_loss(&self, logits: Var, advantages: Var) -> Var {
        let probs = self.exp(self.log_softmax(logits));
        let gains = self.sum_items(self.mul(probs, self.stop_gradient(advantages)));
        self.affine(self.mean(gains), -1.0, 0.0)
    }

    /// `q - Σ_a π(a) q(a)` of each item.
    pub fn advantages(&self, logits: Var, q: Var) -> Var {
        let probs = self.exp(self.log_softmax(logits));
        self.sub(q, self.sum_items(self.mul(probs, q)))
    }

    /// The clipped loss of proximal policy optimisation.
    pub fn proximal_loss(
        &self,
        (logits, values): (Var, Var),
        old: &Steps,
        settings: &Proximity,
    ) -> Proximal {
        let clip = F::of(settings.clip);
        let (low, high) = (F::one() - clip, F::one() + clip);
        let log_probs = self.affine(self.cross_entropy(logits, old.actions), -1.0, 0.0);
        let ratios = self.exp(self.sub(log_probs, old.log_probs));
        let inside = move |r: F| r.max(low).min(high);
        // The worse of the plain and the clipped gain.
        let gains = self.zip(
            ratios,
            old.advantages,
            move |r, a| (r * a).min(inside(r) * a),
            move |r, a| {
                let is_plain = r * a <= inside(r) * a;
                (if is_plain { a } else { F::zero() }, F::zero())
            },
        );
        let policy = self.affine(self.mean(gains), -1.0, 0.0);
        let errors = self.squared(values, old.returns);
        let errors = if settings.clips_values {
            let moved = self.map(
                self.sub(values, old.values),
                move |d| d.max(-clip).min(clip),
                move |d, _| if d.abs() <= clip { F::one() } else { F::zero() },
            );
            let clipped = self.squared(self.add(moved, old.values), old.returns);
            self.zip(errors, clipped, F::max, |a, b| {
                if a >= b { (F::one(), F::zero()) } else { (F::zero(), F::one()) }
            })
        } else {
            errors
        };
        let value = self.affine(self.mean(errors), 0.5, 0.0);
        let entropy = self.mean(self.entropy(logits));
        let loss = self.add(
            self.sub(policy, self.affine(entropy, settings.entropy_weight, 0.0)),
            self.affine(value, settings.value_weight, 0.0),
        );
        Proximal { ratios, policy, value, entropy, loss }
    }
}
