//! Logistic regression.

use nalgebra::{DMatrix, DVector, RowDVector};

use crate::affine::{Affine, centred};
use crate::boost::ONE_CLASS;
use crate::moments::real;

/// The logits of classes under which data are most probable but for a penalty, with intercepts that are not
/// penalised:
///
/// ```text
/// min over W and b of  C Σ_n −log p(class_n | x_n) + ½ ‖W‖²
/// ```
///
/// where `p` is a softmax of `b + Wᵀ x`, and of two classes a sigmoid: the only logit is then that of the second. The
/// intercepts of a softmax, which say the same with any number added, sum to 0. A class that no datum has is left out,
/// with an intercept of −∞; of more classes that leave two, the first has a logit of 0.
///
/// It is found by Newton's method, whose steps are solved by conjugate gradients and shortened where they go too far,
/// until a step is worth no more than 1e-16 nats a datum.
///
/// - `xs`: `[N, D]`, row by row; `classes`: `[N]`, each below `n_classes`.
///
/// # Errors
/// If the data are of one class, or the method does not settle.
pub fn logistic(
    xs: &[f64],
    n_inputs: usize,
    classes: &[usize],
    n_classes: usize,
    c: f64,
) -> Result<Affine, String> {
    let present: Vec<usize> = (0..n_classes).filter(|k| classes.contains(k)).collect();
    if present.len() < 2 {
        return Err(ONE_CLASS.to_owned());
    }
    let n_logits = if present.len() == 2 { 1 } else { present.len() };
    let (x, means) = centred(xs, n_inputs);
    let targets = DMatrix::from_fn(classes.len(), n_logits, |n, k| {
        let of = present[if n_logits == 1 { 1 } else { k }];
        if classes[n] == of { 1.0 } else { 0.0 }
    });
    let theta = Problem { x, targets, penalty: 1.0 / (c * real(classes.len())) }.solved()?;
    let mut at_means: Vec<f64> = theta.row(n_inputs).iter().copied().collect();
    let weights = theta.rows(0, n_inputs).into_owned();
    if n_logits > 1 {
        // What the penalty pulls to zero is the sum of weights, and nothing pulls that of intercepts.
        let shift = (&means * &weights).sum();
        let mean = (at_means.iter().sum::<f64>() - shift) / real(n_logits);
        for b in &mut at_means {
            *b -= mean;
        }
    }
    let fit = Affine::of_centred(&weights, &at_means, &means);
    Ok(if n_classes == 2 || present.len() == n_classes {
        fit
    } else {
        spread(&fit, &present, n_classes)
    })
}

/// The logits of all classes from those of the classes that are present.
fn spread(fit: &Affine, present: &[usize], n_classes: usize) -> Affine {
    let n_logits = fit.intercepts.len();
    let place = |k: &usize| present.iter().position(|other| other == k);
    // Of two, the first has a logit of 0.
    let of = |values: &[f64], k: usize, absent: f64| match (place(&k), n_logits) {
        (None, _) => absent,
        (Some(0), 1) => 0.0,
        (Some(_), 1) => values[0],
        (Some(i), _) => values[i],
    };
    let each = |values: &[f64], absent: f64| {
        (0..n_classes).map(|k| of(values, k, absent)).collect::<Vec<f64>>()
    };
    Affine {
        weights: fit.weights.chunks(n_logits).flat_map(|row| each(row, 0.0)).collect(),
        intercepts: each(&fit.intercepts, f64::NEG_INFINITY),
    }
}

/// How many steps of Newton's method are enough for what has a solution.
const MOST_STEPS: usize = 200;

/// Penalised logistic regression, averaged over data. Parameters are `[D + 1, O]`, the intercepts last.
struct Problem {
    x: DMatrix<f64>,
    /// `[N, O]`: 1 for the class of a datum.
    targets: DMatrix<f64>,
    penalty: f64,
}

