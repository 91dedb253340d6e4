//! The product of a few rows with a large matrix, on one thread.
//!
//! This is a layer and what it passes back: a small batch times the weights, or its gradients times
//! the transposed weights. A general product first copies weights into the order in which its
//! kernel reads them, which takes as long as half the product, or all of it across the rows, where
//! each is used for so few items. Here the batch is copied instead, and each weight is read as it
//! lies: for 32 items and 1024 × 1024 weights 1.3 times as fast as faer, and 1.8 times where they
//! are transposed.
//!
//! Each number is a sum of fused products in the order of the inner dimension, in blocks of
//! [`DEPTH`]. So it does not depend on the width of vector registers, nor on the tile it is in.
//! Registers are spelt out, since loops over arrays are not always compiled to them.

use pulp::{Arch, Simd, WithSimd};

use super::real::Real;

/// How much of the inner dimension is summed in registers, before `out`.
const DEPTH: usize = 512;
/// How many numbers of a row are read at once.
const BLOCK: usize = 32;
/// The most columns of a tile.
const TILE: usize = 12;

/// Replaces `out` by `a b` or `a bᵀ`, or adds it; row-major.
#[derive(Debug)]
pub(super) struct Thin<'a, F> {
    pub(super) a: &'a [F],
    pub(super) b: &'a [F],
    pub(super) inner: usize,
    /// Whether the rows of `b` are the columns of the second factor.
    pub(super) transposed: bool,
    pub(super) add: bool,
    pub(super) out: &'a mut [F],
}

impl<F> Thin<'_, F> {
    /// Whether the matrix does not fit a core's cache and the rows, 32 at a time, read it three
    /// times at most; fewer than half a tile of them waste it. And whether the processor has fused
    /// products in registers.
    pub(super) fn pays(rows: usize, inner: usize, cols: usize) -> bool {
        (17..=96).contains(&rows)
            && cols >= TILE
            && inner * cols >= 1 << 19
            && !matches!(Arch::new(), Arch::Scalar)
    }
}

impl<F: Real> WithSimd for Thin<'_, F> {
    type Output = ();

    /// In tiles that fill the registers, of which there are 16 or 32.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if S::F32_LANES == 8 {
            product::<F, S, 6>(self, simd);
        } else {
            product::<F, S, TILE>(self, simd);
        }
    }
}

/// Two registers of numbers.
type Pair<F, S> = [<F as Real>::Lanes<S>; 2];

/// By tiles of `H` columns of the product and as many of its rows as two registers hold.
#[inline(always)]
fn product<F: Real, S: Simd, const H: usize>(thin: Thin<'_, F>, simd: S) {
    let Thin { a, b, inner, transposed, add, out } = thin;
    let cols = b.len() / inner;
    let mut panel = [[F::lanes(simd, F::zero()); 2]; DEPTH];
    let width = size_of::<Pair<F, S>>() / size_of::<F>();
    for (a, out) in a.chunks(width * inner).zip(out.chunks_mut(width * cols)) {
        for from in (0..inner).step_by(DEPTH) {
            let depth = DEPTH.min(inner - from);
            let numbers: &mut [F] = pulp::bytemuck::cast_slice_mut(&mut panel);
            for (i, row) in a.chunks_exact(inner).enumerate() {
                let places = numbers[i..].iter_mut().step_by(width);
                places.zip(&row[from..from + depth]).for_each(|(place, &x)| *place = x);
            }
            for j in (0..cols).step_by(H) {
                // The last tile may begin among the columns of the one before.
                let first = j.min(cols - H);
                let sums = if transposed {
                    let rows = |i| &b[(first + i) * inner + from..][..depth];
                    down::<F, S, H>(simd, std::array::from_fn(rows), &panel[..depth])
                } else {
                    across::<F, S, H>(simd, &b[from * cols..], (first, cols), &panel[..depth])
                };
                let sums: &[F] = pulp::bytemuck::cast_slice(&sums[j - first..]);
                for (i, out) in out.chunks_exact_mut(cols).enumerate() {
                    for (out, sums) in out[j..].iter_mut().zip(sums.chunks_exact(width)) {
                        *out = if add || from > 0 { *out + sums[i] } else { sums[i] };
                    }
                }
            }
        }
    }
}

