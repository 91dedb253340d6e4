//! The roundabout and its tasks.

use std::f64::consts::TAU;

use ivx_data::Misfit;
use ivx_data::form::failed;
use ivx_op::{Facts, One, OpError, Wrong, declare};

use super::choices::Choices;
use super::drawn::Window;
use super::driver::Driver;
use super::episode::{Episode, RATE, Scene, Terms, release, single};
use super::lane::Point;
use super::network::Network;
use super::roads::roundabout;
use super::seen::Sight;
use super::steering::{Cruise, Meta};
use super::traffic::Traffic;
use super::vehicle::{Pilot, Vehicle};
use crate::env::{Env, Spec, World};
use crate::finite::Numbers;
use crate::luck::Luck;

declare! {
    /// A roundabout of four arms among four other cars (§B.1.2), as `roundabout-v0` of highway-env (Leurent, 2018) has
    /// it. The agent comes from the south and should leave by the third exit, while others leave by the first or the
    /// second, as drawn.
    ///
    /// Seen are the agent's car and the three nearest: `x`, `y` and their speeds, scaled to `[-1, 1]` from 100 m and
    /// 15 m/s and cut there, nearest first along the agent's lane. An action holds the wheels and the pedals for some
    /// frames of 1/15 s; which there are is what k-means makes of what drivers do, `driving_actions(..)`. It tells what
    /// the nearest cars see and do, as `highway(..)` does; a style is the exit that is wanted, from 0.
    ///
    /// The way to the exit pays 1 in all, each metre once; running into somebody pays −1. That ends an episode, and so does
    /// leaving the road or by any exit, which lose what is left of the way. Who has not been in the ring has not left it:
    /// the wrong side of the arm where one comes from is no exit.
    ///
    /// Where the thesis is silent, this is our reading: exits are counted from where the agent comes from, for others
    /// too; what is paid; how often one acts; and that one has 20 s, since the 11 s of highway-env are for the second
    /// exit. Of others there are three in what is seen, though the text speaks of five.
    pub struct Roundabout = "roundabout" @ 3 {
        /// `"exit"`; or `"original"`, in which all is as in highway-env: others leave by the first, the second or the last
        /// exit, and the agent tells a pilot on the way to the second to change lane or speed, once a second.
        task: String = "exit";
        /// Which exit pays, from 1 in the east against the clock to 4, where the agent comes from.
        exit: usize = 3, in 1.0..=4.0;
        /// What can be done: a row for each action, with the angle of the wheels in radians and the acceleration in
        /// m/s². Where left out, six that were made so.
        actions: Option<One<Numbers>>;
        /// For how many frames of 1/15 s an action is held. In the task `"original"` it is 15.
        frames: u64 = 3, in 1.0..=15.0;
        /// After how many seconds an episode is over.
        seconds: u64 = 20, in 1.0..=1e5;
        /// The release of highway-env: `"1.1"`, that of 2021, or `"1.12.1"`, in which time cuts an episode off.
        release: String = "1.1";
    }
    rule is_known;
}

/// What k-means made of what drivers did: angles in radians and accelerations in m/s².
const ACTIONS: [[f64; 2]; 6] = [
    [-0.2606, -5.7366],
    [0.2325, -5.6876],
    [0.0027, -0.0179],
    [-0.2193, 0.0432],
    [0.1817, 0.4839],
    [-0.2113, 1.7603],
];

/// How far apart these things are: their standard deviations.
const SPREAD: [f64; 2] = [0.1880, 1.5212];

/// How many others are seen.
const OTHERS: usize = 3;
const SPEEDS: [f64; 3] = [0.0, 8.0, 16.0];
/// The speed that the agent starts with, and others about this.
const START: f64 = 8.0;
const OTHERS_START: f64 = 16.0;
/// How far from there they are: metres, and m/s.
const DEVIATION: f64 = 2.0;
/// How far beside its lane the agent may be, in metres: at the mouths of the ring drivers are up to half of it.
const BESIDE: f64 = 1.0;
/// The arms by the exits to them, and where one is out.
const EXITS: [(&str, &str); 4] = [("exs", "exr"), ("nxs", "nxr"), ("wxs", "wxr"), ("sxs", "sxr")];

