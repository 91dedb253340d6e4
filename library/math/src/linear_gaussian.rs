//! Linear regression with Gaussian noise and a Gaussian prior (§2.2.1).
//!
//! ```text
//! y = X θ + ε,   ε ~ N(0, σ² I),   θ ~ N(m 1, s² I)
//! ```
//!
//! Powers up to 20 make `XᵀX` singular in double precision, so nothing here forms it: the
//! posterior comes from the QR decomposition of the stacked matrix `[X/σ; I/s]`.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use super::moments::real;

/// A regression problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Regression {
    /// `X`: `[N, D]`, one row a datum.
    pub design: DMatrix<f64>,
    /// `y`: `[N]`.
    pub targets: DVector<f64>,
    /// `σ`, the standard deviation of the noise.
    pub noise: f64,
    /// `m`, the prior mean of every parameter.
    pub prior_mean: f64,
    /// `s`, the prior standard deviation of every parameter.
    pub prior_std: f64,
}

/// The belief after the data: `θ ~ N(mean, root rootᵀ)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Belief {
    /// `[D]`; also the MAP estimate, since a normal density peaks at its mean.
    pub mean: DVector<f64>,
    /// `[D, D]`, upper triangular.
    pub root: DMatrix<f64>,
    /// `log p(y)`.
    pub log_evidence: f64,
}

/// `1, x, …, x^degree` of every input, one row each (Eqn. 2.18b).
#[must_use]
pub fn powers(xs: &[f64], degree: usize) -> DMatrix<f64> {
    let mut design = DMatrix::from_element(xs.len(), degree + 1, 1.0);
    for (n, x) in xs.iter().enumerate() {
        for d in 1..=degree {
            design[(n, d)] = design[(n, d - 1)] * x;
        }
    }
    design
}

/// The posterior belief (Eqn. 2.13).
///
/// With `[X/σ; I/s] = Q R` and `b = [y/σ; m/s]`:
///
/// ```text
/// mean = R⁻¹ Qᵀ b,   root = R⁻¹,
/// log p(y) = −N/2 log 2π − N log σ − D log s − Σ log |R_dd| − ½ ‖b − [X/σ; I/s] mean‖²
/// ```
///
/// # Panics
/// If `noise` or `prior_std` is not positive.
#[must_use]
pub fn posterior(regression: &Regression) -> Belief {
    let Regression { design, targets, noise, prior_mean, prior_std } = regression;
    assert!(*noise > 0.0 && *prior_std > 0.0, "noise and prior must have spread");
    let (n, d) = design.shape();
    let stacked = DMatrix::from_fn(n + d, d, |i, j| match i.checked_sub(n) {
        None => design[(i, j)] / noise,
        Some(k) if k == j => 1.0 / prior_std,
        Some(_) => 0.0,
    });
    let rhs =
        DVector::from_fn(
            n + d,
            |i, _| {
                if i < n { targets[i] / noise } else { prior_mean / prior_std }
            },
        );

    let qr = stacked.clone().qr();
    let r = qr.r();
    let solvable = "`I/s` gives the stack full column rank";
    let mean = r.solve_upper_triangular(&(qr.q().transpose() * &rhs)).expect(solvable);
    let root = r.solve_upper_triangular(&DMatrix::identity(d, d)).expect(solvable);
    let log_det: f64 = r.diagonal().iter().map(|x| x.abs().ln()).sum();
    let residual = (rhs - stacked * &mean).norm_squared();
    let log_evidence = -0.5 * real(n) * TAU.ln()
        - real(n) * noise.ln()
        - real(d) * prior_std.ln()
        - log_det
        - 0.5 * residual;
    Belief { mean, root, log_evidence }
}

/// The parameters of least squared error, of least norm where several have it (Eqn. 2.15).
///
/// Singular values below `max(N, D) ε` times the largest count as zero, where `ε = 2⁻⁵²`. The solution is refined
/// once: where powers make it large, what rounding leaves of the residual would be above what is left by the data.
///
/// # Panics
/// If there are no data.
#[must_use]
pub fn least_squares(design: &DMatrix<f64>, targets: &DVector<f64>) -> DVector<f64> {
    let (n, d) = design.shape();
    assert!(n > 0, "least squares of some data");
    let svd = design.clone().svd(true, true);
    let cut = svd.singular_values.max() * real(n.max(d)) * f64::EPSILON;
    let solve = |targets: &DVector<f64>| svd.solve(targets, cut).expect("both bases were computed");
    let theta = solve(targets);
    let left = solve(&(targets - design * &theta));
    theta + left
}

/// `−log p(y | θ)`.
#[must_use]
pub fn neg_log_likelihood(regression: &Regression, theta: &DVector<f64>) -> f64 {
    let residuals = &regression.targets - &regression.design * theta;
    neg_log_normal(&residuals, regression.noise)
}

