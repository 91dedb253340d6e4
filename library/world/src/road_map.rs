//! The roads of a world.

use ivx_data::{Place, RoadMap};
use ivx_math::simplify::simplified;
use ivx_op::{Ctx, Facts, Op, OpError, Wrong, declare};
use ivx_town::{Town, edges, kerbs};

use crate::env::{Env, NO_MAP};

declare! {
    /// The roads of a world from above, and the route where every episode has the same: of `town(..)` and `carnovel(..)`.
    /// `driven` shows them, and what was driven there.
    pub struct MapRoads = "road_map" @ 1 -> RoadMap {
        /// The world.
        of: Box<dyn Env>;
    }
    rule has_roads;
}

fn has_roads(facts: &Facts<'_>) -> Result<(), Wrong> {
    match facts.arg::<Box<dyn Env>>("of") {
        Some(world) if !world.is_mapped() => Err(Wrong {
            arg: "of",
            message: NO_MAP.to_owned(),
            help: "use one that has roads: `town(..)` or `carnovel(..)`".to_owned(),
        }),
        _ => Ok(()),
    }
}

impl Op for MapRoads {
    fn run(&self, _: &Ctx) -> Result<RoadMap, OpError> {
        self.of.map()
    }
}

/// Metres that lines of a map may be off.
const OFF: f64 = 0.1;

/// Metres up to which an edge that is near no other is a seam where roads meet.
const SEAM: f64 = 2.5;

/// How near that is, in metres.
const NEAR: f64 = 1.0;

/// The roads of a town but for their seams, and a route.
pub(crate) fn roads(town: &Town, route: &[Place]) -> RoadMap {
    let all = edges(&kerbs(&town.network.map, &town.ground));
    let is_near = |a: &Place, b: &Place| (a[0] - b[0]).hypot(a[1] - b[1]) < NEAR;
    let is_alone = |i: usize| {
        let mut others = all.iter().enumerate().filter(|(j, _)| *j != i);
        let ends = [all[i][0], all[i][all[i].len() - 1]];
        others.all(|(_, edge)| !edge.iter().any(|at| ends.iter().any(|end| is_near(at, end))))
    };
    let is_seam = |i: usize| long(&all[i]) <= SEAM && is_alone(i);
    let kept = (0..all.len()).filter(|i| !is_seam(*i));
    RoadMap {
        edges: kept.map(|i| simplified(&all[i], OFF)).collect(),
        route: simplified(route, OFF),
    }
}

/// Metres along a line.
fn long(line: &[Place]) -> f64 {
    line.windows(2).map(|pair| (pair[0][0] - pair[1][0]).hypot(pair[0][1] - pair[1][1])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Carnovel, CartPole};

    fn map(of: Box<dyn Env>) -> Result<RoadMap, OpError> {
        MapRoads { of }.run(&Ctx::new("road_map", 0, None))
    }

    #[test]
    fn towns_and_tasks_have_roads_and_tasks_a_route() {
        let (cars, shows, reach, cells, limit) = (0, vec!["velocity".to_owned()], 50.0, 25, 9);
        let name = "Town01".to_owned();
        let town =
            map(Box::new(crate::Town { name, cars, shows: shows.clone(), reach, cells, limit }))
                .unwrap();
        // Two edges of the 3.9 km of roads that a grid of 400 m by 330 m has, but for junctions.
        let metres: f64 = town.edges.iter().map(|edge| long(edge)).sum();
        let places: usize = town.edges.iter().map(Vec::len).sum();
        assert!(town.route.is_empty() && metres > 5_000.0, "{metres}");
        assert!(places < 3_000, "{places}");
        for task in ivx_town::tasks().into_iter().filter(|task| task.name.ends_with('0')) {
            let name = task.name.clone();
            let found = map(Box::new(Carnovel {
                task: name,
                cars,
                shows: shows.clone(),
                reach,
                cells,
                limit,
            }))
            .unwrap();
            let off =
                |place: &Place, pose: &ivx_town::Pose| (place[0] - pose.x).hypot(place[1] - pose.y);
            assert!(off(&found.route[0], &task.origin) < 3.0, "{}", task.name);
            assert!(off(&found.route[found.route.len() - 1], &task.destination) < 3.0);
            assert!(found.route.len() < 200 && !found.edges.is_empty());
        }
        assert!(map(Box::new(CartPole {})).is_err());
    }
}
