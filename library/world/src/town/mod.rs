//! Driving in towns: those of CARLA (Dosovitskiy et al., 2017) by their road maps, and the tasks of CARNOVEL.

mod sight;

use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use ivx_data::{Act, Actions, End, Misfit, Outline, Picture, Place, RoadMap, Shape};
use ivx_op::{Facts, OpError, Wrong, declare};
use ivx_town::{
    BREADTH, Controls, Drive, Happened, LENGTH, Pose, Task, Town as Streets, autopilot, drive,
    kerbs, route_length, tasks, town, town_map, town_names,
};

use self::sight::{Sight, is_seen, sights, single};
use crate::env::{Env, Row, Spec, World};
use crate::luck::Luck;
use crate::road_map::roads;

declare! {
    /// A town of CARLA by its road map, with a car to drive on a route that is drawn, of 100 to 350 metres, among others.
    ///
    /// A step is a twentieth of a second. It can show
    ///
    /// - `lidar`: a picture from above of points on the ground and of those above it, at most 5 of each in a cell, forward
    ///   from behind and to the right from the left;
    /// - `velocity`: in metres a second forward, aside and up;
    /// - `goals`: points of the route ahead, 2 m apart, forward and to the right of the car;
    /// - `command`: 1 for what a navigation system says of the way, of following the road, left, right and straight on in the
    ///   junction that comes within 15 m;
    /// - `streets`: pictures from above of lanes that lead the car's way, of other lanes, and of other cars, as only the town
    ///   itself knows them;
    /// - `expert`: what the rule-based expert would do, for `autopilot`.
    ///
    /// An action is a pedal, the throttle above 0 and the brake below, and the steering wheel, to the right above 0. To
    /// arrive pays 1 and to collide -1, and both end the drive. Cars are kinematic and others follow rules; there are no
    /// traffic lights, houses or people. `docs/agents.md` has more.
    pub struct Town = "town" @ 1 {
        /// Which: `Town01` to `Town05`.
        name: String = "Town01";
        /// How many others drive there; fewer where there is no room.
        cars: usize = 100, in 0.0..=1000.0;
        /// What is seen, in this order.
        shows: Vec<String> = vec!["lidar", "velocity", "goals"];
        /// How many metres pictures reach to each side.
        reach: f64 = 50.0, in 1.0..=50.0, unit "m";
        /// How many cells a side of a picture has; of `lidar` at most two a metre.
        cells: usize = 200, in 1.0..=200.0;
        /// After how many steps a drive is cut off.
        limit: u64 = 1_500, in 1.0..;
    }
    rule is_a_town;
}

declare! {
    /// A task of CARNOVEL (Filos et al., 2020; §A.1): to drive from one place of a town to another, as in `town`.
    ///
    /// There are `AbnormalTurns0` to 6, `BusyTown0` to 10, `Hills0` to 3, `Roundabouts0` to 4, and of our own `Ramps0` to 7: in
    /// the maps the roads of the hills are flat.
    pub struct Carnovel = "carnovel" @ 1 {
        /// The task.
        task: String;
        /// How many others drive there; fewer where there is no room.
        cars: usize = 100, in 0.0..=1000.0;
        /// What is seen, in this order.
        shows: Vec<String> = vec!["lidar", "velocity", "goals"];
        /// How many metres pictures reach to each side.
        reach: f64 = 50.0, in 1.0..=50.0, unit "m";
        /// How many cells a side of a picture has; of `lidar` at most two a metre.
        cells: usize = 200, in 1.0..=200.0;
        /// After how many steps a drive is cut off.
        limit: u64 = 1_500, in 1.0..;
    }
    rule is_a_task;
}

fn is_a_town(facts: &Facts<'_>) -> Result<(), Wrong> {
    is_seen(facts)?;
    let name: String = facts.arg("name").unwrap_or_default();
    if town_names().contains(&name.as_str()) {
        return Ok(());
    }
    let message = format!("there is no town `{name}`");
    Err(Wrong { arg: "name", message, help: format!("there are {}", town_names().join(", ")) })
}

fn is_a_task(facts: &Facts<'_>) -> Result<(), Wrong> {
    is_seen(facts)?;
    let name: String = facts.arg("task").unwrap_or_default();
    let all = tasks();
    if all.iter().any(|task| task.name == name) {
        return Ok(());
    }
    let names: Vec<&str> = all.iter().map(|task| task.name.as_str()).collect();
    let message = format!("there is no task `{name}`");
    Err(Wrong { arg: "task", message, help: format!("there are {}", names.join(", ")) })
}

/// What is told of a step.
const TELLS: [&str; 12] = [
    "x",
    "y",
    "yaw",
    "speed",
    "metres",
    "arrived",
    "infraction",
    "vehicle",
    "edge",
    "lane",
    "off_road",
    "success",
];

/// Metres of routes that are drawn.
const ROUTES: [f64; 2] = [100.0, 350.0];

