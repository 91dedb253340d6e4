//! Maps against CARLA's own reading of them (`carla.Map` of 0.9.16): poses, neighbours, what is ahead, projections, topology.
//!
//! Other files in the same format are read where `IVX_WORLDS_DIR` names the folder above `carla_map`, or the one above
//! `golden/carla_map`.

use std::fs;
use std::path::PathBuf;

use ivx_town::{At, Kind, Nearest, Network, Point, centre, nearest, network, town_map, wrapped};
use serde::Deserialize;

/// Metres.
const NEAR: f64 = 0.02;
/// Degrees.
const TURNED: f64 = 0.1;

/// Road, section, lane, s, and what follows.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Waypoint {
    Full(
        i32,
        usize,
        i32,
        f64,
        f64,
        f64,
        f64,
        f64,
        f64,
        f64,
        u8,
        i32,
        String,
        serde::de::IgnoredAny,
    ),
    Beside(i32, usize, i32, f64, f64, f64, f64, f64, String),
    Short(i32, usize, i32, f64, f64, f64, f64, f64),
}

#[derive(Debug, Deserialize)]
struct Recorded {
    wp: Waypoint,
    next2: Vec<Waypoint>,
    next10: Vec<Waypoint>,
    left: Option<Waypoint>,
    right: Option<Waypoint>,
}

#[derive(Debug, Deserialize)]
struct Projection(f64, f64, f64, Waypoint, Option<Waypoint>);

#[derive(Debug, Deserialize)]
struct Totals {
    topology_edges: usize,
}

#[derive(Debug, Deserialize)]
struct File {
    town: String,
    totals: Totals,
    waypoints: Vec<Recorded>,
    projections: Vec<Projection>,
    topology: Vec<[Waypoint; 2]>,
}

/// A place, with `x`, `y`, `z` and yaw in degrees.
#[derive(Debug)]
struct Place {
    at: At,
    point: [f64; 3],
    yaw: f64,
}

impl Waypoint {
    fn place(&self, network: &Network) -> Result<Place, String> {
        let (Self::Full(road, section, id, s, x, y, z, yaw, ..)
        | Self::Beside(road, section, id, s, x, y, z, yaw, _)
        | Self::Short(road, section, id, s, x, y, z, yaw)) = self;
        let lane = network.lane(*road, *section, *id);
        let lane = lane.ok_or_else(|| format!("there is no lane for {self:?}"))?;
        Ok(Place { at: At { lane, s: *s }, point: [*x, *y, *z], yaw: *yaw })
    }
}

/// A town as it was read.
struct Town {
    network: Network,
    nearest: Nearest,
}

#[test]
fn golden_maps() {
    for file in files() {
        let network = network(town_map(&file.town).expect("the town is one of ours"));
        let centres: Vec<Vec<Point>> =
            (0..network.lanes.len()).map(|lane| centre(&network, lane)).collect();
        let nearest = nearest(&network, &centres);
        let town = Town { network, nearest };
        let poses = file.waypoints.iter().flat_map(|recorded| waypoint(&town.network, recorded));
        let mut errors: Vec<String> = poses.collect();
        errors.extend(topology(&town.network, &file));
        let mut n_same = 0;
        for projection in &file.projections {
            match projected(&town, projection) {
                Ok(same) => n_same += usize::from(same),
                Err(error) => errors.push(error),
            }
        }
        // On bends CARLA projects onto chords: places differ there, and none of ours is farther away than theirs.
        if 5 * n_same < 2 * file.projections.len() {
            errors.push(format!("only {n_same} of {} projections agree", file.projections.len()));
        }
        assert!(
            errors.is_empty(),
            "{}: {} errors:\n{}",
            file.town,
            errors.len(),
            errors.join("\n")
        );
    }
}

/// A tolerance that lets a place 0.1 m farther on pass would be too wide.
#[test]
fn golden_places_farther_on_are_others() {
    for file in files() {
        let network = network(town_map(&file.town).expect("the town is one of ours"));
        for Recorded { wp, .. } in &file.waypoints {
            let place = wp.place(&network).expect("it is there");
            let [start, end] = network.lanes[place.at.lane].range;
            let s = if place.at.s + 0.1 < end { place.at.s + 0.1 } else { place.at.s - 0.1 };
            let pose = network.pose(At { s, ..place.at });
            let far = (pose.x - place.point[0]).hypot(pose.y - place.point[1]);
            assert!(far > NEAR || end - start < 0.2, "{wp:?}");
        }
    }
}

fn files() -> Vec<File> {
    let elsewhere = std::env::var_os("IVX_WORLDS_DIR").map(PathBuf::from);
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/golden");
    let folder = elsewhere.clone().unwrap_or_else(|| own.into());
    let folders = [folder.join("golden").join("carla_map"), folder.join("carla_map")];
    let entries = folders.iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("a file").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|end| end == "json"));
    paths.sort();
    assert!(
        elsewhere.is_some() || paths.len() == 5,
        "{} maps in {}",
        paths.len(),
        folder.display()
    );
    let read = |path: &PathBuf| {
        let text = fs::read_to_string(path).expect("the file can be read");
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    };
    paths.iter().map(read).collect()
}

fn turned(radians: f64, degrees: f64) -> f64 {
    wrapped(radians - degrees.to_radians()).to_degrees().abs()
}

