//! Products of row-major matrices, on one thread.
//!
//! Members of an ensemble are trained one a core, so a product must not spread over threads;
//! dfdx's would.

use nalgebra::{DMatrixView, DMatrixViewMut, Dyn};

/// A row-major matrix, as it lies in memory or transposed.
#[derive(Clone, Copy)]
pub(super) struct Matrix<'a> {
    values: &'a [f32],
    shape: (usize, usize),
    strides: (usize, usize),
}

impl<'a> Matrix<'a> {
    /// `rows` by `cols`, row after row.
    pub(super) fn new(values: &'a [f32], rows: usize, cols: usize) -> Self {
        assert_eq!(values.len(), rows * cols, "as many values as places");
        Self { values, shape: (rows, cols), strides: (cols, 1) }
    }

    /// Its transpose, without a copy.
    pub(super) fn transposed(self) -> Self {
        let ((rows, cols), (down, right)) = (self.shape, self.strides);
        Self { values: self.values, shape: (cols, rows), strides: (right, down) }
    }
}

/// Replaces `out` by `a b`, or adds `a b` to it; row-major.
///
/// # Panics
/// If the shapes do not fit.
pub(super) fn multiply(a: Matrix<'_>, b: Matrix<'_>, add: bool, out: &mut [f32]) {
    let ((rows, inner), (n, cols)) = (a.shape, b.shape);
    assert_eq!((inner, out.len()), (n, rows * cols), "the shapes fit");
    if rows.min(inner).min(cols) < 8 {
        thin(a, b, add, out);
    } else {
        thick(a, b, add, out);
    }
}

/// For layers with one input or output, where packing costs more than the product.
fn thin(a: Matrix<'_>, b: Matrix<'_>, add: bool, out: &mut [f32]) {
    let (inner, cols) = b.shape;
    if !add {
        out.fill(0.0);
    }
    for (i, row) in out.chunks_exact_mut(cols).enumerate() {
        let left = |k| a.values[i * a.strides.0 + k * a.strides.1];
        if b.strides.1 == 1 {
            for (k, right) in b.values.chunks_exact(cols).enumerate() {
                let x = left(k);
                row.iter_mut().zip(right).for_each(|(sum, y)| *sum += x * y);
            }
        } else {
            for (sum, right) in row.iter_mut().zip(b.values.chunks_exact(inner)) {
                *sum += right.iter().enumerate().fold(0.0, |dot, (k, y)| dot + left(k) * y);
            }
        }
    }
}

/// By packed kernels. nalgebra takes them, which know strides, above 5 rows and columns only.
fn thick(a: Matrix<'_>, b: Matrix<'_>, add: bool, out: &mut [f32]) {
    fn view(matrix: Matrix<'_>) -> DMatrixView<'_, f32, Dyn, Dyn> {
        let ((rows, cols), (down, right)) = (matrix.shape, matrix.strides);
        DMatrixView::from_slice_with_strides(matrix.values, rows, cols, down, right)
    }
    let (rows, cols) = (a.shape.0, b.shape.1);
    let mut out: DMatrixViewMut<'_, f32, Dyn, Dyn> =
        DMatrixViewMut::from_slice_with_strides_mut(out, rows, cols, cols, 1);
    out.gemm(1.0, &view(a), &view(b), if add { 1.0 } else { 0.0 });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_of_every_orientation_and_size_are_sums_of_products() {
        for (rows, inner, cols) in
            [(1, 1, 1), (2, 3, 4), (9, 1, 20), (9, 20, 1), (9, 12, 20), (1, 12, 9)]
        {
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
