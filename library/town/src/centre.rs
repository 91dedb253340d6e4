//! The middles of lanes as points close to each other, in the direction of driving.

use crate::geometry::Pose;
use crate::lanes::{At, Network};

/// Most metres of road between two points.
const SPACING: f64 = 0.5;

/// A point in the middle of a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Place on the road.
    pub s: f64,
    /// Metres driven since the lane was entered.
    pub along: f64,
    /// As a car drives there.
    pub pose: Pose,
    /// Metres from edge to edge.
    pub width: f64,
}

/// The middle of a lane: at least two points, from where it is entered to where it is left.
#[must_use]
pub fn centre(network: &Network, lane: usize) -> Vec<Point> {
    let [from, to] = [network.start(lane).s, network.end(lane).s];
    let n_steps = ((to - from).abs() / SPACING).ceil().max(1.0);
    let mut points: Vec<Point> = Vec::new();
    let steps = std::iter::successors(Some(0.0), |i| (*i < n_steps).then_some(i + 1.0));
    for share in steps.map(|i| i / n_steps) {
        let s = from * (1.0 - share) + to * share;
        let at = At { lane, s };
        let pose = network.pose(at);
        let along = points.last().map_or(0.0, |last| last.along + last.pose.distance(&pose));
        points.push(Point { s, along, pose, width: network.width(at) });
    }
    points
}

/// The pose after `along` metres of a lane's middle, between its points.
#[must_use]
pub fn pose_along(points: &[Point], along: f64) -> Pose {
    let behind = points.partition_point(|point| point.along <= along).clamp(1, points.len() - 1);
    let [a, b] = [&points[behind - 1], &points[behind]];
    let share = ((along - a.along) / (b.along - a.along).max(1e-12)).clamp(0.0, 1.0);
    let mix = |from: f64, to: f64| from + share * (to - from);
    Pose {
        x: mix(a.pose.x, b.pose.x),
        y: mix(a.pose.y, b.pose.y),
        z: mix(a.pose.z, b.pose.z),
        yaw: a.pose.yaw + share * crate::geometry::wrapped(b.pose.yaw - a.pose.yaw),
        pitch: mix(a.pose.pitch, b.pose.pitch),
    }
}