/// What differs at a waypoint.
fn waypoint(network: &Network, recorded: &Recorded) -> Vec<String> {
    let mut errors = Vec::new();
    let place = match posed(network, &recorded.wp) {
        Ok(place) => place,
        Err(error) => return vec![error],
    };
    let Waypoint::Full(.., pitch, width, in_junction, junction, kind, _) = &recorded.wp else {
        return vec![format!("{:?} lacks something", recorded.wp)];
    };
    // Its pitch is the slope itself, in radians.
    let found = network.pose(place.at).pitch.tan();
    if turned(found, *pitch) > TURNED {
        errors.push(format!("pitch {found} at {:?}", recorded.wp));
    }
    if (network.width(place.at) - width).abs() > NEAR {
        errors.push(format!("width {} at {:?}", network.width(place.at), recorded.wp));
    }
    let found = network.junction(place.at.lane);
    if found != (*in_junction == 1).then_some(*junction) {
        errors.push(format!("junction {found:?} at {:?}", recorded.wp));
    }
    if !is_kind(network, place.at.lane, kind) {
        errors.push(format!("kind {:?} at {:?}", network.lanes[place.at.lane].kind, recorded.wp));
    }
    for (distance, next) in [(2.0, &recorded.next2), (10.0, &recorded.next10)] {
        let found = network.ahead(place.at, distance);
        let expected: Result<Vec<Place>, String> =
            next.iter().map(|next| posed(network, next)).collect();
        let same = expected.as_ref().is_ok_and(|expected| {
            found.len() == expected.len()
                && expected.iter().all(|next| found.iter().any(|at| is_at(*at, next.at)))
        });
        if !same {
            errors
                .push(format!("{distance} m ahead of {:?}: {found:?}, {expected:?}", recorded.wp));
        }
    }
    let lane = &network.lanes[place.at.lane];
    for (found, beside) in [(lane.left, &recorded.left), (lane.right, &recorded.right)] {
        let expected = beside.as_ref().map(|beside| posed(network, beside)).transpose();
        let same = expected.as_ref().is_ok_and(|place| place.as_ref().map(|p| p.at.lane) == found);
        let kind = match (beside, found) {
            (Some(Waypoint::Beside(.., kind)), Some(lane)) => is_kind(network, lane, kind),
            (None, None) => true,
            _ => false,
        };
        if !same || !kind {
            errors.push(format!("{found:?} beside {:?}, expected {beside:?}", recorded.wp));
        }
    }
    errors
}

/// Where a waypoint is, if a car there is as recorded.
fn posed(network: &Network, waypoint: &Waypoint) -> Result<Place, String> {
    let place = waypoint.place(network)?;
    let pose = network.pose(place.at);
    let [x, y, z] = place.point;
    let far = (pose.x - x).hypot(pose.y - y).hypot(pose.z - z);
    let turned = turned(pose.yaw, place.yaw);
    if far > NEAR || turned > TURNED {
        return Err(format!("{pose:?} is {far} m and {turned} degrees from {waypoint:?}"));
    }
    Ok(place)
}

fn is_at(found: At, expected: At) -> bool {
    found.lane == expected.lane && (found.s - expected.s).abs() <= NEAR
}

fn is_kind(network: &Network, lane: usize, name: &str) -> bool {
    let kind = match network.lanes[lane].kind {
        Kind::None => "NONE".to_owned(),
        kind => format!("{kind:?}"),
    };
    kind == name
}

/// Whether a point is projected to the place where CARLA has it, and not to a nearer one.
fn projected(town: &Town, projection: &Projection) -> Result<bool, String> {
    let network = &town.network;
    let Projection(x, y, z, expected, on_lane) = projection;
    let expected = expected.place(network)?;
    let (at, far) = town.nearest.find(network, [*x, *y, *z]).expect("there are lanes");
    let away = |[a, b, c]: [f64; 3]| (x - a).hypot(y - b).hypot(z - c);
    let theirs = away(expected.point);
    let pose = network.pose(at);
    // Who is on a lane is known of the place that was recorded; heights do not count.
    let aside = (x - expected.point[0]).hypot(y - expected.point[1]);
    let is_on_lane = aside < network.width(expected.at) / 2.0;
    // Lanes lie on each other in junctions; and once, where the road rises, theirs is not the nearest of two.
    let same_lane = at.lane == expected.at.lane;
    if far > theirs + 1e-3 || is_on_lane != on_lane.is_some() {
        return Err(format!("{at:?} is {far} m and theirs {theirs} from {projection:?}"));
    }
    let apart = (pose.x - expected.point[0]).hypot(pose.y - expected.point[1]);
    if apart > 1.0 && same_lane {
        return Err(format!("{at:?} is {apart} m from {projection:?}"));
    }
    Ok(apart < NEAR && (pose.z - expected.point[2]).abs() < NEAR)
}

fn topology(network: &Network, file: &File) -> Vec<String> {
    let found = network.topology();
    let mut errors = Vec::new();
    if found.len() != file.totals.topology_edges {
        errors.push(format!("{} edges of {}", found.len(), file.totals.topology_edges));
    }
    for edge in &file.topology {
        let places = edge.each_ref().map(|waypoint| posed(network, waypoint));
        let is_there = |pair: &[At; 2]| {
            pair.iter()
                .zip(&places)
                .all(|(at, place)| place.as_ref().is_ok_and(|place| is_at(*at, place.at)))
        };
        if !found.iter().any(is_there) {
            errors.push(format!("no edge {edge:?}"));
        }
    }
    errors
}
