//! What networks compute in: single precision, and double where gradients are checked.

use std::iter::Sum;

use dfdx::prelude::Unit;
use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use num_traits::{Float, NumAssign};
use pulp::Simd;
use pulp::bytemuck::Pod;

/// A number that networks are made of: `f32` or `f64`.
pub trait Real: Float + NumAssign + Sum + Unit + Pod {
    /// The nearest number of this precision.
    fn of(x: f64) -> Self;
    /// This number in double precision.
    fn double(self) -> f64;
    /// `e^x`.
    #[must_use]
    fn exponential(self) -> Self;
    /// The hyperbolic tangent.
    #[must_use]
    fn hyperbolic_tangent(self) -> Self;
    /// Replaces `out` by the product of two matrices, or adds it, on one thread.
    fn product(out: MatMut<'_, Self>, add: bool, a: MatRef<'_, Self>, b: MatRef<'_, Self>);
    /// What a vector register holds.
    type Lanes<S: Simd>: Pod;
    /// A number in all lanes.
    fn lanes<S: Simd>(simd: S, x: Self) -> Self::Lanes<S>;
    /// `x y + sum`, rounded once.
    fn fused<S: Simd>(
        simd: S,
        x: Self::Lanes<S>,
        y: Self::Lanes<S>,
        sum: Self::Lanes<S>,
    ) -> Self::Lanes<S>;
}

impl Real for f32 {
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "rounding is what is asked for")]
    fn of(x: f64) -> Self {
        x as f32
    }

    #[inline]
    fn double(self) -> f64 {
        self.into()
    }

    #[inline]
    fn exponential(self) -> Self {
        exp(self)
    }

    #[inline]
    fn hyperbolic_tangent(self) -> Self {
        tanh(self)
    }

    fn product(out: MatMut<'_, Self>, add: bool, a: MatRef<'_, Self>, b: MatRef<'_, Self>) {
        matmul(out, if add { Accum::Add } else { Accum::Replace }, a, b, 1.0, Par::Seq);
    }

    type Lanes<S: Simd> = S::f32s;

    #[inline(always)]
    fn lanes<S: Simd>(simd: S, x: Self) -> Self::Lanes<S> {
        simd.splat_f32s(x)
    }

    #[inline(always)]
    fn fused<S: Simd>(
        simd: S,
        x: Self::Lanes<S>,
        y: Self::Lanes<S>,
        sum: Self::Lanes<S>,
    ) -> Self::Lanes<S> {
        simd.mul_add_f32s(x, y, sum)
    }
}

impl Real for f64 {
    #[inline]
    fn of(x: f64) -> Self {
        x
    }

    #[inline]
    fn double(self) -> f64 {
        self
    }

    #[inline]
    fn exponential(self) -> Self {
        self.exp()
    }

    #[inline]
    fn hyperbolic_tangent(self) -> Self {
        self.tanh()
    }

    fn product(out: MatMut<'_, Self>, add: bool, a: MatRef<'_, Self>, b: MatRef<'_, Self>) {
        matmul(out, if add { Accum::Add } else { Accum::Replace }, a, b, 1.0, Par::Seq);
    }

    type Lanes<S: Simd> = S::f64s;

    #[inline(always)]
    fn lanes<S: Simd>(simd: S, x: Self) -> Self::Lanes<S> {
        simd.splat_f64s(x)
    }

    #[inline(always)]
    fn fused<S: Simd>(
        simd: S,
        x: Self::Lanes<S>,
        y: Self::Lanes<S>,
        sum: Self::Lanes<S>,
    ) -> Self::Lanes<S> {
        simd.mul_add_f64s(x, y, sum)
    }
}

/// Runs a loop in the widest vector registers that the processor has. Lanes are computed as
/// numbers are, so that its width changes no bit.
#[inline]
pub(super) fn wide<R>(run: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(run)
}

