//! The way from a place to another: along lanes, and from one to that beside it.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use crate::centre::Point;
use crate::change::{CHANGE, changed, passable, schedule};
use crate::geometry::{Pose, wrapped};
use crate::lanes::{At, Network};

/// Metres between the points of a route.
pub const ROUTE_STEP: f64 = 1.0;
/// What a change of lanes costs, in metres of detour.
const DETOUR: f64 = 10.0;
/// Metres between points of lanes that a route is made of.
const FINE: f64 = 0.25;

/// Why there is no route.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RouteError {
    /// No lane is there.
    #[error("there is no lane to drive on near ({x:.1}, {y:.1})")]
    NoLane {
        /// Metres.
        x: f64,
        /// Metres.
        y: f64,
    },
    /// Lanes do not lead there.
    #[error("no lane leads from {from} to {to}")]
    NoWay {
        /// Road, lane and s.
        from: String,
        /// Road, lane and s.
        to: String,
    },
}

/// A point of a route.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// Where, and in which direction the route goes on.
    pub pose: Pose,
    /// The lane; while it changes, that which it goes to.
    pub lane: usize,
}

/// Points every metre from a place to another, the first at the first; the last is the other, within a metre of the one before.
///
/// The shortest way by A* over lanes, where going to the lane beside costs 10 m more, and is done where a broken line is
/// between two lanes of a direction, or none outside of junctions.
///
/// - `centres`: of each lane of the network.
///
/// # Errors
/// Where no lane leads there.
pub fn route(
    network: &Network,
    centres: &[Vec<Point>],
    from: At,
    to: At,
) -> Result<Vec<Waypoint>, RouteError> {
    let lanes = shortest(network, centres, from, to)
        .ok_or_else(|| RouteError::NoWay { from: name(network, from), to: name(network, to) })?;
    Ok(evenly(&fine(network, &lanes, from, to)))
}

/// Metres along a route.
#[must_use]
pub fn route_length(route: &[Waypoint]) -> f64 {
    route.windows(2).map(|pair| pair[0].pose.distance(&pair[1].pose)).sum()
}

fn name(network: &Network, at: At) -> String {
    let lane = &network.lanes[at.lane];
    format!("road {}, lane {}, s = {:.1}", network.map.roads[lane.road].id, lane.id, at.s)
}

/// Lanes from the first to the last; neighbours are beside each other where the section stays the same.
fn shortest(network: &Network, centres: &[Vec<Point>], from: At, to: At) -> Option<Vec<usize>> {
    let goal = network.pose(to);
    let length = |lane: usize| centres[lane].last().map_or(0.0, |point| point.along);
    // Metres from where a lane is entered, for the lanes of one section.
    let along = |lane: usize, s: f64| {
        let range = network.lanes[lane].range;
        let share = (s - network.start(lane).s).abs() / (range[1] - range[0]);
        share * length(lane)
    };
    let rest = |(lane, at_start): (usize, bool)| {
        let s = if at_start { from.s } else { network.start(lane).s };
        network.pose(At { lane, s }).distance(&goal)
    };
    // A place is a lane, and whether it is reached within the section of the start, and thus beside it. Of each is known what
    // it costs, which was before, and from which s on it has been reached.
    let first = (from.lane, true);
    let mut least = BTreeMap::from([(first, (0.0, first, from.s))]);
    let mut open = BinaryHeap::from([(Reverse(Cost(0.0)), Reverse(first))]);
    while let Some((_, Reverse(place))) = open.pop() {
        let (lane, at_start) = place;
        let (cost, _, enters) = least[&place];
        let ahead = !at_start || (to.s - from.s) * direction(network, lane) >= 0.0;
        if lane == to.lane && ahead {
            let back = |place: &(usize, bool)| (*place != first).then(|| least[place].1);
            let mut lanes: Vec<usize> =
                std::iter::successors(Some(place), back).map(|(lane, _)| lane).collect();
            lanes.reverse();
            return Some(lanes);
        }
        let left = length(lane) - if at_start { along(lane, from.s) } else { 0.0 };
        let next = network.lanes[lane].next.iter().filter(|next| network.is_driven(**next));
        let next = next.map(|next| ((*next, false), left, network.start(*next).s));
        let beside = [network.lanes[lane].left, network.lanes[lane].right].into_iter().flatten();
        let beside = beside.filter_map(|other| {
            let leaves = if other == to.lane && ahead { to.s } else { network.end(lane).s };
            if (leaves - enters) * direction(network, lane) <= 0.0 {
                return None;
            }
            let open = passable(network, [lane, other], enters, leaves)?;
            let taken = (open[0] + CHANGE).min(open[1]);
            Some(((other, at_start), DETOUR, enters + direction(network, lane) * taken))
        });
        for (other, more, enters) in next.chain(beside) {
            if least.get(&other).is_none_or(|(known, ..)| cost + more < *known) {
                least.insert(other, (cost + more, place, enters));
                open.push((Reverse(Cost(cost + more + rest(other))), Reverse(other)));
            }
        }
    }
    None
}

