//! Convolutions of images: as products of matrices whose columns are patches.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::curve::Curve;
use crate::graph::{Graph, Shape, Var};
use crate::matmul::{Matrix, multiply};
use crate::params::ParamId;
use crate::real::{Real, wide};

/// How many numbers of columns are kept from the forward to the backward pass: as many as a
/// processor's cache holds.
const KEPT: usize = 1 << 17;

/// How a kernel moves over an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Window {
    /// Rows and columns of the kernel.
    pub kernel: usize,
    /// How far it moves.
    pub stride: usize,
    /// How many rows and columns of zeros surround the image.
    pub padding: usize,
}

impl Window {
    /// How many places it takes along `len` rows or columns; 0 if it does not fit.
    #[must_use]
    pub fn places(&self, len: usize) -> usize {
        match (len + 2 * self.padding).checked_sub(self.kernel) {
            Some(room) => room / self.stride + 1,
            None => 0,
        }
    }

    /// The rows or columns of `len` that lie under the window at a place.
    fn under(&self, place: usize, len: usize) -> Range<usize> {
        let end = place * self.stride + self.kernel;
        (place * self.stride).saturating_sub(self.padding)
            ..end.saturating_sub(self.padding).min(len)
    }

    /// The numbers of an image that lie under the window at a place, first row first; places and
    /// image are counted row after row.
    pub(super) fn taps(
        &self,
        place: usize,
        [rows, cols]: [usize; 2],
    ) -> impl Iterator<Item = usize> + use<> {
        let across = self.places(cols);
        let xs = self.under(place % across, cols);
        self.under(place / across, rows).flat_map(move |y| xs.clone().map(move |x| y * cols + x))
    }

    /// The places at which the tap `k` lies inside: from, to.
    fn inside(&self, k: usize, len: usize, places: usize) -> (usize, usize) {
        let from = self.padding.saturating_sub(k).div_ceil(self.stride);
        let to = (len + self.padding).saturating_sub(k).div_ceil(self.stride).min(places);
        (from.min(to), to)
    }
}

/// The sizes of one convolution, group by group.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    /// Channels, rows and columns of the image.
    image: [usize; 3],
    /// Rows and columns of the places.
    places: [usize; 2],
    window: Window,
}

impl Sizes {
    fn of(image: [usize; 3], window: Window) -> Self {
        let places = [window.places(image[1]), window.places(image[2])];
        assert!(places[0] > 0 && places[1] > 0, "the kernel fits into the image");
        Self { image, places, window }
    }

    fn n_places(&self) -> usize {
        self.places[0] * self.places[1]
    }

    /// Numbers in a patch.
    fn patch(&self) -> usize {
        self.image[0] * self.window.kernel * self.window.kernel
    }

    /// Calls `tap(place, number, rows, len)` for each number of a patch: at which place in the
    /// columns it is first taken from the image, which number of the image that is, for how many
    /// rows of places, and for how many places of each.
    #[inline(always)]
    fn taps(&self, mut tap: impl FnMut(usize, usize, usize, usize)) {
        let Window { kernel, stride, padding } = self.window;
        let ([channels, rows, cols], [out_rows, out_cols]) = (self.image, self.places);
        for ky in 0..kernel {
            let (top, bottom) = self.window.inside(ky, rows, out_rows);
            for kx in 0..kernel {
                let (from, to) = self.window.inside(kx, cols, out_cols);
                if from == to || top == bottom {
                    continue;
                }
                let first = (top * stride + ky - padding) * cols + from * stride + kx - padding;
                for c in 0..channels {
                    let row = (c * kernel + ky) * kernel + kx;
                    let place = row * self.n_places() + top * out_cols + from;
                    tap(place, c * rows * cols + first, bottom - top, to - from);
                }
            }
        }
    }

    /// Patches as columns: `[patch, places]`.
    fn unfold<F: Real>(&self, image: &[F], columns: &mut [F]) {
        if self.window.padding > 0 {
            columns.fill(F::zero());
        }
        let ([_, _, cols], [_, out_cols], stride) = (self.image, self.places, self.window.stride);
        self.taps(|place, from, rows, len| {
            let columns = columns[place..].chunks_mut(out_cols).take(rows);
            for (out, image) in columns.zip(image[from..].chunks(stride * cols)) {
                if stride == 1 {
                    copy(&image[..len], &mut out[..len]);
                } else {
                    let image = image.iter().step_by(stride);
                    out[..len].iter_mut().zip(image).for_each(|(y, &x)| *y = x);
                }
            }
        });
    }

