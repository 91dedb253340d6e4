//! Which preferences explain what was paid, by least squares (§4.2.2).

use nalgebra::{DMatrix, DVector};

/// Below which share of the largest what was seen of a direction is nothing but rounding: cumulants are not told apart
/// where their sizes are more than 10^6 apart, whose squares these are.
const NOTHING: f64 = 1e-12;

/// What is to be known of steps to infer preferences from them: sums, which a step is added to in `d²`.
#[derive(Clone, Debug, PartialEq)]
pub struct Preferences {
    /// `Σ Φ Φᵀ`: `[d, d]`.
    pub products: Vec<f64>,
    /// `Σ Φ r`: `[d]`.
    pub paid: Vec<f64>,
}

impl Preferences {
    /// Of no step, for cumulants of `d` numbers.
    #[must_use]
    pub fn new(d: usize) -> Self {
        Self { products: vec![0.0; d * d], paid: vec![0.0; d] }
    }

    /// Sees a step.
    ///
    /// - `cumulant`: `Φ(s, a)`, `[d]`.
    /// - `reward`: what was paid for it.
    ///
    /// # Panics
    /// If the cumulant has not as many numbers as those before.
    pub fn see(&mut self, cumulant: &[f64], reward: f64) {
        assert_eq!(cumulant.len(), self.paid.len(), "a cumulant as those before");
        let rows = self.products.chunks_exact_mut(cumulant.len()).zip(cumulant);
        for (row, x) in rows {
            row.iter_mut().zip(cumulant).for_each(|(sum, y)| *sum += x * y);
        }
        self.paid.iter_mut().zip(cumulant).for_each(|(sum, x)| *sum += x * reward);
    }

    /// Makes what was seen weigh so much of what it did.
    pub fn fade(&mut self, by: f64) {
        self.products.iter_mut().chain(&mut self.paid).for_each(|sum| *sum *= by);
    }

    /// The preferences that explain best what was paid (Alg. 3, line 5; Eqn. 4.21a): `[d]`.
    ///
    /// ```text
    /// argmin_w Σ (Φᵀ w - r)² + ridge ‖w‖²
    /// ```
    ///
    /// They solve `(Σ Φ Φᵀ + ridge I) w = Σ Φ r`. Without a ridge, where the steps do not tell some preferences apart, they
    /// are the shortest of those that explain best, to which a ridge leads as it goes to 0; with no step they are 0.
    ///
    /// - `ridge`: in the unit of the squares of cumulants, and not a share of the number of steps.
    ///
    /// # Panics
    /// If `ridge` is below 0.
    #[must_use]
    pub fn infer(&self, ridge: f64) -> Vec<f64> {
        assert!(ridge >= 0.0, "a ridge from 0 on");
        let d = self.paid.len();
        let mut system = DMatrix::from_row_slice(d, d, &self.products);
        (0..d).for_each(|i| system[(i, i)] += ridge);
        let paid = DVector::from_column_slice(&self.paid);
        let solved = match system.clone().cholesky() {
            Some(factor) if is_sure(&factor.l()) => factor.solve(&paid),
            _ => shortest(system, &paid),
        };
        solved.iter().copied().collect()
    }
}

/// Whether every number on the diagonal of a factor is more than rounding.
fn is_sure(factor: &DMatrix<f64>) -> bool {
    let squares = factor.diagonal().map(|x| x * x);
    squares.min() > NOTHING * squares.max()
}

/// The shortest solution of a symmetric system, which has more than one.
fn shortest(system: DMatrix<f64>, paid: &DVector<f64>) -> DVector<f64> {
    let parts = system.symmetric_eigen();
    let least = NOTHING * parts.eigenvalues.amax();
    let mut along = parts.eigenvectors.tr_mul(paid);
    for (x, size) in along.iter_mut().zip(&parts.eigenvalues) {
        *x = if *size > least { *x / size } else { 0.0 };
    }
    parts.eigenvectors * along
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Random, apart};
    use super::*;

    fn seen(steps: &[([f64; 2], f64)]) -> Preferences {
        let mut seen = Preferences::new(2);
        for (phi, r) in steps {
            seen.see(phi, *r);
        }
        seen
    }

    #[test]
    fn by_hand() {
        // ((2, 1), (1, 2)) w = (4, 5), and with a ridge of 1 ((3, 1), (1, 3)) w = (4, 5).
        let steps = seen(&[([1.0, 0.0], 1.0), ([0.0, 1.0], 2.0), ([1.0, 1.0], 3.0)]);
        assert_eq!(
            (&steps.products[..], &steps.paid[..]),
            (&[2.0, 1.0, 1.0, 2.0][..], &[4.0, 5.0][..])
        );
        assert!(apart(&steps.infer(0.0), &[1.0, 2.0]) < 1e-14);
        assert!(apart(&steps.infer(1.0), &[7.0 / 8.0, 11.0 / 8.0]) < 1e-14);
    }

    #[test]
    fn what_is_not_told_apart_is_shared() {
        // w_1 + 2 w_2 = 5: the shortest is (1, 2), and a ridge of 1 makes it 5/6 as long.
        let steps = seen(&[([1.0, 2.0], 5.0)]);
        assert!(apart(&steps.infer(0.0), &[1.0, 2.0]) < 1e-13);
        assert!(apart(&steps.infer(1.0), &[5.0 / 6.0, 10.0 / 6.0]) < 1e-13);
        assert!(apart(&steps.infer(1e-6), &steps.infer(0.0)) < 1e-6);
        // One that never occurred.
        assert_eq!(seen(&[([2.0, 0.0], 3.0)]).infer(0.0), [1.5, 0.0]);
        assert_eq!(Preferences::new(2).infer(0.0), [0.0, 0.0]);
        assert_eq!(Preferences::new(2).infer(1.0), [0.0, 0.0]);
    }

    /// A task is known exactly after as many steps as cumulants have numbers, if rewards are linear in them.
    #[test]
    fn a_linear_task_is_found_after_as_many_steps_as_preferences() {
        for i in 0..100 {
            let mut random = Random::of(i);
            let w = random.numbers(3, 2.0);
            let mut seen = Preferences::new(3);
            for phi in random.cumulants.chunks(3).take(3) {
                seen.see(phi, phi.iter().zip(&w).map(|(x, w)| x * w).sum());
            }
            assert!(apart(&seen.infer(0.0), &w) < 1e-6, "{i}");
        }
    }
}
