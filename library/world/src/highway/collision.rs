//! Whether cars run into each other.

use super::lane::{Point, norm};
use super::release::Release;
use super::vehicle::{BREADTH, DT, LENGTH, Vehicle};

/// What becomes of two cars within a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Contact {
    /// Whether they overlap now.
    pub(super) now: bool,
    /// By how much the first would have to be moved so that they do not overlap after the frame, if they do.
    pub(super) apart: Option<Point>,
}

impl Contact {
    const NONE: Self = Self { now: false, apart: None };

    /// How near the centre of another car must be to be looked at.
    pub(super) fn near(one: &Vehicle, release: &Release) -> f64 {
        release.near + one.speed * DT
    }

    /// That of two cars that drive straight on: they do not overlap if they are apart on an axis across a side of one
    /// of them. The axis on which they would overlap the least is that along which they are moved apart.
    pub(super) fn of(one: &Vehicle, other: &Vehicle, release: &Release) -> Self {
        let between = [0, 1].map(|i| one.at[i] - other.at[i]);
        if norm(between) > Self::near(one, release) {
            return Self::NONE;
        }
        let cars = [one, other].map(|car| Box { center: car.at, along: car.direction });
        let (ours, theirs) = (one.velocity(), other.velocity());
        let moved = [0, 1].map(|i| (ours[i] - theirs[i]) * DT);
        let (mut now, mut soon) = (true, true);
        let (mut least, mut apart) = (f64::INFINITY, [0.0, 0.0]);
        for axis in cars.iter().flat_map(Box::axes) {
            let [mut a, b] = [0, 1].map(|i| cars[i].shadow(axis));
            now &= gap(a, b) <= 0.0;
            let way = dot(axis, moved);
            if way < 0.0 {
                a.0 += way;
            } else {
                a.1 += way;
            }
            let gap = gap(a, b);
            soon &= gap <= 0.0;
            if !now && !soon {
                return Self::NONE;
            }
            if gap.abs() < least {
                least = gap.abs();
                apart = if dot(axis, between) > 0.0 { axis } else { axis.map(|x| -x) };
            }
        }
        Self { now, apart: soon.then(|| apart.map(|x| least * x)) }
    }
}

/// A rectangle as long and as wide as a car.
struct Box {
    center: Point,
    along: Point,
}

impl Box {
    /// Out of its sides: behind, right, front and left. Opposite ones differ in how far they say a car inside a
    /// larger shadow is from being outside.
    fn axes(&self) -> [Point; 4] {
        let [x, y] = self.along;
        [[-x, -y], [-y, x], [x, y], [y, -x]]
    }

    /// From where to where it is along an axis.
    fn shadow(&self, axis: Point) -> (f64, f64) {
        let [x, y] = self.along;
        let half =
            LENGTH / 2.0 * dot(axis, self.along).abs() + BREADTH / 2.0 * dot(axis, [-y, x]).abs();
        let center = dot(axis, self.center);
        (center - half, center + half)
    }
}

/// How far two intervals are apart; negative where they overlap.
fn gap(a: (f64, f64), b: (f64, f64)) -> f64 {
    if a.0 < b.0 { b.0 - a.1 } else { a.0 - b.1 }
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::highway::roads::highway;
    use crate::highway::vehicle::Pilot;

    fn contact(other: Point, heading: f64, speed: f64) -> Contact {
        let network = highway(3, &Release::V1_12);
        let car = |at, heading, speed| Vehicle::new(&network, at, heading, speed, Pilot::Held);
        Contact::of(&car([100.0, 4.0], 0.0, speed), &car(other, heading, 0.0), &Release::V1_12)
    }

    #[test]
    fn contacts_by_hand() {
        // Nose to tail at 0.5 m: standing they do not touch, at 15 m/s they overlap by 0.5 m after a frame.
        assert_eq!(contact([105.5, 4.0], 0.0, 0.0), Contact::NONE);
        let soon = contact([105.5, 4.0], 0.0, 15.0);
        assert!(!soon.now && soon.apart.is_some_and(|[x, y]| (x + 0.5).abs() < 1e-9 && y == 0.0));
        // Beside each other, 0.1 m too near: the first is moved to the left.
        let now = contact([101.0, 5.9], 0.0, 0.0);
        assert!(now.now && now.apart.is_some_and(|[x, y]| x == 0.0 && (y + 0.1).abs() < 1e-9));
        // A car across the lane reaches 1 m to each side of its centre, one on the diagonal 3.5 / √2.
        let across = std::f64::consts::FRAC_PI_2;
        assert!(!contact([103.6, 4.0], across, 0.0).now && contact([103.4, 4.0], across, 0.0).now);
        let (corner, aside) = (2.5 + 3.5 / 2.0_f64.sqrt(), 1.5 / 2.0_f64.sqrt());
        let diagonal = |by: f64| contact([100.0 + corner + by, 4.0 + aside], across / 2.0, 0.0).now;
        assert!(!diagonal(0.01) && diagonal(-0.01));
    }
}
