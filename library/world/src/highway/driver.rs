//! How drivers decide: how near to follow, and when to change lane.

use super::network::Network;
use super::release::Release;
use super::traffic::Traffic;
use super::vehicle::{LENGTH, Pilot, Vehicle};

/// The most a driver accelerates or brakes, in m/s²; and what they find comfortable.
const MOST: f64 = 6.0;
const COMFORT: f64 = 3.0;
const COMFORT_BRAKING: f64 = 5.0;
/// The distance of centres that a driver keeps to a standing car, in metres.
const STANDING: f64 = 5.0 + LENGTH;
/// By how much a change of lane must pay, and how hard it may let others brake, in m/s².
const GAIN: f64 = 0.2;
const IMPOSED: f64 = 2.0;
/// Seconds between two looks at other lanes.
const DELAY: f64 = 1.0;

/// A driver of the intelligent driver model (Treiber et al., 2000) who changes lane by MOBIL (Kesting et al., 2007).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Driver {
    /// Seconds since other lanes were looked at.
    pub(super) timer: f64,
    /// How abruptly a speed is kept: the exponent of the model.
    pub(super) exponent: f64,
    /// Seconds that are kept to the car in front.
    pub(super) time_gap: f64,
    /// The lane by number that is preferred to all others.
    pub(super) prefers: Option<usize>,
}

impl Driver {
    /// The time gap of highway-env.
    pub(super) const TIME_GAP: f64 = 1.5;

    /// One without a preference, whose first look at other lanes depends on where the car is.
    pub(super) fn new([x, y]: [f64; 2], exponent: f64) -> Self {
        let timer = ((x + y) * std::f64::consts::PI).rem_euclid(DELAY);
        Self { timer, exponent, time_gap: Self::TIME_GAP, prefers: None }
    }

    /// The distance that is wanted to the car in front, between centres.
    ///
    /// ```text
    /// d* = d₀ + T v + v Δv / (2 √(a b))
    /// ```
    ///
    /// where `Δv` is how fast it comes nearer along the way that the car behind heads.
    pub(super) fn gap(&self, car: &Vehicle, front: &Vehicle) -> f64 {
        let (ours, theirs, direction) = (car.velocity(), front.velocity(), car.direction);
        let nearing = (ours[0] - theirs[0]) * direction[0] + (ours[1] - theirs[1]) * direction[1];
        self.gap_at(car.speed, nearing)
    }

    fn gap_at(&self, speed: f64, nearing: f64) -> f64 {
        STANDING
            + speed * self.time_gap
            + speed * nearing / (2.0 * (COMFORT * COMFORT_BRAKING).sqrt())
    }

    /// The acceleration that this driver has or supposes in a car behind another.
    ///
    /// ```text
    /// a (1 − (v / v₀)^δ − (d* / d)²)
    /// ```
    ///
    /// Without a car in front the last term is missing.
    pub(super) fn accelerates(
        &self,
        car: &Vehicle,
        front: Option<&Vehicle>,
        network: &Network,
        release: &Release,
    ) -> f64 {
        let mut wanted = car.target_speed;
        if release.heeds_limit {
            wanted = wanted.clamp(0.0, network.lanes[car.lane].limit);
        }
        let share = car.speed.max(0.0) / release.not_zero(wanted).abs();
        let mut acceleration = COMFORT * (1.0 - share.powf(self.exponent));
        if let Some(front) = front {
            let distance = release.not_zero(car.ahead(network, front));
            acceleration -= COMFORT * (self.gap(car, front) / distance).powi(2);
        }
        acceleration
    }
}

impl Traffic {
    /// Lets the driver of car `i` decide.
    pub(super) fn drive(&mut self, i: usize) {
        if self.vehicles[i].crashed {
            return;
        }
        self.vehicles[i].follow_road(&self.network);
        self.choose_lane(i);

        let (car, network, release) = (&self.vehicles[i], &self.network, self.release);
        let Pilot::Driver(driver) = &car.pilot else { return };
        let steering = car.steering_to_lane(network, release);
        let behind = |lane| {
            let (front, _) = self.neighbours(i, lane);
            driver.accelerates(car, front.map(|j| &self.vehicles[j]), network, release)
        };
        let mut acceleration = behind(car.lane);
        if car.lane != car.target_lane {
            acceleration = acceleration.min(behind(car.target_lane));
        }
        let car = &mut self.vehicles[i];
        (car.steering, car.acceleration) = (steering, acceleration.clamp(-MOST, MOST));
    }

