//! How far forecasts of a path are from the path that was taken: the measures of the nuScenes prediction challenge
//! (Caesar et al., 2020).
//!
//! A forecast has several modes, each a path with a probability. Measures at `k` look at the `k` most probable modes, and
//! at all where there are fewer.

use super::moments::{mean, real};

/// How far a mode is from the path that was taken, in the unit of both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Displacement {
    /// On average over time.
    pub average: f64,
    /// At the end.
    pub last: f64,
    /// Where it is farthest.
    pub largest: f64,
}

/// How far each mode of a forecast is from the path that was taken, in descending order of their probabilities; of modes
/// as probable, the first given is first.
///
/// ```text
/// d_it = ‖y_it − y_t‖₂    average_i = (1/T) Σ_t d_it    last_i = d_iT    largest_i = max_t d_it
/// ```
///
/// - `modes`: `[M, T]` points, mode by mode.
/// - `probabilities`: `[M]`; nothing but their order counts, and they need not sum to one.
/// - `taken`: `[T]` points at the same times.
///
/// # Errors
/// If there is no mode or no point, lengths differ, a coordinate is not finite or a probability is negative or no number.
pub fn displacements(
    modes: &[[f64; 2]],
    probabilities: &[f64],
    taken: &[[f64; 2]],
) -> Result<Vec<Displacement>, String> {
    let (n_modes, n_points) = (probabilities.len(), taken.len());
    if n_modes == 0 || n_points == 0 {
        return Err(format!("a forecast of {n_modes} modes of {n_points} points is none"));
    }
    if modes.len() != n_modes * n_points {
        let n = modes.len();
        return Err(format!(
            "{n_modes} modes of {n_points} points each are not the {n} points that are foretold"
        ));
    }
    if let Some(t) = taken.iter().position(|point| !is_finite(point)) {
        return Err(format!("point {t} of the path that was taken is {:?}", taken[t]));
    }
    if let Some(i) = modes.iter().position(|point| !is_finite(point)) {
        let (mode, t) = (i / n_points, i % n_points);
        return Err(format!("point {t} of mode {mode} is {:?}", modes[i]));
    }
    let is_weight = |p: &f64| p.is_finite() && *p >= 0.0;
    if let Some(mode) = probabilities.iter().position(|p| !is_weight(p)) {
        let p = probabilities[mode];
        return Err(format!("the probability of mode {mode} is {p}"));
    }
    let mut order: Vec<usize> = (0..n_modes).collect();
    order.sort_by(|&i, &j| probabilities[j].total_cmp(&probabilities[i]));
    Ok(order.into_iter().map(|mode| displacement(&modes[mode * n_points..], taken)).collect())
}

/// `minADE_k`: the least average displacement of the `k` most probable modes.
///
/// # Panics
/// If there is no mode, or `k` is none.
#[must_use]
pub fn min_ade(modes: &[Displacement], k: usize) -> f64 {
    least(modes, k, |mode| mode.average)
}

/// `minFDE_k`: the least displacement at the end of the `k` most probable modes.
///
/// # Panics
/// If there is no mode, or `k` is none.
#[must_use]
pub fn min_fde(modes: &[Displacement], k: usize) -> f64 {
    least(modes, k, |mode| mode.last)
}

/// Whether each of the `k` most probable modes is somewhere as far as `bound` from the path that was taken, or farther.
///
/// - `bound`: 2 m in the challenge.
///
/// # Panics
/// If there is no mode, or `k` is none.
#[must_use]
pub fn is_miss(modes: &[Displacement], k: usize, bound: f64) -> bool {
    least(modes, k, |mode| mode.largest) >= bound
}

/// `MissRate_k`: the share of forecasts that miss at `k`.
///
/// - `forecasts`: the [`displacements`] of each.
///
/// # Panics
/// If there is no forecast, or as [`is_miss`] does.
#[must_use]
pub fn miss_rate(forecasts: &[Vec<Displacement>], k: usize, bound: f64) -> f64 {
    assert!(!forecasts.is_empty(), "a share of forecasts");
    let missed = forecasts.iter().filter(|modes| is_miss(modes, k, bound)).count();
    real(missed) / real(forecasts.len())
}

fn least(modes: &[Displacement], k: usize, of: fn(&Displacement) -> f64) -> f64 {
    assert!(!modes.is_empty() && k > 0, "the least of some modes");
    modes.iter().take(k).map(of).fold(f64::INFINITY, f64::min)
}