/// The sums of products of `H` rows with columns.
///
/// Rows are read in blocks of a known length: a check of bounds in the inner loop costs a third.
#[inline(always)]
fn down<F: Real, S: Simd, const H: usize>(
    simd: S,
    rows: [&[F]; H],
    columns: &[Pair<F, S>],
) -> [Pair<F, S>; H] {
    let mut sums = [[F::lanes(simd, F::zero()); 2]; H];
    let zeros = [F::zero(); BLOCK];
    let (blocks, rest) = columns.as_chunks::<BLOCK>();
    for (n, block) in blocks.iter().enumerate() {
        let mut heads = [&zeros; H];
        for (head, row) in heads.iter_mut().zip(rows) {
            *head = &row.as_chunks().0[n];
        }
        for k in 0..BLOCK {
            add_products::<F, S, H>(simd, |i| heads[i][k], &block[k], &mut sums);
        }
    }
    for (k, column) in (columns.len() - rest.len()..).zip(rest) {
        add_products::<F, S, H>(simd, |i| rows[i][k], column, &mut sums);
    }
    sums
}

/// The same of `H` columns from `first` on of a matrix with rows of `width` numbers.
///
/// While one block of rows is multiplied, the next is on its way.
#[inline(always)]
fn across<F: Real, S: Simd, const H: usize>(
    simd: S,
    b: &[F],
    (first, width): (usize, usize),
    columns: &[Pair<F, S>],
) -> [Pair<F, S>; H] {
    let mut sums = [[F::lanes(simd, F::zero()); 2]; H];
    let mut heads = [[F::zero(); H]; BLOCK];
    let rows = |from: usize| {
        let rows = b[from * width..columns.len() * width].chunks_exact(width);
        rows.map(|row| row[first..].first_chunk().expect("a tile fits a row"))
    };
    heads.iter_mut().zip(rows(0)).for_each(|(head, row)| *head = *row);
    let (blocks, rest) = columns.as_chunks::<BLOCK>();
    for (n, block) in (1..).zip(blocks) {
        let next = rows(n * BLOCK);
        if next.len() >= BLOCK {
            for ((head, column), next) in heads.iter_mut().zip(block).zip(next) {
                add_products::<F, S, H>(simd, |i| head[i], column, &mut sums);
                *head = *next;
            }
        } else {
            for (head, column) in heads.iter().zip(block) {
                add_products::<F, S, H>(simd, |i| head[i], column, &mut sums);
            }
            heads.iter_mut().zip(next).for_each(|(head, row)| *head = *row);
        }
    }
    for (head, column) in heads.iter().zip(rest) {
        add_products::<F, S, H>(simd, |i| head[i], column, &mut sums);
    }
    sums
}

#[inline(always)]
fn add_products<F: Real, S: Simd, const H: usize>(
    simd: S,
    x: impl Fn(usize) -> F,
    ys: &Pair<F, S>,
    sums: &mut [Pair<F, S>; H],
) {
    for (i, sums) in sums.iter_mut().enumerate() {
        let x = F::lanes(simd, x(i));
        sums[0] = F::fused(simd, x, ys[0], sums[0]);
        sums[1] = F::fused(simd, x, ys[1], sums[1]);
    }
}

#[cfg(test)]
mod tests {
    use pulp::Scalar;

    use super::*;
    use ivx_math::moments::real;

    /// Adds sums in the order that is promised, one number at a time.
    fn expected(a: &[f32], b: &[f32], inner: usize, out: &mut [f32]) {
        let cols = b.len() / inner;
        for (i, out) in out.iter_mut().enumerate() {
            let (x, y) = (&a[i / cols * inner..][..inner], &b[i % cols * inner..][..inner]);
            for (x, y) in x.chunks(DEPTH).zip(y.chunks(DEPTH)) {
                *out += x.iter().zip(y).fold(0.0, |sum, (&x, &y)| x.mul_add(y, sum));
            }
        }
    }

    #[test]
    fn tiles_of_any_width_give_the_same_bits() {
        let numbers = |n: usize, step: f64| -> Vec<f32> {
            (0..n).map(|i| f32::of((real(i) * step).sin())).collect()
        };
        let runs: [fn(Thin<'_, f32>); 3] = [
            |thin| Arch::new().dispatch(thin),
            |thin| product::<_, _, 6>(thin, Scalar::new()),
            |thin| product::<_, _, TILE>(thin, Scalar::new()),
        ];
        for (rows, inner, cols) in [(1, 5, 13), (33, 600, 25), (17, 64, 12), (40, 545, 31)] {
            let (a, bt) = (numbers(rows * inner, 0.7), numbers(inner * cols, 0.3));
            let b: Vec<f32> = (0..bt.len()).map(|n| bt[n % cols * inner + n / cols]).collect();
            for (add, before) in [(false, 0.0), (true, 0.5)] {
                let mut sums = vec![before; rows * cols];
                expected(&a, &bt, inner, &mut sums);
                for (b, transposed) in [(&b, false), (&bt, true)] {
                    for run in runs {
                        let mut out = vec![0.5; sums.len()];
                        run(Thin { a: &a, b, inner, transposed, add, out: &mut out });
                        assert_eq!(out, sums, "{rows} {inner} {cols} {transposed}");
                    }
                }
            }
        }
    }
}
