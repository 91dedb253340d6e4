//! Operations on the items of a batch as rows of numbers.

use crate::graph::{Graph, Shape, Var};
use crate::ops::elementwise::store;
use crate::real::{Real, wide};

impl<F: Real> Graph<F> {
    /// The sum of all numbers.
    pub fn sum(&self, x: Var) -> Var {
        self.total(x, F::one())
    }

    /// The mean of all numbers.
    #[expect(clippy::cast_precision_loss, reason = "values have far fewer than 2^53 numbers")]
    pub fn mean(&self, x: Var) -> Var {
        self.total(x, F::of(1.0 / self.shape(x).len() as f64))
    }

    fn total(&self, x: Var, scale: F) -> Var {
        self.op(
            Shape::vectors(1, 1),
            &[x],
            &[],
            |arena, out| out[0] = scale * arena.value(x).iter().copied().sum::<F>(),
            move |arena, _, grad| {
                let slope = scale * grad[0];
                arena.pass(x, |_, out, add| {
                    for g in out {
                        *g = if add { *g + slope } else { slope };
                    }
                });
            },
        )
    }

    /// The length of each item as a vector, `√(Σ x²)`: one number an item. Its slope where it is 0 is 0.
    pub fn lengths(&self, x: Var) -> Var {
        let half = F::of(0.5);
        let slope = move |_, y: F| if y > F::zero() { half / y } else { F::zero() };
        self.map(self.sum_items(self.square(x)), F::sqrt, slope)
    }

    /// The sum of each item's numbers: one number an item.
    pub fn sum_items(&self, x: Var) -> Var {
        let shape = self.shape(x);
        let width = shape.width();
        self.op(
            Shape::vectors(shape.n, 1),
            &[x],
            &[],
            |arena, out| {
                for (sum, row) in out.iter_mut().zip(arena.value(x).chunks_exact(width)) {
                    *sum = row.iter().copied().sum();
                }
            },
            move |arena, _, grad| {
                arena.pass(x, |_, out, add| {
                    for (row, &g) in out.chunks_exact_mut(width).zip(grad.iter()) {
                        for x in row {
                            *x = if add { *x + g } else { g };
                        }
                    }
                });
            },
        )
    }

    /// The logarithm of each item's softmax, `x - ln Σ e^x`, without overflow.
    pub fn log_softmax(&self, x: Var) -> Var {
        let shape = self.shape(x);
        let width = shape.width();
        // Exponentials are taken of all items at once, since rows are often short.
        let exponentials = self.keep(shape.len(), |_, _| {});
        self.op_with(
            exponentials,
            shape,
            &[x],
            &[],
            |arena, exps, out| {
                let rows = || arena.value(x).chunks_exact(width);
                for (exps, row) in exps.chunks_exact_mut(width).zip(rows()) {
                    let max = maximum(row);
                    exps.iter_mut().zip(row).for_each(|(y, &x)| *y = x - max);
                }
                exponentiate(exps);
                let exps = exps.chunks_exact(width);
                for (out, (row, exps)) in out.chunks_exact_mut(width).zip(rows().zip(exps)) {
                    let max = maximum(row);
                    let log_sum = if max.is_infinite() {
                        max
                    } else {
                        max + exps.iter().copied().sum::<F>().ln()
                    };
                    out.iter_mut().zip(row).for_each(|(y, &x)| *y = x - log_sum);
                }
            },
            move |arena, exps, y, grad| {
                exps.copy_from_slice(y);
                exponentiate(exps);
                let exps = exps.chunks_exact(width);
                for (exps, grad) in exps.zip(grad.chunks_exact_mut(width)) {
                    let sum: F = grad.iter().copied().sum();
                    grad.iter_mut().zip(exps).for_each(|(g, &p)| *g -= p * sum);
                }
                arena.pass(x, |_, out, add| store(grad, add, out));
            },
        )
    }

    /// Of each item the number at its index, counted from 0: one number an item.
    ///
    /// # Panics
    /// If there is not one index an item, or an item has no such place.
    pub fn pick(&self, x: Var, index: Var) -> Var {
        let shape = self.shape(x);
        let (n, width) = (shape.n, shape.width());
        assert_eq!(self.shape(index).len(), n, "one index an item");
        self.op(
            Shape::vectors(n, 1),
            &[x],
            &[],
            |arena, out| {
                let rows = arena.value(x).chunks_exact(width);
                for ((y, row), &i) in out.iter_mut().zip(rows).zip(arena.value(index)) {
                    *y = row[place(i)];
                }
            },
            move |arena, _, grad| {
                arena.pass(x, |arena, out, add| {
                    if !add {
                        out.fill(F::zero());
                    }
                    let rows = out.chunks_exact_mut(width);
                    for ((row, &i), &g) in rows.zip(arena.value(index)).zip(grad.iter()) {
                        row[place(i)] += g;
                    }
                });
            },
        )
    }