fn spec(shows: &[String], cells: usize, limit: u64) -> Spec {
    Spec {
        sees: sights(shows).into_iter().map(|sight| sight.field(cells)).collect(),
        does: Actions::Continuous { low: vec![-1.0; 2], high: vec![1.0; 2] },
        tells: TELLS.map(str::to_owned).to_vec(),
        limit: Some(limit),
    }
}

/// A town that was measured once.
fn measured(name: &str) -> Result<Arc<Streets>, OpError> {
    static TOWNS: LazyLock<Mutex<BTreeMap<String, Arc<Streets>>>> = LazyLock::new(Mutex::default);
    let mut towns = TOWNS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(found) = towns.get(name) {
        return Ok(Arc::clone(found));
    }
    let map =
        town_map(name).ok_or_else(|| OpError::Failed(format!("there is no town `{name}`")))?;
    let found = Arc::new(town(map));
    towns.insert(name.to_owned(), Arc::clone(&found));
    Ok(found)
}

impl Carnovel {
    fn task(&self) -> Result<Task, OpError> {
        let task = tasks().into_iter().find(|task| task.name == self.task);
        task.ok_or_else(|| OpError::Failed(format!("there is no task `{}`", self.task)))
    }
}

impl Env for Town {
    fn spec(&self) -> Result<Spec, Misfit> {
        Ok(spec(&self.shows, self.cells, self.limit))
    }

    fn open(&self) -> Result<Box<dyn World>, OpError> {
        let streets = measured(&self.name)?;
        Ok(Box::new(Driving::new(
            streets,
            None,
            self.cars,
            (&self.shows[..], self.reach, self.cells),
        )))
    }

    fn has_expert(&self) -> bool {
        true
    }

    fn is_drawn(&self) -> bool {
        true
    }

    fn is_mapped(&self) -> bool {
        true
    }

    fn map(&self) -> Result<RoadMap, OpError> {
        Ok(roads(&*measured(&self.name)?, &[]))
    }
}

impl Env for Carnovel {
    fn spec(&self) -> Result<Spec, Misfit> {
        Ok(spec(&self.shows, self.cells, self.limit))
    }

    fn open(&self) -> Result<Box<dyn World>, OpError> {
        let task = self.task()?;
        let streets = measured(&task.town)?;
        let seen = (&self.shows[..], self.reach, self.cells);
        Ok(Box::new(Driving::new(streets, Some(task), self.cars, seen)))
    }

    fn has_expert(&self) -> bool {
        true
    }

    fn is_drawn(&self) -> bool {
        true
    }

    fn is_mapped(&self) -> bool {
        true
    }

    fn map(&self) -> Result<RoadMap, OpError> {
        let task = self.task()?;
        let streets = measured(&task.town)?;
        let route = streets.route(&task.origin, &task.destination);
        let route = route.map_err(|why| OpError::Failed(why.to_string()))?;
        let route: Vec<Place> = route.iter().map(|point| [point.pose.x, point.pose.y]).collect();
        Ok(roads(&streets, &route))
    }
}

/// A drive in a town.
struct Driving {
    streets: Arc<Streets>,
    task: Option<Task>,
    cars: usize,
    sees: Vec<Sight>,
    reach: f64,
    cells: usize,
    drive: Option<Drive>,
    /// Whether nothing was wrong so far.
    clean: bool,
}

impl Driving {
    fn new(
        streets: Arc<Streets>,
        task: Option<Task>,
        cars: usize,
        (shows, reach, cells): (&[String], f64, usize),
    ) -> Self {
        let sees = sights(shows);
        Self { streets, task, cars, sees, reach, cells, drive: None, clean: true }
    }

    fn begin(&self, luck: &mut Luck) -> Drive {
        let mut draw = || luck.unit();
        let streets = &*self.streets;
        if let Some(task) = &self.task {
            return drive(streets, &task.origin, &task.destination, self.cars, &mut draw)
                .expect("a test drives every task");
        }
        loop {
            let [from, to] = [(); 2].map(|()| somewhere(streets, &mut draw));
            let Ok(route) = streets.route(&from, &to) else { continue };
            if route_length(&route) < ROUTES[0] {
                continue;
            }
            let mut long = 0.0;
            let end = route.windows(2).position(|pair| {
                long += pair[0].pose.distance(&pair[1].pose);
                long > ROUTES[1]
            });
            let end = route[end.unwrap_or(route.len() - 1)].pose;
            if let Ok(found) = drive(streets, &from, &end, self.cars, &mut draw) {
                return found;
            }
        }
    }

    fn show(&self, row: &mut Row<'_>) {
        let Some(drive) = &self.drive else { return };
        for (i, sight) in self.sees.iter().enumerate() {
            sight.show(&self.streets, drive, (self.reach, self.cells), row, i);
        }
    }

    /// Lets the car be driven for a step, and says what happened.
    fn drive(&mut self, controls: &Controls, luck: &mut Luck) -> Happened {
        let drive = self.drive.as_mut().expect("a drive began");
        let happened = drive.step(&self.streets, controls, &mut || luck.unit());
        self.clean &= !happened.is_infraction();
        happened
    }