impl Problem {
    fn solved(&self) -> Result<DMatrix<f64>, String> {
        let mut theta = DMatrix::zeros(self.x.ncols() + 1, self.targets.ncols());
        let mut loss = self.loss(&theta);
        for _ in 0..MOST_STEPS {
            let shares = self.shares(&theta);
            let gradient = self.gradient(&theta, &shares);
            let step = self.newton_step(&shares, &gradient);
            let worth = -gradient.dot(&step);
            if worth <= 1e-12 {
                // So close, a full step is right up to the square of what is left, and losses are equal up to rounding.
                theta += step;
                if worth <= 1e-16 {
                    return Ok(theta);
                }
                loss = self.loss(&theta);
                continue;
            }
            let mut length = 1.0;
            loop {
                let next = &theta + &step * length;
                let found = self.loss(&next);
                if found <= loss - 1e-4 * length * worth {
                    (theta, loss) = (next, found);
                    break;
                }
                length *= 0.5;
                if length < 1e-12 {
                    return Err(UNSETTLED.to_owned());
                }
            }
        }
        Err(UNSETTLED.to_owned())
    }

    fn logits(&self, theta: &DMatrix<f64>) -> DMatrix<f64> {
        let d = self.x.ncols();
        let mut logits = &self.x * theta.rows(0, d);
        logits.row_iter_mut().for_each(|mut row| row += theta.row(d));
        logits
    }

    fn loss(&self, theta: &DMatrix<f64>) -> f64 {
        let (logits, d) = (self.logits(theta), self.x.ncols());
        let each = logits.row_iter().zip(self.targets.row_iter()).map(|(logits, targets)| {
            let own = logits.dot(&targets);
            log_sum_exp(&logits.into_owned()) - own
        });
        let penalty = 0.5 * self.penalty * theta.rows(0, d).norm_squared();
        each.sum::<f64>() / real(self.x.nrows()) + penalty + 0.5 * self.drift(theta).powi(2)
    }

    /// The sum of the intercepts of a softmax. It says nothing, and would be anything: it is drawn to 0, which costs
    /// nothing at the minimum.
    fn drift(&self, theta: &DMatrix<f64>) -> f64 {
        if self.targets.ncols() == 1 { 0.0 } else { theta.row(self.x.ncols()).sum() }
    }

    /// The probability of the class of each logit.
    fn shares(&self, theta: &DMatrix<f64>) -> DMatrix<f64> {
        let mut shares = self.logits(theta);
        for mut row in shares.row_iter_mut() {
            let log_sum = log_sum_exp(&row.clone_owned());
            row.apply(|logit| *logit = (*logit - log_sum).exp());
        }
        shares
    }

    fn gradient(&self, theta: &DMatrix<f64>, shares: &DMatrix<f64>) -> DMatrix<f64> {
        self.back(&(shares - &self.targets), theta)
    }

    /// The gradient by parameters from that by logits, and the pull of the penalty on `theta`.
    fn back(&self, by_logits: &DMatrix<f64>, theta: &DMatrix<f64>) -> DMatrix<f64> {
        let (n, d) = self.x.shape();
        let mut back = DMatrix::zeros(d + 1, by_logits.ncols());
        back.rows_mut(0, d).copy_from(&(self.x.tr_mul(by_logits) / real(n)));
        let mut weights = back.rows_mut(0, d);
        weights += theta.rows(0, d) * self.penalty;
        back.row_mut(d).copy_from(&by_logits.row_mean().add_scalar(self.drift(theta)));
        back
    }

    /// The Hessian times a direction.
    fn curved(&self, shares: &DMatrix<f64>, direction: &DMatrix<f64>) -> DMatrix<f64> {
        let mut moved = self.logits(direction);
        for (mut moved, shares) in moved.row_iter_mut().zip(shares.row_iter()) {
            let mean = moved.dot(&shares);
            moved.zip_apply(&shares, |moved, share| *moved = share * (*moved - mean));
        }
        self.back(&moved, direction)
    }

    /// The step to the minimum of the quadratic at hand, by conjugate gradients on what the diagonal leaves.
    fn newton_step(&self, shares: &DMatrix<f64>, gradient: &DMatrix<f64>) -> DMatrix<f64> {
        let diagonal = self.diagonal(shares);
        let eased = |x: &DMatrix<f64>| x.component_div(&diagonal);
        let mut step = DMatrix::zeros(gradient.nrows(), gradient.ncols());
        let mut left = -gradient;
        let mut direction = eased(&left);
        let mut size = left.dot(&direction);
        // Far from the end a rough step does as well.
        let enough = size * size.sqrt().clamp(1e-10, 0.1).powi(2);
        for _ in 0..4 * gradient.len() + 20 {
            if size <= enough || size < f64::MIN_POSITIVE {
                break;
            }
            let curved = self.curved(shares, &direction);
            let length = size / direction.dot(&curved);
            step += &direction * length;
            left -= curved * length;
            let next = eased(&left);
            let grown = left.dot(&next);
            direction = next + direction * (grown / size);
            size = grown;
        }
        step
    }

