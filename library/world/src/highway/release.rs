//! What differs between the releases of highway-env that are replayed.

/// The constants and choices in which two releases of highway-env differ.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::struct_excessive_bools, reason = "releases differ in that many ways")]
pub(super) struct Release {
    /// How fast one may drive on a highway, in m/s.
    pub(super) limit: f64,
    /// The speeds that cars start with, as shares of the limit.
    pub(super) start: (f64, f64),
    /// The distance between cars that start: so many metres, and so many seconds at their speed.
    pub(super) spacing: (f64, f64),
    /// The exponents of the speed in the intelligent driver model, from which each driver's is drawn.
    pub(super) exponents: (f64, f64),
    /// Whether drivers heed the limit of a lane.
    pub(super) heeds_limit: bool,
    /// How fast a car must be to change its lane, in m/s.
    pub(super) least_speed_to_change: f64,
    /// Whether a route can ask for the first lane of a road; that of 2021 takes the number 0 for none.
    pub(super) first_lane_is_asked_for: bool,
    /// Whether the angle of slip is turned into one of the wheels.
    pub(super) wheels: bool,
    /// What stands in for a speed of 0 where one divides by it.
    pub(super) zero: f64,
    /// How near the centres of two cars must be, besides the way of one frame, to be looked at for a collision.
    pub(super) near: f64,
    /// How far is seen, in metres.
    pub(super) sight: f64,
    /// What is seen as 1 on a highway: a distance along it in metres, and a speed in m/s.
    pub(super) scale: (f64, f64),
    /// Whether a highway pays for the speed along it, and not for any.
    pub(super) pays_along: bool,
    /// Whether a roundabout pays nothing off the road.
    pub(super) roundabout_pays_on_road: bool,
    /// The least that a roundabout pays before it is mapped to `[0, 1]`.
    pub(super) roundabout_least: f64,
    /// Whether an episode that takes too long is over, and not cut off.
    pub(super) ends_in_time: bool,
}

impl Release {
    /// That of 2021, 1.1.
    pub(super) const V1_1: Self = Self {
        limit: 20.0,
        start: (0.7, 1.0),
        spacing: (15.0, 1.2),
        exponents: (4.0, 4.0),
        heeds_limit: false,
        least_speed_to_change: 0.0,
        first_lane_is_asked_for: false,
        wheels: false,
        zero: -0.01,
        near: 5.0,
        sight: 180.0,
        scale: (150.0, 60.0),
        pays_along: false,
        roundabout_pays_on_road: false,
        roundabout_least: -1.05,
        ends_in_time: true,
    };

    /// 1.12.1.
    pub(super) const V1_12: Self = Self {
        limit: 30.0,
        start: (0.7, 0.8),
        spacing: (12.0, 1.0),
        exponents: (3.5, 4.5),
        heeds_limit: true,
        least_speed_to_change: 1.0,
        first_lane_is_asked_for: true,
        wheels: true,
        zero: 0.01,
        // The diagonal of a car, √(5² + 2²).
        near: 5.385_164_807_134_504,
        sight: 200.0,
        scale: (200.0, 80.0),
        pays_along: true,
        roundabout_pays_on_road: true,
        roundabout_least: -1.0,
        ends_in_time: false,
    };

    /// That of a version's name.
    pub(super) fn of(version: &str) -> Option<&'static Self> {
        match version {
            "1.1" => Some(&Self::V1_1),
            "1.12.1" => Some(&Self::V1_12),
            _ => None,
        }
    }

    /// The number, or ±0.01 where it is nearer to 0 than that.
    pub(super) fn not_zero(&self, x: f64) -> f64 {
        if x.abs() > 0.01 {
            x
        } else if x == 0.0 {
            self.zero
        } else {
            0.01_f64.copysign(x)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_divided_by_is_not_zero() {
        let both = |x| [Release::V1_1, Release::V1_12].map(|release| release.not_zero(x));
        assert_eq!(both(0.02), [0.02; 2]);
        assert_eq!((both(0.005), both(-0.005)), ([0.01; 2], [-0.01; 2]));
        assert_eq!(both(0.0), [-0.01, 0.01]);
        assert!((Release::V1_12.near - 29.0_f64.sqrt()).abs() < 1e-15);
    }
}