    /// Begins a change of lane that pays, now and then, and gives one up for which another car was first.
    fn choose_lane(&mut self, i: usize) {
        let car = &self.vehicles[i];
        if car.lane != car.target_lane {
            if self.another_was_first(i) {
                let car = &mut self.vehicles[i];
                car.target_lane = car.lane;
            }
            return;
        }
        let Pilot::Driver(driver) = &mut self.vehicles[i].pilot else { return };
        if driver.timer <= DELAY {
            return;
        }
        driver.timer = 0.0;
        let Vehicle { lane, at, speed, .. } = self.vehicles[i];
        for beside in self.network.beside(lane) {
            if self.network.lanes[beside].is_reachable(at)
                && speed.abs() >= self.release.least_speed_to_change
                && self.pays_to_change(i, beside)
            {
                self.vehicles[i].target_lane = beside;
            }
        }
    }

    /// Whether another car that changes to the same lane is in front, and too near.
    fn another_was_first(&self, i: usize) -> bool {
        let car = &self.vehicles[i];
        let Pilot::Driver(driver) = &car.pilot else { return false };
        let first = |other: &Vehicle| {
            if other.lane == car.target_lane
                || other.target_lane != car.target_lane
                || other.pilot == Pilot::Held
            {
                return false;
            }
            let distance = car.ahead(&self.network, other);
            0.0 < distance && distance < driver.gap(car, other)
        };
        self.network.same_road(car.lane, car.target_lane)
            && (0..self.vehicles.len()).any(|j| j != i && first(&self.vehicles[j]))
    }

    /// MOBIL: whether a change to a lane beside makes nobody brake hard, and lets the car accelerate by more; or, where
    /// a lane is meant by the route or preferred, leads towards it and needs no hard braking.
    fn pays_to_change(&self, i: usize, lane: usize) -> bool {
        let (car, network, release) = (&self.vehicles[i], &self.network, self.release);
        let Pilot::Driver(driver) = &car.pilot else { return false };
        let get = |j: Option<usize>| j.map(|j| &self.vehicles[j]);
        let behind = |front| driver.accelerates(car, front, network, release);

        let (front, rear) = self.neighbours(i, lane);
        if let Some(rear) = get(rear)
            && driver.accelerates(rear, Some(car), network, release) < -IMPOSED
        {
            return false;
        }
        let then = behind(get(front));
        if let Some(meant) = driver.prefers.or_else(|| self.lane_of_route(car)) {
            let side = |lane: usize| lane.cmp(&network.number(car.target_lane));
            side(network.number(lane)) == side(meant) && then >= -IMPOSED
        } else {
            let (front, _) = self.neighbours(i, car.lane);
            then - behind(get(front)) >= GAIN
        }
    }

    /// The number of the lane that a car's route asks for now, if it does.
    fn lane_of_route(&self, car: &Vehicle) -> Option<usize> {
        let lane = car.route.front()?.lane;
        lane.filter(|lane| *lane > 0 || self.release.first_lane_is_asked_for)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_by_hand() {
        // 10 + 1.5 · 20 + 20 · 5 / (2 √15) at 20 m/s behind 15 m/s.
        let driver = Driver::new([0.0, 0.0], 4.0);
        let expected = 40.0 + 50.0 / 15.0_f64.sqrt();
        assert!((driver.gap_at(20.0, 5.0) - expected).abs() < 1e-12);
        let near = Driver { time_gap: 1.0, ..driver };
        assert!((near.gap_at(20.0, 5.0) - expected + 10.0).abs() < 1e-12);
    }

    #[test]
    fn the_first_look_depends_on_the_place() {
        let timer = |x, y| Driver::new([x, y], 4.0).timer;
        assert!((timer(1.0, 1.0) - (std::f64::consts::TAU - 6.0)).abs() < 1e-12);
        assert!((timer(-2.0, 1.0) - (4.0 - std::f64::consts::PI)).abs() < 1e-12);
    }
}
