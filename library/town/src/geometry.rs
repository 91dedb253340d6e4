//! Where lanes lie: from numbers of a road to poses.
//!
//! Poses are in the axes of the town, which are CARLA's: `x`, `y` to the right of it, `z` up, yaw from `x` to `y`. The file's
//! `y` is to the left, so that `y` and headings change their signs here and nowhere else.

use std::f64::consts::PI;

use crate::map::{Cubic, Kind, Piece, Road, Section, Strip};

/// A place in the town and a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Metres.
    pub x: f64,
    /// Metres, to the right of `x`.
    pub y: f64,
    /// Metres above the map's 0.
    pub z: f64,
    /// Radians from `x` to `y`, within ±π.
    pub yaw: f64,
    /// Radians, upwards above 0.
    pub pitch: f64,
}

impl Pose {
    /// The point `(forward, right)` of this pose's own frame, in the town.
    #[must_use]
    pub fn outward(&self, [forward, right]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.yaw.sin_cos();
        [self.x + forward * cos - right * sin, self.y + forward * sin + right * cos]
    }

    /// The point `(x, y)` of the town in this pose's own frame: forward, right.
    #[must_use]
    pub fn inward(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.yaw.sin_cos();
        let [dx, dy] = [x - self.x, y - self.y];
        [dx * cos + dy * sin, dy * cos - dx * sin]
    }

    /// Metres to a point, as the crow flies.
    #[must_use]
    pub fn distance(&self, other: &Pose) -> f64 {
        let [dx, dy, dz] = [self.x - other.x, self.y - other.y, self.z - other.z];
        (dx * dx + dy * dy + dz * dz).sqrt()
    }
}

/// An angle within ±π.
#[must_use]
pub fn wrapped(angle: f64) -> f64 {
    let turned = angle.rem_euclid(2.0 * PI);
    if turned > PI { turned - 2.0 * PI } else { turned }
}

/// Value and slope at `s` of what holds from its own `s` on; 0 where there is nothing.
pub(crate) fn cubic(cubics: &[Cubic], s: f64) -> (f64, f64) {
    let behind = cubics.partition_point(|cubic| cubic.s <= s);
    let Some(cubic) = cubics.get(behind.saturating_sub(1)) else { return (0.0, 0.0) };
    let d = s - cubic.s;
    let value = cubic.a + d * (cubic.b + d * (cubic.c + d * cubic.d));
    (value, cubic.b + d * (2.0 * cubic.c + d * 3.0 * cubic.d))
}

/// The piece of a road's line at `s`.
pub(crate) fn piece(road: &Road, s: f64) -> &Piece {
    let behind = road.plan.partition_point(|piece| piece.s <= s);
    &road.plan[behind.saturating_sub(1)]
}

/// `(x, y)` in the axes of the file and heading of a road's line at `s`.
///
/// ```text
/// h(d) = h_0 + κ d;   x(d) = x_0 + (sin h(d) - sin h_0)/κ;   y(d) = y_0 - (cos h(d) - cos h_0)/κ
/// ```
fn line(road: &Road, s: f64) -> ([f64; 2], f64) {
    let piece = piece(road, s);
    let d = s - piece.s;
    let (sin_0, cos_0) = piece.heading.sin_cos();
    let k = piece.curvature;
    if k.abs() < 1e-12 {
        return ([piece.x + d * cos_0, piece.y + d * sin_0], piece.heading);
    }
    let heading = piece.heading + k * d;
    let (sin, cos) = heading.sin_cos();
    ([piece.x + (sin - sin_0) / k, piece.y - (cos - cos_0) / k], heading)
}

/// The lanes on one side of a section, outwards.
pub(crate) fn side(section: &Section, left: bool) -> &[Strip] {
    if left { &section.left } else { &section.right }
}

/// The lane with this number, which is not 0.
pub(crate) fn strip(section: &Section, id: i32) -> Option<&Strip> {
    let place = usize::try_from(id.unsigned_abs()).ok()?.checked_sub(1)?;
    side(section, id > 0).get(place)
}

/// Where a lane lies beside the road's line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Across {
    /// Metres to the left of the line at its middle.
    pub(crate) middle: f64,
    /// How this changes a metre.
    pub(crate) slope: f64,
    /// Metres from edge to edge.
    pub(crate) width: f64,
}

/// Where lane `id` of a section lies at `s` of the road. Lanes inside of it that are missing count as nothing.
pub(crate) fn across(road: &Road, section: &Section, id: i32, s: f64) -> Across {
    let (mut inner, mut slope) = cubic(&road.lane_offset, s);
    let sign = f64::from(id.signum());
    let mut width = (0.0, 0.0);
    for strip in side(section, id > 0).iter().take(id.unsigned_abs() as usize) {
        inner += sign * width.0;
        slope += sign * width.1;
        width = cubic(&strip.widths, s - section.s);
    }
    Across {
        middle: inner + sign * width.0 / 2.0,
        slope: slope + sign * width.1 / 2.0,
        width: width.0,
    }
}

/// The pose at `s` of a road, `t` metres to the left of its line, where `t` changes by `slope` a metre: along the road, or
/// against it for lanes on the left.
#[expect(clippy::many_single_char_names, reason = "as in the equation")]
pub(crate) fn pose(road: &Road, s: f64, t: f64, slope: f64, against: bool) -> Pose {
    let ([x, y], heading) = line(road, s);
    let (sin, cos) = heading.sin_cos();
    let (z, grade) = cubic(&road.elevation, s);
    let turned = heading + slope.atan() + if against { PI } else { 0.0 };
    Pose {
        x: x - t * sin,
        y: -(y + t * cos),
        z,
        yaw: wrapped(-turned),
        pitch: if against { -grade.atan() } else { grade.atan() },
    }
}

