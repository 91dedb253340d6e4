//! Replays recorded episodes of highway-env, frame by frame.

use std::path::PathBuf;

use serde::Deserialize;
use serde_json::Value;

use super::driver::Driver;
use super::episode::single;
use super::lane::Point;
use super::network::{Leg, Network, Route};
use super::release::Release;
use super::roads::{highway, roundabout};
use super::seen::Sight;
use super::steering::{Cruise, Meta};
use super::traffic::Traffic;
use super::vehicle::{DT, Pilot, Vehicle};
use super::{on_highway, on_roundabout};

/// A recorded episode.
#[derive(Deserialize)]
struct Record {
    format: String,
    package: String,
    env: String,
    lanes: Vec<RecordedLane>,
    vehicles: Vec<Car>,
    frame_columns: Vec<String>,
    obs0: Vec<[f64; 4]>,
    steps: Vec<Step>,
    config: Config,
}

#[derive(Deserialize)]
struct Config {
    duration: usize,
}

#[derive(Deserialize)]
struct RecordedLane {
    index: (String, String, usize),
    length: f64,
    width: f64,
    speed_limit: f64,
    /// Places and what they are: along, across, x, y, heading, width, along, across.
    #[serde(default)]
    samples: Vec<[f64; 8]>,
}

#[derive(Deserialize)]
#[expect(non_snake_case, reason = "the file has it so")]
struct Car {
    cls: String,
    x: f64,
    y: f64,
    heading: f64,
    speed: f64,
    lane: (String, String, usize),
    target_lane: (String, String, usize),
    target_speed: f64,
    route: Option<Vec<(String, String, Option<usize>)>>,
    timer: Option<f64>,
    DELTA: Option<f64>,
    speed_index: Option<usize>,
}

#[derive(Deserialize)]
struct Step {
    action: String,
    reward: f64,
    terminated: bool,
    obs: Vec<[f64; 4]>,
    /// By frame and car.
    frames: Vec<Vec<[Option<f64>; 11]>>,
}

const COLUMNS: [&str; 11] = [
    "x",
    "y",
    "heading",
    "speed",
    "steering",
    "acceleration",
    "lane(index into lanes)",
    "target_lane",
    "target_speed",
    "timer",
    "crashed",
];

/// How near all numbers are to be.
const NEAR: f64 = 1e-6;

impl Record {
    fn release(&self) -> &'static Release {
        let version = self.package.strip_prefix("highway-env==").expect("a version");
        Release::of(version).expect("a release that is replayed")
    }

    fn network(&self) -> Network {
        match self.env.as_str() {
            "highway-v0" => highway(self.lanes.len(), self.release()),
            "roundabout-v0" => roundabout(),
            other => panic!("no road of {other}"),
        }
    }

    fn traffic(&self) -> Traffic {
        let mut traffic = Traffic::new(self.network(), self.release());
        let cars = self.vehicles.iter().map(|car| car.vehicle(&traffic.network)).collect();
        traffic.vehicles = cars;
        traffic
    }
}

fn lane(network: &Network, (from, to, number): &(String, String, usize)) -> usize {
    network.roads[network.road(from, to).expect("a road")].first + number
}

impl Car {
    fn vehicle(&self, network: &Network) -> Vehicle {
        let at = [self.x, self.y];
        let pilot = if self.cls == "IDMVehicle" {
            let mut driver = Driver::new(at, self.DELTA.expect("an exponent"));
            let timer = self.timer.expect("a timer");
            assert!((driver.timer - timer).abs() < NEAR, "{} is not {timer}", driver.timer);
            driver.timer = timer;
            Pilot::Driver(driver)
        } else {
            let speeds =
                if network.roads.len() == 1 { [20.0, 25.0, 30.0] } else { [0.0, 8.0, 16.0] };
            let place = self.speed_index.expect("a speed");
            Pilot::Cruise(Cruise { speeds, place })
        };
        let mut car = Vehicle::new(network, at, self.heading, self.speed, pilot);
        assert_eq!(car.lane, lane(network, &self.lane), "the lane that a car starts on");
        car.target_lane = lane(network, &self.target_lane);
        car.target_speed = self.target_speed;
        let leg = |(from, to, lane): &(String, String, Option<usize>)| Leg {
            road: network.road(from, to).expect("a road"),
            lane: *lane,
        };
        car.route = self.route.iter().flatten().map(leg).collect();
        if let Some(last) = car.route.back() {
            let planned: Route = network.route(car.lane, network.roads[last.road].to);
            assert_eq!(planned, car.route, "the route of a car");
        }
        car
    }
}

