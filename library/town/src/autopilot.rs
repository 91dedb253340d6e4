//! The expert: it follows its route at 20 km/h and stops for whoever is in its way.

use crate::car::{pedals, pursuit};
use crate::drive::Drive;
use crate::geometry::wrapped;
use crate::pid::Controls;

/// Metres a second: 20 km/h.
const CRUISE: f64 = 20.0 / 3.6;
/// Metres a second squared, to the side in bends.
const SIDEWARDS: f64 = 1.5;
/// Metres a second squared with which it stops.
const BRAKING: f64 = 2.0;
/// Metres that it keeps from where it must not go.
const SPARE: f64 = 1.0;
/// Metres of the route that it looks at for bends.
const LOOKS: usize = 10;
/// Metres ahead to which it steers: so many, and more by the second of speed.
const AIMS: [f64; 2] = [1.2, 0.25];
/// By how much it speeds up for what it is too slow, by the second.
const EAGER: f64 = 2.0;

/// What the expert does.
///
/// - `noise`: the probability of doing anything else: pedals and wheel drawn uniformly.
/// - `draw`: uniform in `[0, 1)`; nothing is drawn without noise.
pub fn autopilot(drive: &Drive, noise: f64, draw: &mut dyn FnMut() -> f64) -> Controls {
    if noise > 0.0 && draw() < noise {
        let [throttle, brake, steer] = [draw(), draw(), 2.0 * draw() - 1.0];
        return Controls { throttle, brake, steer };
    }
    let speed = drive.ego.speed;
    let stops = (2.0 * BRAKING * (drive.room() - SPARE).max(0.0)).sqrt();
    let target = CRUISE.min(stops).min(bends(drive));
    let pose = &drive.ego.pose;
    let aim = AIMS[0] + AIMS[1] * speed;
    let point = drive.route[drive.at..].iter().find(|point| {
        point.pose.distance(pose) >= aim && pose.inward([point.pose.x, point.pose.y])[0] > 0.0
    });
    // Behind the last point it goes straight on.
    let steer = point.map_or(0.0, |point| pursuit(pose, [point.pose.x, point.pose.y]));
    let [throttle, brake] = pedals(&drive.ego, EAGER * (target - speed));
    let standing = target < 0.1 && speed < 0.5;
    if standing {
        Controls { throttle: 0.0, brake: 1.0, steer }
    } else {
        Controls { throttle, brake, steer }
    }
}

/// The speed at which all bends ahead can still be taken.
fn bends(drive: &Drive) -> f64 {
    let end = (drive.at + LOOKS).min(drive.route.len());
    let pairs = drive.route[drive.at..end].windows(2).zip(0_u32..);
    let speeds = pairs.map(|(pair, metres)| {
        let bend = wrapped(pair[1].pose.yaw - pair[0].pose.yaw).abs().max(1e-6);
        (SIDEWARDS / bend + 2.0 * BRAKING * f64::from(metres)).sqrt()
    });
    speeds.fold(f64::INFINITY, f64::min)
}