/// `1 / (1 + e^-x)`.
#[inline(always)]
pub(super) fn sigmoid<F: Real>(x: F) -> F {
    F::one() / (F::one() + (-x).exponential())
}

/// `ln(1 + e^x)`, without overflow.
#[inline(always)]
pub(super) fn softplus<F: Real>(x: F) -> F {
    x.max(F::zero()) + (-x.abs()).exponential().ln_1p()
}

/// `tanh` as an odd rational function: it runs in vector registers, and on every platform
/// by the same multiplications and additions, unlike the system's.
#[inline]
#[expect(clippy::excessive_precision, reason = "the coefficients as fitted")]
fn tanh(x: f32) -> f32 {
    const P: [f32; 7] = [
        -2.760_768_5e-16,
        2.000_187_9e-13,
        -8.604_671_5e-11,
        5.122_297_1e-8,
        1.485_722_36e-5,
        6.372_619_3e-4,
        4.893_524_6e-3,
    ];
    const Q: [f32; 4] = [1.198_258_4e-6, 1.185_347_06e-4, 2.268_434_6e-3, 4.893_525_2e-3];
    // Beyond this the quotient is 1 to single precision; the polynomials go on growing.
    let x = x.clamp(-7.998_812, 7.998_812);
    let square = x * x;
    x * polynomial(&P, square) / polynomial(&Q, square)
}

/// `e^x = 2^n e^r` with `|r| ≤ ln 2 / 2`, likewise; 0 below the smallest normal number.
#[inline]
#[expect(clippy::excessive_precision, reason = "the coefficients as fitted")]
fn exp(x: f32) -> f32 {
    const P: [f32; 6] = [
        1.987_569_2e-4,
        1.398_200_0e-3,
        8.333_452e-3,
        4.166_579_6e-2,
        1.666_666_5e-1,
        5.000_000_1e-1,
    ];
    // ln 2 in two parts, so that n ln 2 is exact to more digits than a number has.
    const LN_2: [f32; 2] = [0.693_359_375, -2.121_944_4e-4];
    // Adding and taking this away rounds to the nearest whole number.
    const ROUND: f32 = 12_582_912.0;
    let inside = x.clamp(-87.336_54, 88.722_83);
    let shifted = inside * std::f32::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = inside - n * LN_2[0] - n * LN_2[1];
    let fraction = polynomial(&P, r) * r * r + r + 1.0;
    // 2^128 is no number, and 2^-127 not a normal one.
    let (bias, rest) = if n > 0.0 { (126, 2.0) } else { (127, 1.0) };
    let power = f32::from_bits((shifted.to_bits() << 23).wrapping_add(bias << 23));
    let value = fraction * power * rest;
    if x < -87.336_54 {
        0.0
    } else if x > 88.722_83 {
        f32::INFINITY
    } else {
        value
    }
}

#[inline]
fn polynomial(coefficients: &[f32], x: f32) -> f32 {
    coefficients.iter().fold(0.0, |sum, c| sum * x + c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tanh_and_exp_agree_with_double_precision() {
        for i in -40_000_i32..=40_000 {
            let x = f32::of(f64::from(i) / 455.0);
            let (exact, ours) = (x.double().exp(), exp(x).double());
            if (-87.3..88.7).contains(&x) {
                assert!((ours - exact).abs() <= 2e-7 * exact, "exp({x}) = {ours}, not {exact}");
            }
            let (exact, ours) = (x.double().tanh(), tanh(x).double());
            assert!((ours - exact).abs() <= 4e-7 * exact.abs() && ours.abs() <= 1.0, "tanh({x})");
        }
        assert!(tanh(f32::NAN).is_nan() && exp(f32::NAN).is_nan());
        assert_eq!([-200.0, f32::NEG_INFINITY, 0.0].map(exp), [0.0, 0.0, 1.0]);
        assert_eq!([89.0, f32::INFINITY].map(exp), [f32::INFINITY; 2]);
    }
}