    /// The diagonal of the Hessian.
    fn diagonal(&self, shares: &DMatrix<f64>) -> DMatrix<f64> {
        let (n, d) = self.x.shape();
        let spread = shares.map(|p| p * (1.0 - p));
        let mut diagonal = DMatrix::zeros(d + 1, shares.ncols());
        let squares = self.x.map(|x| x * x).tr_mul(&spread) / real(n);
        diagonal.rows_mut(0, d).copy_from(&squares.add_scalar(self.penalty));
        // A class that is certain has no slope to speak of.
        let of_drift = if shares.ncols() == 1 { 0.0 } else { 1.0 };
        let own = spread.row_mean().map(|x| x.max(f64::MIN_POSITIVE.sqrt()) + of_drift);
        diagonal.row_mut(d).copy_from(&own);
        diagonal
    }
}

const UNSETTLED: &str =
    "logistic regression did not settle: bring the inputs to one scale, or take a smaller `c`";

/// `log Σ e^logit`, of one logit beside another that is 0.
fn log_sum_exp(logits: &RowDVector<f64>) -> f64 {
    let rest = if logits.len() == 1 { 0.0 } else { f64::NEG_INFINITY };
    let highest = logits.max().max(rest);
    let all = logits.iter().chain([&rest]).map(|logit| (logit - highest).exp());
    highest + DVector::from_iterator(logits.len() + 1, all).sum().ln()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// The mean share of each class where inputs say nothing.
    #[test]
    fn inputs_that_say_nothing_leave_the_shares_of_classes() {
        let fit = logistic(&[0.0; 6], 1, &[0, 1, 1, 2, 2, 2], 3, 1.0).expect("there is one");
        let logits = fit.values(&[0.0]);
        let expected = [1.0_f64, 2.0, 3.0].map(f64::ln);
        let mean = expected.iter().sum::<f64>() / 3.0;
        for (found, expected) in logits.iter().zip(expected) {
            assert!((found - (expected - mean)).abs() < 1e-8, "{logits:?}");
        }
        let two = logistic(&[0.0; 4], 1, &[0, 1, 1, 1], 2, 1.0).expect("there is one");
        assert!((two.values(&[0.0])[0] - 3.0_f64.ln()).abs() < 1e-8);
    }

    /// At the minimum of `C Σ log(1 + e^∓z) + ½ w²` with x = ∓1 and classes apart: `w = 2 C σ(−w)`.
    #[test]
    fn two_data_apart_by_hand() {
        let w = 2.0_f64;
        let c = w * (1.0 + w.exp()) / 2.0;
        let fit = logistic(&[-1.0, 1.0], 1, &[0, 1], 2, c).expect("there is one");
        assert!((fit.weights[0] - w).abs() < 1e-8, "{fit:?}");
        assert!(fit.intercepts[0].abs() < 1e-8);
        // By a softmax with weights ∓v: C Σ log(1 + e^−2v) + v², so that v = 2 C σ(−2v).
        let v = 1.0_f64;
        let c = v * (1.0 + (2.0 * v).exp()) / 2.0;
        let problem = Problem {
            x: DMatrix::from_row_slice(2, 1, &[-1.0, 1.0]),
            targets: DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 1.0]),
            penalty: 1.0 / (c * 2.0),
        };
        let theta = problem.solved().expect("there is one");
        assert!((theta[(0, 1)] - v).abs() < 1e-8 && (theta[(0, 0)] + v).abs() < 1e-8, "{theta}");
    }

    #[test]
    fn slopes_and_curvature_are_differences_of_losses() {
        let problem = Problem {
            x: DMatrix::from_row_slice(3, 2, &[0.3, -1.0, 1.2, 0.4, -0.7, 0.9]),
            targets: DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0]),
            penalty: 0.3,
        };
        let theta = DMatrix::from_fn(3, 3, |i, j| 0.3 * real(i) - 0.5 * real(j) + 0.1);
        let at = |theta: &DMatrix<f64>| problem.gradient(theta, &problem.shares(theta));
        let (gradient, h) = (at(&theta), 1e-6);
        for place in 0..9 {
            let mut step = DMatrix::zeros(3, 3);
            step[place] = h;
            let (up, down) = (&theta + &step, &theta - &step);
            let slope = (problem.loss(&up) - problem.loss(&down)) / (2.0 * h);
            assert!((slope - gradient[place]).abs() < 1e-8, "{slope} {}", gradient[place]);
            let curved = problem.curved(&problem.shares(&theta), &(&step / h));
            let difference = (at(&up) - at(&down)) / (2.0 * h);
            assert!((curved - difference).norm() < 1e-8);
            let of_diagonal = problem.diagonal(&problem.shares(&theta))[place];
            let slope = (at(&up)[place] - at(&down)[place]) / (2.0 * h);
            assert!((slope - of_diagonal).abs() < 1e-8);
        }
    }

    #[test]
    fn a_class_that_is_nowhere_is_impossible() {
        let xs = [0.0, 1.0, 2.0, 0.5];
        let fit = logistic(&xs, 1, &[3, 1, 1, 3], 4, 1.0).expect("there is one");
        let two = logistic(&xs, 1, &[1, 0, 0, 1], 2, 1.0).expect("there is one");
        let logits = fit.values(&[0.7]);
        assert_eq!((logits[0], logits[2]), (f64::NEG_INFINITY, f64::NEG_INFINITY));
        assert_eq!((logits[1], logits[3]), (0.0, two.values(&[0.7])[0]));
        assert!(logistic(&xs, 1, &[1, 1, 1, 1], 4, 1.0).is_err());
    }

    #[test]
    fn data_that_lie_far_apart_settle_too() {
        let xs: Vec<f64> =
            (0..40).flat_map(|i| [f64::from(i), 1e6 * f64::from(i * i % 7)]).collect();
        let classes: Vec<usize> = (0..40).map(|i| usize::from(i > 19)).collect();
        for c in [1e-6, 1.0, 1e6] {
            let fit = logistic(&xs, 2, &classes, 2, c).expect("there is one");
            assert!(fit.weights[0] > 0.0);
        }
    }

    #[test]
    fn three_classes_apart_settle_whatever_the_penalty() {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        for trial in 0..8 {
            let (n, d) = (90, 13);
            let classes: Vec<usize> = (0..n).map(|i| i % 3).collect();
            let draw = |class: usize| {
                move |rng: &mut ChaCha8Rng, j: usize| {
                    rng.random::<f64>() * 2.0 - 1.0 + if j % 3 == class { 1.5 } else { 0.0 }
                }
            };
            let xs: Vec<f64> = classes
                .iter()
                .flat_map(|class| (0..d).map(|j| draw(*class)(&mut rng, j)).collect::<Vec<_>>())
                .collect();
            for c in [1e-3, 0.1, 1.0, 10.0, 1e3] {
                let fit = logistic(&xs, d, &classes, 3, c);
                let fit = fit.unwrap_or_else(|why| panic!("{why} in trial {trial} at {c}"));
                assert!(fit.intercepts.iter().sum::<f64>().abs() < 1e-6, "{fit:?}");
            }
        }
    }

    #[test]
    fn the_intercepts_of_a_softmax_do_not_drift() {
        let x = DMatrix::from_fn(9, 2, |n, j| real((n * 5 + j * 3) % 7) - 3.0);
        let targets = DMatrix::from_fn(9, 3, |n, k| f64::from(u8::from(n % 3 == k)));
        let problem = Problem { x, targets, penalty: 0.1 };
        let theta = problem.solved().expect("there is one");
        let shares = problem.shares(&theta);
        // What rounding leaves of a gradient points along them all together, where nothing is curved.
        let rounding = DMatrix::from_element(3, 3, 1e-12);
        let step = problem.newton_step(&shares, &(problem.gradient(&theta, &shares) + rounding));
        assert!(step.norm() < 1e-9, "{}", step.norm());
        assert!(problem.drift(&theta).abs() < 1e-9);
    }
}
