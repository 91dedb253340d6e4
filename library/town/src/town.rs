//! A town: its lanes, and what is asked of them again and again.

use crate::centre::{Point, centre};
use crate::geometry::Pose;
use crate::ground::{Ground, ground};
use crate::lanes::{At, Network, network};
use crate::map::Map;
use crate::project::{Nearest, nearest};
use crate::relief::{Relief, relief};
use crate::route::{RouteError, Waypoint, route};
use crate::space::{Space, space};

/// A map, and what was measured of it.
#[derive(Clone, Debug)]
pub struct Town {
    /// Its lanes.
    pub network: Network,
    /// The middle of each lane.
    pub centres: Vec<Vec<Point>>,
    /// Where its driving lanes are.
    pub nearest: Nearest,
    /// Where its roads are.
    pub ground: Ground,
    /// Its heights on a raster.
    pub relief: Relief,
    /// What cannot be on its lanes at the same time.
    pub space: Space,
}

/// Measures a map.
#[must_use]
pub fn town(map: Map) -> Town {
    let network = network(map);
    let centres: Vec<Vec<Point>> =
        (0..network.lanes.len()).map(|lane| centre(&network, lane)).collect();
    let nearest = nearest(&network, &centres);
    let ground = ground(&network.map);
    let relief = relief(&network.map, &ground);
    let space = space(&network, &centres);
    Town { network, centres, nearest, ground, relief, space }
}

impl Town {
    /// The route from a pose to another, each on the nearest lane that goes its way.
    ///
    /// # Errors
    /// Where there is no lane, or none leads there.
    pub fn route(&self, from: &Pose, to: &Pose) -> Result<Vec<Waypoint>, RouteError> {
        let ends = [from, to].map(|pose| {
            let at = self.nearest.find_along(&self.network, pose).map(|(at, _)| at);
            at.ok_or(RouteError::NoLane { x: pose.x, y: pose.y })
        });
        let [from, to]: [Result<At, RouteError>; 2] = ends;
        route(&self.network, &self.centres, from?, to?)
    }
}
