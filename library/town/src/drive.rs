//! A drive: the agent's car, its route, the traffic about it, and what it does wrong.

use crate::body::Body;
use crate::car::{Ego, driven};
use crate::geometry::{Pose, wrapped};
use crate::map::Line;
use crate::marks::crossed;
use crate::pid::Controls;
use crate::route::{RouteError, Waypoint};
use crate::town::Town;
use crate::traffic::{Traffic, traffic};
use crate::way::{Way, way};

/// Steps before the agent acts, in which its brakes hold it.
const WARM_UP: usize = 50;
/// Metres from the destination at which a drive has arrived.
pub const ARRIVED: f64 = 7.5;
/// Points of the route that are goals, and the metres between them.
pub const N_GOALS: usize = 10;
const GOALS_APART: usize = 2;
/// Metres from its route at which the agent is away from it, and from which another is looked for.
const AWAY: [f64; 2] = [2.0, 4.0];
/// Radians from its route at which it does not follow it.
const ASKEW: f64 = 1.2;
/// Metres a second squared with which it is thought to brake.
const BRAKING: f64 = 3.0;
/// Metres of its route that are kept for it beyond that.
const SPARE: f64 = 4.0;
/// Points ahead of the route whose lanes it may go to over broken lines.
const CHANGES: usize = 20;
/// Half of what wheels are apart, along and across, in metres.
const WHEELS: [f64; 2] = [1.36, 0.8];

/// A drive that is going on.
#[derive(Clone, Debug)]
pub struct Drive {
    /// The agent's car.
    pub ego: Ego,
    /// All others.
    pub traffic: Traffic,
    /// Points every metre to the destination.
    pub route: Vec<Waypoint>,
    /// The point of the route that is nearest to the agent.
    pub at: usize,
    /// Steps that the agent has acted.
    pub step: u64,
    /// Metres that it has driven.
    pub distance: f64,
    destination: Pose,
    way: Way,
    /// Cells in which it is in the way of cars.
    body: Vec<usize>,
}

/// What happened in a step.
#[derive(Clone, Debug, Default, PartialEq)]
#[expect(clippy::struct_excessive_bools, reason = "each is counted by itself")]
pub struct Happened {
    /// It touches a car.
    pub hits_vehicle: bool,
    /// A wheel touches what is beside the road.
    pub hits_edge: bool,
    /// Its wheels crossed a mark on the road, but for a broken line to a lane that its route takes.
    pub invades_lane: bool,
    /// Its middle is where no car may be.
    pub is_off_road: bool,
    /// Metres that it drove.
    pub moved: f64,
    /// It is near its destination.
    pub has_arrived: bool,
}

impl Happened {
    /// Whether anything is wrong with it.
    #[must_use]
    pub fn is_infraction(&self) -> bool {
        self.hits_vehicle || self.hits_edge || self.invades_lane || self.is_off_road
    }
}

/// Begins a drive: the agent stands at the start of its route, and others have driven for 50 steps.
///
/// - `n_cars`: of the traffic.
/// - `draw`: uniform in `[0, 1)`.
///
/// # Errors
/// Where no route leads from one to the other.
pub fn drive(
    town: &Town,
    origin: &Pose,
    destination: &Pose,
    n_cars: usize,
    draw: &mut dyn FnMut() -> f64,
) -> Result<Drive, RouteError> {
    let route = town.route(origin, destination)?;
    let ego = Ego { pose: route[0].pose, ..Ego::default() };
    let body = Body::car(ego.pose, [1.0, 0.3]);
    let traffic = traffic(&town.space, &town.centres, n_cars, &[body], draw);
    let way = way(&town.space, &route);
    let destination = route[route.len() - 1].pose;
    let (at, step, distance, body) = (0, 0, 0.0, Vec::new());
    let mut drive = Drive { ego, traffic, route, at, step, distance, destination, way, body };
    for _ in 0..WARM_UP {
        drive.go_on(town, &Controls { brake: 1.0, ..Controls::default() }, draw);
    }
    Ok(drive)
}