/// The greatest difference, or where one is too great.
fn replay(
    record: &Record,
    traffic: &mut Traffic,
    disturb: impl Fn(&mut Traffic),
) -> Result<f64, String> {
    let mut most = unseen(traffic, &record.obs0);
    if most > NEAR {
        return Err(format!("the first that is seen differs by {most}"));
    }
    for (t, step) in record.steps.iter().enumerate() {
        let told = Meta::NAMES.iter().position(|name| *name == step.action).expect("an action");
        traffic.vehicles[0].tell(Meta::ALL[told], &traffic.network);
        for (k, frame) in step.frames.iter().enumerate() {
            traffic.decide();
            traffic.go();
            disturb(traffic);
            assert_eq!(frame.len(), traffic.vehicles.len());
            for (i, (car, expected)) in traffic.vehicles.iter().zip(frame).enumerate() {
                let found = columns(car);
                for (column, (found, expected)) in COLUMNS.iter().zip(found.iter().zip(expected)) {
                    let error = match (found, expected) {
                        (Some(found), Some(expected)) => (found - expected).abs(),
                        (found, expected) if found == expected => 0.0,
                        _ => f64::INFINITY,
                    };
                    most = most.max(error);
                    if error.is_nan() || error > NEAR {
                        return Err(format!(
                            "step {t}, frame {k}, car {i}, {column}: {found:?} is not {expected:?}"
                        ));
                    }
                }
            }
            for (car, recorded) in traffic.vehicles.iter_mut().zip(frame) {
                follow_standing(car, recorded);
            }
        }
        let error = (paid(traffic, Meta::ALL[told]) - step.reward).abs();
        let seen = unseen(traffic, &step.obs).max(error);
        most = most.max(seen);
        let over = traffic.vehicles[0].crashed
            || traffic.release.ends_in_time && t + 1 >= record.config.duration;
        if seen.is_nan() || seen > NEAR || over != step.terminated {
            return Err(format!("step {t}: what is seen, paid or over differs by {seen}"));
        }
    }
    Ok(most)
}

fn paid(traffic: &Traffic, told: Meta) -> f64 {
    match traffic.network.roads.len() {
        1 => on_highway::paid(traffic, traffic.network.lanes.len() - 1),
        _ => on_roundabout::paid(traffic, told),
    }
}

/// How far what is seen is from what was.
fn unseen(traffic: &Traffic, recorded: &[[f64; 4]]) -> f64 {
    let sight = Sight { others: recorded.len() - 1, absolute: false, scale: None };
    let others = sight.others(traffic, 0);
    let rows: Vec<[f64; 4]> = sight.rows(traffic, 0, &others).collect();
    assert_eq!(rows.len(), recorded.len());
    // The later release has it in single precision.
    let exact = |x: f64| if traffic.release.ends_in_time { x } else { f64::from(single(x)) };
    let errors = rows.iter().flatten().zip(recorded.iter().flatten());
    errors.map(|(found, expected)| (exact(*found) - expected).abs()).fold(0.0, f64::max)
}

