//! Functions of one value and of two, number by number.

use statrs::function::erf::erf;

use crate::curve::Curve;
use crate::graph::{Graph, Shape, Var};
use crate::real::{Real, sigmoid, wide};

impl<F: Real> Graph<F> {
    /// `f(x)` of each number; `slope(x, f(x))` is its derivative.
    pub fn map(&self, x: Var, f: impl Fn(F) -> F, slope: impl Fn(F, F) -> F + 'static) -> Var {
        self.op(
            self.shape(x),
            &[x],
            &[],
            |arena, out| {
                wide(
                    #[inline(always)]
                    || out.iter_mut().zip(arena.value(x)).for_each(|(y, &x)| *y = f(x)),
                );
            },
            move |arena, y, grad| {
                arena.pass(x, |arena, out, add| {
                    let values = arena.value(x).iter().zip(y).zip(grad.iter());
                    wide(
                        #[inline(always)]
                        || {
                            for (out, ((&x, &y), &g)) in out.iter_mut().zip(values) {
                                let new = slope(x, y) * g;
                                *out = if add { *out + new } else { new };
                            }
                        },
                    );
                });
            },
        )
    }

    /// `f(a, b)` of each pair of numbers; `slopes(a, b)` are its derivatives by both.
    ///
    /// `b` has the shape of `a`, one number an item, one item for all, or one number for all.
    ///
    /// # Panics
    /// If it has another shape.
    pub fn zip(
        &self,
        a: Var,
        b: Var,
        f: impl Fn(F, F) -> F,
        slopes: impl Fn(F, F) -> (F, F) + 'static,
    ) -> Var {
        let (shape, other) = (self.shape(a), self.shape(b));
        let spread = Spread::of(shape, other);
        self.op(
            shape,
            &[a, b],
            &[],
            |arena, out| {
                let (a, b) = (arena.value(a), arena.value(b));
                match spread {
                    Spread::Same => wide(
                        #[inline(always)]
                        || {
                            for (y, (&a, &b)) in out.iter_mut().zip(a.iter().zip(b)) {
                                *y = f(a, b);
                            }
                        },
                    ),
                    _ => {
                        out.iter_mut().enumerate().for_each(|(i, y)| *y = f(a[i], b[spread.at(i)]));
                    }
                }
            },
            move |arena, _, grad| {
                arena.pass(a, |arena, out, add| {
                    let (a, b) = (arena.value(a), arena.value(b));
                    for (i, (out, &g)) in out.iter_mut().zip(grad.iter()).enumerate() {
                        let new = slopes(a[i], b[spread.at(i)]).0 * g;
                        *out = if add { *out + new } else { new };
                    }
                });
                arena.pass(b, |arena, out, add| {
                    let (a, b) = (arena.value(a), arena.value(b));
                    if !add {
                        out.fill(F::zero());
                    }
                    for (i, &g) in grad.iter().enumerate() {
                        out[spread.at(i)] += slopes(a[i], b[spread.at(i)]).1 * g;
                    }
                });
            },
        )
    }

    /// An activation of each number.
    pub fn curve(&self, x: Var, curve: Curve) -> Var {
        if curve == Curve::Silu {
            return self.silu(x);
        }
        self.op(
            self.shape(x),
            &[x],
            &[],
            |arena, out| {
                out.copy_from_slice(arena.value(x));
                curve.apply(out);
            },
            move |arena, y, grad| {
                curve.backward(y, grad);
                arena.pass(x, |_, out, add| store(grad, add, out));
            },
        )
    }

    /// The sigmoid linear unit, `x / (1 + e^-x)`.
    pub fn silu(&self, x: Var) -> Var {
        self.map(
            x,
            |x| x * sigmoid(x),
            |x, y| {
                let s = sigmoid(x);
                s + y * (F::one() - s)
            },
        )
    }

    /// The Gaussian error linear unit, `x Φ(x)` with the normal distribution function `Φ`.
    pub fn gelu(&self, x: Var) -> Var {
        let phi = |x: F| 0.5 * (1.0 + erf(x.double() / std::f64::consts::SQRT_2));
        self.map(
            x,
            |x| x * F::of(phi(x)),
            move |x, _| {
                let density =
                    (-0.5 * x.double().powi(2)).exp() / (2.0 * std::f64::consts::PI).sqrt();
                F::of(phi(x) + x.double() * density)
            },
        )
    }

    /// `x` where `keep` is 1, times `1 / (1 - rate)`, and 0 where it is 0 (Srivastava et al.,
    /// 2014). With the mask drawn anew for each prediction too, a sample of the posterior (Gal and
    /// Ghahramani, 2016).
    pub fn dropout(&self, x: Var, keep: Var, rate: f64) -> Var {
        let scale = F::of(1.0 / (1.0 - rate));
        let keep = self.still(|| self.map(keep, |k| k * scale, move |_, _| scale));
        self.mul(x, keep)
    }

    /// `a + b`; shapes as for [`Graph::zip`].
    pub fn add(&self, a: Var, b: Var) -> Var {
        self.zip(a, b, |a, b| a + b, |_, _| (F::one(), F::one()))
    }

    /// `a - b`; shapes as for [`Graph::zip`].
    pub fn sub(&self, a: Var, b: Var) -> Var {
        self.zip(a, b, |a, b| a - b, |_, _| (F::one(), -F::one()))
    }

    /// `a b`; shapes as for [`Graph::zip`].
    pub fn mul(&self, a: Var, b: Var) -> Var {
        self.zip(a, b, |a, b| a * b, |a, b| (b, a))
    }

    /// `scale x + shift`.
    pub fn affine(&self, x: Var, scale: f64, shift: f64) -> Var {
        let (scale, shift) = (F::of(scale), F::of(shift));
        self.map(x, |x| scale * x + shift, move |_, _| scale)
    }

    /// `e^x`.
    pub fn exp(&self, x: Var) -> Var {
        self.map(x, F::exponential, |_, y| y)
    }

    /// `x²`.
    pub fn square(&self, x: Var) -> Var {
        self.map(x, |x| x * x, |x, _| F::of(2.0) * x)
    }
}

/// Replaces numbers by others, or adds these.
#[inline]
pub(super) fn store<F: Real>(from: &[F], add: bool, to: &mut [F]) {
    if add {
        wide(
            #[inline(always)]
            || to.iter_mut().zip(from).for_each(|(to, &x)| *to += x),
        );
    } else {
        to.copy_from_slice(from);
    }
}

/// Which number of a smaller value belongs to each of a larger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Spread {
    Same,
    /// One number an item of so many.
    Item(usize),
    /// One item, of so many, for all.
    Row(usize),
}

impl Spread {
    fn of(whole: Shape, part: Shape) -> Self {
        if part.len() == whole.len() {
            Self::Same
        } else if part.width() == 1 && part.n == whole.n {
            Self::Item(whole.width())
        } else if part.n == 1 && (part.width() == whole.width() || part.width() == 1) {
            Self::Row(part.width())
        } else {
            panic!("{part:?} does not spread over {whole:?}")
        }
    }

    #[inline]
    fn at(self, i: usize) -> usize {
        match self {
            Self::Same => i,
            Self::Item(width) => i / width,
            Self::Row(width) => i % width,
        }
    }
}
