//! Vectors of symbols.

use crate::graph::{Graph, Shape, Var};
use crate::ops::rows::place;
use crate::params::ParamId;
use crate::real::{Real, wide};

impl<F: Real> Graph<F> {
    /// The row of `table` that each item names.
    ///
    /// - `index`: one number an item, counted from 0.
    /// - `table`: `[symbols, width]`.
    ///
    /// # Panics
    /// If an item is no place in the table.
    pub fn embedding(&self, index: Var, table: ParamId) -> Var {
        let n = self.shape(index).len();
        let width = self.params().shape(table)[1];
        let row = move |i: F| place(i) * width;
        self.op(
            Shape::vectors(n, width),
            &[],
            &[table],
            |arena, out| {
                let table = arena.params.value(table);
                for (out, &i) in out.chunks_exact_mut(width).zip(arena.value(index)) {
                    out.copy_from_slice(&table[row(i)..][..width]);
                }
            },
            move |arena, _, grad| {
                arena.learn(table, |arena, out, add| {
                    if !add {
                        out.fill(F::zero());
                    }
                    for (grad, &i) in grad.chunks_exact(width).zip(arena.value(index)) {
                        let out = &mut out[row(i)..][..width];
                        wide(
                            #[inline(always)]
                            || out.iter_mut().zip(grad).for_each(|(sum, &g)| *sum += g),
                        );
                    }
                });
            },
        )
    }
}
