//! What a navigation system says of the way ahead (Assumption 3.2).

use crate::geometry::wrapped;
use crate::lanes::Network;
use crate::route::Waypoint;

/// Metres before a junction from which it is told where the way goes on. Ours.
const TOLD: usize = 15;
/// Degrees by which a way turns in a junction: less is straight on, as CARLA's planner has it.
const STRAIGHT: f64 = 35.0;

/// Where the way goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Along the road: no junction is near.
    Follow,
    /// To the left in the junction.
    Left,
    /// To the right in it.
    Right,
    /// Straight on in it.
    Straight,
}

/// What is told at a point of a route: of the junction that the point is in, or that the route comes to within 15 m.
#[must_use]
pub fn command(network: &Network, route: &[Waypoint], at: usize) -> Command {
    let junction = |k: usize| route.get(k).and_then(|point| network.junction(point.lane));
    let Some(first) = (at..=at + TOLD).find(|k| junction(*k).is_some()) else {
        return Command::Follow;
    };
    let own = junction(first);
    let enters = (0..=first).rev().take_while(|k| junction(*k) == own).last().unwrap_or(first);
    let leaves = (first..route.len()).take_while(|k| junction(*k) == own).last().unwrap_or(first);
    // The points before and after it lie on roads, whose directions are those of the turn.
    let [from, to] = [enters.saturating_sub(1), (leaves + 1).min(route.len() - 1)];
    let turn = wrapped(route[to].pose.yaw - route[from].pose.yaw).to_degrees();
    match turn {
        _ if turn.abs() < STRAIGHT => Command::Straight,
        _ if turn > 0.0 => Command::Right,
        _ => Command::Left,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::maps::town_map;
    use crate::town::town;

    /// Town01's streets cross at right angles: a turn of the route is one of the junction between its ends.
    #[test]
    fn turns_are_told_before_and_in_junctions() {
        let town = town(town_map("Town01").unwrap());
        let network = &town.network;
        let centre = |lane: usize| town.centres[lane][town.centres[lane].len() / 2].pose;
        let in_town = |lane: &usize| network.is_driven(*lane) && network.junction(*lane).is_none();
        let starts: Vec<Pose> =
            (0..network.lanes.len()).filter(in_town).map(centre).step_by(7).collect();
        let (mut told, mut n) = ([0; 4], 0);
        for from in &starts {
            for to in starts.iter().rev().take(3) {
                let Ok(route) = town.route(from, to) else { continue };
                n += 1;
                for at in 0..route.len() {
                    let command = command(network, &route, at);
                    told[command as usize] += 1;
                    let near = (at..=at + TOLD)
                        .any(|k| route.get(k).is_some_and(|p| network.junction(p.lane).is_some()));
                    assert_eq!(command == Command::Follow, !near);
                }
            }
        }
        assert!(n > 10 && told.iter().all(|told| *told > 20), "{told:?} of {n} routes");
    }

    #[test]
    fn left_is_against_a_growing_angle() {
        let town = town(town_map("Town01").unwrap());
        let network = &town.network;
        let mut seen = [false; 2];
        for lane in (0..network.lanes.len()).filter(|lane| network.junction(*lane).is_some()) {
            if !network.is_driven(lane) {
                continue;
            }
            let points = &town.centres[lane];
            let (first, last) = (points[0].pose, points[points.len() - 1].pose);
            let turn = wrapped(last.yaw - first.yaw).to_degrees();
            let route: Vec<Waypoint> =
                points.iter().map(|point| Waypoint { pose: point.pose, lane }).collect();
            // Where it ends, seen from where it begins: to the right is positive.
            let aside = first.inward([last.x, last.y])[1];
            match command(network, &route, 0) {
                Command::Left => assert!(aside < -2.0 && turn < 0.0, "{aside} {turn}"),
                Command::Right => assert!(aside > 2.0 && turn > 0.0, "{aside} {turn}"),
                Command::Straight => assert!(turn.abs() < STRAIGHT),
                Command::Follow => panic!("it is in a junction"),
            }
            seen[usize::from(aside > 0.0)] |= aside.abs() > 2.0;
        }
        assert_eq!(seen, [true; 2]);
    }
}
