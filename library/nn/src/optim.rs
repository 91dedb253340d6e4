//! Update rules of gradient-based optimisation (Eqn. 2.20), as pure functions over slices.

use num_traits::Float;

use super::real::{Real, wide};

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

/// A force towards one value, the gradient of `l2/2 ‖θ - centre‖² + l1 ‖θ - centre‖_1`, whose
/// second term has the slope 0 at its kink.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull {
    /// How strong it is for each unit of distance; 0 for none.
    pub l2: f64,
    /// How strong it is at any distance; 0 for none.
    pub l1: f64,
    /// Whither.
    pub centre: f64,
}

impl Pull {
    /// Nowhither.
    pub const NONE: Self = Self { l2: 0.0, l1: 0.0, centre: 0.0 };
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
    /// A decoupled pull of every parameter towards 0 (Loshchilov and Hutter, 2017).
    pub weight_decay: f64,
    /// Another one.
    pub pull: Pull,
}

/// One step of Adam with bias correction; `t` counts from 0.
///
/// ```text
/// m ← β_1 m + (1 - β_1) g
/// v ← β_2 v + (1 - β_2) g²
/// m̂ = m / (1 - β_1^{t+1}),  v̂ = v / (1 - β_2^{t+1})
/// θ ← θ - η (weight_decay θ + l2 (θ - centre) + l1 sign(θ - centre) + m̂ / (√v̂ + ε))
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
    // The pulls: η (weight_decay θ + l2 (θ - centre)) = decay θ - shift, and that at the kink.
    let Pull { l2, l1, centre } = rule.pull;
    let decay = real::<F>(rule.lr * (l2 + rule.weight_decay));
    let shift = real::<F>(rule.lr * (l2 * centre));
    let (kink, centre) = (real::<F>(rule.lr * l1), real::<F>(centre));
    let moments = moments.first.iter_mut().zip(&mut moments.second);
    // By `move`, the numbers are seen to lie apart from the arrays: or the loop is run one by one.
    wide(
        #[inline(always)]
        move || {
            for ((p, &g), (m, v)) in params.iter_mut().zip(grads).zip(moments) {
                *m = keep1 * *m + new1 * g;
                *v = keep2 * *v + new2 * g * g;
                let mut pull = decay * *p - shift;
                if l1 != 0.0 {
                    pull = pull + kink * sign(*p - centre);
                }
                *p = *p - (pull + rate * *m / (v.sqrt() * root + eps));
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

/// The Euclidean norm of all gradients together, in double precision.
#[must_use]
pub fn global_norm<'a, F: Real>(grads: impl IntoIterator<Item = &'a [F]>) -> f64 {
    const LANES: usize = 16;
    let mut sums = [0.0; LANES];
    for array in grads {
        wide(
            #[inline(always)]
            || {
                let (chunks, rest) = array.as_chunks::<LANES>();
                for chunk in chunks {
                    sums.iter_mut().zip(chunk).for_each(|(sum, g)| *sum += g.double() * g.double());
                }
                sums.iter_mut().zip(rest).for_each(|(sum, g)| *sum += g.double() * g.double());
            },
        );
    }
    sums.iter().sum::<f64>().sqrt()
}

/// Scales all gradients, whose norm is given, down to `max_norm` if they are above.
pub fn clip_global_norm<'a, F: Real>(
    grads: impl IntoIterator<Item = &'a mut [F]>,
    norm: f64,
    max_norm: f64,
) {
    if norm > max_norm {
        let scale = F::of(max_norm / norm);
        grads.into_iter().flatten().for_each(|g| *g *= scale);
    }
}

/// Brings every number of the gradients within `±limit`.
pub fn clip_value<'a, F: Real>(grads: impl IntoIterator<Item = &'a mut [F]>, limit: f64) {
    let limit = F::of(limit);
    // A number that is none stays so, for a training that diverges to be seen.
    grads.into_iter().flatten().for_each(|g| {
        if *g > limit {
            *g = limit;
        } else if *g < -limit {
            *g = -limit;
        }
    });
}

/// Moves the target network's parameters a little (Polyak): `θ⁻ ← (1 - τ) θ⁻ + τ θ`.
pub fn target_update<F: Float>(target: &mut [F], online: &[F], tau: f64) {
    let (keep, new) = (real::<F>(1.0 - tau), real::<F>(tau));
    target.iter_mut().zip(online).for_each(|(t, &o)| *t = keep * *t + new * o);
}

