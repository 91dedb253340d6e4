//! The course of a lane.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// `[x, y]` in metres.
pub(super) type Point = [f64; 2];

/// How wide all lanes are, in metres.
pub(super) const WIDTH: f64 = 4.0;
/// By how much a car is on a lane, or reaches it, beyond its ends.
const OVERHANG: f64 = 5.0;

/// A lane: its middle, how long it is and how fast one may drive there.
///
/// A place on it is `[along, across]`: metres from its start, and metres from its middle to the right as one drives with
/// `y` downwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lane {
    pub(super) course: Course,
    pub(super) length: f64,
    pub(super) limit: f64,
}

/// The middle of a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Course {
    Straight(Line),
    /// A wave about a line: `amplitude · sin(pulsation · along + phase)` across it.
    Sine {
        line: Line,
        amplitude: f64,
        pulsation: f64,
        phase: f64,
    },
    /// An arc about the origin against the clock as `y` points down: angles become smaller.
    Arc {
        radius: f64,
        start: f64,
    },
}

/// From where, in which direction, and its angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    pub(super) start: Point,
    pub(super) direction: Point,
    pub(super) heading: f64,
}

impl Line {
    fn between(start: Point, end: Point) -> (Self, f64) {
        let way = [end[0] - start[0], end[1] - start[1]];
        let length = norm(way);
        let direction = way.map(|x| x / length);
        (Self { start, direction, heading: way[1].atan2(way[0]) }, length)
    }

    fn point(&self, [along, across]: Point) -> Point {
        let ([x, y], [dx, dy]) = (self.start, self.direction);
        [x + along * dx - across * dy, y + along * dy + across * dx]
    }

    fn local(&self, at: Point) -> Point {
        let [dx, dy] = self.direction;
        let [x, y] = [at[0] - self.start[0], at[1] - self.start[1]];
        [x * dx + y * dy, y * dx - x * dy]
    }
}

/// A point as seen from the origin, reckoned once for all arcs about it.
#[derive(Clone, Copy)]
pub(super) struct Polar {
    radius: f64,
    angle: f64,
}

impl Polar {
    pub(super) fn of(at: Point) -> Self {
        Self { radius: norm(at), angle: at[1].atan2(at[0]) }
    }
}

impl Lane {
    pub(super) fn straight(start: Point, end: Point, limit: f64) -> Self {
        let (line, length) = Line::between(start, end);
        Self { course: Course::Straight(line), length, limit }
    }

    pub(super) fn sine(
        (start, end): (Point, Point),
        (amplitude, pulsation, phase): (f64, f64, f64),
        limit: f64,
    ) -> Self {
        let (line, length) = Line::between(start, end);
        Self { course: Course::Sine { line, amplitude, pulsation, phase }, length, limit }
    }

    /// An arc about the origin between two angles, of which the second is the smaller.
    pub(super) fn arc(radius: f64, (start, end): (f64, f64), limit: f64) -> Self {
        Self { course: Course::Arc { radius, start }, length: radius * (start - end), limit }
    }

    /// The point of a place.
    pub(super) fn point(&self, [along, across]: Point) -> Point {
        match self.course {
            Course::Straight(line) => line.point([along, across]),
            Course::Sine { line, amplitude, pulsation, phase } => {
                line.point([along, across + amplitude * (pulsation * along + phase).sin()])
            }
            Course::Arc { radius, start } => {
                let (sin, cos) = (start - along / radius).sin_cos();
                [(radius + across) * cos, (radius + across) * sin]
            }
        }
    }

    /// The place of a point.
    #[inline]
    pub(super) fn local(&self, at: Point) -> Point {
        match self.course {
            Course::Straight(line) => line.local(at),
            Course::Sine { .. } | Course::Arc { .. } => self.local_polar(at, || Polar::of(at)),
        }
    }

    /// The same where it may be known already how the point is seen from the origin.
    fn local_polar(&self, at: Point, polar: impl FnOnce() -> Polar) -> Point {
        match self.course {
            Course::Straight(line) => line.local(at),
            Course::Sine { line, amplitude, pulsation, phase } => {
                let [along, across] = line.local(at);
                [along, across - amplitude * (pulsation * along + phase).sin()]
            }
            Course::Arc { radius, start } => {
                let polar = polar();
                let turned = wrap(polar.angle - start);
                // Backwards where the angle grows, as the original has it in this order.
                let angle = start + turned;
                [-(angle - start) * radius, polar.radius - radius]
            }
        }
    }

    /// Where the lane heads, so far from its start.
    pub(super) fn heading(&self, along: f64) -> f64 {
        match self.course {
            Course::Straight(line) => line.heading,
            Course::Sine { line, amplitude, pulsation, phase } => {
                let slope = amplitude * pulsation * (pulsation * along + phase).cos();
                line.heading + slope.atan()
            }
            Course::Arc { radius, start } => start - along / radius - FRAC_PI_2,
        }
    }