/// A cost, ordered.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cost(f64);

impl Eq for Cost {}

impl Ord for Cost {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl PartialOrd for Cost {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

fn direction(network: &Network, lane: usize) -> f64 {
    -f64::from(network.lanes[lane].id.signum())
}

/// Points close to each other along lanes.
fn fine(network: &Network, lanes: &[usize], from: At, to: At) -> Vec<([f64; 3], usize)> {
    let same = |a: usize, b: usize| {
        let [a, b] = [a, b].map(|lane| &network.lanes[lane]);
        a.road == b.road && a.section == b.section
    };
    let mut points: Vec<([f64; 3], usize)> = Vec::new();
    // A lane can follow itself, around a block or in a circle.
    let parts: Vec<&[usize]> = lanes.chunk_by(|a, b| a != b && same(*a, *b)).collect();
    for (i, part) in parts.iter().enumerate() {
        let start = if i == 0 { from.s } else { network.start(part[0]).s };
        let end = if i + 1 == parts.len() { to.s } else { network.end(part[0]).s };
        let metres = (end - start).abs();
        let schedule = schedule(network, part, start, end);
        let n_steps = (metres / FINE).ceil().max(1.0);
        let steps = std::iter::successors(Some(0.0), |k| (*k < n_steps).then_some(k + 1.0));
        for share in steps.map(|k| k / n_steps) {
            let s = start + share * (end - start);
            let (here, beside, moved) = changed(part, &schedule, share * metres);
            let [a, b] = [here, beside].map(|lane| network.pose(At { lane, s }));
            let mix = |a: f64, b: f64| a + moved * (b - a);
            points.push(([mix(a.x, b.x), mix(a.y, b.y), mix(a.z, b.z)], beside));
        }
    }
    points
}

/// Points every metre.
fn evenly(fine: &[([f64; 3], usize)]) -> Vec<Waypoint> {
    let mut points: Vec<([f64; 3], usize)> = Vec::new();
    let (mut along, mut due) = (0.0, 0.0);
    let (mut before, last) = (fine[0].0, fine[fine.len() - 1]);
    for (point, lane) in fine {
        let by = [0, 1, 2].map(|i| point[i] - before[i]);
        let step = by.iter().map(|d| d * d).sum::<f64>().sqrt();
        while along + step >= due {
            let share = if step > 0.0 { (due - along) / step } else { 0.0 };
            points.push(([0, 1, 2].map(|i| before[i] + share * by[i]), *lane));
            due += ROUTE_STEP;
        }
        along += step;
        before = *point;
    }
    if along - (due - ROUTE_STEP) > 1e-6 {
        points.push(last);
    }
    let towards = |i: usize| {
        let [a, b] = [points[i.saturating_sub(1)].0, points[(i + 1).min(points.len() - 1)].0];
        let [dx, dy, dz] = [0, 1, 2].map(|k| b[k] - a[k]);
        (wrapped(dy.atan2(dx)), dz.atan2(dx.hypot(dy)))
    };
    let waypoints = points.iter().enumerate().map(|(i, ([x, y, z], lane))| {
        let (yaw, pitch) = towards(i);
        Waypoint { pose: Pose { x: *x, y: *y, z: *z, yaw, pitch }, lane: *lane }
    });
    waypoints.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::town_map;
    use crate::town::town;

    #[test]
    fn points_are_a_metre_apart() {
        // 2.5 m along x: points at 0, 1, 2 and the end.
        let fine: Vec<([f64; 3], usize)> =
            [0.0, 0.7, 1.3, 2.5].iter().map(|x| ([*x, 1.0, 0.0], 3)).collect();
        let xs: Vec<f64> = evenly(&fine).iter().map(|point| point.pose.x).collect();
        assert!(xs.iter().zip([0.0, 1.0, 2.0, 2.5]).all(|(a, b)| (a - b).abs() < 1e-12));
        assert_eq!(xs.len(), 4);
        assert_eq!(evenly(&fine[..1]).len(), 1);
    }

    #[test]
    fn a_goal_behind_is_reached_around_the_block() {
        let town = town(town_map("Town01").unwrap());
        let network = &town.network;
        let ahead = network.lane_at(10, -1, 100.0).unwrap();
        let [from, to] = [At { s: 60.0, ..ahead }, ahead];
        let there = route_length(&route(network, &town.centres, from, to).unwrap());
        let back = route_length(&route(network, &town.centres, to, from).unwrap());
        assert!((there - 40.0).abs() < 0.1 && back > 200.0, "{there} {back}");
        let nowhere = route(network, &town.centres, to, to).unwrap();
        assert_eq!(nowhere.len(), 1);
    }

    #[test]
    fn lanes_that_lead_nowhere_are_told() {
        let mut map = town_map("Town01").unwrap();
        map.junctions.iter_mut().for_each(|junction| junction.connections.clear());
        let town = town(map);
        let [from, to] =
            [(10, 100.0), (5, 10.0)].map(|(road, s)| town.network.lane_at(road, -1, s).unwrap());
        let error = route(&town.network, &town.centres, from, to).unwrap_err();
        let text = "no lane leads from road 10, lane -1, s = 100.0 to road 5, lane -1, s = 10.0";
        assert_eq!(error.to_string(), text);
        let nan = Pose { x: f64::NAN, ..Pose::default() };
        assert!(matches!(town.route(&nan, &nan), Err(RouteError::NoLane { .. })));
    }

    #[test]
    fn routes_are_the_shortest_and_smooth() {
        let town = town(town_map("Town05").unwrap());
        let network = &town.network;
        let driven: Vec<usize> = (0..network.lanes.len())
            .filter(|lane| network.is_driven(*lane) && town.centres[*lane].len() > 20)
            .collect();
        let mut n_changes = 0;
        for k in 0..150 {
            let [from, to] =
                [driven[k * 13 % driven.len()], driven[k * 41 % driven.len()]].map(|lane| At {
                    lane,
                    s: f64::midpoint(network.start(lane).s, network.end(lane).s),
                });
            let Ok(found) = route(network, &town.centres, from, to) else { continue };
            for pair in found.windows(2) {
                let turned = wrapped(pair[1].pose.yaw - pair[0].pose.yaw).abs();
                // The map has lanes with radii of 2 m.
                assert!(turned < 0.75, "{turned} at {:?}", pair[0]);
                let [a, b] = [pair[0].lane, pair[1].lane];
                let gap = pair[0].pose.distance(&pair[1].pose);
                assert!(gap < 1.0 + 1e-6);
                n_changes += usize::from(
                    a != b
                        && network.lanes[a].section == network.lanes[b].section
                        && network.lanes[a].road == network.lanes[b].road,
                );
            }
        }
        assert!(n_changes > 2, "{n_changes}");
    }
}