fn displacement(mode: &[[f64; 2]], taken: &[[f64; 2]]) -> Displacement {
    let apart =
        |(a, b): (&[f64; 2], &[f64; 2])| ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt();
    let apart: Vec<f64> = mode.iter().zip(taken).map(apart).collect();
    Displacement {
        average: mean(&apart),
        last: apart[apart.len() - 1],
        largest: apart.iter().copied().fold(0.0, f64::max),
    }
}

fn is_finite(point: &[f64; 2]) -> bool {
    point.iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along a line from 0 to 2; a mode beside it by 1, one that ends on it after a detour of 3, and one that parts.
    const TAKEN: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]];
    const MODES: [[[f64; 2]; 3]; 3] = [
        [[0.0, 1.0], [1.0, 1.0], [2.0, 1.0]],
        [[0.0, 0.0], [1.0, 3.0], [2.0, 0.0]],
        [[0.0, 0.0], [1.0, 0.0], [5.0, 4.0]],
    ];

    fn found(probabilities: [f64; 3]) -> Vec<Displacement> {
        displacements(MODES.as_flattened(), &probabilities, &TAKEN).unwrap()
    }

    #[test]
    fn displacements_by_hand() {
        let [beside, detour, parts] = [(1.0, 1.0, 1.0), (1.0, 0.0, 3.0), (5.0 / 3.0, 5.0, 5.0)]
            .map(|(average, last, largest)| Displacement { average, last, largest });
        let modes = found([0.2, 0.3, 0.5]);
        assert_eq!(modes, [parts, detour, beside]);
        assert_eq!([1, 2, 3, 9].map(|k| min_ade(&modes, k)), [5.0 / 3.0, 1.0, 1.0, 1.0]);
        assert_eq!([1, 2, 3, 9].map(|k| min_fde(&modes, k)), [5.0, 0.0, 0.0, 0.0]);
        // The detour ends where it should, and is a miss.
        assert_eq!([1, 2, 3, 9].map(|k| is_miss(&modes, k, 2.0)), [true, true, false, false]);
        // As far as the bound is too far.
        assert!(is_miss(&modes, 2, 3.0) && !is_miss(&modes, 2, 3.1));
    }

    #[test]
    fn modes_as_probable_stay_in_order() {
        let averages = |p| found(p).iter().map(|mode| mode.largest).collect::<Vec<_>>();
        assert_eq!(averages([0.5, 0.5, 0.5]), [1.0, 3.0, 5.0]);
        assert_eq!(averages([0.0, 0.5, 0.5]), [3.0, 5.0, 1.0]);
    }

    #[test]
    fn a_forecast_of_one_point_is_as_far_in_all_ways() {
        let modes = displacements(&[[3.0, 4.0]], &[1.0], &[[0.0, 0.0]]).unwrap();
        assert_eq!(modes, [Displacement { average: 5.0, last: 5.0, largest: 5.0 }]);
        let near = displacements(&[[1.0, 0.0]], &[1.0], &[[0.0, 0.0]]).unwrap();
        assert_eq!(miss_rate(&[modes.clone(), near, modes.clone(), modes], 5, 2.0), 0.75);
    }

    #[test]
    fn what_is_no_forecast_is_told() {
        let why = |modes: &[[f64; 2]], p: &[f64], taken: &[[f64; 2]]| {
            displacements(modes, p, taken).unwrap_err()
        };
        let one = [[0.0, 0.0]];
        assert!(why(&[], &[], &one).contains("0 modes of 1 points"));
        assert!(why(&[], &[1.0], &[]).contains("1 modes of 0 points"));
        assert!(why(&one, &[0.5, 0.5], &one).contains("2 modes of 1 points"));
        assert!(why(&one, &[1.0], &TAKEN).contains("1 modes of 3 points"));
        let mut broken = MODES;
        broken[1][2][0] = f64::NAN;
        let broken = why(broken.as_flattened(), &[0.2, 0.3, 0.5], &TAKEN);
        assert!(broken.contains("point 2 of mode 1 is [NaN, 0.0]"), "{broken}");
        let taken = [[0.0, 0.0], [0.0, f64::INFINITY], [0.0, 0.0]];
        let taken = why(MODES.as_flattened(), &[0.2, 0.3, 0.5], &taken);
        assert!(taken.contains("point 1 of the path that was taken"), "{taken}");
        for p in [f64::NAN, -0.1, f64::INFINITY] {
            assert!(why(&one, &[p], &one).contains("the probability of mode 0"));
        }
    }
}