/// Adds a pull to the gradients, for rules that do not decouple it.
pub fn add_pull<F: Float>(pull: Pull, params: &[F], grads: &mut [F]) {
    let [l2, l1, centre] = [pull.l2, pull.l1, pull.centre].map(real::<F>);
    if pull.l2 != 0.0 {
        grads.iter_mut().zip(params).for_each(|(g, &p)| *g = *g + l2 * (p - centre));
    }
    if pull.l1 != 0.0 {
        grads.iter_mut().zip(params).for_each(|(g, &p)| *g = *g + l1 * sign(p - centre));
    }
}

/// The slope of `|x|`; 0 at its kink.
#[inline(always)]
fn sign<F: Float>(x: F) -> F {
    if x > F::zero() {
        F::one()
    } else if x < F::zero() {
        -F::one()
    } else {
        F::zero()
    }
}

fn real<F: Float>(x: f64) -> F {
    F::from(x).expect("a float is a float")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Adam =
        Adam { lr: 0.1, beta1: 0.9, beta2: 0.999, eps: 0.0, weight_decay: 0.0, pull: Pull::NONE };

    #[test]
    fn the_first_step_of_adam_has_the_length_of_the_rate() {
        // m̂ = g and v̂ = g², so that θ moves by η sign(g).
        let mut params = [1.0_f64, 1.0];
        adam(&PLAIN, 0, &mut params, &[0.25, -3.0], &mut Moments::zeros(2));
        assert!((params[0] - 0.9).abs() < 1e-12 && (params[1] - 1.1).abs() < 1e-12);
    }

    #[test]
    fn a_pull_without_gradient_closes_its_share_of_the_distance() {
        // η l2 = 0.05; (3 − 1) · 0.95 = 1.9 remains to 1. And weight decay takes 0.02 · 3.
        let pull = Pull { l2: 0.5, centre: 1.0, ..Pull::NONE };
        let rule = Adam { eps: 1e-8, weight_decay: 0.2, pull, ..PLAIN };
        let mut params = [3.0_f64];
        adam(&rule, 0, &mut params, &[0.0], &mut Moments::zeros(1));
        assert!((params[0] - (2.9 - 0.06)).abs() < 1e-12);

        let mut grads = [1.0_f64];
        add_pull(pull, &[3.0], &mut grads);
        assert_eq!(grads, [2.0]);
    }

    #[test]
    fn an_l1_pull_is_as_strong_at_any_distance_and_none_at_its_kink() {
        let pull = Pull { l1: 0.5, centre: 1.0, ..Pull::NONE };
        let mut grads = [0.0_f64; 4];
        add_pull(pull, &[9.0, 1.5, 1.0, -7.0], &mut grads);
        assert_eq!(grads, [0.5, 0.5, 0.0, -0.5]);

        // η l1 = 0.05.
        let mut params = [9.0_f64, 1.0, -7.0];
        let rule = Adam { eps: 1e-8, pull, ..PLAIN };
        adam(&rule, 0, &mut params, &[0.0; 3], &mut Moments::zeros(3));
        assert_eq!(params, [8.95, 1.0, -6.95]);
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
        let (mut a, mut b) = ([3.0_f64], [0.0, 4.0]);
        let norm = global_norm([&a[..], &b]);
        assert_eq!(norm, 5.0);
        clip_global_norm([&mut a[..], &mut b], norm, 1.0);
        assert!((a[0] - 0.6).abs() < 1e-12 && (b[1] - 0.8).abs() < 1e-12);
        let (norm, before) = (global_norm([&a[..], &b]), b);
        clip_global_norm([&mut a[..], &mut b], norm, 2.0);
        assert_eq!(b, before);
    }

    /// In single precision a running sum of a million squares of 0.1 is off by a thousandth.
    #[test]
    fn the_norm_of_many_gradients_is_exact() {
        let grads = vec![0.1_f32; 1_000_003];
        let exact = f64::from(0.1_f32) * 1_000_003_f64.sqrt();
        assert!((global_norm([&grads[..400_000], &grads[400_000..]]) / exact - 1.0).abs() < 1e-12);
        assert_eq!(global_norm::<f32>([]), 0.0);
    }

    #[test]
    fn clipping_by_value_brings_each_number_within_the_limit() {
        let (mut a, mut b) = ([3.0_f64, 0.5], [-4.0, f64::NAN]);
        clip_value([&mut a[..], &mut b], 1.0);
        assert_eq!((a, b[0]), ([1.0, 0.5], -1.0));
        assert!(b[1].is_nan());
    }

    #[test]
    fn the_target_moves_by_tau() {
        let mut target = [1.0_f64];
        target_update(&mut target, &[3.0], 0.25);
        assert_eq!(target, [1.5]);
    }
}
