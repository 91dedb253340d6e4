//! Products of some rows with weights that stay, on one thread and without memory of its own.
//!
//! A plan is scored by a handful of rows at a time, so that what [`multiply`](crate::matmul::multiply) does before a
//! product costs as much as the product. Here weights are laid out once, rows of them filled up to a whole number of
//! registers, and are read as they lie. Each number is two sums of fused products, of the even and of the odd places of
//! the inner dimension in their order, added at the end: so a processor has enough to do at once, whatever the width of
//! its registers, and no bit depends on that or on the tile that a number is in.

use pulp::{Arch, Simd, WithSimd};

use crate::real::{Real, wide};

/// What the length of a row of weights is a multiple of: a register of single precision.
const FILL: usize = 16;

/// Weights `[inputs, outputs]`, and where products with them start from.
#[derive(Clone, Debug)]
pub(super) struct Weights<F> {
    values: Vec<F>,
    bias: Vec<F>,
    inputs: usize,
    /// Filled up.
    width: usize,
}

impl<F: Real> Weights<F> {
    /// Those of a layer.
    ///
    /// # Panics
    /// If there are not `inputs · outputs` of them.
    pub(super) fn new(values: &[F], bias: &[F]) -> Self {
        let outputs = bias.len();
        assert!(values.len().is_multiple_of(outputs), "rows of as many weights");
        let inputs = values.len() / outputs;
        let width = padded(outputs);
        let mut filled = vec![F::zero(); inputs * width];
        let rows = filled.chunks_exact_mut(width).zip(values.chunks_exact(outputs));
        rows.for_each(|(to, row)| to[..outputs].copy_from_slice(row));
        let mut start = vec![F::zero(); width];
        start[..outputs].copy_from_slice(bias);
        Self { values: filled, bias: start, inputs, width }
    }

    /// Its transpose `[outputs, inputs]`, which passes gradients back; rows of gradients are filled up, too.
    pub(super) fn back(&self, outputs: usize) -> Self {
        let width = padded(self.inputs);
        let mut values = vec![F::zero(); self.width * width];
        for i in 0..self.inputs {
            (0..outputs).for_each(|j| values[j * width + i] = self.values[i * self.width + j]);
        }
        Self { values, bias: vec![F::zero(); width], inputs: self.width, width }
    }

    /// How many numbers a row of a product has.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// `x W + b` of each row `x`, of which the first `inputs` numbers count.
    ///
    /// - `x`: `[rows, at least inputs]`
    /// - `out`: `[rows, width]`
    pub(super) fn times(&self, x: &[F], out: &mut [F]) {
        Arch::new().dispatch(Times { weights: self, x, out });
    }

    /// The gradient of each row `x` where products with these weights have the gradients `grad`: as [`back`](Self::back), for
    /// few inputs.
    ///
    /// - `grad`: `[rows, width]`
    /// - `out`: `[rows, inputs]`
    pub(super) fn dots(&self, grad: &[F], out: &mut [F]) {
        wide(
            #[inline(always)]
            || {
                let rows = grad.chunks_exact(self.width).zip(out.chunks_exact_mut(self.inputs));
                for (grad, out) in rows {
                    for (out, weights) in out.iter_mut().zip(self.values.chunks_exact(self.width)) {
                        let mut sums = [F::zero(); FILL];
                        let blocks = grad.as_chunks::<FILL>().0.iter();
                        for (xs, ys) in blocks.zip(weights.as_chunks::<FILL>().0) {
                            (0..FILL).for_each(|i| sums[i] += xs[i] * ys[i]);
                        }
                        *out = sums.iter().fold(F::zero(), |sum, x| sum + *x);
                    }
                }
            },
        );
    }
}

/// The length of a row that is filled up.
pub(super) fn padded(len: usize) -> usize {
    len.next_multiple_of(FILL)
}

struct Times<'a, F> {
    weights: &'a Weights<F>,
    x: &'a [F],
    out: &'a mut [F],
}

impl<F: Real> WithSimd for Times<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { weights, x, out } = self;
        let rows = out.len() / weights.width;
        let stride = x.len() / rows.max(1);
        let (mut x, mut out) = (x, out);
        // Some rows share what is read of the weights; one has more sums at once instead.
        let together = if S::F32_LANES == 8 { 2 } else { 4 };
        while out.len() >= together * weights.width {
            let (these, rest) = std::mem::take(&mut out).split_at_mut(together * weights.width);
            let xs = &x[..together * stride];
            if together == 2 {
                block::<F, S, 2, 2>(simd, weights, xs, these);
            } else {
                block::<F, S, 4, 2>(simd, weights, xs, these);
            }
            (x, out) = (&x[together * stride..], rest);
        }
        while !out.is_empty() {
            let (these, rest) = std::mem::take(&mut out).split_at_mut(weights.width);
            block::<F, S, 1, 4>(simd, weights, &x[..stride], these);
            (x, out) = (&x[stride..], rest);
        }
    }
}

