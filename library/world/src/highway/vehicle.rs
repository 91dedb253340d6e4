//! A car and how it moves.

use super::driver::Driver;
use super::lane::Point;
use super::network::{Network, Route};
use super::steering::Cruise;

/// Seconds from one frame to the next.
pub(super) const DT: f64 = 1.0 / 15.0;
/// How long a car is, in metres.
pub(super) const LENGTH: f64 = 5.0;
/// How wide it is.
pub(super) const BREADTH: f64 = 2.0;
const FASTEST: f64 = 40.0;

/// A car: where it is, where it wants to go, and who steers it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Vehicle {
    pub(super) at: Point,
    pub(super) heading: f64,
    /// Where it heads, as a vector of length 1.
    pub(super) direction: Point,
    pub(super) speed: f64,
    /// The angle of the wheels, in radians.
    pub(super) steering: f64,
    /// In m/s².
    pub(super) acceleration: f64,
    /// The lane that it is on, and that which it follows.
    pub(super) lane: usize,
    pub(super) target_lane: usize,
    pub(super) target_speed: f64,
    pub(super) route: Route,
    pub(super) crashed: bool,
    /// By how much a collision moves it in the next frame.
    pub(super) impact: Option<Point>,
    pub(super) pilot: Pilot,
}

/// Who steers a car.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Pilot {
    /// Who decides on everything.
    Driver(Driver),
    /// Who keeps a lane and a speed and is told which.
    Cruise(Cruise),
    /// Nobody: wheels and pedals stay as they are put.
    Held,
}

impl Vehicle {
    /// A car on a road that follows the lane closest to it at its speed.
    pub(super) fn new(
        network: &Network,
        at: Point,
        heading: f64,
        speed: f64,
        pilot: Pilot,
    ) -> Self {
        let lane = network.closest(at, heading, 0);
        Self {
            at,
            heading,
            direction: towards(heading),
            speed,
            steering: 0.0,
            acceleration: 0.0,
            lane,
            target_lane: lane,
            target_speed: speed,
            route: Route::new(),
            crashed: false,
            impact: None,
            pilot,
        }
    }

    /// Turns it.
    pub(super) fn turn_to(&mut self, heading: f64) {
        (self.heading, self.direction) = (heading, towards(heading));
    }

    /// In m/s.
    pub(super) fn velocity(&self) -> Point {
        self.direction.map(|x| self.speed * x)
    }

    /// Moves it by one frame, as a bicycle of which the front wheel is turned: position and heading change by the speed
    /// that was.
    ///
    /// ```text
    /// β = atan(tan(δ) / 2)
    /// (x, y) += v (cos(ψ + β), sin(ψ + β)) dt
    /// ψ += v sin(β) / (L / 2) dt
    /// v += a dt
    /// ```
    ///
    /// What has crashed brakes with its wheels straight, and nothing becomes faster than 40 m/s for long. The lane it is
    /// on is found anew.
    pub(super) fn step(&mut self, network: &Network) {
        self.obey_limits();
        let slip = (0.5 * self.steering.tan()).atan();
        // Most go straight on.
        let straight = slip == 0.0;
        let [x, y] = if straight { self.direction } else { towards(self.heading + slip) };
        self.at[0] += self.speed * x * DT;
        self.at[1] += self.speed * y * DT;
        if let Some([x, y]) = self.impact.take() {
            self.at[0] += x;
            self.at[1] += y;
            self.crashed = true;
        }
        if !straight {
            self.turn_to(self.heading + self.speed * slip.sin() / (LENGTH / 2.0) * DT);
        }
        self.speed += self.acceleration * DT;
        self.lane = network.closest(self.at, self.heading, self.lane);
        if let Pilot::Driver(driver) = &mut self.pilot {
            driver.timer += DT;
        }
    }

    fn obey_limits(&mut self) {
        if self.crashed {
            (self.steering, self.acceleration) = (0.0, -self.speed);
        }
        if self.speed > FASTEST {
            self.acceleration = self.acceleration.min(FASTEST - self.speed);
        } else if self.speed < -FASTEST {
            self.acceleration = self.acceleration.max(-FASTEST - self.speed);
        }
    }

    /// How far another car is ahead along the lane that this one is on.
    pub(super) fn ahead(&self, network: &Network, other: &Self) -> f64 {
        let lane = &network.lanes[self.lane];
        lane.local(other.at)[0] - lane.local(self.at)[0]
    }

    /// Whether it is on its lane, and not beside the road.
    pub(super) fn on_road(&self, network: &Network) -> bool {
        let lane = &network.lanes[self.lane];
        lane.has(lane.local(self.at), 0.0)
    }
}

fn towards(heading: f64) -> Point {
    let (sin, cos) = heading.sin_cos();
    [cos, sin]
}