/// `−log p(θ)`.
#[must_use]
pub fn neg_log_prior(regression: &Regression, theta: &DVector<f64>) -> f64 {
    neg_log_normal(&theta.add_scalar(-regression.prior_mean), regression.prior_std)
}

/// The gradient by `θ` of `−log p(y | θ) − log p(θ)` (Eqn. 2.16d):
/// `Xᵀ(Xθ − y)/σ² + (θ − m)/s²`.
#[must_use]
pub fn neg_log_posterior_gradient(regression: &Regression, theta: &DVector<f64>) -> DVector<f64> {
    let residuals = &regression.design * theta - &regression.targets;
    regression.design.transpose() * residuals / regression.noise.powi(2)
        + theta.add_scalar(-regression.prior_mean) / regression.prior_std.powi(2)
}

/// Minus the log density of independent normals with mean 0.
fn neg_log_normal(deviations: &DVector<f64>, std: f64) -> f64 {
    let n = real(deviations.len());
    0.5 * deviations.norm_squared() / std.powi(2) + n * std.ln() + 0.5 * n * TAU.ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn regression() -> Regression {
        Regression {
            design: powers(&[-1.0, 0.5, 2.0], 2),
            targets: DVector::from_vec(vec![1.0, -0.5, 3.0]),
            noise: 0.5,
            prior_mean: 0.25,
            prior_std: 2.0,
        }
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-9
    }

    #[test]
    fn one_parameter_and_one_datum() {
        // Precision 1/4 + 2²/1 = 4.25; mean = (2·3/1 + 1/4) / 4.25; y ~ N(2·1, 1 + 4·4 = 17).
        let belief = posterior(&Regression {
            design: DMatrix::from_element(1, 1, 2.0),
            targets: DVector::from_element(1, 3.0),
            noise: 1.0,
            prior_mean: 1.0,
            prior_std: 2.0,
        });
        assert!(close(belief.mean[0], 6.25 / 4.25));
        assert!(close(belief.root[(0, 0)].powi(2), 1.0 / 4.25));
        assert!(close(belief.log_evidence, -0.5 * (TAU * 17.0).ln() - 0.5 / 17.0));
    }

    #[test]
    fn without_data_the_belief_is_the_prior() {
        let prior =
            Regression { design: powers(&[], 2), targets: DVector::zeros(0), ..regression() };
        let belief = posterior(&prior);
        assert!(belief.mean.iter().all(|m| close(*m, 0.25)));
        assert!(close((&belief.root * belief.root.transpose())[(1, 1)], 4.0));
        assert!(close(belief.log_evidence, 0.0));
    }

    #[test]
    fn the_gradient_is_a_finite_difference_and_vanishes_at_the_mode() {
        let problem = regression();
        let loss = |theta: &DVector<f64>| {
            neg_log_likelihood(&problem, theta) + neg_log_prior(&problem, theta)
        };
        let theta = DVector::from_vec(vec![0.3, -1.0, 0.7]);
        let gradient = neg_log_posterior_gradient(&problem, &theta);
        for d in 0..3 {
            let mut step = DVector::zeros(3);
            step[d] = 1e-5;
            let difference = (loss(&(&theta + &step)) - loss(&(&theta - &step))) / 2e-5;
            assert!((difference - gradient[d]).abs() < 1e-6);
        }
        let mode = posterior(&problem).mean;
        assert!(neg_log_posterior_gradient(&problem, &mode).norm() < 1e-12);
    }

    #[test]
    fn bayes_rule_holds_at_any_parameters() {
        // log p(y) = log p(y|θ) + log p(θ) − log p(θ|y) for every θ; here at the mean, where
        // log p(θ|y) = −D/2 log 2π − Σ log |root_dd|.
        let problem = regression();
        let belief = posterior(&problem);
        let log_det: f64 = belief.root.diagonal().iter().map(|x| x.abs().ln()).sum();
        let at_mean = -1.5 * TAU.ln() - log_det;
        let joint =
            -neg_log_likelihood(&problem, &belief.mean) - neg_log_prior(&problem, &belief.mean);
        assert!(close(belief.log_evidence, joint - at_mean));
    }

    #[test]
    fn least_squares_takes_the_smallest_of_many_solutions() {
        // θ_0 + θ_1 = 2 has the least norm at (1, 1).
        let theta = least_squares(&powers(&[1.0], 1), &DVector::from_element(1, 2.0));
        assert!(close(theta[0], 1.0) && close(theta[1], 1.0));
        // Through (0, 1) and (2, 5) goes 1 + 2x.
        let theta = least_squares(&powers(&[0.0, 2.0], 1), &DVector::from_vec(vec![1.0, 5.0]));
        assert!(close(theta[0], 1.0) && close(theta[1], 2.0));
    }
}
