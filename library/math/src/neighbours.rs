//! The nearest of many points.

/// The places of the `k` points nearest to `at` by Euclidean distance, nearest first; the earlier where two are as near.
///
/// - `points`: `[N, D]`, row by row, where `at` is `[D]`.
///
/// # Panics
/// If there are fewer points, or a distance is not a number.
#[must_use]
pub fn nearest(points: &[f64], at: &[f64], k: usize) -> Vec<usize> {
    let squares = points
        .chunks_exact(at.len())
        .map(|point| point.iter().zip(at).map(|(a, b)| (a - b).powi(2)).sum::<f64>());
    let mut all: Vec<(f64, usize)> = squares.zip(0..).collect();
    assert!((1..=all.len()).contains(&k), "{k} of {} points", all.len());
    let by_distance =
        |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1));
    all.select_nth_unstable_by(k - 1, by_distance);
    all.truncate(k);
    all.sort_unstable_by(by_distance);
    all.into_iter().map(|(_, place)| place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_by_hand() {
        // From (1, 0): √2, 1, 2 and 1 away.
        let points = [0.0, 1.0, 1.0, 1.0, -1.0, 0.0, 2.0, 0.0];
        assert_eq!(nearest(&points, &[1.0, 0.0], 1), [1]);
        assert_eq!(nearest(&points, &[1.0, 0.0], 2), [1, 3]);
        assert_eq!(nearest(&points, &[1.0, 0.0], 4), [1, 3, 0, 2]);
    }
}
