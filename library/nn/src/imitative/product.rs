//! Products of some rows with weights that stay, on one thread and without memory of its own.
//!
//! A plan is scored by a handful of rows at a time, so that what [`multiply`](crate::matmul::multiply) does before a
//! product costs as much as the product. Here weights are laid out once, rows of them filled up to a whole number of
//! registers, and are read as they lie. Each number is a sum of fused products in the order of the inner dimension,
//! whatever the width of registers and the tile that it is in.

use pulp::{Arch, Simd, WithSimd};

use crate::real::Real;

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
        // Four rows share what is read of the weights; one has more sums at once instead.
        while out.len() >= 4 * weights.width {
            let (these, rest) = std::mem::take(&mut out).split_at_mut(4 * weights.width);
            block::<F, S, 4, 2>(simd, weights, &x[..4 * stride], these);
            (x, out) = (&x[4 * stride..], rest);
        }
        while !out.is_empty() {
            let (these, rest) = std::mem::take(&mut out).split_at_mut(weights.width);
            block::<F, S, 1, 8>(simd, weights, &x[..stride], these);
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
    let mut sums = [registers(&bias[from..]); R];
    let stride = x.len() / R;
    let xs: [&[F]; R] = std::array::from_fn(|r| &x[r * stride..][..*inputs]);
    for (k, row) in values.chunks_exact(*width).enumerate() {
        let row = registers(&row[from..]);
        for (sums, x) in sums.iter_mut().zip(xs) {
            let x = F::lanes(simd, x[k]);
            for (sum, y) in sums.iter_mut().zip(row) {
                *sum = F::fused(simd, x, y, *sum);
            }
        }
    }
    for (out, sums) in out.chunks_exact_mut(*width).zip(&sums) {
        out[from..from + C * lanes].copy_from_slice(pulp::bytemuck::cast_slice(sums));
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
    fn products_are_sums_in_the_order_of_the_inner_dimension() {
        for (rows, inputs, outputs) in [(1, 3, 4), (4, 64, 192), (7, 5, 33), (9, 1, 1)] {
            let (x, w) = (numbers(rows * inputs, 0.7), numbers(inputs * outputs, 0.3));
            let b = numbers(outputs, 1.1);
            let weights = Weights::new(&w, &b);
            let mut out = vec![f64::NAN; rows * weights.width()];
            weights.times(&x, &mut out);
            let back = weights.back(outputs);
            let mut returned = vec![f64::NAN; rows * back.width()];
            back.times(&out, &mut returned);
            for i in 0..rows {
                for j in 0..outputs {
                    let sum = (0..inputs)
                        .fold(b[j], |sum, k| x[i * inputs + k].mul_add(w[k * outputs + j], sum));
                    assert_eq!(out[i * weights.width() + j], sum);
                }
                for k in 0..inputs {
                    let sum = (0..outputs).fold(0.0, |sum: f64, j| {
                        out[i * weights.width() + j].mul_add(w[k * outputs + j], sum)
                    });
                    assert_eq!(returned[i * back.width() + k], sum);
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
