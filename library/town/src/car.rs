//! How the agent's car moves: a kinematic bicycle with pedals.

use crate::geometry::{Pose, wrapped};
use crate::pid::Controls;
use crate::traffic::DT;

/// Metres between axles: a Ford Mustang's 2.72.
const WHEELBASE: f64 = 2.72;
/// Radians that the front wheels turn at full steer: 70°, the default of CARLA's wheels. A real car turns them by 40°, and
/// would not come around lanes of the maps whose radius is 2 m.
const TURN: f64 = 1.221_730_476_396_030_7;
/// Metres a second squared at full throttle from rest. Ours: a Mustang takes 4.5 s to 100 km/h, 6 m/s².
const DRIVE: f64 = 6.0;
/// Metres a second squared at full brake, on dry asphalt: 0.8 g.
const BRAKE: f64 = 8.0;
/// Metres a second squared of rolling: 0.015 g.
const ROLL: f64 = 0.147;
/// Drag a metre: `ρ c_d A/(2 m)` with 1.2 kg/m³, 0.35, 2.3 m² and 1700 kg.
const DRAG: f64 = 2.84e-4;
/// Metres a second squared.
const GRAVITY: f64 = 9.81;
/// Watts a kilogram: 310 kW and 1700 kg, which bounds the drive at higher speeds.
const POWER: f64 = 182.0;

/// The state of a car. Its place is that of its middle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ego {
    /// Where its middle is.
    pub pose: Pose,
    /// Metres a second, forwards; it does not go backwards.
    pub speed: f64,
    /// Metres a second squared, of the last step.
    pub acceleration: f64,
}

/// A car after `DT` seconds.
///
/// ```text
/// a  = throttle min(DRIVE, POWER/v) - brake BRAKE - DRAG v² - ROLL - g sin(grade)
/// β  = atan(tan(δ)/2),   δ = steer TURN
/// x' = x + v cos(ψ + β) dt;  y' = y + v sin(ψ + β) dt;  ψ' = ψ + v sin(β)/(L/2) dt;  v' = max(v + a dt, 0)
/// ```
///
/// where `L` is the wheelbase, and the middle of the car is halfway between its axles (Polack et al., 2017). Brakes and rolling
/// do not push it back: from rest it moves where the drive is stronger than they and the slope are. Speed over ground along a
/// slope is less by its cosine.
///
/// - `controls`: bounded to what they can be; what is not a number counts as 0.
///
/// Height and pitch are left to the ground.
#[must_use]
pub fn driven(ego: &Ego, controls: &Controls) -> Ego {
    let bounded = |x: f64, low: f64| if x.is_nan() { 0.0 } else { x.clamp(low, 1.0) };
    let [throttle, brake] = [bounded(controls.throttle, 0.0), bounded(controls.brake, 0.0)];
    let Ego { pose, speed, .. } = *ego;
    let drive = throttle * DRIVE.min(POWER / speed.max(1.0));
    let slows = brake * BRAKE + ROLL + DRAG * speed * speed;
    let pulls = drive - GRAVITY * pose.pitch.sin();
    let after = (speed + (pulls - slows) * DT).max(0.0);
    let slip = ((bounded(controls.steer, -1.0) * TURN).tan() / 2.0).atan();
    let level = speed * pose.pitch.cos();
    let course = pose.yaw + slip;
    let pose = Pose {
        x: pose.x + level * course.cos() * DT,
        y: pose.y + level * course.sin() * DT,
        yaw: wrapped(pose.yaw + level * slip.sin() / (WHEELBASE / 2.0) * DT),
        ..pose
    };
    Ego { pose, speed: after, acceleration: (after - speed) / DT }
}

/// Throttle and brake by which a car gains so many metres a second squared, as far as it can.
#[must_use]
pub fn pedals(ego: &Ego, acceleration: f64) -> [f64; 2] {
    let drag = ROLL + DRAG * ego.speed * ego.speed;
    let pull = acceleration + drag + GRAVITY * ego.pose.pitch.sin();
    if pull > 0.0 { [(pull / DRIVE).min(1.0), 0.0] } else { [0.0, (-pull / BRAKE).min(1.0)] }
}