/// Puts a car that is told what to do where it was recorded once it nearly stands. There the control of the original is
/// not stable, and multiplies the last digit, in which no two libraries agree, by up to eight a frame.
fn follow_standing(car: &mut Vehicle, recorded: &[Option<f64>; 11]) {
    if !matches!(car.pilot, Pilot::Cruise(_)) || car.speed.abs() >= 1.0 {
        return;
    }
    let [x, y, heading, speed] = [0, 1, 2, 3].map(|i| recorded[i].expect("a number"));
    (car.at, car.speed) = ([x, y], speed);
    car.turn_to(heading);
}

#[expect(clippy::cast_precision_loss, reason = "a few lanes")]
fn columns(car: &Vehicle) -> [Option<f64>; 11] {
    let timer = if let Pilot::Driver(driver) = &car.pilot { Some(driver.timer) } else { None };
    let lanes = [car.lane, car.target_lane].map(|lane| Some(lane as f64));
    [
        Some(car.at[0]),
        Some(car.at[1]),
        Some(car.heading),
        Some(car.speed),
        Some(car.steering),
        Some(car.acceleration),
        lanes[0],
        lanes[1],
        Some(car.target_speed),
        timer,
        Some(f64::from(u8::from(car.crashed))),
    ]
}

fn records() -> Vec<(String, Record)> {
    let elsewhere = std::env::var_os("IVX_WORLDS_DIR").map(PathBuf::from);
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/golden");
    let folder = elsewhere.clone().unwrap_or_else(|| own.into());
    let files = ["highway", "highway_v1.1"].iter().flat_map(|family| {
        std::fs::read_dir(folder.join(family))
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.path())
    });
    let mut files: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|end| end == "json")).collect();
    files.sort();
    assert!(elsewhere.is_some() || files.len() >= 4, "{} has too few episodes", folder.display());
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).expect("the file can be read");
        let name = path.display().to_string();
        let record: Record =
            serde_json::from_str(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(
            (record.format.as_str(), &record.frame_columns[..]),
            ("ivx-highway-golden-1", &COLUMNS.map(str::to_owned)[..])
        );
        (name, record)
    };
    files.into_iter().map(read).collect()
}

#[test]
fn golden_lanes_are_those_of_highway_env() {
    for (name, record) in records() {
        let network = record.network();
        assert_eq!(network.lanes.len(), record.lanes.len());
        for (i, expected) in record.lanes.iter().enumerate() {
            assert_eq!(lane(&network, &expected.index), i, "{name}");
            let found = network.lanes[i];
            let size = [found.length, super::lane::WIDTH, found.limit];
            let facts = [expected.length, expected.width, expected.speed_limit];
            assert!(size.iter().zip(facts).all(|(a, b)| (a - b).abs() < 1e-9), "{name}, lane {i}");
            for [s, r, x, y, heading, _, along, across] in &expected.samples {
                let [fx, fy]: Point = found.point([*s, *r]);
                let local = found.local([*x, *y]);
                let found = [fx, fy, found.heading(*s), local[0], local[1]];
                let near = found
                    .iter()
                    .zip([*x, *y, *heading, *along, *across])
                    .all(|(a, b)| (a - b).abs() < 1e-9);
                assert!(near, "{name}, lane {i} at {s}, {r}: {found:?}");
            }
        }
    }
}

#[test]
fn golden_cars_drive_as_in_highway_env() {
    let mut errors = Vec::new();
    for (name, record) in records() {
        match replay(&record, &mut record.traffic(), |_| {}) {
            Ok(most) => eprintln!("{name}: {most:e}"),
            Err(error) => errors.push(format!("{name}: {error}")),
        }
    }
    assert!(errors.is_empty(), "{} episodes differ:\n{}", errors.len(), errors.join("\n"));
}

