//! What a spinning laser on the roof of a car sees, and its picture from above.
//!
//! Rays meet the raster of the ground (`relief.rs`), kerbs, the banks beside roads, and cars as boxes. There are no houses and
//! no trees in maps: beside roads everything is a bank (`BANK`).
//!
//! As published for CARNOVEL: 2.5 m above the car's place, 32 channels from +10 to -30 degrees, 10 000 points a turn at 50 m.
//! Its pictures tell points above the ground from those on it; what its release does in fact cannot be known (the points of
//! that CARLA are upside down), so that what was meant is done: `z` is up. The sensor is tilted with the car by shear instead
//! of rotation: heights change by `forward · tan(pitch)`, which is off by 2 % of distances at 20 %.

#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "rays and bins are counted, and points are single precision"
)]

use std::f64::consts::TAU;

use crate::body::Body;
use crate::geometry::Pose;
use crate::relief::{CELL, Relief};

/// Metres of a picture's side that are bins: 200 of 0.505 m, from 50 m behind and left of the sensor to 51 m.
const BINS: [f64; 2] = [-50.0, 51.0];
/// Bins along each side of a picture.
pub const SIDE: usize = 200;
/// Points of a bin that are counted.
pub const MOST_POINTS: u8 = 5;
/// Height of what is beside roads over the road before it, in metres. Ours: low walls and hedges.
const BANK: f32 = 1.0;
/// Height of cars, in metres: a Mustang's.
const CAR: f64 = 1.38;
/// Nearest that a ray meets the ground, in metres: the car itself is below.
const NEAREST: f64 = 1.0;

/// A sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Lidar {
    /// Metres above the car's place.
    pub height: f64,
    /// Metres.
    pub range: f64,
    /// Channels, evenly from the first to the last elevation.
    pub n_channels: usize,
    /// Degrees: that of the first channel and of the last, which is lower.
    pub elevations: [f64; 2],
    /// Points of a turn, of all channels together.
    pub n_points: usize,
}

impl Default for Lidar {
    fn default() -> Self {
        Self {
            height: 2.5,
            range: 50.0,
            n_channels: 32,
            elevations: [10.0, -30.0],
            n_points: 10_000,
        }
    }
}

/// What a box of a car is to rays in one direction.
#[derive(Clone, Copy, Debug)]
struct Crossed {
    /// Where rays enter and leave it, in metres.
    at: [f64; 2],
    /// Its lower and upper side, from the sensor.
    z: [f64; 2],
}

/// Points in the frame of the sensor: forward, right, up, in metres. Rays that meet nothing within the range have none. They
/// come direction by direction from ahead to the right, and in each from the lowest channel to the highest.
///
/// - `pose`: of the car.
/// - `cars`: all others; those that are far away do not matter.
#[must_use]
pub fn scan(lidar: &Lidar, relief: &Relief, pose: &Pose, cars: &[Body]) -> Vec<[f32; 3]> {
    let n_directions = lidar.n_points / lidar.n_channels.max(1);
    // From the lowest: who looks farther down meets the ground earlier.
    let [first, last] = lidar.elevations;
    let n_gaps = count(lidar.n_channels.saturating_sub(1)).max(1.0);
    let channels = (0..lidar.n_channels).rev().map(|c| first + (last - first) * count(c) / n_gaps);
    let rises: Vec<f64> = channels.map(|degrees| degrees.to_radians().tan()).collect();
    let reach: Vec<f64> = rises.iter().map(|rise| lidar.range / rise.hypot(1.0)).collect();
    let boxes = crossings(lidar, pose, cars, n_directions);
    let mut points = Vec::with_capacity(lidar.n_points);
    let mut met = vec![0.0; rises.len()];
    for (direction, boxes) in boxes.iter().enumerate() {
        let (sin, cos) = (TAU * count(direction) / count(n_directions)).sin_cos();
        meet_ground(lidar, relief, pose, [cos, sin], &rises, &mut met);
        for crossed in boxes {
            for (met, rise) in met.iter_mut().zip(&rises) {
                *met = met.min(meet_box(crossed, *rise));
            }
        }
        for ((met, rise), reach) in met.iter().zip(&rises).zip(&reach) {
            if met <= reach {
                points.push([met * cos, met * sin, met * rise].map(|x| x as f32));
            }
        }
    }
    points
}

fn count(n: usize) -> f64 {
    f64::from(u32::try_from(n).unwrap_or(u32::MAX))
}

