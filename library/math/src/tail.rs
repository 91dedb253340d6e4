//! Shares of the tail of a discrete distribution.

/// How much each atom weighs in the mean of the lowest `alpha` of the probability mass.
///
/// The atom at the edge is split; among equal atoms the first is taken first. The weights sum
/// to one, and `Σ w_i x_i` is the conditional value at risk
///
/// ```text
/// CVaR_α = (1/α) ∫_0^α F⁻¹(u) du
/// ```
///
/// of which they are a subgradient in `x`.
///
/// # Panics
/// If there is not one probability an atom, no atom is possible, or `alpha` is not positive.
#[must_use]
pub fn lower_tail(xs: &[f64], probabilities: &[f64], alpha: f64) -> Vec<f64> {
    assert_eq!(xs.len(), probabilities.len(), "one probability an atom");
    assert!(alpha > 0.0, "`alpha` must be positive");
    let mut order: Vec<usize> = support(probabilities).collect();
    assert!(!order.is_empty(), "some atom must be possible");
    order.sort_by(|&i, &j| xs[i].total_cmp(&xs[j]));

    let mut weights = vec![0.0; xs.len()];
    let mut left = alpha;
    for i in order {
        weights[i] = probabilities[i].min(left);
        left -= weights[i];
    }
    let mass: f64 = weights.iter().sum();
    weights.iter().map(|w| w / mass).collect()
}

/// How much each atom weighs in the mean of the highest `alpha` of the probability mass.
///
/// # Panics
/// As [`lower_tail`].
#[must_use]
pub fn upper_tail(xs: &[f64], probabilities: &[f64], alpha: f64) -> Vec<f64> {
    let mirrored: Vec<f64> = xs.iter().map(|x| -x).collect();
    lower_tail(&mirrored, probabilities, alpha)
}

/// The places of what is possible.
pub fn support(probabilities: &[f64]) -> impl Iterator<Item = usize> {
    (0..probabilities.len()).filter(|&i| probabilities[i] > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_atom_at_the_edge_is_split() {
        // Half the mass: all of −1 (0.25) and 0.25 of the 0.5 at 2.
        let (xs, ps) = ([5.0, -1.0, 2.0], [0.25, 0.25, 0.5]);
        assert_eq!(lower_tail(&xs, &ps, 0.5), [0.0, 0.5, 0.5]);
        assert_eq!(upper_tail(&xs, &ps, 0.5), [0.5, 0.0, 0.5]);
        assert_eq!(lower_tail(&xs, &ps, 1.0), ps);
    }

    #[test]
    fn impossible_atoms_weigh_nothing() {
        assert_eq!(lower_tail(&[-99.0, 1.0, 1.0], &[0.0, 0.5, 0.5], 0.1), [0.0, 1.0, 0.0]);
    }
}