impl Drive {
    /// Lets the agent act for a step of `DT` seconds, and the others drive.
    pub fn step(
        &mut self,
        town: &Town,
        controls: &Controls,
        draw: &mut dyn FnMut() -> f64,
    ) -> Happened {
        let before = self.ego.pose;
        self.go_on(town, controls, draw);
        self.step += 1;
        let pose = self.ego.pose;
        let moved = before.distance(&pose);
        self.distance += moved;
        let own = Body::car(pose, [0.0, 0.0]);
        let below = |[x, y]: [f64; 2]| town.ground.below(&town.network.map, [x, y, pose.z]);
        // Cells of the raster are coarse at edges, and roads have gaps between them that are filled there.
        let is_beside =
            |point: [f64; 2]| town.relief.height(point, pose.z).is_none() && below(point).is_none();
        let middle = [pose.x, pose.y];
        Happened {
            hits_vehicle: self.traffic.bodies().any(|car| own.overlaps(&car)),
            hits_edge: wheels(&pose).into_iter().any(is_beside),
            invades_lane: self.invades(town, &before),
            is_off_road: match below(middle) {
                Some(footing) => !crate::geometry::is_paved(footing.kind),
                None => is_beside(middle),
            },
            moved,
            has_arrived: pose.distance(&self.destination) < ARRIVED,
        }
    }

    /// Points ahead on the route, 2 m apart, in the agent's frame: forward and right, in metres. Where the route ends they are
    /// at its end.
    #[must_use]
    pub fn goals(&self) -> [[f64; 2]; N_GOALS] {
        std::array::from_fn(|k| {
            let place = (self.at + GOALS_APART * (k + 1)).min(self.route.len() - 1);
            let goal = self.route[place].pose;
            self.ego.pose.inward([goal.x, goal.y])
        })
    }

    /// Metres of the route ahead on which no other car may be, nor come, before the agent has passed.
    #[must_use]
    pub fn room(&self) -> f64 {
        if self.way.is_whole() { f64::INFINITY } else { self.way.room(self.at) }
    }

    fn go_on(&mut self, town: &Town, controls: &Controls, draw: &mut dyn FnMut() -> f64) {
        self.ego = driven(&self.ego, controls);
        self.settle(town);
        let away = self.follow(town);
        let held = &mut self.traffic.held;
        held.unblock(&self.body);
        self.body = town.space.touched(&Body::car(self.ego.pose, [0.0, 0.0]));
        held.block(&self.body);
        let speed = self.ego.speed;
        let needs = speed * speed / (2.0 * BRAKING) + speed + SPARE;
        let askew = wrapped(self.ego.pose.yaw - self.route[self.at].pose.yaw).abs();
        let at = (away < AWAY[0] && askew < ASKEW).then_some(self.at);
        self.way.keep(held, at, speed, needs);
        self.traffic.step(&town.space, &town.centres, draw);
    }

    /// Puts the car on the ground below it.
    fn settle(&mut self, town: &Town) {
        let pose = &mut self.ego.pose;
        let below = town.ground.below(&town.network.map, [pose.x, pose.y, pose.z]);
        let (sin, cos) = pose.yaw.sin_cos();
        (pose.z, pose.pitch) = match below {
            Some(footing) => (footing.z, (footing.slope[0] * cos + footing.slope[1] * sin).atan()),
            None => (pose.z, 0.0),
        };
    }

    /// Finds the nearest point of the route, or another route from where the agent has gone to; how far it is away.
    fn follow(&mut self, town: &Town) -> f64 {
        let pose = self.ego.pose;
        let window = self.at.saturating_sub(5)..(self.at + 15).min(self.route.len());
        let far = |k: &usize| self.route[*k].pose.distance(&pose);
        let nearest = window.min_by(|a, b| far(a).total_cmp(&far(b)));
        self.at = nearest.unwrap_or(self.at);
        let away = far(&self.at);
        let is_near_end = pose.distance(&self.destination) < 2.0 * ARRIVED;
        if away > AWAY[1]
            && self.step.is_multiple_of(5)
            && !is_near_end
            && let Ok(route) = town.route(&pose, &self.destination)
        {
            self.way.give_up(&mut self.traffic.held);
            self.way = way(&town.space, &route);
            (self.route, self.at) = (route, 0);
        }
        away
    }

    /// Whether a wheel crossed a mark that it should not.
    fn invades(&self, town: &Town, before: &Pose) -> bool {
        let ahead = &self.route[self.at..(self.at + CHANGES).min(self.route.len())];
        let road = town.network.lanes[self.route[self.at].lane].road;
        let pose = &self.ego.pose;
        wheels(before).iter().zip(wheels(pose)).any(|(from, to)| {
            let [from, to] = [(*from, before.z), (to, pose.z)].map(|([x, y], z)| [x, y, z]);
            let crossings = crossed(town, road, from, to);
            crossings.iter().any(|(line, lane)| {
                let may =
                    *line == Line::Broken && ahead.iter().any(|point| Some(point.lane) == *lane);
                *line != Line::None && !may
            })
        })
    }
}

/// Where the wheels of a car are.
fn wheels(pose: &Pose) -> [[f64; 2]; 4] {
    let [l, w] = WHEELS;
    [[l, -w], [l, w], [-l, w], [-l, -w]].map(|wheel| pose.outward(wheel))
}