fn is_known(facts: &Facts<'_>) -> Result<(), Wrong> {
    let wrong = |arg, Misfit { message, help }| Err(Wrong { arg, message, help });
    if let Some(Err(why)) = facts.arg::<String>("task").map(|task| is_original(&task)) {
        return wrong("task", why);
    }
    match facts.arg::<String>("release").map(|version| release(&version)) {
        Some(Err(why)) => wrong("release", why),
        _ => Ok(()),
    }
}

fn is_original(task: &str) -> Result<bool, Misfit> {
    match task {
        "exit" => Ok(false),
        "original" => Ok(true),
        _ => {
            let message = format!("no task on the roundabout is called {task:?}");
            Err(Misfit::new(message, "say `\"exit\"` or `\"original\"`"))
        }
    }
}

impl Roundabout {
    pub(super) fn terms(&self) -> Result<(Terms, OnRoundabout), Misfit> {
        let (original, release) = (is_original(&self.task)?, release(&self.release)?);
        let choices = match (&self.actions, original) {
            (None, true) => Choices::Meta,
            (Some(_), true) => {
                let message =
                    "in the task \"original\" actions are those of highway-env".to_owned();
                return Err(Misfit::new(message, "leave out `actions`"));
            }
            (None, false) => Choices::Held(ACTIONS.to_vec()),
            (Some(actions), false) => Choices::of(&actions.0.0)?,
        };
        let scale = Some([100.0, 100.0, 15.0, 15.0]);
        let sight = Sight { others: OTHERS, absolute: true, scale };
        let frames = if original { RATE } else { self.frames };
        let limit = self.seconds * RATE / frames;
        let network = roundabout();
        let way = (!original).then(|| Way::new(&network, self.exit - 1));
        Ok((Terms { release, choices, sight, frames, limit }, OnRoundabout { way, entered: false }))
    }
}

impl Env for Roundabout {
    fn spec(&self) -> Result<Spec, Misfit> {
        Ok(self.terms()?.0.spec::<OnRoundabout>())
    }

    fn open(&self) -> Result<Box<dyn World>, OpError> {
        let (terms, scene) = self.terms().map_err(failed)?;
        let traffic = Traffic::new(roundabout(), terms.release);
        Ok(Box::new(Episode::new(terms, scene, traffic)))
    }

    fn is_drawn(&self) -> bool {
        true
    }
}

/// Who is on the roundabout.
#[derive(Clone, Debug)]
pub(super) struct OnRoundabout {
    /// The agent's way, unless a pilot knows it.
    way: Option<Way>,
    /// Whether the agent has been in the ring.
    entered: bool,
}