/// How far each ray of a direction goes until it meets the ground.
///
/// - `direction`: cosine and sine, from the car's.
/// - `rises`: of the rays, metres a metre, ascending.
/// - `met`: by ray; not finite where it meets nothing.
fn meet_ground(
    lidar: &Lidar,
    relief: &Relief,
    pose: &Pose,
    [cos, sin]: [f64; 2],
    rises: &[f64],
    met: &mut [f64],
) {
    met.fill(f64::INFINITY);
    let (turn_sin, turn_cos) = pose.yaw.sin_cos();
    let ahead = [cos * turn_cos - sin * turn_sin, cos * turn_sin + sin * turn_cos];
    let tilt = cos * pose.pitch.tan();
    let mut road = pose.z as f32;
    let sensor = pose.z + lidar.height;
    // Ground is met where it has come up to the ray; between two places it is straight.
    let mut before = [0.0, -lidar.height];
    let mut ray = 0;
    let mut far = NEAREST;
    while far <= lidar.range && ray < rises.len() {
        let point = [pose.x + far * ahead[0], pose.y + far * ahead[1]];
        let ground = relief.seen_from(point, &mut road, BANK);
        let here = [far, f64::from(ground) - sensor - far * tilt];
        while ray < rises.len() && rises[ray] * here[0] <= here[1] {
            let [above, below] = [before, here].map(|[far, z]| rises[ray] * far - z);
            let share = if above > below { above / (above - below) } else { 1.0 };
            met[ray] = before[0] + share.clamp(0.0, 1.0) * (here[0] - before[0]);
            ray += 1;
        }
        before = here;
        far += CELL;
    }
}

/// How far a ray goes until it meets a box: its near side, or its roof from above.
fn meet_box(crossed: &Crossed, rise: f64) -> f64 {
    let [enters, leaves] = crossed.at;
    let [low, high] = crossed.z;
    let z = rise * enters;
    if (low..=high).contains(&z) {
        enters
    } else if z > high && rise * leaves < high {
        high / rise
    } else {
        f64::INFINITY
    }
}

/// Cars that rays of each direction cross.
fn crossings(lidar: &Lidar, pose: &Pose, cars: &[Body], n_directions: usize) -> Vec<Vec<Crossed>> {
    let mut crossings = vec![Vec::new(); n_directions];
    for car in cars {
        let middle = pose.inward([car.pose.x, car.pose.y]);
        let far = middle[0].hypot(middle[1]);
        if far > lidar.range + car.reach() || far < car.reach() {
            continue;
        }
        let [towards, half] = [middle[1].atan2(middle[0]), (car.reach() / far).min(1.0).asin()];
        let each = TAU / count(n_directions);
        let from = ((towards - half) / each).floor() as i64;
        let to = ((towards + half) / each).ceil() as i64;
        for k in from..=to {
            let direction = k.rem_euclid(n_directions as i64) as usize;
            let (sin, cos) = (each * count(direction)).sin_cos();
            let ahead = pose.outward([cos, sin]);
            if let Some(at) = car.crossed_by([pose.x, pose.y], ahead) {
                let low = car.pose.z - pose.z - lidar.height - at[0] * cos * pose.pitch.tan();
                crossings[direction].push(Crossed { at, z: [low, low + CAR] });
            }
        }
    }
    crossings
}

