//! Functions that are linear but for a constant.

use nalgebra::{DMatrix, DVector, RowDVector};

/// `f_o(x) = b_o + Σ_d x_d W_do`.
#[derive(Clone, Debug, PartialEq)]
pub struct Affine {
    /// `W`: `[D, O]`, row by row.
    pub weights: Vec<f64>,
    /// `b`: `[O]`.
    pub intercepts: Vec<f64>,
}

impl Affine {
    /// What it gives for inputs one after the other: `[N, O]`, row by row.
    ///
    /// - `xs`: `[N, D]`, row by row.
    #[must_use]
    pub fn values(&self, xs: &[f64]) -> Vec<f64> {
        let n_outputs = self.intercepts.len();
        let rows = xs.chunks_exact(self.weights.len() / n_outputs);
        let value = |row: &[f64], o: usize| {
            let column = self.weights[o..].iter().step_by(n_outputs);
            row.iter().zip(column).fold(self.intercepts[o], |sum, (x, w)| sum + x * w)
        };
        rows.flat_map(|row| (0..n_outputs).map(move |o| value(row, o))).collect()
    }

    /// That of inputs which are not centred, from the weights `[D, O]` of centred ones, what it gives for their
    /// means, and these.
    pub(crate) fn of_centred(
        weights: &DMatrix<f64>,
        at_means: &[f64],
        means: &RowDVector<f64>,
    ) -> Self {
        let shift = means * weights;
        Self {
            weights: weights.transpose().as_slice().to_vec(),
            intercepts: at_means.iter().zip(shift.iter()).map(|(b, s)| b - s).collect(),
        }
    }
}

/// The rows of a table without the means of its columns, and these.
///
/// - `rows`: `[N, width]`, row by row, with `N > 0`.
pub(crate) fn centred(rows: &[f64], width: usize) -> (DMatrix<f64>, RowDVector<f64>) {
    let mut table = DMatrix::from_row_slice(rows.len() / width, width, rows);
    let means = table.row_mean();
    // A second time, for what rounding left of large means.
    let rest = {
        table.row_iter_mut().for_each(|mut row| row -= &means);
        table.row_mean()
    };
    table.row_iter_mut().for_each(|mut row| row -= &rest);
    (table, means + rest)
}

/// The parameters of least penalised squared error, with an intercept that is not penalised (Hoerl and Kennard, 1970):
///
/// ```text
/// min over W and b of  Σ_n ‖y_n − b − Wᵀ x_n‖² + α ‖W‖²
/// ```
///
/// With `[x_1 − x̄; …] = Q R`, `R = U S Vᵀ` and `t = Uᵀ Qᵀ [y_1 − ȳ; …]` that is `W = V s t / (s² + α)`, where singular
/// values `s` below `max(N, D) ε` times the largest count as zero: without a penalty, of several the least.
///
/// - `xs`: `[N, D]`, row by row; `ys`: `[N, O]`.
///
/// # Panics
/// If there are no data.
#[must_use]
pub fn ridge(xs: &[f64], n_inputs: usize, ys: &[f64], n_outputs: usize, alpha: f64) -> Affine {
    let ((x, x_means), (mut y, y_means)) = (centred(xs, n_inputs), centred(ys, n_outputs));
    let (n_rows, rank) = (x.nrows(), x.nrows().min(n_inputs));
    assert!(n_rows > 0, "a fit of some data");
    let qr = x.qr();
    qr.q_tr_mul(&mut y);
    let svd = qr.r().svd(true, true);
    let (left, right) = (svd.u.expect("asked for"), svd.v_t.expect("asked for"));
    let singular = svd.singular_values;
    let cut = singular.max() * crate::moments::real(n_rows.max(n_inputs)) * f64::EPSILON;
    let shrunk = |s: f64| if s > cut { s / (s * s + alpha) } else { 0.0 };
    let scale = DMatrix::from_diagonal(&DVector::from_iterator(
        singular.len(),
        singular.iter().map(|s| shrunk(*s)),
    ));
    let weights = right.transpose() * scale * left.transpose() * y.rows(0, rank);
    Affine::of_centred(&weights, y_means.as_slice(), &x_means)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: &[f64], b: &[f64], by: f64) {
        assert_eq!(a.len(), b.len());
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= by), "{a:?} {b:?}");
    }

    #[test]
    fn a_line_is_shrunk_towards_the_mean() {
        // x − x̄ = −1, 0, 1 and y − ȳ = −3, 1, 2: Σxy = 5 and Σx² = 2, so w = 5/(2 + α), b = 4 − 2w.
        let fit = |alpha| ridge(&[1.0, 2.0, 3.0], 1, &[1.0, 5.0, 6.0], 1, alpha);
        for alpha in [0.0, 1.0, 3.0] {
            let w = 5.0 / (2.0 + alpha);
            close(&fit(alpha).weights, &[w], 1e-12);
            close(&fit(alpha).intercepts, &[4.0 - 2.0 * w], 1e-12);
        }
        // A penalty without end leaves the mean, and none of a line's data the line.
        close(&fit(1e15).values(&[7.0]), &[4.0], 1e-9);
        let line = ridge(&[1.0, 2.0, 3.0], 1, &[3.0, 5.0, 7.0], 1, 0.0);
        close(&line.values(&[10.0]), &[21.0], 1e-12);
    }

    #[test]
    fn targets_are_fitted_each_on_its_own() {
        let xs = [0.0, 1.0, 1.0, 0.0, 2.0, 2.0, -1.0, 3.0];
        let (one, two) = ([1.0, 2.0, 0.5, -1.0], [0.0, 1.0, 5.0, 2.0]);
        let both: Vec<f64> = one.iter().zip(&two).flat_map(|(a, b)| [*a, *b]).collect();
        let both = ridge(&xs, 2, &both, 2, 0.7).values(&[0.3, -0.2]);
        let alone = [one, two].map(|ys| ridge(&xs, 2, &ys, 1, 0.7).values(&[0.3, -0.2])[0]);
        close(&both, &alone, 1e-12);
    }

    #[test]
    fn of_several_without_a_penalty_the_least_is_found() {
        // Both inputs are one number: y = 2x is w = (1, 1). And one datum is its own mean.
        let fit = ridge(&[0.0, 0.0, 1.0, 1.0, 2.0, 2.0], 2, &[0.0, 2.0, 4.0], 1, 0.0);
        close(&fit.weights, &[1.0, 1.0], 1e-12);
        close(&ridge(&[4.0, 5.0], 2, &[3.0], 1, 0.0).values(&[0.0, 9.0]), &[3.0], 0.0);
    }

    #[test]
    fn far_from_zero_nothing_is_lost() {
        let xs: Vec<f64> = (0..50).map(|i| 1e8 + f64::from(i)).collect();
        let ys: Vec<f64> = xs.iter().map(|x| 3.0 * (x - 1e8) + 1e6).collect();
        close(&ridge(&xs, 1, &ys, 1, 0.0).weights, &[3.0], 1e-9);
    }
}