impl Scene for OnRoundabout {
    const TELLS: &'static [&'static str] = &["crashed", "off_road", "speed", "exit"];
    const SPREAD: [f64; 2] = SPREAD;

    fn begin(&mut self, traffic: &mut Traffic, luck: &mut Luck) -> Vec<usize> {
        let lane =
            |from, to| traffic.network.road(from, to).map(|road| traffic.network.roads[road].first);
        let lane = |from, to, number| lane(from, to).expect("a road") + number;
        let starts = [
            (lane("we", "sx", 1), 5.0),
            (lane("we", "sx", 0), 20.0),
            (lane("we", "sx", 0), -20.0),
            (lane("eer", "ees", 0), 50.0),
        ];
        let (arm, network) = (lane("ser", "ses", 0), &traffic.network);
        let pilot = match self.way {
            Some(_) => Pilot::Held,
            None => Pilot::Cruise(Cruise::new(SPEEDS, START)),
        };
        let on = |lane: usize, along, speed, pilot: &dyn Fn([f64; 2]) -> Pilot| {
            let at = network.lanes[lane].point([along, 0.0]);
            Vehicle::new(network, at, network.lanes[lane].heading(along), speed, pilot(at))
        };
        let node = |name| network.node(name).expect("a node");
        self.entered = false;
        let mut own = on(arm, 125.0, START, &|_| pilot.clone());
        own.route = network.route(own.lane, node("nxs"));
        let (mut cars, mut styles) = (vec![own], vec![0]);
        // The first and the second; in the original the last, too.
        let exits: &[usize] = if self.way.is_some() { &[0, 1] } else { &[0, 3, 1] };
        for (lane, along) in starts {
            let along = along + DEVIATION * normal(luck);
            let speed = OTHERS_START + DEVIATION * normal(luck);
            let exit = exits[luck.below(u32::try_from(exits.len()).expect("few")) as usize];
            let (least, most) = traffic.release.exponents;
            let exponent = luck.between(least, most);
            let mut car = on(lane, along, speed, &|at| Pilot::Driver(Driver::new(at, exponent)));
            car.route = network.route(car.lane, node(EXITS[exit].1));
            cars.push(car);
            styles.push(exit);
        }
        traffic.vehicles = cars;
        if let Some(way) = &mut self.way {
            way.done = way.along(traffic, &traffic.vehicles[0]).expect("it starts there");
            way.start = way.done;
        }
        styles
    }

    fn pays(&mut self, traffic: &Traffic, act: usize, tells: &mut [f32]) -> (f64, bool) {
        let (car, network) = (&traffic.vehicles[0], &traffic.network);
        let lane = &network.lanes[car.lane];
        let on_road = lane.has(lane.local(car.at), BESIDE);
        let road = network.road_of(car.lane);
        let (from, to) = (&network.nodes[road.from], &network.nodes[road.to]);
        // Nodes of the ring have names of two letters.
        self.entered |= from.len() == 2 && to.len() == 2;
        let left = EXITS.iter().zip(1_u8..).find(|((exit, _), _)| self.entered && from == exit);
        let exit = left.map_or(0, |(_, number)| number);
        let flag = |is: bool| f32::from(u8::from(is));
        let told = [flag(car.crashed), flag(!on_road), single(car.speed), f32::from(exit)];
        tells.copy_from_slice(&told);
        match &mut self.way {
            None => (paid(traffic, Meta::ALL[act]), car.crashed),
            Some(_) if car.crashed => (-1.0, true),
            Some(_) if !on_road => (0.0, true),
            Some(way) => (way.advanced(traffic, self.entered), exit > 0),
        }
    }

    /// 60 m each way from the middle of the roundabout; or from as near to it as has the agent within 50 m.
    fn window(&self, _: &Traffic, agent: Point) -> Window {
        Window { low: agent.map(|x| x - x.clamp(-50.0, 50.0) - 60.0), size: [120.0; 2] }
    }
}

/// A number about 0 with a standard deviation of 1, by Box and Muller (1958).
fn normal(luck: &mut Luck) -> f64 {
    let radius = (-2.0 * (1.0 - luck.unit()).ln()).sqrt();
    radius * (TAU * luck.unit()).cos()
}

/// The agent's way to an exit.
#[derive(Clone, Debug)]
struct Way {
    /// Its roads, how far their starts are, and how long they are.
    roads: Vec<(usize, f64, f64)>,
    length: f64,
    /// How far along it an episode started.
    start: f64,
    /// The farthest that was reached.
    done: f64,
}

impl Way {
    fn new(network: &Network, exit: usize) -> Self {
        let start = network.roads[network.road("ser", "ses").expect("a road")].first;
        let mut way = Self { roads: Vec::new(), length: 0.0, start: 0.0, done: 0.0 };
        for leg in network.route(start, network.node(EXITS[exit].0).expect("a node")) {
            let road = network.roads[leg.road];
            let lanes = &network.lanes[road.first..][..road.n];
            let lengths: Vec<f64> = lanes.iter().map(|lane| lane.length).collect();
            let length = ivx_math::moments::mean(&lengths);
            way.roads.push((leg.road, way.length, length));
            way.length += length;
        }
        way
    }

    /// How far along it a car is, if it is on it: by the share of its lane, since of two lanes one is longer.
    fn along(&self, traffic: &Traffic, car: &Vehicle) -> Option<f64> {
        let network = &traffic.network;
        let road = network.road_of(car.lane);
        let at = self.roads.iter().find(|(i, ..)| network.roads[*i] == road)?;
        let lane = &network.lanes[car.lane];
        let share = (lane.local(car.at)[0] / lane.length).clamp(0.0, 1.0);
        Some(at.1 + at.2 * share)
    }

