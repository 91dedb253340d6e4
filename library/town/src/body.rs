//! Rectangles that cars take up.

use crate::geometry::Pose;

/// Metres from bumper to bumper: a Ford Mustang, as CARNOVEL's agent drives.
pub const LENGTH: f64 = 4.7;
/// Metres from side to side, without mirrors.
pub const BREADTH: f64 = 1.9;
/// Bodies whose heights differ by more, in metres, are on different roads.
const LEVEL: f64 = 3.0;

/// A rectangle on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Its middle and direction.
    pub pose: Pose,
    /// Cosine and sine of its yaw.
    direction: [f64; 2],
    /// Half its length and breadth, in metres.
    half: [f64; 2],
    /// Metres from its middle to its corners.
    reach: f64,
}

impl Body {
    /// A car that is larger by so many metres at its ends, and at its sides.
    #[must_use]
    pub fn car(pose: Pose, [ends, sides]: [f64; 2]) -> Self {
        let (sin, cos) = pose.yaw.sin_cos();
        let half = [LENGTH / 2.0 + ends, BREADTH / 2.0 + sides];
        Self { pose, direction: [cos, sin], half, reach: half[0].hypot(half[1]) }
    }

    /// Metres from its middle to its corners.
    pub(crate) fn reach(&self) -> f64 {
        self.reach
    }

    /// Its corners: front left, front right, rear right, rear left.
    #[must_use]
    pub fn corners(&self) -> [[f64; 2]; 4] {
        let [l, w] = self.half;
        [[l, -w], [l, w], [-l, w], [-l, -w]].map(|corner| self.pose.outward(corner))
    }

    /// Whether two rectangles overlap: they do not if they are apart along a side of one of them.
    #[must_use]
    pub fn overlaps(&self, other: &Self) -> bool {
        let between = [other.pose.x - self.pose.x, other.pose.y - self.pose.y];
        let far = self.reach + other.reach;
        if between[0] * between[0] + between[1] * between[1] > far * far
            || (other.pose.z - self.pose.z).abs() > LEVEL
        {
            return false;
        }
        let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        let across = |[x, y]: [f64; 2]| [-y, x];
        let axes =
            [self.direction, across(self.direction), other.direction, across(other.direction)];
        axes.iter().all(|axis| {
            let half = |body: &Self| {
                body.half[0] * dot(body.direction, *axis).abs()
                    + body.half[1] * dot(across(body.direction), *axis).abs()
            };
            dot(between, *axis).abs() <= half(self) + half(other)
        })
    }

    /// How far a ray goes until it enters and until it leaves it, if it does, in units of its direction.
    ///
    /// - `from`, `through`: two points of the ray.
    pub(crate) fn crossed_by(&self, from: [f64; 2], through: [f64; 2]) -> Option<[f64; 2]> {
        let [start, next] = [from, through].map(|point| self.pose.inward(point));
        let mut span = [0.0_f64, f64::INFINITY];
        for i in 0..2 {
            let by = next[i] - start[i];
            let sides = [-self.half[i], self.half[i]].map(|side| (side - start[i]) / by);
            if by.abs() < 1e-12 {
                if start[i].abs() > self.half[i] {
                    return None;
                }
                continue;
            }
            span = [span[0].max(sides[0].min(sides[1])), span[1].min(sides[0].max(sides[1]))];
        }
        (span[0] <= span[1]).then_some(span)
    }

    /// Least and largest `x` and `y`, as `[x, y, x, y]`.
    pub(crate) fn bounds(&self) -> [f64; 4] {
        let [x, y] = [0, 1].map(|i| {
            let j = 1 - i;
            self.half[0] * self.direction[i].abs() + self.half[1] * self.direction[j].abs()
        });
        [self.pose.x - x, self.pose.y - y, self.pose.x + x, self.pose.y + y]
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    use super::*;

    fn at(x: f64, y: f64, yaw: f64) -> Body {
        Body::car(Pose { x, y, yaw, ..Pose::default() }, [0.0, 0.0])
    }

    #[test]
    fn cars_overlap_where_no_side_parts_them() {
        let car = at(0.0, 0.0, 0.0);
        assert!(car.overlaps(&at(4.69, 0.0, 0.0)) && !car.overlaps(&at(4.71, 0.0, 0.0)));
        assert!(car.overlaps(&at(0.0, 1.89, 0.0)) && !car.overlaps(&at(0.0, 1.91, 0.0)));
        // Across: half a length and half a breadth.
        assert!(
            car.overlaps(&at(3.29, 0.0, FRAC_PI_2)) && !car.overlaps(&at(3.31, 0.0, FRAC_PI_2))
        );
        // Aslant at the corner, 1.2 m of its own length past the corner: only its own sides part them.
        let d = (LENGTH / 2.0 + 0.01) * FRAC_PI_4.cos();
        assert!(!car.overlaps(&at(LENGTH / 2.0 + d, BREADTH / 2.0 + d, FRAC_PI_4)));
        assert!(car.overlaps(&at(LENGTH / 2.0 + d - 0.02, BREADTH / 2.0 + d - 0.02, FRAC_PI_4)));
        let above = Body { pose: Pose { z: 5.0, ..Pose::default() }, ..car };
        assert!(!car.overlaps(&above));
    }

    #[test]
    fn bounds_are_around_corners() {
        let car = at(1.0, 2.0, 0.7);
        let [x, y, far_x, far_y] = car.bounds();
        for [cx, cy] in car.corners() {
            assert!(cx >= x - 1e-9 && cx <= far_x + 1e-9 && cy >= y - 1e-9 && cy <= far_y + 1e-9);
        }
        let most = car.corners().iter().map(|c| c[0]).fold(f64::MIN, f64::max);
        assert!((most - far_x).abs() < 1e-9);
    }
}