    /// How far off a point is: across the lane, and along it before its start or behind its end.
    pub(super) fn distance(&self, at: Point) -> f64 {
        self.off(self.local(at))
    }

    fn off(&self, [along, across]: Point) -> f64 {
        across.abs() + (along - self.length).max(0.0) + (-along).max(0.0)
    }

    /// The same, with the radians by which a car there heads elsewhere; or more than `best` where that is less.
    pub(super) fn distance_heading(
        &self,
        at: Point,
        heading: f64,
        best: f64,
        polar: &mut Option<Polar>,
    ) -> f64 {
        // A wave is left by at most its amplitude less than its line is.
        if let Course::Sine { line, amplitude, .. } = self.course {
            let [along, across] = line.local(at);
            if self.off([along, (across.abs() - amplitude).max(0.0)]) > best {
                return f64::INFINITY;
            }
        }
        let place = self.local_polar(at, || *polar.get_or_insert_with(|| Polar::of(at)));
        let off = self.off(place);
        // What follows is not negative.
        if off > best {
            return off;
        }
        off + wrap(heading - self.heading(place[0])).abs()
    }

    /// Whether a place is on the lane, or no farther than `margin` beside it.
    #[inline]
    pub(super) fn has(&self, [along, across]: Point, margin: f64) -> bool {
        across.abs() <= WIDTH / 2.0 + margin && -OVERHANG <= along && along < self.length + OVERHANG
    }

    /// Whether one can change to it from a point.
    pub(super) fn is_reachable(&self, at: Point) -> bool {
        let [along, across] = self.local(at);
        across.abs() <= 2.0 * WIDTH && 0.0 <= along && along < self.length + OVERHANG
    }

    /// Whether a point is at its end.
    pub(super) fn ends_at(&self, at: Point) -> bool {
        self.local(at)[0] > self.length - OVERHANG / 2.0
    }
}

/// The same angle in `[-π, π)`.
#[inline]
pub(super) fn wrap(angle: f64) -> f64 {
    let from_zero = angle + PI;
    // A remainder takes long, and most are themselves.
    let rest = if (0.0..TAU).contains(&from_zero) { from_zero } else { from_zero.rem_euclid(TAU) };
    rest - PI
}

pub(super) fn norm([x, y]: Point) -> f64 {
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: Point, expected: Point) {
        let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near, "{found:?} is not {expected:?}");
    }

    #[test]
    fn places_by_hand() {
        // Upwards from (2, 10) to (2, 4): to the right is to larger x.
        let up = Lane::straight([2.0, 10.0], [2.0, 4.0], 20.0);
        assert_eq!((up.length, up.heading(0.0)), (6.0, -FRAC_PI_2));
        near(up.point([1.0, 0.5]), [2.5, 9.0]);
        near(up.local([2.5, 9.0]), [1.0, 0.5]);
        // From the right of a circle of radius 2 upwards by a quarter; outside is to the right.
        let arc = Lane::arc(2.0, (0.0, -FRAC_PI_2), 20.0);
        near([arc.length, arc.heading(0.0)], [PI, -FRAC_PI_2]);
        near(arc.point([PI, 1.0]), [0.0, -3.0]);
        near(arc.local([0.0, -3.0]), [PI, 1.0]);
        // A wave of height 1 and half length 4 about y = 0.
        let wave = Lane::sine(([0.0, 0.0], [8.0, 0.0]), (1.0, PI / 4.0, 0.0), 20.0);
        near(wave.point([2.0, 0.5]), [2.0, 1.5]);
        near(wave.local([2.0, 1.5]), [2.0, 0.5]);
        near([wave.heading(2.0), wave.heading(4.0)], [0.0, (-PI / 4.0).atan()]);
    }

    #[test]
    fn distances_by_hand() {
        let lane = Lane::straight([0.0, 0.0], [10.0, 0.0], 20.0);
        assert_eq!(
            [[3.0, -1.0], [12.0, 1.0], [-2.0, 1.0]].map(|at| lane.distance(at)),
            [1.0, 3.0, 3.0]
        );
        let headed = |best| lane.distance_heading([12.0, 1.0], 0.5 + TAU, best, &mut None);
        assert!((headed(9.0) - 3.5).abs() < 1e-12 && headed(2.0) > 2.0);
        assert!(lane.has([14.9, 2.0], 0.0) && !lane.has([15.0, 2.0], 0.0));
        assert!(lane.has([-5.0, 3.0], 1.0) && !lane.has([-5.0, 3.1], 1.0));
        assert!(lane.is_reachable([0.0, 8.0]) && !lane.is_reachable([-0.1, 8.0]));
        assert!(lane.ends_at([7.6, 9.0]) && !lane.ends_at([7.5, 9.0]));
    }

    #[test]
    fn angles_are_wrapped() {
        for (angle, expected) in
            [(0.5, 0.5), (4.0, 4.0 - TAU), (-4.0, TAU - 4.0), (PI, -PI), (20.0, 20.0 - 3.0 * TAU)]
        {
            assert!((wrap(angle) - expected).abs() < 1e-12);
        }
    }
}