    /// The share of the way that the agent came on since it was farthest.
    ///
    /// - `entered`: whether it has been in the ring, before which nothing counts that lies behind it.
    fn advanced(&mut self, traffic: &Traffic, entered: bool) -> f64 {
        let (car, network) = (&traffic.vehicles[0], &traffic.network);
        let road = network.road_of(car.lane);
        let last = network.roads[self.roads.last().expect("a way has roads").0];
        let along = match () {
            () if !entered && road == last => None,
            () if entered && last.to == road.from => Some(self.length),
            () => self.along(traffic, car),
        };
        let farther = (along.unwrap_or(0.0) - self.done).max(0.0);
        self.done += farther;
        farther / (self.length - self.start)
    }
}

/// What the roundabout of highway-env pays:
///
/// ```text
/// −crashed + 0.1 · number of the speed − 0.05 if to change lane, from [least, 0.2] to [0, 1]
/// ```
///
/// off the road 0 in 1.12.1.
pub(super) fn paid(traffic: &Traffic, told: Meta) -> f64 {
    let (car, release) = (&traffic.vehicles[0], traffic.release);
    if release.roundabout_pays_on_road && !car.on_road(&traffic.network) {
        return 0.0;
    }
    let Pilot::Cruise(cruise) = &car.pilot else { return 0.0 };
    #[expect(clippy::cast_precision_loss, reason = "0, 1 or 2")]
    let speed = cruise.place as f64 / 2.0;
    let crashed = if car.crashed { 1.0 } else { 0.0 };
    let changes = if matches!(told, Meta::Left | Meta::Right) { 1.0 } else { 0.0 };
    let least = release.roundabout_least;
    (0.2 * speed - crashed - 0.05 * changes - least) / (0.2 - least)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::highway::driving_actions::{centres, spread};
    use crate::highway::release::Release;

    fn scene(exit: usize) -> (OnRoundabout, Traffic) {
        let way = Some(Way::new(&roundabout(), exit - 1));
        (OnRoundabout { way, entered: false }, Traffic::new(roundabout(), &Release::V1_1))
    }

    /// The default actions are the centres of what drivers do without the agent, five times a second, until they leave
    /// or run into each other.
    #[test]
    fn actions_are_what_drivers_do() {
        let (mut scene, mut traffic) = scene(3);
        let (mut luck, mut did) = (Luck::numpy(0), Vec::new());
        for _ in 0..200 {
            scene.begin(&mut traffic, &mut luck);
            traffic.vehicles.remove(0);
            for frame in 0..300 {
                traffic.frame();
                if traffic.vehicles.iter().any(|car| car.crashed) {
                    break;
                }
                let network = &traffic.network;
                let out =
                    |car: &&Vehicle| network.nodes[network.road_of(car.lane).to].ends_with("xr");
                if frame % 3 == 0 {
                    let there = traffic.vehicles.iter().filter(|car| !out(car));
                    did.extend(there.map(|car| [car.steering, car.acceleration]));
                }
            }
        }
        let found = centres(&did, ACTIONS.len(), 3, &mut ChaCha8Rng::seed_from_u64(0));
        let near = |(a, b): (&[f64; 2], &[f64; 2])| (0..2).all(|i| (a[i] - b[i]).abs() < 1e-3);
        assert!(found.iter().zip(&ACTIONS).all(near), "{found:.4?}");
        let apart = spread(&did);
        assert!(near((&apart, &SPREAD)), "{apart:.4?}");
    }

    /// A search that knows how traffic goes on finds a way to the third exit, all of which pays 1.
    #[test]
    fn there_is_a_way_to_the_third_exit() {
        let (mut scene, mut traffic) = scene(3);
        scene.begin(&mut traffic, &mut Luck::numpy(1));
        let return_ = search(scene, traffic).expect("a way");
        assert!((return_ - 1.0).abs() < 1e-9, "{return_}");
    }

    /// What the way pays to the exit that is wanted, if it is found: of all that can be done, some that differ and came
    /// farthest are gone on from.
    fn search(scene: OnRoundabout, traffic: Traffic) -> Option<f64> {
        let choices = Choices::Held(ACTIONS.to_vec());
        let mut best = vec![(0.0, 0.0, scene, traffic)];
        for _ in 0..100 {
            let mut next = Vec::new();
            for (return_, _, scene, traffic) in &best {
                for act in 0..ACTIONS.len() {
                    let (mut scene, mut traffic) = (scene.clone(), traffic.clone());
                    choices.take(act, &mut traffic);
                    (0..3).for_each(|_| traffic.frame());
                    let mut told = [0.0; 4];
                    let (pays, over) = scene.pays(&traffic, act, &mut told);
                    if told == [0.0, 0.0, told[2], 3.0] {
                        assert!(over);
                        return Some(return_ + pays);
                    }
                    if !over {
                        let car = &traffic.vehicles[0];
                        let lane = &traffic.network.lanes[car.lane];
                        let [along, across] = lane.local(car.at);
                        let turned = crate::highway::lane::wrap(lane.heading(along) - car.heading);
                        let score = return_ + pays - 0.01 * across.abs() - 0.05 * turned.abs();
                        next.push((return_ + pays, score, scene, traffic));
                    }
                }
            }
            next.sort_by(|a, b| b.1.total_cmp(&a.1));
            let mut kept: Vec<[f64; 4]> = Vec::new();
            next.retain(|(.., traffic)| {
                let Vehicle { at, speed, heading, .. } = traffic.vehicles[0];
                let about = [at[0], at[1], speed, 4.0 * heading].map(f64::round);
                let new = kept.len() < 400 && !kept.contains(&about);
                kept.extend(new.then_some(about));
                new
            });
            best = next;
        }
        None
    }

    /// An agent put at places on its way: what it pays is the share of 2.5 m that are left of the arm, the bend of 17 m
    /// and so on, each metre once.
    #[test]
    fn the_way_pays_one_in_all() {
        let (mut scene, mut traffic) = scene(3);
        scene.begin(&mut traffic, &mut Luck::numpy(0));
        traffic.vehicles.truncate(1);
        let put = |traffic: &mut Traffic, from, to, along: f64| {
            let road = traffic.network.road(from, to).unwrap();
            let lane = traffic.network.roads[road].first;
            let course = &traffic.network.lanes[lane];
            let (at, heading) = (course.point([along, 0.0]), course.heading(along));
            traffic.vehicles[0] = Vehicle::new(&traffic.network, at, heading, 8.0, Pilot::Held);
        };
        let mut pays = |from, to, along| {
            put(&mut traffic, from, to, along);
            let mut told = [0.0; 4];
            let (pays, over) = scene.pays(&traffic, 0, &mut told);
            (pays, over, told[3])
        };
        // The means of the two lanes: radius 22, over 42° and 48° by turns.
        let ring = 22.0 * (3.0 * 42.0_f64 + 2.0 * 48.0).to_radians();
        let length = 2.5 + 17.0 + ring + 17.0;
        let near = |(pays, over, exit): (f64, bool, f32), expected: f64| {
            assert!((pays - expected).abs() < 1e-9 && !over && exit == 0.0, "{pays}, {expected}");
        };
        near(pays("ses", "se", 10.0), 12.5 / length);
        near(pays("ses", "se", 5.0), 0.0);
        near(pays("ses", "se", 11.0), 1.0 / length);
        // The wrong side of the arm is no exit, and pays nothing.
        near(pays("sxs", "sxr", 10.0), 0.0);
        near(pays("se", "ex", 0.0), 6.0 / length);
        // Another exit ends it, and pays nothing.
        near(pays("ex", "exs", 10.0), 0.0);
        assert_eq!(pays("exs", "exr", 10.0), (0.0, true, 1.0));
        let (rest, over, exit) = pays("wxs", "wxr", 1.0);
        assert!((rest - (length - 19.5) / length).abs() < 1e-9 && over && exit == 3.0);
        // In the meadow.
        traffic.vehicles[0].at = [60.0, 60.0];
        assert_eq!(scene.pays(&traffic, 0, &mut [0.0; 4]), (0.0, true));
        traffic.vehicles[0].crashed = true;
        assert_eq!(scene.pays(&traffic, 0, &mut [0.0; 4]), (-1.0, true));
    }
}
