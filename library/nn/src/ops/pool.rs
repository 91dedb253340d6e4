//! Pooling of images.

use crate::graph::{Graph, Shape, Var};
use crate::ops::conv::Window;
use crate::real::Real;

impl<F: Real> Graph<F> {
    /// The largest number of each window; its gradient goes to the first of equals. Zeros
    /// around the image do not count.
    ///
    /// # Panics
    /// If the window does not fit.
    pub fn max_pool(&self, x: Var, window: Window) -> Var {
        let shape = self.shape(x);
        let [channels, rows, cols] = shape.item;
        let (out_rows, out_cols) = (window.places(rows), window.places(cols));
        assert!(out_rows > 0 && out_cols > 0, "the window fits into the image");
        assert!(2 * window.padding <= window.kernel, "every window meets the image");
        // Where in its image the largest number lies, first row first.
        let largest = move |image: &[F], place: usize| {
            let mut taps = window.taps(place, [rows, cols]);
            let first = taps.next().expect("every window meets the image");
            taps.fold(first, |best, i| if image[i] > image[best] { i } else { best })
        };
        self.op(
            Shape { n: shape.n, item: [channels, out_rows, out_cols] },
            &[x],
            &[],
            |arena, out| {
                let images = arena.value(x).chunks_exact(rows * cols);
                for (image, out) in images.zip(out.chunks_exact_mut(out_rows * out_cols)) {
                    let places = out.iter_mut().enumerate();
                    places.for_each(|(place, y)| *y = image[largest(image, place)]);
                }
            },
            move |arena, _, grad| {
                arena.pass(x, |arena, out, add| {
                    if !add {
                        out.fill(F::zero());
                    }
                    let images = arena.value(x).chunks_exact(rows * cols);
                    let images = images.zip(out.chunks_exact_mut(rows * cols));
                    for ((image, out), grad) in images.zip(grad.chunks_exact(out_rows * out_cols)) {
                        for (place, &g) in grad.iter().enumerate() {
                            out[largest(image, place)] += g;
                        }
                    }
                });
            },
        )
    }

    /// The mean of each window; zeros around the image count.
    ///
    /// # Panics
    /// If the window does not fit.
    pub fn mean_pool(&self, x: Var, window: Window) -> Var {
        let shape = self.shape(x);
        let [channels, rows, cols] = shape.item;
        let (out_rows, out_cols) = (window.places(rows), window.places(cols));
        assert!(out_rows > 0 && out_cols > 0, "the window fits into the image");
        let area = u32::try_from(window.kernel * window.kernel).expect("windows are small");
        let share = F::one() / F::of(f64::from(area));
        let taps = move |place: usize| window.taps(place, [rows, cols]);
        self.op(
            Shape { n: shape.n, item: [channels, out_rows, out_cols] },
            &[x],
            &[],
            |arena, out| {
                let images = arena.value(x).chunks_exact(rows * cols);
                for (image, out) in images.zip(out.chunks_exact_mut(out_rows * out_cols)) {
                    for (place, y) in out.iter_mut().enumerate() {
                        *y = share * taps(place).map(|i| image[i]).sum::<F>();
                    }
                }
            },
            move |arena, _, grad| {
                arena.pass(x, |_, out, add| {
                    if !add {
                        out.fill(F::zero());
                    }
                    let images = out.chunks_exact_mut(rows * cols);
                    for (out, grad) in images.zip(grad.chunks_exact(out_rows * out_cols)) {
                        for (place, &g) in grad.iter().enumerate() {
                            taps(place).for_each(|i| out[i] += share * g);
                        }
                    }
                });
            },
        )
    }

    /// The mean of each channel: one number a channel.
    ///
    /// # Panics
    /// If the image is not square.
    pub fn global_mean_pool(&self, x: Var) -> Var {
        let [_, rows, cols] = self.shape(x).item;
        assert_eq!(rows, cols, "square images");
        self.mean_pool(x, Window { kernel: rows, stride: 1, padding: 0 })
    }
}
