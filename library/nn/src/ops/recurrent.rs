//! Cells of recurrent networks.

use super::gate::{by_candidate, by_reset, by_state, by_update, candidates, mix, sigmoids};
use super::linear::sum_rows;
use crate::curve::Curve;
use crate::graph::{Graph, Shape, Var};
use crate::matmul::{Matrix, multiply};
use crate::params::ParamId;
use crate::real::{Real, wide};

/// The parameters of a cell of `H` units with `I` inputs and `G` gates.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// `[I, G H]`.
    pub input_weight: ParamId,
    /// `[G H]`.
    pub input_bias: ParamId,
    /// `[H, G H]`.
    pub state_weight: ParamId,
    /// `[G H]`.
    pub state_bias: ParamId,
}

impl<F: Real> Graph<F> {
    /// One step of a gated recurrent unit (Cho et al., 2014), as `PyTorch` computes it: the gates are
    /// `r`, `z` and `n`.
    ///
    /// ```text
    /// r = σ(x W_r + h U_r),  z = σ(x W_z + h U_z),  n = tanh(x W_n + r ⊙ (h U_n))
    /// h' = (1 - z) ⊙ n + z ⊙ h
    /// ```
    ///
    /// where every product has its bias.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn gru(&self, x: Var, h: Var, cell: &Cell) -> Var {
        let (items, units) = (self.shape(h).n, self.shape(h).width());
        let of_x = self.linear(x, cell.input_weight, cell.input_bias, Curve::Identity);
        let of_h = self.linear(h, cell.state_weight, cell.state_bias, Curve::Identity);
        assert_eq!(self.shape(of_x).width(), 3 * units, "three gates");
        // r, z and n of each item.
        let gates = self.keep(items * 3 * units, |arena, gates| {
            let rows = arena.value(of_x).chunks_exact(3 * units);
            let rows = rows.zip(arena.value(of_h).chunks_exact(3 * units));
            wide(
                #[inline(always)]
                || {
                    for (gates, (a, b)) in gates.chunks_exact_mut(3 * units).zip(rows) {
                        let (open, new) = gates.split_at_mut(2 * units);
                        sigmoids(&a[..2 * units], &b[..2 * units], open);
                        candidates(&a[2 * units..], &b[2 * units..], &open[..units], new);
                    }
                },
            );
        });
        self.op(
            Shape::vectors(items, units),
            &[of_x, of_h, h],
            &[],
            |arena, out| {
                let gates = arena.value(gates).chunks_exact(3 * units);
                let rows = gates.zip(arena.value(h).chunks_exact(units));
                wide(
                    #[inline(always)]
                    || {
                        for (out, (gates, h)) in out.chunks_exact_mut(units).zip(rows) {
                            let (z, new) = gates[units..].split_at(units);
                            mix(z, new, h, out);
                        }
                    },
                );
            },
            move |arena, _, grad| {
                for (before, by_state) in [(of_x, false), (of_h, true)] {
                    arena.pass(before, |arena, out, add| {
                        let gates = arena.value(gates).chunks_exact(3 * units);
                        let rows = gates.zip(arena.value(of_h).chunks_exact(3 * units));
                        let rows = rows.zip(arena.value(h).chunks_exact(units));
                        let rows = rows.zip(grad.chunks_exact(units));
                        wide(
                            #[inline(always)]
                            || {
                                for (out, (((gates, of_h), h), grad)) in
                                    out.chunks_exact_mut(3 * units).zip(rows)
                                {
                                    let (r, rest) = gates.split_at(units);
                                    let (z, new) = rest.split_at(units);
                                    let (out_r, rest) = out.split_at_mut(units);
                                    let (out_z, out_n) = rest.split_at_mut(units);
                                    by_reset((grad, z, new), &of_h[2 * units..], r, add, out_r);
                                    by_update(grad, (z, new), h, add, out_z);
                                    by_candidate((grad, z, new), r, by_state, add, out_n);
                                }
                            },
                        );
                    });
                }
                arena.pass(h, |arena, out, add| {
                    let rows = arena.value(gates).chunks_exact(3 * units);
                    let rows = rows.zip(grad.chunks_exact(units));
                    wide(
                        #[inline(always)]
                        || {
                            for (out, (gates, grad)) in out.chunks_exact_mut(units).zip(rows) {
                                by_state(grad, &gates[units..2 * units], add, out);
                            }
                        },
                    );
                });
            },
        )
    }

    /// One step of long short-term memory (Hochreiter and Schmidhuber, 1997), as `PyTorch` computes
    /// it: the gates are `i`, `f`, `g` and `o`. Returns the output and the cell.
    ///
    /// ```text
    /// i, f, o = σ(x W + h U),  g = tanh(x W_g + h U_g)
    /// c' = f ⊙ c + i ⊙ g,  h' = o ⊙ tanh(c')
    /// ```
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn lstm(&self, x: Var, (h, c): (Var, Var), cell: &Cell) -> (Var, Var) {
        let shape = self.shape(c);
        let (n, units) = (shape.n, shape.width());
        let gates = self.gates(x, h, cell);
        assert_eq!(self.shape(gates).width(), 4 * units, "four gates");
        // σ of i, f and o, and tanh of g, in one value.
        let open = self.op(
            self.shape(gates),
            &[gates],
            &[],
            |arena, out| {
                out.copy_from_slice(arena.value(gates));
                for row in out.chunks_exact_mut(4 * units) {
                    Curve::Sigmoid.apply(&mut row[..2 * units]);
                    Curve::Tanh.apply(&mut row[2 * units..3 * units]);
                    Curve::Sigmoid.apply(&mut row[3 * units..]);
                }
            },
            move |arena, y, grad| {
                for (y, grad) in y.chunks_exact(4 * units).zip(grad.chunks_exact_mut(4 * units)) {
                    for (curve, places) in [
                        (Curve::Sigmoid, 0..2 * units),
                        (Curve::Tanh, 2 * units..3 * units),
                        (Curve::Sigmoid, 3 * units..4 * units),
                    ] {
                        curve.backward(&y[places.clone()], &mut grad[places]);
                    }
                }
                arena.pass(gates, |_, out, add| super::elementwise::store(grad, add, out));
            },
        );
        let next = self.op(
            Shape::vectors(n, units),
            &[open, c],
            &[],
            |arena, out| {
                let rows = arena.value(open).chunks_exact(4 * units);
                let rows = rows.zip(arena.value(c).chunks_exact(units));
                for (out, (gates, c)) in out.chunks_exact_mut(units).zip(rows) {
                    for j in 0..units {
                        out[j] = gates[units + j] * c[j] + gates[j] * gates[2 * units + j];
                    }
                }
            },
            move |arena, _, grad| {
                arena.pass(open, |arena, out, add| {
                    if !add {
                        out.fill(F::zero());
                    }
                    let rows = arena.value(open).chunks_exact(4 * units);
                    let rows = rows.zip(arena.value(c).chunks_exact(units));
                    let rows = rows.zip(grad.chunks_exact(units));
                    for (out, ((gates, c), grad)) in out.chunks_exact_mut(4 * units).zip(rows) {
                        for j in 0..units {
                            out[j] += grad[j] * gates[2 * units + j];
                            out[units + j] += grad[j] * c[j];
                            out[2 * units + j] += grad[j] * gates[j];
                        }
                    }
                });
                arena.pass(c, |arena, out, add| {
                    let rows = arena.value(open).chunks_exact(4 * units);
                    let rows = rows.zip(grad.chunks_exact(units));
                    for (out, (gates, grad)) in out.chunks_exact_mut(units).zip(rows) {
                        for j in 0..units {
                            let new = grad[j] * gates[units + j];
                            out[j] = if add { out[j] + new } else { new };
                        }
                    }
                });
            },
        );
        let squashed = self.curve(next, Curve::Tanh);
        let output = self.columns(open, 3 * units, units);
        (self.mul(output, squashed), next)
    }

    /// `x W + h U` with both biases.
    fn gates(&self, x: Var, h: Var, cell: &Cell) -> Var {
        let (n, n_in, units) = (self.shape(h).n, self.shape(x).width(), self.shape(h).width());
        let width = self.params().value(cell.input_bias).len();
        let Cell { input_weight, input_bias, state_weight, state_bias } = *cell;
        self.op(
            Shape::vectors(n, width),
            &[x, h],
            &[input_weight, input_bias, state_weight, state_bias],
            |arena, out| {
                let params = &arena.params;
                let biases = params.value(input_bias).iter().zip(params.value(state_bias));
                for row in out.chunks_exact_mut(width) {
                    row.iter_mut().zip(biases.clone()).for_each(|(y, (&a, &b))| *y = a + b);
                }
                for (value, len, weight) in [(x, n_in, input_weight), (h, units, state_weight)] {
                    let weight = Matrix::new(params.value(weight), len, width);
                    multiply(Matrix::new(arena.value(value), n, len), weight, true, out);
                }
            },
            move |arena, _, grad| {
                let rows = Matrix::new(grad, n, width);
                for bias in [input_bias, state_bias] {
                    arena.learn(bias, |_, sums, add| sum_rows(grad, add, sums));
                }
                for (value, len, weight) in [(x, n_in, input_weight), (h, units, state_weight)] {
                    arena.learn(weight, |arena, out, add| {
                        let value = Matrix::new(arena.value(value), n, len);
                        multiply(value.transposed(), rows, add, out);
                    });
                    arena.pass(value, |arena, out, add| {
                        let weight = Matrix::new(arena.params.value(weight), len, width);
                        multiply(rows, weight.transposed(), add, out);
                    });
                }
            },
        )
    }
}