/// The turn of the wheel by which a car comes to a point: pure pursuit (Coulter, 1992), for the middle of the car.
///
/// ```text
/// κ = 2 sin(α)/(d + L cos(α));   sin(β) = κ L/2;   δ = atan(2 tan(β))
/// ```
///
/// where `α` is the angle to the point and `d` how far it is. The circle through both touches the course, which is `β` away from
/// the car's direction: hence `L cos(α)`, up to `cos(β)`.
///
/// - `point`: `x`, `y` in the town.
#[must_use]
pub fn pursuit(pose: &Pose, point: [f64; 2]) -> f64 {
    let [forward, right] = pose.inward(point);
    let far = forward.hypot(right).max(0.1);
    let curvature = 2.0 * (right / far) / (far + WHEELBASE * forward / far).max(0.1);
    let slip = (curvature * WHEELBASE / 2.0).clamp(-0.9, 0.9).asin();
    ((2.0 * slip.tan()).atan() / TURN).clamp(-1.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(ego: Ego, controls: [f64; 3], expected: f64) {
        let [throttle, brake, steer] = controls;
        let found = driven(&ego, &Controls { throttle, brake, steer }).acceleration;
        assert!((found - expected).abs() < 1e-9, "{found} for {expected}");
    }

    #[test]
    fn pedals_and_slopes_accelerate() {
        let at = |speed: f64, pitch: f64| Ego {
            pose: Pose { pitch, ..Pose::default() },
            speed,
            acceleration: 0.0,
        };
        check(at(0.0, 0.0), [1.0, 0.0, 0.0], 6.0 - 0.147);
        // At 10 m/s: 0.0284 of drag.
        check(at(10.0, 0.0), [0.5, 0.0, 0.0], 3.0 - 0.147 - 0.0284);
        check(at(10.0, 0.0), [0.0, 1.0, 0.0], -8.0 - 0.147 - 0.0284);
        // At 50 m/s the engine gives 3.64.
        check(at(50.0, 0.0), [1.0, 0.0, 0.0], 3.64 - 0.147 - 0.71);
        // Uphill by 30°: half of g. Downhill it would be as much faster.
        let up = std::f64::consts::FRAC_PI_6;
        check(at(10.0, up), [1.0, 0.0, 0.0], 6.0 - 4.905 - 0.147 - 0.0284);
        check(at(10.0, -up), [1.0, 0.0, 0.0], 6.0 + 4.905 - 0.147 - 0.0284);
        // It neither rolls back nor is braked backwards, and rolls down by itself.
        check(at(0.0, up), [0.0, 1.0, 0.0], 0.0);
        check(at(0.0, up), [0.0, 0.0, 0.0], 0.0);
        check(at(0.0, -up), [0.0, 0.0, 0.0], 4.905 - 0.147);
        check(at(0.1, 0.0), [0.0, 1.0, 0.0], -2.0);
        check(at(0.0, 0.0), [f64::NAN, f64::NAN, f64::NAN], 0.0);
        check(at(0.0, 0.0), [9.0, -9.0, 0.0], 6.0 - 0.147);
    }

    #[test]
    fn at_full_steer_it_drives_in_a_circle() {
        let mut ego = Ego { speed: 1.0, ..Ego::default() };
        // Radius (L/2)/sin(β) with tan(β) = tan(70°)/2: 1.68 m.
        let slip = (70_f64.to_radians().tan() / 2.0).atan();
        let radius = 1.36 / slip.sin();
        let mut ys = Vec::new();
        for _ in 0..400 {
            ego = driven(&ego, &Controls { steer: 1.0, ..Controls::default() });
            ego.speed = 1.0;
            ys.push(ego.pose.y);
        }
        // Steps are chords, so that the circle is a little larger. To the right of x is y above 0.
        let [low, high] =
            [ys.iter().copied().fold(9.0, f64::min), ys.iter().copied().fold(-9.0, f64::max)];
        assert!((high - low - 2.0 * radius).abs() < 0.1 && high > 2.5, "{low} {high} {radius}");
    }

    #[test]
    fn pursuit_hits_the_point() {
        for point in [[8.0, 1.0], [6.0, -2.0], [10.0, 0.0]] {
            let mut ego = Ego { speed: 1.0, ..Ego::default() };
            let mut least = f64::INFINITY;
            for _ in 0..400 {
                let steer = pursuit(&ego.pose, point);
                ego =
                    Ego { speed: 1.0, ..driven(&ego, &Controls { steer, ..Controls::default() }) };
                least = least.min((ego.pose.x - point[0]).hypot(ego.pose.y - point[1]));
            }
            assert!(least < 0.1, "{least} from {point:?}");
        }
    }
}
