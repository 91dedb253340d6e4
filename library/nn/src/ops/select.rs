//! Parameters as values, and parts of items that others choose or weigh.

use crate::graph::{Graph, Shape, Var};
use crate::ops::elementwise::store;
use crate::ops::rows::place;
use crate::params::ParamId;
use crate::real::Real;

impl<F: Real> Graph<F> {
    /// A parameter as a value: one item of all its numbers.
    pub fn parameter(&self, id: ParamId) -> Var {
        let n = self.params().value(id).len();
        self.op(
            Shape::vectors(1, n),
            &[],
            &[id],
            |arena, out| out.copy_from_slice(arena.params.value(id)),
            move |arena, _, grad| arena.learn(id, |_, out, add| store(grad, add, out)),
        )
    }

    /// Of each item, which has `width` numbers for each of some choices, those of the choice at its index, counted from
    /// 0: as features of the action taken.
    ///
    /// # Panics
    /// If there is not one index an item, or an item has no such choice.
    pub fn gather(&self, x: Var, index: Var, width: usize) -> Var {
        let shape = self.shape(x);
        let (n, whole) = (shape.n, shape.width());
        assert_eq!(self.shape(index).len(), n, "one index an item");
        self.op(
            Shape::vectors(n, width),
            &[x],
            &[],
            |arena, out| {
                let rows = arena.value(x).chunks_exact(whole).zip(arena.value(index));
                for (out, (row, &i)) in out.chunks_exact_mut(width).zip(rows) {
                    out.copy_from_slice(&row[place(i) * width..][..width]);
                }
            },
            move |arena, _, grad| {
                arena.pass(x, |arena, out, add| {
                    if !add {
                        out.fill(F::zero());
                    }
                    let rows = out.chunks_exact_mut(whole).zip(arena.value(index));
                    for ((row, &i), grad) in rows.zip(grad.chunks_exact(width)) {
                        store(grad, true, &mut row[place(i) * width..][..width]);
                    }
                });
            },
        )
    }

    /// The items at these places, one after the other; one may be there twice.
    ///
    /// # Panics
    /// If there is no such item.
    pub fn items(&self, x: Var, places: &[usize]) -> Var {
        let shape = self.shape(x);
        let width = shape.width();
        let kept = places.to_vec();
        self.op(
            Shape { n: places.len(), ..shape },
            &[x],
            &[],
            |arena, out| {
                for (out, i) in out.chunks_exact_mut(width).zip(places) {
                    out.copy_from_slice(&arena.value(x)[i * width..][..width]);
                }
            },
            move |arena, _, grad| {
                arena.pass(x, |_, out, add| {
                    if !add {
                        out.fill(F::zero());
                    }
                    for (grad, i) in grad.chunks_exact(width).zip(&kept) {
                        store(grad, true, &mut out[i * width..][..width]);
                    }
                });
            },
        )
    }

    /// `Ψ w`: of each item, which has a vector for each of some choices, the product of each vector with `w`, as
    /// successor features with preferences (Eqn. 4.12). `w` is one vector for all, or one an item.
    ///
    /// # Panics
    /// If the vectors are not as long as `w`.
    pub fn contract(&self, x: Var, w: Var) -> Var {
        let (shape, of) = (self.shape(x), self.shape(w));
        let (whole, width) = (shape.width(), of.width());
        assert!(whole.is_multiple_of(width), "vectors as long as the weights");
        assert!(of.n == 1 || of.n == shape.n, "one vector for all, or one an item");
        // Where the weights of an item lie.
        let step = if of.n == 1 { 0 } else { width };
        let choices = whole / width;
        self.op(
            Shape::vectors(shape.n, choices),
            &[x, w],
            &[],
            |arena, out| {
                let (xs, ws) = (arena.value(x), arena.value(w));
                for (i, out) in out.iter_mut().enumerate() {
                    let w = &ws[i / choices * step..][..width];
                    *out = xs[i * width..][..width].iter().zip(w).map(|(&x, &w)| x * w).sum();
                }
            },
            move |arena, _, grad| {
                arena.pass(x, |arena, out, add| {
                    let ws = arena.value(w);
                    for (i, (out, &g)) in out.chunks_exact_mut(width).zip(grad.iter()).enumerate() {
                        let w = &ws[i / choices * step..][..width];
                        for (out, &w) in out.iter_mut().zip(w) {
                            *out = if add { *out + g * w } else { g * w };
                        }
                    }
                });
                arena.pass(w, |arena, out, add| {
                    if !add {
                        out.fill(F::zero());
                    }
                    let xs = arena.value(x).chunks_exact(width).zip(grad.iter());
                    for (i, (x, &g)) in xs.enumerate() {
                        let out = &mut out[i / choices * step..][..width];
                        out.iter_mut().zip(x).for_each(|(out, &x)| *out += g * x);
                    }
                });
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::Params;

    /// Two items with two choices of three numbers, and weights: by hand, and by differences.
    #[test]
    fn what_is_chosen_and_weighed_has_the_gradients_of_differences() {
        let xs: Vec<f64> = (0..12_u8).map(|i| (f64::from(i) * 1.7).sin()).collect();
        let w = [0.5, -1.0, 2.0, 0.25, 1.5, -0.75];
        for n in [1, 2] {
            let w = &w[..3 * n];
            let run = |xs: &[f64], w: &[f64]| {
                let mut params = Params::default();
                let id = params.add("w".into(), vec![n, 3], w.to_vec());
                let graph = Graph::new(params);
                let x = graph.variable(Shape::vectors(2, 6), xs);
                let weights = graph.reshape(graph.parameter(id), Shape::vectors(n, 3));
                let q = graph.contract(x, weights);
                let index = graph.input(Shape::vectors(2, 1), &[1.0, 0.0]);
                let twice = graph.items(graph.gather(x, index, 3), &[1, 0, 1]);
                let loss = graph.add(graph.sum(graph.square(q)), graph.sum(graph.square(twice)));
                graph.backward(loss);
                let grad = graph.params().grad(id).unwrap().to_vec();
                (graph.scalar(loss), graph.grad(x), grad, graph.value(q), graph.value(twice))
            };
            let (_, by_x, by_w, q, twice) = run(&xs, w);
            let dot = |at: usize, w: &[f64]| (0..3).map(|i| xs[at + i] * w[i]).sum::<f64>();
            let second = &w[3 * (n - 1)..];
            assert_eq!(q, [dot(0, w), dot(3, w), dot(6, second), dot(9, second)]);
            assert_eq!(twice[..6], [&xs[6..9], &xs[3..6]].concat());
            let h = 1e-6;
            let slope = |of: &dyn Fn(f64) -> f64| (of(h) - of(-h)) / (2.0 * h);
            for i in 0..12 {
                let moved = |h: f64| {
                    let mut xs = xs.clone();
                    xs[i] += h;
                    run(&xs, w).0
                };
                assert!((slope(&moved) - by_x[i]).abs() < 1e-7, "by x {i}");
            }
            for i in 0..3 * n {
                let moved = |h: f64| {
                    let mut w = w.to_vec();
                    w[i] += h;
                    run(&xs, &w).0
                };
                assert!((slope(&moved) - by_w[i]).abs() < 1e-7, "by w {i}");
            }
        }
    }
}
