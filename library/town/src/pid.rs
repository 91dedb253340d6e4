//! From where a car should be to pedals and wheel: the two PID controllers of CARLA's agents.

use std::collections::VecDeque;

use crate::geometry::Pose;
use crate::traffic::DT;

/// Errors that are kept.
const WINDOW: usize = 10;

/// A controller of one number.
///
/// ```text
/// u_t = clip(K_P e_t + K_D (e_t - e_{t-1})/dt + K_I dt Σ e, -bound, bound)
/// ```
///
/// The sum is over the last errors, with that of now; both it and the difference are 0 until two have been seen. As published
/// for CARLA's agents; `tests/golden` has cases.
#[derive(Clone, Debug, PartialEq)]
pub struct Pid {
    /// `K_P`, `K_I`, `K_D`.
    pub gains: [f64; 3],
    /// Largest output either way.
    pub bound: f64,
    /// Seconds between errors.
    pub dt: f64,
    /// How many errors the sum is over; all where it is none.
    pub window: Option<usize>,
    errors: VecDeque<f64>,
    sum: f64,
}

impl Pid {
    /// A controller that has seen nothing.
    #[must_use]
    pub fn new(gains: [f64; 3], bound: f64, dt: f64, window: Option<usize>) -> Self {
        Self { gains, bound, dt, window, errors: VecDeque::new(), sum: 0.0 }
    }

    /// What to do about an error.
    pub fn control(&mut self, error: f64) -> f64 {
        self.errors.push_back(error);
        let sum = if let Some(window) = self.window {
            while self.errors.len() > window.max(1) {
                self.errors.pop_front();
            }
            self.errors.iter().sum()
        } else {
            self.sum += error;
            while self.errors.len() > 2 {
                self.errors.pop_front();
            }
            self.sum
        };
        let [kp, ki, kd] = self.gains;
        let more = match self.errors.len() {
            0 | 1 => 0.0,
            n => kd * (error - self.errors[n - 2]) / self.dt + ki * self.dt * sum,
        };
        (kp * error + more).clamp(-self.bound, self.bound)
    }
}

/// What a driver does for a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Controls {
    /// From 0 to 1.
    pub throttle: f64,
    /// From 0 to 1.
    pub brake: f64,
    /// From -1, left, to 1, right.
    pub steer: f64,
}

/// Follows set-points with pedals and wheel, as the agents of CARNOVEL do.
#[derive(Clone, Debug, PartialEq)]
pub struct Follower {
    along: Pid,
    across: Pid,
    steer: f64,
}

/// Largest throttle.
const THROTTLE: f64 = 0.75;
/// Largest brake.
const BRAKE: f64 = 0.3;
/// Largest turn of the wheel.
const STEER: f64 = 0.8;
/// Largest change of the wheel in a step.
const TURN: f64 = 0.1;

impl Default for Follower {
    /// Lateral 1.95, 1.4, 0.01 and longitudinal 1, 1, 0 for `K_P`, `K_I`, `K_D`.
    fn default() -> Self {
        Self {
            along: Pid::new([1.0, 1.0, 0.0], 1.0, DT, Some(WINDOW)),
            across: Pid::new([1.95, 1.4, 0.01], 1.0, DT, Some(WINDOW)),
            steer: 0.0,
        }
    }
}

impl Follower {
    /// What brings a car towards a point at a speed.
    ///
    /// - `speed`, `target`: metres a second; their difference is controlled in km/h.
    /// - `point`: `x`, `y` in the town; the angle to it is controlled in radians.
    pub fn follow(&mut self, pose: &Pose, speed: f64, target: f64, point: [f64; 2]) -> Controls {
        let pedal = self.along.control(3.6 * (target - speed));
        let [forward, right] = pose.inward(point);
        let wheel = self.across.control(right.atan2(forward));
        self.steer = wheel.clamp(self.steer - TURN, self.steer + TURN).clamp(-STEER, STEER);
        Controls {
            throttle: pedal.clamp(0.0, THROTTLE),
            brake: (-pedal).clamp(0.0, BRAKE),
            steer: self.steer,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn golden(case: &serde_json::Value, change: fn(&mut Pid)) -> f64 {
        let of = |key: &str| &case["inputs"][key];
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        let gains = ["kp", "ki", "kd"].map(|key| number(of(key)));
        let window = of("window").as_u64().map(|n| usize::try_from(n).unwrap());
        let mut pid = Pid::new(gains, number(&of("clip")[1]), number(of("dt")), window);
        change(&mut pid);
        let errors = of("errors").as_array().unwrap().iter();
        let expected = case["expected"]["u"].as_array().unwrap();
        let off = errors.zip(expected).map(|(e, u)| (pid.control(number(e)) - number(u)).abs());
        off.fold(0.0, f64::max)
    }

    fn cases() -> Vec<serde_json::Value> {
        let elsewhere = std::env::var_os("IVX_GOLDEN_DIR").map(std::path::PathBuf::from);
        let own = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/golden");
        let path = elsewhere.unwrap_or_else(|| own.into()).join("agents_baselines.json");
        let Ok(text) = std::fs::read_to_string(path) else { return Vec::new() };
        let file: serde_json::Value = serde_json::from_str(&text).unwrap();
        let cases = file["cases"].as_array().unwrap().iter();
        cases.filter(|case| case["kind"] == "pid").cloned().collect()
    }

    #[test]
    fn golden_pid() {
        let cases = cases();
        assert!(std::env::var_os("IVX_GOLDEN_DIR").is_some() || cases.len() == 3);
        for case in &cases {
            let off = golden(case, |_| {});
            assert!(off < 1e-9, "{} is off by {off}", case["name"]);
            // Without the integral, over other errors, or with another bound it is seen.
            assert!(golden(case, |pid| pid.gains[1] = 0.0) > 1e-4);
            assert!(golden(case, |pid| pid.window = Some(2)) > 1e-4);
            assert!(golden(case, |pid| pid.bound = 0.5) > 1e-2);
        }
    }

    #[test]
    fn a_car_is_turned_to_the_point_by_and_by() {
        let mut follower = Follower::default();
        let pose = Pose::default();
        let first = follower.follow(&pose, 0.0, 5.0, [5.0, 5.0]);
        // 18 km/h too slow: more throttle than there is. 45° to the right: as far as the wheel turns in a step.
        assert_eq!(first, Controls { throttle: 0.75, brake: 0.0, steer: 0.1 });
        let second = follower.follow(&pose, 0.0, 5.0, [5.0, 5.0]);
        assert_eq!(second.steer, 0.2);
        let left = Follower::default().follow(&pose, 5.0, 0.0, [5.0, -5.0]);
        assert_eq!(left, Controls { throttle: 0.0, brake: 0.3, steer: -0.1 });
    }
}
