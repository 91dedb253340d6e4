//! Products of row-major matrices, on one thread.
//!
//! Members of an ensemble are trained one a core, so a product must not spread over threads;
//! dfdx's would.

use faer::{MatMut, MatRef};
use pulp::Arch;

use super::real::{Real, wide};
use super::thin::Thin;

/// A row-major matrix, as it lies in memory or transposed.
#[derive(Clone, Copy)]
pub(super) struct Matrix<'a, F> {
    values: &'a [F],
    /// As it lies in memory.
    rows: usize,
    cols: usize,
    transposed: bool,
}

impl<'a, F: Real> Matrix<'a, F> {
    /// `rows` by `cols`, row after row.
    pub(super) fn new(values: &'a [F], rows: usize, cols: usize) -> Self {
        assert_eq!(values.len(), rows * cols, "as many values as places");
        Self { values, rows, cols, transposed: false }
    }

    /// Its transpose, without a copy.
    pub(super) fn transposed(self) -> Self {
        Self { transposed: !self.transposed, ..self }
    }

    fn shape(self) -> (usize, usize) {
        if self.transposed { (self.cols, self.rows) } else { (self.rows, self.cols) }
    }

    fn view(self) -> MatRef<'a, F> {
        let view = MatRef::from_row_major_slice(self.values, self.rows, self.cols);
        if self.transposed { view.transpose() } else { view }
    }
}

/// Replaces `out` by `a b`, or adds `a b` to it; row-major.
///
/// # Panics
/// If the shapes do not fit.
pub(super) fn multiply<F: Real>(a: Matrix<'_, F>, b: Matrix<'_, F>, add: bool, out: &mut [F]) {
    let ((rows, inner), (n, cols)) = (a.shape(), b.shape());
    assert_eq!((inner, out.len()), (n, rows * cols), "the shapes fit");
    if inner == 1 && cols > 1 && !b.transposed {
        wide(
            #[inline(always)]
            || outer(a.values, b.values, add, out),
        );
    } else if cols == 1 && (rows == 1 || !a.transposed) || rows == 1 && b.transposed {
        let (matrix, column) = if cols == 1 { (a, b) } else { (b, a) };
        wide(
            #[inline(always)]
            || dots(matrix.values, column.values, add, out),
        );
    } else if !a.transposed && Thin::<F>::pays(rows, inner, cols) {
        let (a, b, transposed) = (a.values, b.values, b.transposed);
        Arch::new().dispatch(Thin { a, b, inner, transposed, add, out });
    } else {
        F::product(MatMut::from_row_major_slice_mut(out, rows, cols), add, a.view(), b.view());
    }
}

/// A column times a row.
#[inline(always)]
fn outer<F: Real>(a: &[F], b: &[F], add: bool, out: &mut [F]) {
    for (&x, row) in a.iter().zip(out.chunks_exact_mut(b.len())) {
        if add {
            row.iter_mut().zip(b).for_each(|(sum, &y)| *sum += x * y);
        } else {
            row.iter_mut().zip(b).for_each(|(sum, &y)| *sum = x * y);
        }
    }
}

/// A matrix times a column, summed in sixteen lanes whatever the width of registers; by faer as many
/// as there are.
#[inline(always)]
fn dots<F: Real>(a: &[F], b: &[F], add: bool, out: &mut [F]) {
    for (row, sum) in a.chunks_exact(b.len()).zip(out) {
        let (rows, row_rest) = row.as_chunks::<16>();
        let (cols, col_rest) = b.as_chunks::<16>();
        let mut lanes = [F::zero(); 16];
        for (xs, ys) in rows.iter().zip(cols) {
            for i in 0..16 {
                lanes[i] += xs[i] * ys[i];
            }
        }
        let rest = row_rest.iter().zip(col_rest).fold(F::zero(), |sum, (&x, &y)| sum + x * y);
        let dot = lanes.iter().fold(rest, |sum, &x| sum + x);
        *sum = if add { *sum + dot } else { dot };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_every_orientation_and_size_are_sums_of_products() {
        for (rows, inner, cols) in [
            (1, 1, 1),
            (2, 3, 4),
            (9, 1, 20),
            (9, 20, 1),
            (9, 40, 1),
            (9, 12, 20),
            (1, 12, 9),
            (1, 7, 70),
            (2, 9, 33),
            (1, 40, 9),
            (32, 64, 6),
            (32, 1024, 512),
        ] {
            // Small whole numbers, so that sums are exact.
            let whole = |n: usize, seed: usize| -> Vec<f32> {
                (0..n)
                    .map(|i| f32::from(u8::try_from((i * seed + i * i) % 7).unwrap()) - 3.0)
                    .collect()
            };
            let (a, b) = (whole(rows * inner, 3), whole(inner * cols, 5));
            let mut expected = vec![1.0; rows * cols];
            for (i, j, k) in
                (0..rows * cols * inner).map(|n| (n / inner / cols, n / inner % cols, n % inner))
            {
                expected[i * cols + j] += a[i * inner + k] * b[k * cols + j];
            }
            let flip = |values: &[f32], rows: usize, cols: usize| -> Vec<f32> {
                (0..rows * cols).map(|n| values[n % rows * cols + n / rows]).collect()
            };
            let (at, bt) = (flip(&a, rows, inner), flip(&b, inner, cols));
            let lefts = [Matrix::new(&a, rows, inner), Matrix::new(&at, inner, rows).transposed()];
            let rights = [Matrix::new(&b, inner, cols), Matrix::new(&bt, cols, inner).transposed()];
            for (left, right) in lefts.into_iter().flat_map(|l| rights.map(|r| (l, r))) {
                let mut out = vec![1.0; rows * cols];
                multiply(left, right, true, &mut out);
                assert_eq!(out, expected);
                multiply(left, right, false, &mut out);
                assert!(out.iter().zip(&expected).all(|(x, y)| x + 1.0 == *y));
            }
        }
    }
}
