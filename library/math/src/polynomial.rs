//! Polynomials.

/// `θ_0 + θ_1 x + … + θ_d x^d` at each place (Eqn. 2.18b).
#[must_use]
pub fn polynomial(theta: &[f64], xs: &[f64]) -> Vec<f64> {
    xs.iter().map(|x| theta.iter().rev().fold(0.0, |sum, c| sum * x + c)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_constant_comes_first() {
        // 1 − 2x + 3x²
        assert_eq!(polynomial(&[1.0, -2.0, 3.0], &[0.0, 2.0, -1.0]), [1.0, 9.0, 6.0]);
        assert_eq!(polynomial(&[], &[5.0]), [0.0]);
    }
}
