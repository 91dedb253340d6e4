//! The best plans that were seen.

use ivx_op::OpError;

/// The best plan of each problem so far, the first of equals. One whose worth is not a number is none.
pub(super) struct Best<'a> {
    plans: &'a mut [f64],
    worth: &'a mut [f64],
    len: usize,
}

impl<'a> Best<'a> {
    /// None yet: what `plans` and `worth` hold is lost as soon as there are some.
    pub(super) fn none(plans: &'a mut [f64], worth: &'a mut [f64], len: usize) -> Self {
        worth.fill(f64::NAN);
        Self { plans, worth, len }
    }

    /// Looks at as many plans for each problem as there are: `[rows, n, len]`, worth `[rows, n]`.
    pub(super) fn see(&mut self, tried: &[f64], worth: &[f64]) {
        let n = worth.len() / self.worth.len();
        let rows = self.worth.iter_mut().zip(self.plans.chunks_exact_mut(self.len));
        for ((most, best), (row, each)) in rows.zip(worth.chunks_exact(n).enumerate()) {
            let mut found = None;
            for (i, &worth) in each.iter().enumerate() {
                if worth > *most || most.is_nan() && !worth.is_nan() {
                    (*most, found) = (worth, Some(i));
                }
            }
            if let Some(i) = found {
                best.copy_from_slice(&tried[(row * n + i) * self.len..][..self.len]);
            }
        }
    }

    /// What was found.
    pub(super) fn found(self) -> Result<(), OpError> {
        match self.worth.iter().position(|worth| worth.is_nan()) {
            None => Ok(()),
            Some(row) => Err(OpError::Failed(format!(
                "no plan that was tried for problem {row} is worth a number"
            ))),
        }
    }
}