    /// Adds patches to the image that they overlap in.
    fn fold<F: Real>(&self, columns: &[F], image: &mut [F]) {
        let ([_, _, cols], [_, out_cols], stride) = (self.image, self.places, self.window.stride);
        self.taps(|place, to, rows, len| {
            let columns = columns[place..].chunks(out_cols).take(rows);
            for (from, image) in columns.zip(image[to..].chunks_mut(stride * cols)) {
                if stride == 1 {
                    image[..len].iter_mut().zip(&from[..len]).for_each(|(x, &y)| *x += y);
                } else {
                    let image = image.iter_mut().step_by(stride);
                    image.zip(&from[..len]).for_each(|(x, &y)| *x += y);
                }
            }
        });
    }
}

/// Copies numbers, eight at a time: runs are so short that a call of the system's copy takes
/// longer.
#[inline(always)]
fn copy<F: Real>(from: &[F], to: &mut [F]) {
    let (eights, rest) = to.as_chunks_mut::<8>();
    for (to, from) in eights.iter_mut().zip(from.as_chunks().0) {
        *to = *from;
    }
    let done = from.len() - rest.len();
    rest.iter_mut().zip(&from[done..]).for_each(|(to, &x)| *to = x);
}

impl<F: Real> Graph<F> {
    /// The cross-correlation of images with kernels.
    ///
    /// - `weight`: `[channels out, channels in / groups, kernel, kernel]`.
    /// - `bias`: `[channels out]`, where there is one.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn conv2d(
        &self,
        x: Var,
        weight: ParamId,
        bias: Option<ParamId>,
        (window, groups): (Window, usize),
        curve: Curve,
    ) -> Var {
        if curve == Curve::Silu {
            let y = self.conv2d(x, weight, bias, (window, groups), Curve::Identity);
            return self.curve(y, curve);
        }
        let shape = self.shape(x);
        let [channels, rows, cols] = shape.item;
        let n_out = self.params().shape(weight)[0];
        let expected = [n_out, channels / groups, window.kernel, window.kernel];
        assert_eq!(self.params().shape(weight), expected, "the kernel fits the channels");
        assert!(channels.is_multiple_of(groups) && n_out.is_multiple_of(groups), "whole groups");
        let sizes = Sizes::of([channels / groups, rows, cols], window);
        let (places, patch) = (sizes.n_places(), sizes.patch());
        let (group_in, group_out) = (shape.width() / groups, n_out / groups);
        // The columns of all images, for the way back, or of one where they are many.
        let width = patch * places;
        let kept = if shape.n * groups * width <= KEPT { shape.n * groups } else { 1 };
        let scratch = self.keep(kept * width, |_, _| {});
        let out = Shape { n: shape.n, item: [n_out, sizes.places[0], sizes.places[1]] };
        let params = [weight, bias.unwrap_or(weight)];
        self.op_with(
            scratch,
            out,
            &[x],
            &params,
            |arena, columns, out| {
                let (x, kernels) = (arena.value(x), arena.params.value(weight));
                if let Some(bias) = bias {
                    let bias = arena.params.value(bias).iter().cycle();
                    out.chunks_exact_mut(places).zip(bias).for_each(|(y, &b)| y.fill(b));
                }
                for (i, out) in out.chunks_exact_mut(group_out * places).enumerate() {
                    let kernels = &kernels[i % groups * group_out * patch..][..group_out * patch];
                    let image = &x[i * group_in..][..group_in];
                    let columns = &mut columns[i % kept * width..][..width];
                    sizes.unfold(image, columns);
                    multiply(
                        Matrix::new(kernels, group_out, patch),
                        Matrix::new(columns, patch, places),
                        bias.is_some(),
                        out,
                    );
                }
                curve.apply(out);
            },
            move |arena, columns, y, grad| {
                curve.backward(y, grad);
                if let Some(bias) = bias {
                    arena.learn(bias, |_, sums, add| {
                        if !add {
                            sums.fill(F::zero());
                        }
                        for (i, row) in grad.chunks_exact(places).enumerate() {
                            sums[i % n_out] += wide(
                                #[inline(always)]
                                || row.iter().copied().sum::<F>(),
                            );
                        }
                    });
                }
                arena.learn(weight, |arena, out, add| {
                    let x = arena.value(x);
                    for (i, grad) in grad.chunks_exact(group_out * places).enumerate() {
                        let columns = &mut columns[i % kept * width..][..width];
                        if kept == 1 {
                            sizes.unfold(&x[i * group_in..][..group_in], columns);
                        }
                        let out = &mut out[i % groups * group_out * patch..][..group_out * patch];
                        let columns = Matrix::new(columns, patch, places).transposed();
                        let grad = Matrix::new(grad, group_out, places);
                        multiply(grad, columns, add || i >= groups, out);
                    }
                });
                arena.pass(x, |arena, out, add| {
                    if !add {
                        out.fill(F::zero());
                    }
                    let kernels = arena.params.value(weight);
                    let columns = &mut columns[..width];
                    for (i, grad) in grad.chunks_exact(group_out * places).enumerate() {
                        let kernels =
                            &kernels[i % groups * group_out * patch..][..group_out * patch];
                        let kernels = Matrix::new(kernels, group_out, patch).transposed();
                        multiply(kernels, Matrix::new(grad, group_out, places), false, columns);
                        sizes.fold(columns, &mut out[i * group_in..][..group_in]);
                    }
                });
            },
        )
    }

    /// The transpose of a convolution: what [`Graph::conv2d`] passes back, forward.
    ///
    /// - `weight`: `[channels in, channels out, kernel, kernel]`.
    /// - `bias`: `[channels out]`.
    ///
    /// Rows and columns: `(rows - 1) stride - 2 padding + kernel`.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn conv_transpose2d(&self, x: Var, weight: ParamId, bias: ParamId, window: Window) -> Var {
        let shape = self.shape(x);
        let [channels, rows, cols] = shape.item;
        let n_out = self.params().value(bias).len();
        let expected = [channels, n_out, window.kernel, window.kernel];
        assert_eq!(self.params().shape(weight), expected, "the kernel fits the channels");
        let grown = |len: usize| (len - 1) * window.stride + window.kernel - 2 * window.padding;
        let item = [n_out, grown(rows), grown(cols)];
        let sizes = Sizes::of(item, window);
        assert_eq!(sizes.places, [rows, cols], "the window fits");
        let (places, patch) = (rows * cols, sizes.patch());
        let width: usize = item.iter().product();
        let scratch = self.keep(patch * places, |_, _| {});
        self.op_with(
            scratch,
            Shape { n: shape.n, item },
            &[x],
            &[weight, bias],
            |arena, columns, out| {
                let kernels = Matrix::new(arena.params.value(weight), channels, patch);
                let biases = arena.params.value(bias).iter().cycle();
                out.chunks_exact_mut(item[1] * item[2]).zip(biases).for_each(|(y, &b)| y.fill(b));
                let images = arena.value(x).chunks_exact(channels * places);
                for (image, out) in images.zip(out.chunks_exact_mut(width)) {
                    let image = Matrix::new(image, channels, places);
                    multiply(kernels.transposed(), image, false, columns);
                    sizes.fold(columns, out);
                }
            },
            move |arena, columns, _, grad| {
                arena.learn(bias, |_, sums, add| {
                    if !add {
                        sums.fill(F::zero());
                    }
                    for (i, row) in grad.chunks_exact(item[1] * item[2]).enumerate() {
                        sums[i % n_out] += row.iter().copied().sum::<F>();
                    }
                });
                arena.learn(weight, |arena, out, add| {
                    let images = arena.value(x).chunks_exact(channels * places);
                    for (i, (image, grad)) in images.zip(grad.chunks_exact(width)).enumerate() {
                        sizes.unfold(grad, columns);
                        let columns = Matrix::new(columns, patch, places).transposed();
                        multiply(Matrix::new(image, channels, places), columns, add || i > 0, out);
                    }
                });
                arena.pass(x, |arena, out, add| {
                    let kernels = Matrix::new(arena.params.value(weight), channels, patch);
                    let images = out.chunks_exact_mut(channels * places);
                    for (out, grad) in images.zip(grad.chunks_exact(width)) {
                        sizes.unfold(grad, columns);
                        multiply(kernels, Matrix::new(columns, patch, places), add, out);
                    }
                });
            },
        )
    }
}