/// `R` rows, by tiles of `C` registers and what is left by tiles of one.
#[inline(always)]
fn block<F: Real, S: Simd, const R: usize, const C: usize>(
    simd: S,
    weights: &Weights<F>,
    x: &[F],
    out: &mut [F],
) {
    let lanes = size_of::<F::Lanes<S>>() / size_of::<F>();
    let mut from = 0;
    while from + C * lanes <= weights.width {
        tile::<F, S, R, C>(simd, weights, x, out, from);
        from += C * lanes;
    }
    while from + 2 * lanes <= weights.width {
        tile::<F, S, R, 2>(simd, weights, x, out, from);
        from += 2 * lanes;
    }
    while from < weights.width {
        tile::<F, S, R, 1>(simd, weights, x, out, from);
        from += lanes;
    }
}

#[inline(always)]
fn tile<F: Real, S: Simd, const R: usize, const C: usize>(
    simd: S,
    weights: &Weights<F>,
    x: &[F],
    out: &mut [F],
    from: usize,
) {
    let Weights { values, bias, inputs, width } = weights;
    let lanes = size_of::<F::Lanes<S>>() / size_of::<F>();
    let registers = |row: &[F]| -> [F::Lanes<S>; C] {
        let row: &[F::Lanes<S>] = pulp::bytemuck::cast_slice(&row[..C * lanes]);
        std::array::from_fn(|c| row[c])
    };
    let add = |x: F, row: &[F::Lanes<S>; C], sums: &mut [F::Lanes<S>; C]| {
        let x = F::lanes(simd, x);
        for c in 0..C {
            sums[c] = F::fused(simd, x, row[c], sums[c]);
        }
    };
    let mut even = [registers(&bias[from..]); R];
    let mut odd = [[F::lanes(simd, F::zero()); C]; R];
    let stride = x.len() / R;
    let xs: [&[F]; R] = std::array::from_fn(|r| &x[r * stride..][..*inputs]);
    let mut pairs = values.chunks_exact(2 * width);
    for (k, rows) in pairs.by_ref().enumerate() {
        let (first, second) = (registers(&rows[from..]), registers(&rows[width + from..]));
        for r in 0..R {
            add(xs[r][2 * k], &first, &mut even[r]);
            add(xs[r][2 * k + 1], &second, &mut odd[r]);
        }
    }
    if inputs % 2 == 1 {
        let row = registers(&pairs.remainder()[from..]);
        (0..R).for_each(|r| add(xs[r][inputs - 1], &row, &mut even[r]));
    }
    let one = F::lanes(simd, F::one());
    for (out, (even, odd)) in out.chunks_exact_mut(*width).zip(even.iter().zip(&odd)) {
        let sums: [_; C] = std::array::from_fn(|c| F::fused(simd, one, even[c], odd[c]));
        out[from..from + C * lanes].copy_from_slice(pulp::bytemuck::cast_slice(&sums));
    }
}

#[cfg(test)]
mod tests {
    use ivx_math::moments::real;

    use super::*;

    fn numbers(n: usize, step: f64) -> Vec<f64> {
        (0..n).map(|i| (real(i) * step).sin()).collect()
    }

    #[test]
    fn products_are_sums_of_even_and_odd_places() {
        for (rows, inputs, outputs) in [(1, 3, 4), (4, 64, 192), (7, 5, 33), (9, 1, 1)] {
            let (x, w) = (numbers(rows * inputs, 0.7), numbers(inputs * outputs, 0.3));
            let b = numbers(outputs, 1.1);
            let weights = Weights::new(&w, &b);
            let mut out = vec![f64::NAN; rows * weights.width()];
            weights.times(&x, &mut out);
            let back = weights.back(outputs);
            let mut returned = vec![f64::NAN; rows * back.width()];
            back.times(&out, &mut returned);
            let mut dots = vec![f64::NAN; rows * inputs];
            weights.dots(&out, &mut dots);
            let pairs = dots.chunks_exact(inputs).zip(returned.chunks_exact(back.width()));
            let mut pairs = pairs.flat_map(|(dots, returned)| dots.iter().zip(returned));
            assert!(pairs.all(|(dot, sum)| (dot - sum).abs() < 1e-12 * (1.0 + sum.abs())));
            for i in 0..rows {
                for j in 0..outputs {
                    let sums = (0..inputs).fold([b[j], 0.0], |mut sums, k| {
                        sums[k % 2] = x[i * inputs + k].mul_add(w[k * outputs + j], sums[k % 2]);
                        sums
                    });
                    assert_eq!(out[i * weights.width() + j], sums[0] + sums[1]);
                }
                for k in 0..inputs {
                    let sums = (0..outputs).fold([0.0_f64; 2], |mut sums, j| {
                        let grad = out[i * weights.width() + j];
                        sums[j % 2] = grad.mul_add(w[k * outputs + j], sums[j % 2]);
                        sums
                    });
                    assert_eq!(returned[i * back.width() + k], sums[0] + sums[1]);
                }
            }
        }
    }

    /// A row alone has the bits that it has among others.
    #[test]
    fn a_row_does_not_depend_on_its_tile() {
        #[expect(clippy::cast_possible_truncation, reason = "rounding is what is asked for")]
        let single = |n, step| numbers(n, step).iter().map(|x| *x as f32).collect::<Vec<f32>>();
        let weights = Weights::new(&single(64 * 192, 0.3), &single(192, 0.9));
        let x = single(4 * 64, 0.7);
        let mut all = vec![0.0; 4 * 192];
        weights.times(&x, &mut all);
        let mut one = vec![0.0; 192];
        weights.times(&x[2 * 64..3 * 64], &mut one);
        assert_eq!(one, all[2 * 192..3 * 192]);
    }
}
