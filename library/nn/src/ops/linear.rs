//! A linear map, its bias and what follows.

use crate::curve::Curve;
use crate::graph::{Graph, Shape, Var};
use crate::matmul::{Matrix, multiply};
use crate::params::ParamId;
use crate::real::{Real, wide};

impl<F: Real> Graph<F> {
    /// `ν(x W + b)` of each item `x`, as vectors.
    ///
    /// - `weight`: `[n_in, n_out]`.
    /// - `bias`: `[n_out]`.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn linear(&self, x: Var, weight: ParamId, bias: ParamId, curve: Curve) -> Var {
        if curve == Curve::Silu {
            return self.silu(self.linear(x, weight, bias, Curve::Identity));
        }
        let shape = self.shape(x);
        let (n, n_in) = (shape.n, shape.width());
        let n_out = self.params().value(bias).len();
        self.op(
            Shape::vectors(n, n_out),
            &[x],
            &[weight, bias],
            |arena, out| {
                let bias = arena.params.value(bias);
                for row in out.chunks_exact_mut(n_out) {
                    row.copy_from_slice(bias);
                }
                let weight = Matrix::new(arena.params.value(weight), n_in, n_out);
                multiply(Matrix::new(arena.value(x), n, n_in), weight, true, out);
                curve.apply(out);
            },
            move |arena, y, grad| {
                curve.backward(y, grad);
                arena.learn(bias, |_, sums, add| {
                    wide(
                        #[inline(always)]
                        || sum_rows(grad, add, sums),
                    );
                });
                let rows = Matrix::new(grad, n, n_out);
                arena.learn(weight, |arena, out, add| {
                    multiply(Matrix::new(arena.value(x), n, n_in).transposed(), rows, add, out);
                });
                arena.pass(x, |arena, out, add| {
                    let weight = Matrix::new(arena.params.value(weight), n_in, n_out);
                    multiply(rows, weight.transposed(), add, out);
                });
            },
        )
    }
}

/// The sums over the rows of a matrix, in their place or added.
#[inline(always)]
pub(super) fn sum_rows<F: Real>(rows: &[F], add: bool, sums: &mut [F]) {
    if !add {
        sums.fill(F::zero());
    }
    for row in rows.chunks_exact(sums.len()) {
        sums.iter_mut().zip(row).for_each(|(sum, &x)| *sum += x);
    }
}