/// The picture of points from above: for each bin ahead and to the right how many points are on the ground, and how many above,
/// at most 5: a fifth of it is what networks see. `[200, 200, 2]`: forward from behind, to the right from the left.
///
/// - `split`: points up to this height from the sensor are on the ground, in metres. Meant is the ground's, -2.5; so that
///   rounding does not decide, something between that and a kerb.
#[must_use]
pub fn picture(points: &[[f32; 3]], split: f32) -> Vec<u8> {
    let mut picture = vec![0; SIDE * SIDE * 2];
    let scale = count(SIDE) / (BINS[1] - BINS[0]);
    for [x, y, z] in points {
        let [row, column] = [x, y].map(|x| (f64::from(*x) - BINS[0]) * scale);
        // Rays reach no farther back or left than the first bin, and casts saturate.
        let [row, column] = [row as usize, column as usize];
        if row < SIDE && column < SIDE {
            let bin = &mut picture[(row * SIDE + column) * 2 + usize::from(*z > split)];
            *bin = (*bin + 1).min(MOST_POINTS);
        }
    }
    picture
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::town_map;
    use crate::town::{Town, town};
    use crate::xodr::read_map;

    /// A flat road of 400 m with lanes of 100 m on each side.
    fn plain() -> Town {
        let lane = |id: i32| {
            format!(
                r#"<lane id="{id}" type="driving"><width sOffset="0" a="100" b="0" c="0" d="0"/></lane>"#
            )
        };
        let text = format!(
            r#"<OpenDRIVE><road id="1" length="400" junction="-1">
            <planView><geometry s="0" x="-200" y="0" hdg="0" length="400"><line/></geometry></planView>
            <lanes><laneSection s="0"><left>{}</left><right>{}</right></laneSection></lanes></road></OpenDRIVE>"#,
            lane(1),
            lane(-1)
        );
        town(read_map(&text).unwrap())
    }

    fn total(picture: &[u8], channel: usize) -> u32 {
        picture.iter().skip(channel).step_by(2).map(|n| u32::from(*n)).sum()
    }

    #[test]
    fn on_a_plain_there_are_rings() {
        let town = plain();
        let points = scan(&Lidar::default(), &town.relief, &Pose::default(), &[]);
        // Channels are 40/31 degrees apart: from the 11th on, at -2.9 degrees and 49.3 m, they meet the ground within 50 m.
        assert_eq!(points.len(), 22 * 312);
        for (k, [x, y, z]) in points[..22].iter().enumerate() {
            let angle = (-30.0 + 40.0 / 31.0 * count(k)).to_radians();
            assert!(
                (f64::from(*x) - 2.5 / -angle.tan()).abs() < 1e-3 && y.abs() < 1e-5,
                "{k}: {x}"
            );
            assert!((z + 2.5).abs() < 1e-5);
        }
        let picture = picture(&points, -2.4);
        assert_eq!(total(&picture, 1), 0);
        assert!(total(&picture, 0) > 4_000 && picture.iter().all(|n| *n <= 5));
        // Straight ahead at 4.33 m: row (4.33 + 50)/0.505 = 107, column 50/0.505 = 99.
        assert!(picture[(107 * SIDE + 99) * 2] > 0);
        // A split below the ground would have everything above it.
        assert_eq!(total(&super::picture(&points, -2.6), 0), 0);
    }

    #[test]
    fn a_car_is_seen_and_hides_what_is_behind() {
        let town = plain();
        let car = Body::car(Pose { x: 10.0, ..Pose::default() }, [0.0, 0.0]);
        let points = scan(&Lidar::default(), &town.relief, &Pose::default(), &[car]);
        let above: Vec<&[f32; 3]> = points.iter().filter(|[.., z]| *z > -2.4).collect();
        // Its near side is at 7.65 m and its roof at -1.12.
        assert!(above.len() > 50);
        for [x, y, z] in above {
            let side = (x - 7.65).abs() < 0.01 && *z < -1.1;
            let roof = (z + 1.12).abs() < 0.01 && (7.64..12.36).contains(x);
            assert!((side || roof) && y.abs() < 0.96, "{x} {y} {z}");
        }
        // Over its roof the next ray down the road meets the ground at 12.35/1.12 · 2.5 m or farther.
        let hidden = |[x, y, z]: &&[f32; 3]| *x > 12.4 && *x < 25.0 && y.abs() < 0.5 && *z < -2.4;
        assert_eq!(points.iter().filter(hidden).count(), 0);
        let free = scan(&Lidar::default(), &town.relief, &Pose::default(), &[]);
        assert!(free.iter().filter(hidden).count() > 10);
        assert_eq!(scan(&Lidar::default(), &town.relief, &Pose::default(), &[car]), points);
    }

    #[test]
    fn roads_have_edges_and_ramps_rise() {
        let town = town(town_map("Town03").unwrap());
        let look = |road: i32, id: i32, s: f64| {
            let pose = town.network.pose(town.network.lane_at(road, id, s).unwrap());
            let points = scan(&Lidar::default(), &town.relief, &pose, &[]);
            // Ahead on its own lane.
            let ahead = |[x, y, _]: &&[f32; 3]| *x > 5.0 && *x < 30.0 && y.abs() < 1.0;
            let on_lane: Vec<[f32; 3]> = points.iter().filter(ahead).copied().collect();
            let above = on_lane.iter().filter(|[.., z]| *z > -2.4).count();
            let edges = points.iter().filter(|[.., z]| *z > -2.4).count();
            (on_lane.len(), above, edges)
        };
        // On the flat, all of the lane is ground, and what is beside the road is above.
        let (n, above, edges) = look(90, -1, 20.0);
        assert!(n > 20 && above <= n / 10 && edges > 500, "{n} {above} {edges}");
        // At the foot of the ramp of road 51, which is driven against its line.
        let end = town.network.map.roads.iter().find(|road| road.id == 51).unwrap().length;
        let (n, above, _) = look(51, 1, end);
        assert!(above > n / 2, "{n} {above}");
    }
}