    /// The largest number of each item: one number an item. Its gradient goes to the first
    /// of equals.
    ///
    /// # Panics
    /// If an item has more than 2^32 numbers.
    pub fn max_items(&self, x: Var) -> Var {
        self.pick(x, self.argmax_items(x))
    }

    /// The place of the largest number of each item, the first of equals; it has no gradient.
    ///
    /// # Panics
    /// If an item has more than 2^32 numbers.
    pub fn argmax_items(&self, x: Var) -> Var {
        let Shape { n, .. } = self.shape(x);
        let width = self.shape(x).width();
        self.keep(n, |arena, out| {
            for (index, row) in out.iter_mut().zip(arena.value(x).chunks_exact(width)) {
                let first = row
                    .iter()
                    .enumerate()
                    .fold(0, |best, (i, x)| if *x > row[best] { i } else { best });
                *index = F::of(f64::from(u32::try_from(first).expect("items are short")));
            }
        })
    }

    /// The numbers of several values side by side, item by item, as vectors.
    ///
    /// # Panics
    /// If they have different numbers of items, or there are none.
    pub fn concat(&self, parts: &[Var]) -> Var {
        let n = self.shape(parts[0]).n;
        let mut width = 0;
        let places: Vec<(Var, usize, usize)> = parts
            .iter()
            .map(|part| {
                let (shape, from) = (self.shape(*part), width);
                assert_eq!(shape.n, n, "as many items in each part");
                width += shape.width();
                (*part, from, width)
            })
            .collect();
        let kept = places.clone();
        self.op(
            Shape::vectors(n, width),
            parts,
            &[],
            |arena, out| {
                for (part, from, to) in places {
                    let rows = arena.value(part).chunks_exact(to - from);
                    for (out, row) in out.chunks_exact_mut(width).zip(rows) {
                        out[from..to].copy_from_slice(row);
                    }
                }
            },
            move |arena, _, grad| {
                for (part, from, to) in kept {
                    arena.pass(part, |_, out, add| {
                        let rows = grad.chunks_exact(width);
                        for (out, row) in out.chunks_exact_mut(to - from).zip(rows) {
                            store(&row[from..to], add, out);
                        }
                    });
                }
            },
        )
    }

    /// The numbers from `from` on of each item, `len` of them, as vectors.
    ///
    /// # Panics
    /// If an item has not as many.
    pub fn columns(&self, x: Var, from: usize, len: usize) -> Var {
        let shape = self.shape(x);
        let width = shape.width();
        self.op(
            Shape::vectors(shape.n, len),
            &[x],
            &[],
            |arena, out| {
                let rows = arena.value(x).chunks_exact(width);
                for (out, row) in out.chunks_exact_mut(len).zip(rows) {
                    out.copy_from_slice(&row[from..from + len]);
                }
            },
            move |arena, _, grad| {
                arena.pass(x, |_, out, add| {
                    if !add {
                        out.fill(F::zero());
                    }
                    for (out, row) in out.chunks_exact_mut(width).zip(grad.chunks_exact(len)) {
                        store(row, true, &mut out[from..from + len]);
                    }
                });
            },
        )
    }

    /// The same numbers in another shape.
    ///
    /// # Panics
    /// If it has not as many.
    pub fn reshape(&self, x: Var, shape: Shape) -> Var {
        assert_eq!(shape.len(), self.shape(x).len(), "as many numbers in another shape");
        self.op(
            shape,
            &[x],
            &[],
            |arena, out| out.copy_from_slice(arena.value(x)),
            move |arena, _, grad| arena.pass(x, |_, out, add| store(grad, add, out)),
        )
    }
}

fn maximum<F: Real>(xs: &[F]) -> F {
    xs.iter().copied().fold(F::neg_infinity(), F::max)
}

fn exponentiate<F: Real>(xs: &mut [F]) {
    wide(
        #[inline(always)]
        || xs.iter_mut().for_each(|x| *x = x.exponential()),
    );
}

/// A number that counts places.
pub(super) fn place<F: Real>(x: F) -> usize {
    x.to_usize().expect("an index is a whole number from 0 on")
}
