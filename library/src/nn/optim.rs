//! Update rules of gradient-based optimisation (Eqn. 2.20), as pure functions over slices.

use num_traits::Float;

use super::real::wide;

/// Running averages of one array's gradients; which of them a rule uses is its own affair.
#[derive(Clone, Debug, PartialEq)]
pub struct Moments<F> {
    /// Of the gradient: Adam's first moment, SGD's velocity.
    pub first: Vec<F>,
    /// Of the squared gradient.
    pub second: Vec<F>,
}

impl<F: Float> Moments<F> {
    /// Those of `n` parameters before the first step.
    #[must_use]
    pub fn zeros(n: usize) -> Self {
        Self { first: vec![F::zero(); n], second: vec![F::zero(); n] }
    }
}

/// A force towards one value, the gradient of `strength/2 ‖θ - centre‖²`.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Pull {
    /// How strong; 0 for none.
    pub strength: f64,
    /// Whither.
    pub centre: f64,
}

/// The settings of one Adam step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adam {
    /// Learning rate `η` of this step.
    pub lr: f64,
    /// Decay `β_1` of the first moment.
    pub beta1: f64,
    /// Decay `β_2` of the second moment.
    pub beta2: f64,
    /// Added to the root, outside it.
    pub eps: f64,
    /// Decoupled pulls (Loshchilov and Hutter, 2017), added up.
    pub pulls: [Pull; 2],
}

/// One step of Adam with bias correction; `t` counts from 0.
///
/// ```text
/// m ← β_1 m + (1 - β_1) g
/// v ← β_2 v + (1 - β_2) g²
/// θ ← θ - η strength (θ - centre) - η m̂ / (√v̂ + ε),  m̂ = m / (1 - β_1^{t+1}),  v̂ = v / (1 - β_2^{t+1})
/// ```
pub fn adam<F: Float>(
    rule: &Adam,
    t: u64,
    params: &mut [F],
    grads: &[F],
    moments: &mut Moments<F>,
) {
    let n = i32::try_from(t + 1).unwrap_or(i32::MAX);
    let rate = real::<F>(rule.lr / (1.0 - rule.beta1.powi(n)));
    let root = real::<F>(1.0 / (1.0 - rule.beta2.powi(n)).sqrt());
    let [keep1, keep2, eps] = [rule.beta1, rule.beta2, rule.eps].map(real::<F>);
    let [new1, new2] = [1.0 - rule.beta1, 1.0 - rule.beta2].map(real::<F>);
    // The pulls as one line: η Σ strength (θ - centre) = decay θ - shift.
    let decay = real::<F>(rule.lr * rule.pulls.iter().map(|p| p.strength).sum::<f64>());
    let shift = real::<F>(rule.lr * rule.pulls.iter().map(|p| p.strength * p.centre).sum::<f64>());
    let moments = moments.first.iter_mut().zip(&mut moments.second);
    wide(
        #[inline(always)]
        || {
            for ((p, &g), (m, v)) in params.iter_mut().zip(grads).zip(moments) {
                *m = keep1 * *m + new1 * g;
                *v = keep2 * *v + new2 * g * g;
                *p = *p - (decay * *p - shift + rate * *m / (v.sqrt() * root + eps));
            }
        },
    );
}

/// One step of gradient descent with momentum: `u ← μ u + g`, `θ ← θ - η u`.
pub fn sgd<F: Float>(lr: f64, momentum: f64, params: &mut [F], grads: &[F], velocity: &mut [F]) {
    let (lr, momentum) = (real::<F>(lr), real::<F>(momentum));
    for ((p, &g), u) in params.iter_mut().zip(grads).zip(velocity) {
        *u = momentum * *u + g;
        *p = *p - lr * *u;
    }
}

/// The settings of one `RMSProp` step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RmsProp {
    /// Learning rate `η` of this step.
    pub lr: f64,
    /// Decay `α` of the averages.
    pub decay: f64,
    /// Added to the root, outside it.
    pub eps: f64,
    /// Whether to divide by the deviation from the mean rather than by the magnitude.
    pub centered: bool,
}

/// One step of `RMSProp`.
///
/// ```text
/// v ← α v + (1 - α) g²
/// m ← α m + (1 - α) g        if centered, else m = 0
/// θ ← θ - η g / (√(v - m²) + ε)
/// ```
pub fn rmsprop<F: Float>(rule: &RmsProp, params: &mut [F], grads: &[F], moments: &mut Moments<F>) {
    let [lr, keep, new, eps] = [rule.lr, rule.decay, 1.0 - rule.decay, rule.eps].map(real::<F>);
    let moments = moments.first.iter_mut().zip(&mut moments.second);
    for ((p, &g), (m, v)) in params.iter_mut().zip(grads).zip(moments) {
        *v = keep * *v + new * g * g;
        if rule.centered {
            *m = keep * *m + new * g;
        }
        // Rounding can take a variance of 0 below it.
        let variance = (*v - *m * *m).max(F::zero());
        *p = *p - lr * g / (variance.sqrt() + eps);
    }
}