/// Positions by the speed that follows, and constants of the other release: neither passes.
#[test]
fn golden_a_wrong_formula_is_noticed() {
    let by_new_speed = |traffic: &mut Traffic| {
        for car in &mut traffic.vehicles {
            let slip = (0.5 * car.steering.tan()).atan();
            let (sin, cos) = (car.heading + slip).sin_cos();
            car.at[0] += car.acceleration * DT * DT * cos;
            car.at[1] += car.acceleration * DT * DT * sin;
        }
    };
    for (name, record) in records() {
        assert!(replay(&record, &mut record.traffic(), by_new_speed).is_err(), "{name}");
        let mut other = record.traffic();
        let old = *record.release() == Release::V1_1;
        other.release = if old { &Release::V1_12 } else { &Release::V1_1 };
        assert!(replay(&record, &mut other, |_| {}).is_err(), "{name}");
    }
}

/// Equations one by one: the bicycle, and how hard drivers accelerate.
#[test]
fn golden_equations_are_those_of_highway_env() {
    let elsewhere = std::env::var_os("IVX_GOLDEN_DIR").map(PathBuf::from);
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/golden");
    let path = elsewhere.clone().unwrap_or_else(|| own.into()).join("env_highway.json");
    if elsewhere.is_some() && !path.exists() {
        return;
    }
    let text = std::fs::read_to_string(&path).expect("the file can be read");
    let file: Value = serde_json::from_str(&text).expect("JSON");
    let tolerance = &file["tolerance"]["f64"];
    let near = |found: f64, expected: &Value, place: &str| {
        let [rtol, atol, expected] = [&tolerance["rtol"], &tolerance["atol"], expected].map(number);
        let near = (found - expected).abs() <= atol + rtol * expected.abs();
        assert!(near, "{place}: {found} is not {expected}");
    };
    let cases = file["cases"].as_array().expect("cases");
    assert!(!cases.is_empty(), "no case to check");
    for case in cases {
        let (inputs, expected) = (&case["inputs"], &case["expected"]);
        match case["kind"].as_str() {
            Some("bicycle") => bicycle(inputs, &expected["states_x_y_heading_speed"], &near),
            Some("idm") => accelerations(inputs, expected, &near),
            kind => panic!("nothing computes {kind:?}"),
        }
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn bicycle(inputs: &Value, states: &Value, near: &dyn Fn(f64, &Value, &str)) {
    let network = highway(4, &Release::V1_12);
    assert!((number(&inputs["dt"]) - DT).abs() < 1e-15);
    let [x, y, heading, speed] = [0, 1, 2, 3].map(|i| number(&inputs["state0"][i]));
    let mut car = Vehicle::new(&network, [x, y], heading, speed, Pilot::Held);
    let check = |car: &Vehicle, t: usize| {
        let found = [car.at[0], car.at[1], car.heading, car.speed];
        (0..4).for_each(|i| near(found[i], &states[t][i], &format!("state {t}, {i}")));
    };
    check(&car, 0);
    let actions = inputs["actions_steer_acc"].as_array().expect("actions");
    for (t, action) in actions.iter().enumerate() {
        (car.steering, car.acceleration) = (number(&action[0]), number(&action[1]));
        car.step(&network);
        check(&car, t + 1);
    }
}

fn accelerations(inputs: &Value, expected: &Value, near: &dyn Fn(f64, &Value, &str)) {
    let network = highway(1, &Release::V1_12);
    let rows = inputs["rows"].as_array().expect("rows");
    for (i, row) in rows.iter().enumerate() {
        let car = |x, speed| Vehicle::new(&network, [x, 0.0], 0.0, speed, Pilot::Held);
        let mut behind = car(100.0, number(&row["ego_speed"]));
        behind.target_speed = number(&row["target_speed"]);
        let front = row["gap_center_to_center"].as_f64();
        let front = front.map(|gap| car(100.0 + gap, number(&row["front_speed"])));
        let driver = Driver::new([0.0, 0.0], number(&row["delta"]));
        let found = driver.accelerates(&behind, front.as_ref(), &network, &Release::V1_12);
        near(found, &expected["accel"][i], &format!("acceleration {i}"));
        if let Some(front) = &front {
            near(driver.gap(&behind, front), &expected["desired_gap"][i], &format!("gap {i}"));
        }
    }
}
