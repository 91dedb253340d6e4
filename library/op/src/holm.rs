//! Several tests at once.

/// Holm's adjusted probabilities: those of at most `α` are rejected with a chance of at most `α` to reject a true one
/// (Holm, 1979). What is not a number is adjusted to 1.
#[must_use]
pub fn holm(ps: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..ps.len()).collect();
    order.sort_by(|&i, &j| ps[i].total_cmp(&ps[j]));
    let mut adjusted = vec![1.0; ps.len()];
    let mut highest = 0.0_f64;
    for (rank, i) in order.iter().copied().enumerate() {
        #[expect(clippy::cast_precision_loss, reason = "tests are few")]
        let left = (ps.len() - rank) as f64;
        highest = if ps[i].is_nan() { 1.0 } else { highest.max(ps[i] * left).min(1.0) };
        adjusted[i] = highest;
    }
    adjusted
}
