//! Functions applied number by number.

use serde::{Deserialize, Serialize};

use super::real::{Real, sigmoid, softplus, wide};

/// A function without parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Curve {
    /// `x`.
    Identity,
    /// `tanh x`.
    Tanh,
    /// `max(x, 0)`.
    Relu,
    /// `min(max(x, 0), 6)`.
    Relu6,
    /// `x` above 0, `e^x - 1` below.
    Elu,
    /// `1 / (1 + e^-x)`.
    Sigmoid,
    /// `ln(1 + e^x)`.
    Softplus,
    /// `x / (1 + e^-x)`, whose slope does not follow from its value.
    Silu,
}

impl Curve {
    /// Replaces each number by the function's value.
    pub(super) fn apply<F: Real>(self, xs: &mut [F]) {
        match self {
            Self::Identity => {}
            Self::Tanh => wide(
                #[inline(always)]
                || each(xs, F::hyperbolic_tangent),
            ),
            Self::Relu => wide(
                #[inline(always)]
                || each(xs, |x| if x > F::zero() { x } else { F::zero() }),
            ),
            Self::Relu6 => wide(
                #[inline(always)]
                || each(xs, |x| x.max(F::zero()).min(F::of(6.0))),
            ),
            Self::Elu => wide(
                #[inline(always)]
                || {
                    each(xs, |x| {
                        let below = x.min(F::zero()).exponential() - F::one();
                        if x > F::zero() { x } else { below }
                    });
                },
            ),
            Self::Sigmoid => wide(
                #[inline(always)]
                || each(xs, sigmoid),
            ),
            Self::Softplus => wide(
                #[inline(always)]
                || each(xs, softplus),
            ),
            Self::Silu => wide(
                #[inline(always)]
                || each(xs, |x| x * sigmoid(x)),
            ),
        }
    }

    /// Multiplies each gradient by the function's slope where it took the value `y`.
    pub(super) fn backward<F: Real>(self, ys: &[F], grads: &mut [F]) {
        match self {
            Self::Identity => {}
            Self::Tanh => wide(
                #[inline(always)]
                || slopes(ys, grads, |y| F::one() - y * y),
            ),
            Self::Relu => wide(
                #[inline(always)]
                || slopes(ys, grads, |y| step(y > F::zero())),
            ),
            Self::Relu6 => {
                wide(
                    #[inline(always)]
                    || slopes(ys, grads, |y| step(y > F::zero() && y < F::of(6.0))),
                );
            }
            Self::Elu => wide(
                #[inline(always)]
                || slopes(ys, grads, |y| F::one() + y.min(F::zero())),
            ),
            Self::Sigmoid => wide(
                #[inline(always)]
                || slopes(ys, grads, |y| y * (F::one() - y)),
            ),
            Self::Softplus => wide(
                #[inline(always)]
                || slopes(ys, grads, |y| F::one() - (-y).exponential()),
            ),
            Self::Silu => unreachable!("an operation of its own keeps its input"),
        }
    }

    /// How the function's slope changes with the value `y` that it took; 0 where it is of straight pieces.
    pub(super) fn bend<F: Real>(self, y: F) -> F {
        match self {
            Self::Identity | Self::Relu | Self::Relu6 => F::zero(),
            Self::Tanh => F::of(-2.0) * y,
            Self::Elu => step(y < F::zero()),
            Self::Sigmoid => F::one() - F::of(2.0) * y,
            Self::Softplus => (-y).exponential(),
            Self::Silu => unreachable!("its slope does not follow from its value"),
        }
    }
}

/// 1 or 0.
#[inline(always)]
fn step<F: Real>(is: bool) -> F {
    if is { F::one() } else { F::zero() }
}

#[inline(always)]
fn each<F: Real>(xs: &mut [F], f: impl Fn(F) -> F) {
    for x in xs {
        *x = f(*x);
    }
}

#[inline(always)]
fn slopes<F: Real>(ys: &[F], grads: &mut [F], slope: impl Fn(F) -> F) {
    grads.iter_mut().zip(ys).for_each(|(g, &y)| *g *= slope(y));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So that results do not depend on how many fit into a register.
    #[test]
    fn lanes_compute_as_single_numbers_do() {
        let xs: Vec<f32> = (-999..1000).map(|i| f32::of(f64::from(i) * 0.0201)).collect();
        let curves = [
            Curve::Tanh,
            Curve::Relu,
            Curve::Relu6,
            Curve::Elu,
            Curve::Sigmoid,
            Curve::Softplus,
            Curve::Silu,
        ];
        for curve in curves {
            let (mut ys, mut slopes) = (xs.clone(), xs.clone());
            curve.apply(&mut ys);
            let has_slope = curve != Curve::Silu;
            if has_slope {
                curve.backward(&ys, &mut slopes);
            }
            for (i, x) in xs.iter().enumerate() {
                let (mut y, mut slope) = ([*x], [*x]);
                curve.apply(&mut y);
                if has_slope {
                    curve.backward(&y, &mut slope);
                }
                let bits = |pair: [f32; 2]| pair.map(f32::to_bits);
                assert_eq!(bits([y[0], slope[0]]), bits([ys[i], slopes[i]]), "{curve:?} at {x}");
            }
        }
    }
}
