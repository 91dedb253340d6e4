//! The lane that is nearest to a point.

use crate::centre::Point;
use crate::geometry::Pose;
use crate::grid::Grid;
use crate::lanes::{At, Network};

/// Sections by which the place on a lane is refined: `0.618³⁰` of what is looked at is less than a micrometre.
const N_REFINED: usize = 30;
/// What is looked at before and behind the nearest place of a step, in metres.
const AROUND: f64 = 0.75;
/// `(√5 - 1)/2`.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// Distances that differ by less are those of the same place, in metres.
const SAME: f64 = 1e-6;

/// Where driving lanes are.
#[derive(Clone, Debug)]
pub struct Nearest {
    grid: Grid<Step>,
}

/// A step of the middle of a lane.
#[derive(Clone, Copy, Debug)]
struct Step {
    lane: usize,
    s: [f64; 2],
    from: [f64; 3],
    by: [f64; 3],
}

/// Sorts the middles of driving lanes by place.
///
/// - `centres`: of each lane of the network.
#[must_use]
pub fn nearest(network: &Network, centres: &[Vec<Point>]) -> Nearest {
    let driven = (0..centres.len()).filter(|lane| network.is_driven(*lane));
    let steps = driven.flat_map(|lane| {
        centres[lane].windows(2).map(move |ends| {
            let [from, to] = [ends[0].pose, ends[1].pose].map(|pose| [pose.x, pose.y, pose.z]);
            let by = [0, 1, 2].map(|i| to[i] - from[i]);
            Step { lane, s: [ends[0].s, ends[1].s], from, by }
        })
    });
    let boxes: Vec<([f64; 4], Step)> = steps
        .map(|step| {
            let [x, y] = [0, 1].map(|i| [step.from[i], step.from[i] + step.by[i]]);
            ([x[0].min(x[1]), y[0].min(y[1]), x[0].max(x[1]), y[0].max(y[1])], step)
        })
        .collect();
    Nearest { grid: Grid::of(&boxes, 4.0) }
}

impl Nearest {
    /// The place in the middle of a driving lane that is nearest to a point, and how far that is, in metres; `None` in a
    /// network without such lanes, and for a point that is none.
    ///
    /// - `point`: `x`, `y`, `z`. Heights count, so that bridges and what is below them are told apart.
    #[must_use]
    pub fn find(&self, network: &Network, point: [f64; 3]) -> Option<(At, f64)> {
        self.find_where(network, point, |_| true)
    }

    /// As `find`, of lanes that go the way of a pose: less than 90° away from it.
    #[must_use]
    pub fn find_along(&self, network: &Network, pose: &Pose) -> Option<(At, f64)> {
        let (sin, cos) = pose.yaw.sin_cos();
        let along = |step: &Step| step.by[0] * cos + step.by[1] * sin > 0.0;
        self.find_where(network, [pose.x, pose.y, pose.z], along)
    }

    fn find_where(
        &self,
        network: &Network,
        point: [f64; 3],
        fits: impl Fn(&Step) -> bool,
    ) -> Option<(At, f64)> {
        if !point.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut best: Option<(f64, &Step, f64)> = None;
        self.grid.around([point[0], point[1]], |step| {
            let to = [0, 1, 2].map(|i| point[i] - step.from[i]);
            let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let share = (dot(to, step.by) / dot(step.by, step.by).max(1e-30)).clamp(0.0, 1.0);
            let apart = [0, 1, 2].map(|i| to[i] - share * step.by[i]);
            let far = dot(apart, apart).sqrt();
            let nearer = best.is_none_or(|(least, before, _)| {
                far < least - SAME || (far < least + SAME && step.lane < before.lane)
            });
            if nearer && fits(step) {
                best = Some((far, step, share));
            }
            best.map_or(f64::INFINITY, |(least, ..)| least)
        });
        let (_, step, share) = best?;
        let at = At { lane: step.lane, s: step.s[0] + share * (step.s[1] - step.s[0]) };
        Some(refined(network, at, point))
    }
}

/// The place on a lane that is nearest to a point, and how far that is, by golden sections of a step and its neighbours.
fn refined(network: &Network, near: At, point: [f64; 3]) -> (At, f64) {
    let range = network.lanes[near.lane].range;
    let far = |s: f64| {
        let pose = network.pose(At { lane: near.lane, s });
        (point[0] - pose.x).hypot(point[1] - pose.y).hypot(point[2] - pose.z)
    };
    let [mut low, mut high] =
        [near.s - AROUND, near.s + AROUND].map(|s| s.clamp(range[0], range[1]));
    for _ in 0..N_REFINED {
        let cut = (high - low) * (1.0 - GOLDEN);
        if far(low + cut) <= far(high - cut) {
            high -= cut;
        } else {
            low += cut;
        }
    }
    // An end that was never moved is the place itself.
    let [s, least] = [low, f64::midpoint(low, high), high]
        .map(|s| [s, far(s)])
        .into_iter()
        .min_by(|a, b| a[1].total_cmp(&b[1]))
        .expect("there are three");
    (At { lane: near.lane, s }, least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::network;
    use crate::maps::town_map;

    #[test]
    fn the_nearest_lane_is_that_of_all() {
        let network = network(town_map("Town03").unwrap());
        let centres: Vec<Vec<Point>> =
            (0..network.lanes.len()).map(|lane| crate::centre::centre(&network, lane)).collect();
        let nearest = nearest(&network, &centres);
        // Near roads, between them, and far outside of the town; on the deck and below it.
        for (i, point) in (0..60)
            .map(|i| (f64::from(i), [f64::from(i * 37 % 400 - 200), f64::from(i * 61 % 400 - 200)]))
        {
            let point = [point[0], point[1], if i % 2.0 == 0.0 { 0.0 } else { 8.0 }];
            let (at, far) = nearest.find(&network, point).unwrap();
            let driven = centres.iter().enumerate().filter(|(lane, _)| network.is_driven(*lane));
            let least = driven.flat_map(|(_, points)| points).map(|p| {
                (p.pose.x - point[0]).hypot(p.pose.y - point[1]).hypot(p.pose.z - point[2])
            });
            let least = least.fold(f64::INFINITY, f64::min);
            assert!(far <= least + 1e-9 && far > least - 0.3, "{point:?} {at:?} {far} {least}");
        }
        let (_, far) = nearest.find(&network, [1e5, 0.0, 0.0]).unwrap();
        assert!((far - 1e5).abs() < 500.0);
        assert_eq!(nearest.find(&network, [f64::NAN, 0.0, 0.0]), None);
    }
}
