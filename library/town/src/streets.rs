//! What is about a car as the town knows it, from above: lanes and cars.

use crate::body::Body;
use crate::geometry::{Pose, wrapped};
use crate::town::Town;

/// Metres by which a lane that is on the same level is higher or lower at most.
const LEVEL: f64 = 4.0;
/// Metres between points that are marked.
const FINE: f64 = 0.5;

/// How many pictures there are: lanes on which cars drive as the car does, or nearly so, other lanes, and other cars.
pub const N_STREETS: usize = 3;

/// Pictures from above of `cells` by `cells` each, forward and to the right from `half` metres behind and left of the car:
/// 1 where there is such a thing, and 0 elsewhere. `[3, cells, cells]`.
///
/// # Panics
/// If `out` is of another size.
pub fn streets(
    town: &Town,
    pose: &Pose,
    cars: &[Body],
    (half, cells): (f64, usize),
    out: &mut [u8],
) {
    assert_eq!(out.len(), N_STREETS * cells * cells, "a cell is a number");
    out.fill(0);
    #[expect(clippy::cast_precision_loss, reason = "cells are few")]
    let scale = cells as f64 / (2.0 * half);
    let mut mark = |channel: usize, place: [f64; 2]| {
        let [x, y] = pose.inward(place).map(|x| (x + half) * scale);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "casts of what is outside saturate, and what is below 0 is told by its sign"
        )]
        let [row, column] = [x as usize, y as usize];
        if x >= 0.0 && y >= 0.0 && row < cells && column < cells {
            out[(channel * cells + row) * cells + column] = 1;
        }
    };
    let reach = half * std::f64::consts::SQRT_2;
    for (lane, points) in town.centres.iter().enumerate() {
        if !town.network.is_driven(lane) {
            continue;
        }
        for point in points {
            let own = &point.pose;
            let near = (own.x - pose.x).abs() < reach && (own.y - pose.y).abs() < reach;
            if !near || (own.z - pose.z).abs() > LEVEL {
                continue;
            }
            let with = wrapped(own.yaw - pose.yaw).abs() < std::f64::consts::FRAC_PI_2;
            let mut aside = FINE / 2.0 - point.width / 2.0;
            while aside < point.width / 2.0 {
                mark(usize::from(!with), own.outward([0.0, aside]));
                aside += FINE;
            }
        }
    }
    for car in cars {
        let [a, b, _, d] = car.corners();
        let steps = |to: [f64; 2]| ((to[0] - a[0]).hypot(to[1] - a[1]) / FINE).ceil().max(1.0);
        let (long, wide) = (steps(b), steps(d));
        let shares =
            |n: f64| std::iter::successors(Some(0.0), move |i| (*i < n).then_some(i + 1.0));
        for i in shares(long).map(|i| i / long) {
            for j in shares(wide).map(|j| j / wide) {
                let along = |k: usize| a[k] + i * (b[k] - a[k]) + j * (d[k] - a[k]);
                mark(2, [along(0), along(1)]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::town_map;
    use crate::town::town;

    #[test]
    fn lanes_and_cars_are_where_they_are() {
        let town = town(town_map("Town01").unwrap());
        let network = &town.network;
        let straight = |lane: &usize| {
            let points = &town.centres[*lane];
            network.is_driven(*lane)
                && network.junction(*lane).is_none()
                && points[points.len() - 1].along > 80.0
                && wrapped(points[points.len() - 1].pose.yaw - points[0].pose.yaw).abs() < 1e-3
        };
        let lane = (0..network.lanes.len()).find(straight).unwrap();
        let pose = crate::centre::pose_along(&town.centres[lane], 40.0);
        let ahead =
            Pose { x: pose.outward([12.0, 0.0])[0], y: pose.outward([12.0, 0.0])[1], ..pose };
        let cells = 50;
        let mut found = vec![9; N_STREETS * cells * cells];
        streets(&town, &pose, &[Body::car(ahead, [0.0, 0.0])], (25.0, cells), &mut found);
        let at = |channel: usize, forward: i32, right: i32| {
            let cell = |x: i32| usize::try_from(x + 25).unwrap();
            found[(channel * cells + cell(forward)) * cells + cell(right)]
        };
        // Its own lane is below it and ahead, about 4 m wide; to the left is that of those who come, and farther no street.
        for forward in [-20, -5, 0, 5, 20] {
            assert_eq!((at(0, forward, 0), at(1, forward, 0)), (1, 0));
            assert_eq!((at(0, forward, -4), at(1, forward, -4)), (0, 1));
            assert_eq!((at(0, forward, -12), at(1, forward, -12)), (0, 0));
            assert_eq!((at(0, forward, 4), at(1, forward, 4)), (0, 0));
        }
        let of_cars: Vec<usize> =
            (2 * cells * cells..3 * cells * cells).filter(|i| found[*i] == 1).collect();
        assert!((8..=20).contains(&of_cars.len()), "a car has about 4.7 m by 1.9 m: {of_cars:?}");
        assert_eq!((at(2, 12, 0), at(2, 8, 0), at(2, 12, -3)), (1, 0, 0));
    }
}
