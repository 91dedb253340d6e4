//! Tasks: to drive from here to there.
//!
//! Those of CARNOVEL (Filos et al., 2020) are named by numbers of spawn points whose list is not public. Their coordinates were
//! recovered from figures of its repository (`OATML/oatomobile` at 1680aee, Apache-2.0), of which each task says how well:
//! `spawns` are the numbers, `metres` the length that the figure states. The family Ramps is ours, since the roads of the
//! family Hills are flat in the map: its tasks climb or descend the ramps of Town03, 8 m in 40 to 56 m.

use serde::Deserialize;

use crate::geometry::{Pose, wrapped};

/// A drive from a place to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// As `Hills0`.
    pub name: String,
    /// As `Hills`.
    pub family: String,
    /// As `Town03`.
    pub town: String,
    /// Where it starts.
    pub origin: Pose,
    /// Where it ends.
    pub destination: Pose,
    /// How long the route is said to be.
    pub metres: f64,
    /// Where its places are from, and how sure they are.
    pub quality: String,
}

#[derive(Debug, Deserialize)]
struct Written {
    name: String,
    family: String,
    town: String,
    origin: [f64; 4],
    destination: [f64; 4],
    metres: f64,
    quality: String,
}

/// All tasks, by family: 27 of CARNOVEL, and ours.
///
/// # Panics
/// Never: the file is part of the program, and a test reads it.
#[must_use]
pub fn tasks() -> Vec<Task> {
    let written: Vec<Written> =
        serde_json::from_str(include_str!("tasks.json")).expect("the tasks of the crate are JSON");
    let pose =
        |[x, y, z, yaw]: [f64; 4]| Pose { x, y, z, yaw: wrapped(yaw.to_radians()), pitch: 0.0 };
    let task = |task: Written| Task {
        name: task.name,
        family: task.family,
        town: task.town,
        origin: pose(task.origin),
        destination: pose(task.destination),
        metres: task.metres,
        quality: task.quality,
    };
    written.into_iter().map(task).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::maps::town_map;
    use crate::route::route_length;
    use crate::town::town;

    #[test]
    fn each_task_has_a_route_as_long_as_it_says() {
        let tasks = tasks();
        let mut families: BTreeMap<&str, usize> = BTreeMap::new();
        for task in &tasks {
            *families.entry(&task.family).or_default() += 1;
        }
        let expected = [
            ("AbnormalTurns", 7),
            ("BusyTown", 11),
            ("Hills", 4),
            ("Ramps", 8),
            ("Roundabouts", 5),
        ];
        assert_eq!(families, BTreeMap::from(expected));
        for name in ["Town03", "Town04"] {
            let town = town(town_map(name).unwrap());
            for task in tasks.iter().filter(|task| task.town == name) {
                let route = town.route(&task.origin, &task.destination).unwrap();
                let off = route_length(&route) / task.metres - 1.0;
                // Its recorded way goes from a lane to that beside it over a solid line.
                let most = if task.name == "AbnormalTurns4" { 0.17 } else { 0.051 };
                assert!(off.abs() < most, "{}: {:+.1} %", task.name, 100.0 * off);
                assert!(route[0].pose.distance(&task.origin) < 0.05);
                assert!(route[route.len() - 1].pose.distance(&task.destination) < 0.05);
                let steep = route.iter().filter(|point| point.pose.pitch.abs() > 0.02).count();
                assert_eq!(
                    steep > 40,
                    task.family == "Ramps" || task.name == "BusyTown10",
                    "{}",
                    task.name
                );
            }
        }
    }
}
