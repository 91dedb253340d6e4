//! Groups of points about centres.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use crate::moments::real;

/// Points in groups, each about the mean of its points.
#[derive(Clone, Debug, PartialEq)]
pub struct Clusters {
    /// The centres: `[K, D]`, row by row.
    pub centres: Vec<f64>,
    /// The group of each point: `[N]`, that of the nearest centre, the first of those as near.
    pub groups: Vec<usize>,
    /// The sum of squared distances of points to their centres.
    pub inertia: f64,
}

/// Lloyd's algorithm (1982) from given centres: each point goes to the nearest centre, each centre to the mean of its
/// points, until no point changes its group or `most` rounds are over. A centre without points stays.
///
/// - `points`: `[N, D]`, row by row; `centres`: `[K, D]`.
///
/// # Panics
/// If there is no point, no centre, or a number that is none.
#[must_use]
pub fn lloyd(points: &[f64], mut centres: Vec<f64>, width: usize, most: usize) -> Clusters {
    assert!(!points.is_empty() && !centres.is_empty(), "points and centres");
    let mut groups = nearest(points, &centres, width);
    for _ in 0..most {
        let n_centres = centres.len() / width;
        let (mut sums, mut counts) = (vec![0.0; centres.len()], vec![0; n_centres]);
        for (point, (group, _)) in points.chunks_exact(width).zip(&groups) {
            counts[*group] += 1;
            let sum = &mut sums[group * width..][..width];
            sum.iter_mut().zip(point).for_each(|(sum, x)| *sum += x);
        }
        for (k, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            for d in k * width..(k + 1) * width {
                centres[d] = sums[d] / real(*count);
            }
        }
        let next = nearest(points, &centres, width);
        let settled = next.iter().zip(&groups).all(|(a, b)| a.0 == b.0);
        groups = next;
        if settled {
            break;
        }
    }
    let inertia = groups.iter().map(|(_, square)| square).sum();
    Clusters { centres, groups: groups.into_iter().map(|(group, _)| group).collect(), inertia }
}

/// First centres by k-means++ (Arthur and Vassilvitskii, 2007): the first is one of the points, evenly drawn, each other
/// one with a probability in proportion to its squared distance from the nearest centre so far.
///
/// Where all points are among the centres already, the last of them is repeated.
///
/// # Panics
/// If there is no point, or no centre is asked for.
#[must_use]
pub fn spread(points: &[f64], n_centres: usize, width: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    assert!(!points.is_empty() && n_centres > 0, "centres of points");
    let n = points.len() / width;
    let point = |i: usize| &points[i * width..][..width];
    let mut centres = point(rng.random_range(0..n)).to_vec();
    let mut squares = vec![f64::INFINITY; n];
    for _ in 1..n_centres {
        let last = centres[centres.len() - width..].to_vec();
        for (square, point) in squares.iter_mut().zip(points.chunks_exact(width)) {
            *square = square.min(squared(point, &last));
        }
        let mut left = rng.random::<f64>() * squares.iter().sum::<f64>();
        let farther = |square: &f64| {
            left -= square;
            left < 0.0
        };
        let drawn = squares.iter().position(farther);
        let far = || squares.iter().rposition(|square| *square > 0.0).unwrap_or(n - 1);
        centres.extend(point(drawn.unwrap_or_else(far)));
    }
    centres
}

/// The best of `times` groupings from centres that are drawn by [`spread`]: that of least inertia, the first of equals.
///
/// # Panics
/// As [`spread`] and [`lloyd`] do, or if it is none.
#[must_use]
pub fn kmeans(
    (points, width): (&[f64], usize),
    n_centres: usize,
    times: usize,
    rng: &mut ChaCha8Rng,
) -> Clusters {
    let all =
        (0..times).map(|_| lloyd(points, spread(points, n_centres, width, rng), width, 1_000));
    all.min_by(|a, b| a.inertia.total_cmp(&b.inertia)).expect("at least one")
}

/// The place of the nearest centre to each point, and its squared distance.
fn nearest(points: &[f64], centres: &[f64], width: usize) -> Vec<(usize, f64)> {
    let of = |point: &[f64]| {
        let squares = centres.chunks_exact(width).map(|centre| squared(point, centre));
        squares.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).expect("a centre")
    };
    points.chunks_exact(width).map(of).collect()
}

fn squared(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;

    use super::*;

    #[test]
    fn groups_by_hand() {
        // On a line, 0 is nearer to 0 and all others to 1: means 0 and 6¼. Then 1 goes over: means ½ and 8.
        let points = [0.0, 1.0, 5.0, 9.0, 10.0];
        let found = lloyd(&points, vec![0.0, 1.0], 1, 10);
        assert_eq!((found.centres, found.groups), (vec![0.5, 8.0], vec![0, 0, 1, 1, 1]));
        assert_eq!(found.inertia, 0.25 * 2.0 + 9.0 + 1.0 + 4.0);
        // After one round 1 has gone over, and means are not yet taken again.
        let early = lloyd(&points, vec![0.0, 1.0], 1, 1);
        assert_eq!((early.centres, early.groups), (vec![0.0, 6.25], vec![0, 0, 1, 1, 1]));
        // As near to both: the first. Without points a centre stays.
        let found = lloyd(&[0.0, 2.0], vec![1.0, 1.0, 50.0], 1, 10);
        assert_eq!((found.centres, found.groups), (vec![1.0, 1.0, 50.0], vec![0, 0]));
    }

    #[test]
    fn centres_are_drawn_from_points_far_apart() {
        let points = [0.0, 0.0, 0.0, 1.0, 100.0, 0.0];
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let mut far = 0;
        for _ in 0..200 {
            let centres = spread(&points, 2, 2, &mut rng);
            let one = |centre: &[f64]| points.chunks_exact(2).any(|point| point == centre);
            assert!(centres.chunks_exact(2).all(one) && centres[..2] != centres[2..]);
            far += usize::from(centres[0] + centres[2] == 100.0);
        }
        // But for 1 in 10 000, whatever was drawn first.
        assert!(far >= 198, "{far}");
        assert_eq!(spread(&[3.0, 3.0], 3, 1, &mut rng), [3.0; 3]);
    }

    #[test]
    fn the_best_of_several_groupings_finds_groups_that_there_are() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let corners = [[0.0, 0.0], [9.0, 0.0], [0.0, 9.0], [9.0, 9.0]];
        let near = |i: usize| corners[i % 4].map(|x| x + (real(i) * 0.37).sin() / 2.0);
        let points: Vec<f64> = (0..80).flat_map(near).collect();
        let found = kmeans((&points, 2), 4, 5, &mut rng);
        assert!(found.inertia < 80.0 * 0.5, "{}", found.inertia);
        assert!((0..80).all(|i| found.groups[i] == found.groups[i % 4]));
        assert!(
            found.groups[..4]
                .iter()
                .all(|g| found.groups[..4].iter().filter(|h| *h == g).count() == 1)
        );
    }
}
