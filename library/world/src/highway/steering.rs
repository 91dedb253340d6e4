//! How a car keeps to a lane and a speed.

use std::f64::consts::{FRAC_PI_3, FRAC_PI_4};

use super::lane::wrap;
use super::network::Network;
use super::release::Release;
use super::vehicle::{LENGTH, Vehicle};

/// How quickly a speed is reached, a heading and a place across the lane, each 1 by seconds.
const FOR_SPEED: f64 = 1.0 / 0.6;
const FOR_HEADING: f64 = 1.0 / 0.2;
const FOR_PLACE: f64 = 1.0 / 0.6;
/// How many seconds ahead the lane is looked at.
const PURSUIT: f64 = 0.1;
const MOST: f64 = FRAC_PI_3;

/// What a car is told that keeps a lane and a speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meta {
    Left,
    Idle,
    Right,
    Faster,
    Slower,
}

impl Meta {
    /// All in the order of highway-env.
    pub(super) const ALL: [Self; 5] =
        [Self::Left, Self::Idle, Self::Right, Self::Faster, Self::Slower];
    /// What it calls them.
    pub(super) const NAMES: [&str; 5] = ["LANE_LEFT", "IDLE", "LANE_RIGHT", "FASTER", "SLOWER"];
}

/// A pilot who is told what to do, at one of three speeds.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cruise {
    pub(super) speeds: [f64; 3],
    pub(super) place: usize,
}

impl Cruise {
    /// One who starts at the speed nearest to that of the car.
    pub(super) fn new(speeds: [f64; 3], speed: f64) -> Self {
        let mut cruise = Self { speeds, place: 0 };
        cruise.place = cruise.nearest(speed);
        cruise
    }

    /// The place of the nearest of its speeds, which are evenly apart; of two as near the one with the even place.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0, 1 or 2")]
    fn nearest(&self, speed: f64) -> usize {
        let [low, _, high] = self.speeds;
        ((speed - low) / (high - low) * 2.0).round_ties_even().clamp(0.0, 2.0) as usize
    }

    /// The speed that follows.
    fn told(&mut self, what: Meta, speed: f64) -> Option<f64> {
        let nearest = self.nearest(speed);
        self.place = match what {
            Meta::Faster => (nearest + 1).min(2),
            Meta::Slower => nearest.saturating_sub(1),
            Meta::Left | Meta::Idle | Meta::Right => return None,
        };
        Some(self.speeds[self.place])
    }
}

impl Vehicle {
    /// Tells a car that keeps a lane and a speed what to do, and nothing to any other.
    pub(super) fn tell(&mut self, what: Meta, network: &Network) {
        let super::vehicle::Pilot::Cruise(cruise) = &mut self.pilot else { return };
        let speed = cruise.told(what, self.speed);
        self.target_speed = speed.unwrap_or(self.target_speed);
        self.follow_road(network);
        let road = network.road_of(self.target_lane);
        let lane = match what {
            Meta::Left => self.target_lane.saturating_sub(1).max(road.first),
            Meta::Right => (self.target_lane + 1).min(road.first + road.n - 1),
            Meta::Idle | Meta::Faster | Meta::Slower => return,
        };
        if network.lanes[lane].is_reachable(self.at) {
            self.target_lane = lane;
        }
    }

    /// At the end of the lane that it follows, follows the next.
    pub(super) fn follow_road(&mut self, network: &Network) {
        if network.lanes[self.target_lane].ends_at(self.at) {
            self.target_lane = network.next_lane(self.target_lane, &mut self.route, self.at);
        }
    }

    /// The angle of the wheels that leads to the middle of the lane that is followed: the place across it asks for a
    /// speed across, that for a heading, and that for a turn.
    ///
    /// ```text
    /// heading* = lane's(along + 0.1 v) + clip(asin(clip(−across / 0.6 / v)), ±π/4)
    /// slip = asin(clip(L / 2 / v · wrap(heading* − ψ) / 0.2))
    /// δ = clip(atan(2 tan(slip)), ±π/3)
    /// ```
    ///
    /// The release of 2021 takes the slip for the angle.
    pub(super) fn steering_to_lane(&self, network: &Network, release: &Release) -> f64 {
        let lane = &network.lanes[self.target_lane];
        let [along, across] = lane.local(self.at);
        let speed = release.not_zero(self.speed);
        let ahead = lane.heading(along + self.speed * PURSUIT);
        let across = (-FOR_PLACE * across / speed).clamp(-1.0, 1.0).asin();
        let heading = ahead + across.clamp(-FRAC_PI_4, FRAC_PI_4);
        let turn = FOR_HEADING * wrap(heading - self.heading);
        let slip = (LENGTH / 2.0 / speed * turn).clamp(-1.0, 1.0).asin();
        let wheels = if release.wheels { (2.0 * slip.tan()).atan() } else { slip };
        wheels.clamp(-MOST, MOST)
    }

    /// The acceleration towards the speed that is wanted.
    pub(super) fn towards_speed(&self) -> f64 {
        FOR_SPEED * (self.target_speed - self.speed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_by_hand() {
        let mut cruise = Cruise::new([20.0, 25.0, 30.0], 26.0);
        assert_eq!(cruise.place, 1);
        // Which one follows depends on the speed that the car has, and not on that which it was told.
        assert_eq!(cruise.told(Meta::Faster, 20.1), Some(25.0));
        assert_eq!(cruise.told(Meta::Faster, 29.0), Some(30.0));
        assert_eq!(cruise.told(Meta::Slower, 24.0), Some(20.0));
        assert_eq!(cruise.told(Meta::Slower, 14.0), Some(20.0));
        assert_eq!((cruise.told(Meta::Left, 14.0), cruise.place), (None, 0));
    }
}