/// `(s, t)` on a piece of a road of a point in the axes of the town, and whether it lies beside the piece at all (`None` where
/// it is before its start, behind its end, or beyond the centre of its arc).
#[expect(clippy::many_single_char_names, reason = "as in the equation")]
pub(crate) fn onto(piece: &Piece, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let [dx, dy] = [x - piece.x, -y - piece.y];
    let (sin, cos) = piece.heading.sin_cos();
    let [ahead, aside] = [dx * cos + dy * sin, dy * cos - dx * sin];
    let k = piece.curvature;
    let [d, t] = if k.abs() < 1e-12 {
        [ahead, aside]
    } else {
        // The centre is `1/κ` to the left; the radius to the point makes the angle `κ d` with that to the start.
        let [out, up] = [ahead * k, 1.0 - aside * k];
        [out.atan2(up) / k, (1.0 - out.hypot(up)) / k]
    };
    // What two pieces share belongs to both.
    let slack = 1e-6;
    (-slack..=piece.length + slack).contains(&d).then_some([piece.s + d, t])
}

/// Whether cars may be on such a lane.
#[must_use]
pub fn is_paved(kind: Kind) -> bool {
    matches!(
        kind,
        Kind::Driving | Kind::Bidirectional | Kind::Parking | Kind::Shoulder | Kind::Border
    )
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    fn bend(curvature: f64) -> Road {
        let text = format!(
            r#"<OpenDRIVE><road id="1" length="20" junction="-1">
            <planView><geometry s="0" x="10" y="5" hdg="0" length="20"><arc curvature="{curvature}"/></geometry></planView>
            <elevationProfile><elevation s="0" a="1" b="0.1" c="0" d="0"/></elevationProfile>
            <lanes><laneOffset s="0" a="1" b="0" c="0" d="0"/><laneSection s="0">
            <left><lane id="1" type="driving"><width sOffset="0" a="4" b="0" c="0" d="0"/></lane></left>
            <right><lane id="-1" type="driving"><width sOffset="0" a="2" b="0.1" c="0" d="0"/></lane></right>
            </laneSection></lanes></road></OpenDRIVE>"#
        );
        crate::xodr::read_map(&text).unwrap().roads.remove(0)
    }

    fn near(found: [f64; 3], expected: [f64; 3]) -> bool {
        found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    #[test]
    fn a_quarter_of_a_circle_ends_beside_its_centre() {
        // κ = 0.1: radius 10, centre (10, 15) in the file; after s = 5π it is at (20, 15) and goes along y.
        let road = bend(0.1);
        let s = 10.0 * FRAC_PI_2;
        let on_line = pose(&road, s, 0.0, 0.0, false);
        assert!(near([on_line.x, on_line.y, on_line.z], [20.0, -15.0, 1.0 + 0.1 * s]));
        assert!((on_line.yaw + FRAC_PI_2).abs() < 1e-9 && (on_line.pitch.tan() - 0.1).abs() < 1e-9);
        // Lane 1 is 4 m wide from 1 m left of the line: 3 m nearer to the centre, and driven against.
        let left = across(&road, &road.sections[0], 1, s);
        assert_eq!((left.middle, left.slope, left.width), (3.0, 0.0, 4.0));
        let against = pose(&road, s, left.middle, left.slope, true);
        assert!(near([against.x, against.y, against.yaw], [17.0, -15.0, FRAC_PI_2]));
        assert!((against.pitch.tan() + 0.1).abs() < 1e-9);
        // Lane -1 widens: at s = 10 it is 3 m wide, its middle 1.5 m right of the offset, and drifts by 0.05.
        let right = across(&road, &road.sections[0], -1, 10.0);
        assert!(near([right.middle, right.slope, right.width], [-0.5, -0.05, 3.0]));
    }

    #[test]
    fn points_are_projected_onto_pieces() {
        for curvature in [0.1, -0.1, 0.0] {
            let road = bend(curvature);
            for (s, t) in [(0.0, 0.0), (3.0, 2.0), (12.0, -4.0), (20.0, 1.0)] {
                let pose = pose(&road, s, t, 0.0, false);
                let [found_s, found_t] = onto(&road.plan[0], [pose.x, pose.y]).unwrap();
                assert!(
                    (found_s - s).abs() < 1e-9 && (found_t - t).abs() < 1e-9,
                    "{curvature} {s} {t}"
                );
            }
            assert_eq!(onto(&road.plan[0], [0.0, -5.0]), None);
        }
    }

    #[test]
    fn frames_are_turned_and_turned_back() {
        // At (1, 2), looking along y: what is 3 ahead and 1 right is at (0, 5).
        let pose = Pose { x: 1.0, y: 2.0, yaw: FRAC_PI_2, ..Pose::default() };
        let [x, y] = pose.outward([3.0, 1.0]);
        assert!((x - 0.0).abs() < 1e-12 && (y - 5.0).abs() < 1e-12);
        let [forward, right] = pose.inward([0.0, 5.0]);
        assert!((forward - 3.0).abs() < 1e-12 && (right - 1.0).abs() < 1e-12);
        assert_eq!(wrapped(3.0 * PI), PI);
        assert!((wrapped(-FRAC_PI_2 * 3.0) - FRAC_PI_2).abs() < 1e-12);
    }
}