/// The norm of all gradients together, which are scaled down to `max_norm` if it is above.
pub fn clip_global_norm<F: Float>(grads: &mut [&mut [F]], max_norm: f64) -> F {
    let norm = global_norm(grads);
    let max_norm = real::<F>(max_norm);
    if norm > max_norm {
        grads
            .iter_mut()
            .flat_map(|array| array.iter_mut())
            .for_each(|g| *g = *g * (max_norm / norm));
    }
    norm
}

/// The Euclidean norm of all gradients together.
#[must_use]
pub fn global_norm<F: Float>(grads: &[&mut [F]]) -> F {
    grads.iter().flat_map(|array| array.iter()).fold(F::zero(), |sum, &g| sum + g * g).sqrt()
}

/// Moves the target network's parameters a little (Polyak): `θ⁻ ← (1 - τ) θ⁻ + τ θ`.
pub fn target_update<F: Float>(target: &mut [F], online: &[F], tau: f64) {
    let (keep, new) = (real::<F>(1.0 - tau), real::<F>(tau));
    target.iter_mut().zip(online).for_each(|(t, &o)| *t = keep * *t + new * o);
}

/// Adds a pull to the gradients, for rules that do not decouple it.
pub fn add_pull<F: Float>(pull: Pull, params: &[F], grads: &mut [F]) {
    let (strength, centre) = (real::<F>(pull.strength), real::<F>(pull.centre));
    grads.iter_mut().zip(params).for_each(|(g, &p)| *g = *g + strength * (p - centre));
}

fn real<F: Float>(x: f64) -> F {
    F::from(x).expect("a float is a float")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Adam = Adam {
        lr: 0.1,
        beta1: 0.9,
        beta2: 0.999,
        eps: 0.0,
        pulls: [Pull { strength: 0.0, centre: 0.0 }; 2],
    };

    #[test]
    fn the_first_step_of_adam_has_the_length_of_the_rate() {
        // m̂ = g and v̂ = g², so that θ moves by η sign(g).
        let mut params = [1.0_f64, 1.0];
        adam(&PLAIN, 0, &mut params, &[0.25, -3.0], &mut Moments::zeros(2));
        assert!((params[0] - 0.9).abs() < 1e-12 && (params[1] - 1.1).abs() < 1e-12);
    }

    #[test]
    fn a_pull_without_gradient_closes_its_share_of_the_distance() {
        // η strength = 0.05; (3 − 1) · 0.95 = 1.9 remains to 1. And weight decay takes 0.02 · 3.
        let pulls = [Pull { strength: 0.5, centre: 1.0 }, Pull { strength: 0.2, centre: 0.0 }];
        let rule = Adam { eps: 1e-8, pulls, ..PLAIN };
        let mut params = [3.0_f64];
        adam(&rule, 0, &mut params, &[0.0], &mut Moments::zeros(1));
        assert!((params[0] - (2.9 - 0.06)).abs() < 1e-12);

        let mut grads = [1.0_f64];
        add_pull(pulls[0], &[3.0], &mut grads);
        assert_eq!(grads, [2.0]);
    }

    #[test]
    fn velocity_gathers() {
        // u = 2, then 0.5·2 + 2 = 3: θ = 1 − 0.1·2 − 0.1·3.
        let (mut params, mut velocity) = ([1.0_f64], [0.0]);
        sgd(0.1, 0.5, &mut params, &[2.0], &mut velocity);
        sgd(0.1, 0.5, &mut params, &[2.0], &mut velocity);
        assert!((params[0] - 0.5).abs() < 1e-12);
    }

    #[test]
    fn centring_divides_by_the_deviation() {
        // v = 2, m = 1, g = 2: plain √2, centred √(2 − 1) = 1.
        let rule = RmsProp { lr: 1.0, decay: 0.5, eps: 0.0, centered: false };
        for (centered, step) in [(false, 2.0_f64.sqrt()), (true, 2.0)] {
            let mut params = [0.0_f64];
            rmsprop(&RmsProp { centered, ..rule }, &mut params, &[2.0], &mut Moments::zeros(1));
            assert!((params[0] + step).abs() < 1e-12);
        }
    }

    #[test]
    fn clipping_keeps_the_direction_and_short_gradients() {
        let (mut a, mut b) = ([3.0_f64], [4.0]);
        assert_eq!(clip_global_norm(&mut [&mut a, &mut b], 1.0), 5.0);
        assert!((a[0] - 0.6).abs() < 1e-12 && (b[0] - 0.8).abs() < 1e-12);
        assert!((clip_global_norm(&mut [&mut a, &mut b], 2.0) - 1.0).abs() < 1e-12);
        assert!((b[0] - 0.8).abs() < 1e-12);
    }

    #[test]
    fn the_target_moves_by_tau() {
        let mut target = [1.0_f64];
        target_update(&mut target, &[3.0], 0.25);
        assert_eq!(target, [1.5]);
    }
}