    fn told(&self, happened: &Happened) -> [f32; TELLS.len()] {
        let is = |it: bool| f64::from(u8::from(it));
        let Some(drive) = &self.drive else { return [0.0; TELLS.len()] };
        let Pose { x, y, yaw, .. } = drive.ego.pose;
        let told = [
            x,
            y,
            yaw,
            drive.ego.speed,
            happened.moved,
            is(happened.has_arrived),
            is(happened.is_infraction()),
            is(happened.hits_vehicle),
            is(happened.hits_edge),
            is(happened.invades_lane),
            is(happened.is_off_road),
            is(happened.has_arrived && self.clean),
        ];
        told.map(single)
    }
}

/// The pose of a place on a lane that is drawn, all metres of all lanes being as probable.
fn somewhere(streets: &Streets, draw: &mut dyn FnMut() -> f64) -> Pose {
    let driven = (0..streets.centres.len()).filter(|lane| streets.network.is_driven(*lane));
    let long = |lane: usize| streets.centres[lane].last().map_or(0.0, |point| point.along);
    let all: f64 = driven.clone().map(long).sum();
    let mut left = draw() * all;
    let mut last = 0;
    for lane in driven {
        last = lane;
        if left < long(lane) {
            break;
        }
        left -= long(lane);
    }
    ivx_town::pose_along(&streets.centres[last], left)
}

impl World for Driving {
    fn reset(&mut self, luck: &mut Luck, row: &mut Row<'_>) {
        self.drive = Some(self.begin(luck));
        self.clean = true;
        self.show(row);
    }

    fn step(&mut self, act: Act<'_>, luck: &mut Luck, row: &mut Row<'_>) -> (f64, End) {
        let [pedal, steer] = *act.vector() else { panic!("an action is a pedal and a wheel") };
        let (pedal, steer) = (f64::from(pedal), f64::from(steer));
        let controls = Controls { throttle: pedal.max(0.0), brake: (-pedal).max(0.0), steer };
        let happened = self.drive(&controls, luck);
        self.show(row);
        row.told().copy_from_slice(&self.told(&happened));
        match (happened.hits_vehicle || happened.hits_edge, happened.has_arrived) {
            (true, _) => (-1.0, End::Terminal),
            (false, true) => (1.0, End::Terminal),
            (false, false) => (0.0, End::No),
        }
    }

    fn shown(&self, steps: usize, luck: &mut Luck) -> Option<Vec<f32>> {
        let drive = self.drive.clone()?;
        let sees = Vec::new();
        let (streets, task) = (Arc::clone(&self.streets), None);
        let mut ahead = Self { streets, task, sees, drive: Some(drive), ..*self };
        let mut told = Vec::with_capacity((steps + 1) * TELLS.len());
        told.extend(ahead.told(&Happened::default()));
        for _ in 0..steps {
            let controls = autopilot(ahead.drive.as_ref()?, 0.0, &mut || 0.0);
            let happened = ahead.drive(&controls, luck);
            told.extend(ahead.told(&happened));
            if happened.has_arrived || happened.hits_vehicle || happened.hits_edge {
                break;
            }
        }
        Some(told)
    }

    /// A hundred metres about the car: the edges of roads, the route, and all cars.
    fn draw(&self) -> Option<Picture> {
        let drive = self.drive.as_ref()?;
        let Pose { x, y, .. } = drive.ego.pose;
        let half = 50.0;
        let at = |[px, py]: [f64; 2]| [px - x + half, py - y + half];
        let near = |[px, py]: [f64; 2]| (px - x).abs() < 2.0 * half && (py - y).abs() < 2.0 * half;
        let mut shapes = Vec::new();
        let map = &self.streets.network.map;
        for [[ax, ay, _], [bx, by, _]] in kerbs(map, &self.streets.ground) {
            if near([ax, ay]) {
                let line = vec![at([ax, ay]), at([bx, by])];
                shapes.push(Shape { outline: Outline::Line(line, 0.4), colour: [120, 120, 120] });
            }
        }
        let route = drive.route[drive.at..].iter().map(|point| [point.pose.x, point.pose.y]);
        let route: Vec<_> = route.take_while(|place| near(*place)).map(at).collect();
        if route.len() > 1 {
            shapes.push(Shape { outline: Outline::Line(route, 0.6), colour: [150, 190, 240] });
        }
        let mut car = |pose: &Pose, colour: [u8; 3]| {
            if near([pose.x, pose.y]) {
                let outline = Outline::rectangle(at([pose.x, pose.y]), [LENGTH, BREADTH], pose.yaw);
                shapes.push(Shape { outline, colour });
            }
        };
        drive.traffic.cars.iter().for_each(|other| car(&other.pose, [90, 90, 90]));
        car(&drive.ego.pose, [200, 60, 40]);
        Some(Picture { size: [2.0 * half; 2], shapes })
    }
}

#[cfg(test)]
mod tests;
