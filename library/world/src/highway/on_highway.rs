//! The highway and its tasks.

use ivx_data::Misfit;
use ivx_data::form::failed;
use ivx_op::{Facts, One, OpError, Wrong, declare};

use super::choices::Choices;
use super::drawn::Window;
use super::driver::Driver;
use super::episode::{Episode, RATE, Scene, Terms, release, single};
use super::lane::{Point, WIDTH};
use super::roads::highway;
use super::seen::Sight;
use super::steering::Cruise;
use super::traffic::Traffic;
use super::vehicle::{Pilot, Vehicle};
use crate::env::{Env, Spec, World};
use crate::finite::Numbers;
use crate::luck::Luck;

declare! {
    /// A highway among other cars (§B.1.1), as `highway-v0` of highway-env (Leurent, 2018) has it. The agent should be
    /// fast, keep to a lane and run into nobody.
    ///
    /// Seen are the agent's car and the five nearest: `x`, `y` and their speeds, the others from where the agent is,
    /// nearest first. All is scaled to `[-1, 1]` and cut there; who is 10 m behind or far ahead is not seen. An action
    /// holds the wheels and the pedals for some frames of 1/15 s; which there are is what k-means makes of what drivers
    /// do, `driving_actions(..)`.
    ///
    /// The tasks are what the others want. In `"single"` they want what the agent is paid for: 30 m/s and its lane. In
    /// `"adversarial"` they stand still. In `"multi"` each has one of five styles: a speed, a lane and a distance. All
    /// decide as drivers do who keep their distance (Treiber et al., 2000) and change lane when it pays (Kesting et al.,
    /// 2007). In `"original"` all is as in highway-env: others have no lane that they prefer, and the agent tells a pilot
    /// to change lane or speed, once a second.
    ///
    /// It tells of each of the nearest cars, from `1.` to `5.`, which it is and its style, what it saw (`saw.0` and on,
    /// as the agent sees) and the angle of its wheels and its acceleration, which it decided on then; and `act`, which of
    /// the agent's actions comes nearest to these, each divided by the standard deviation of what drivers do. So who learns
    /// can learn from it, `watched(..)`. In `"original"` nothing that others do is an action of the agent.
    ///
    /// Each step pays from 0 to 1 as in highway-env: 2/3, up to 4/15 more for a speed from 20 to 30 m/s and up to 1/15
    /// for the lane, 2/3 less in a collision and nothing off the road. Both end an episode.
    ///
    /// Where the thesis is silent, this is our reading: how often one acts, five times a second, since wheels that are
    /// held for a whole one leave the road; what is paid, which is the same in all tasks; the styles; that others prefer a
    /// lane as on a route; that leaving the road ends an episode; and the scales of what is seen, which are highway-env's.
    pub struct Highway = "highway" @ 2 {
        /// `"single"`, `"adversarial"`, `"multi"` or `"original"`.
        task: String;
        /// What can be done: a row for each action, with the angle of the wheels in radians and the acceleration in
        /// m/s². Where left out, nine that were made so from the task `"multi"`.
        actions: Option<One<Numbers>>;
        /// How many other cars there are.
        cars: usize = 50, in 1.0..=500.0;
        /// How many lanes.
        lanes: usize = 4, in 1.0..=12.0;
        /// The lane that pays, from 0 on the left; where there are fewer, the last.
        lane: usize = 3, in 0.0..=11.0;
        /// For how many frames of 1/15 s an action is held. In the task `"original"` it is 15.
        frames: u64 = 3, in 1.0..=15.0;
        /// After how many seconds an episode is over.
        seconds: u64 = 40, in 1.0..=1e5;
        /// The release of highway-env: `"1.1"`, that of 2021, or `"1.12.1"`, in which time cuts an episode off.
        release: String = "1.1";
    }
    rule is_known;
}

/// What k-means made of what drivers did in the task `"multi"`: angles in radians and accelerations in m/s².
const ACTIONS: [[f64; 2]; 9] = [
    [-0.0010, -4.9259],
    [0.4048, -1.3157],
    [-0.0026, -1.3027],
    [0.1727, -0.4151],
    [0.0000, 0.0111],
    [-0.2098, 0.0175],
    [0.0011, 0.6802],
    [-0.0600, 1.1844],
    [0.0037, 1.7948],
];

/// How far apart these things are: their standard deviations.
const SPREAD: [f64; 2] = [0.0198, 0.6326];

/// How many others are seen.
const OTHERS: usize = 5;
/// What a pilot drives at when the agent tells it, in m/s; what is between the first and the last is paid for.
const SPEEDS: [f64; 3] = [20.0, 25.0, 30.0];
/// The speed that the agent starts with.
const START: f64 = 25.0;

/// What others want.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Task {
    Single,
    Adversarial,
    Multi,
    Original,
}

impl Task {
    fn of(name: &str) -> Result<Self, Misfit> {
        match name {
            "single" => Ok(Self::Single),
            "adversarial" => Ok(Self::Adversarial),
            "multi" => Ok(Self::Multi),
            "original" => Ok(Self::Original),
            _ => Err(Misfit::new(format!("no task on the highway is called {name:?}"), HELP)),
        }
    }
}

const HELP: &str = "say `\"single\"`, `\"adversarial\"`, `\"multi\"` or `\"original\"`";

/// How one drives in the task `"multi"`: at which speed in m/s, on which of four lanes, how many seconds behind others.
struct Style {
    speed: f64,
    lane: Option<usize>,
    time_gap: f64,
}

const STYLES: [Style; 5] = [
    Style { speed: 30.0, lane: Some(3), time_gap: 1.5 },
    Style { speed: 30.0, lane: Some(0), time_gap: 0.8 },
    Style { speed: 26.0, lane: Some(1), time_gap: 1.2 },
    Style { speed: 22.0, lane: Some(2), time_gap: 2.0 },
    Style { speed: 24.0, lane: None, time_gap: 1.5 },
];

fn is_known(facts: &Facts<'_>) -> Result<(), Wrong> {
    let wrong = |arg, Misfit { message, help }| Err(Wrong { arg, message, help });
    if let Some(Err(why)) = facts.arg::<String>("task").map(|task| Task::of(&task)) {
        return wrong("task", why);
    }
    match facts.arg::<String>("release").map(|version| release(&version)) {
        Some(Err(why)) => wrong("release", why),
        _ => Ok(()),
    }
}

impl Highway {
    fn terms(&self) -> Result<(Terms, OnHighway), Misfit> {
        let (task, release) = (Task::of(&self.task)?, release(&self.release)?);
        let choices = match (&self.actions, task) {
            (None, Task::Original) => Choices::Meta,
            (Some(_), Task::Original) => {
                let message =
                    "in the task \"original\" actions are those of highway-env".to_owned();
                return Err(Misfit::new(message, "leave out `actions`"));
            }
            (None, _) => Choices::Held(ACTIONS.to_vec()),
            (Some(actions), _) => Choices::of(&actions.0.0)?,
        };
        let (far, fast) = release.scale;
        #[expect(clippy::cast_precision_loss, reason = "a few lanes")]
        let wide = WIDTH * self.lanes as f64;
        let sight = Sight { others: OTHERS, absolute: false, scale: Some([far, wide, fast, fast]) };
        let frames = if task == Task::Original { RATE } else { self.frames };
        let limit = self.seconds * RATE / frames;
        let scene = OnHighway { task, cars: self.cars, goal: self.lane.min(self.lanes - 1) };
        Ok((Terms { release, choices, sight, frames, limit }, scene))
    }
}

impl Env for Highway {
    fn spec(&self) -> Result<Spec, Misfit> {
        Ok(self.terms()?.0.spec::<OnHighway>())
    }

    fn open(&self) -> Result<Box<dyn World>, OpError> {
        let (terms, scene) = self.terms().map_err(failed)?;
        let traffic = Traffic::new(highway(self.lanes, terms.release), terms.release);
        Ok(Box::new(Episode::new(terms, scene, traffic)))
    }

    fn is_drawn(&self) -> bool {
        true
    }
}

/// Who is on the highway.
#[derive(Clone, Debug)]
pub(super) struct OnHighway {
    task: Task,
    cars: usize,
    /// The lane that pays the most.
    goal: usize,
}

impl OnHighway {
    /// Another car at a place, and its style.
    fn other(
        &self,
        traffic: &Traffic,
        at: [f64; 2],
        speed: f64,
        luck: &mut Luck,
    ) -> (Vehicle, usize) {
        let (least, most) = traffic.release.exponents;
        let mut driver = Driver::new(at, luck.between(least, most));
        let (mut wanted, mut style) = (speed, 0);
        match self.task {
            Task::Original => {}
            Task::Adversarial => {
                return (Vehicle::new(&traffic.network, at, 0.0, 0.0, Pilot::Held), 0);
            }
            Task::Single => (wanted, driver.prefers) = (SPEEDS[2], Some(self.goal)),
            Task::Multi => {
                style = luck.below(u32::try_from(STYLES.len()).expect("a few")) as usize;
                let Style { speed, lane, time_gap } = STYLES[style];
                let last = traffic.network.lanes.len() - 1;
                (wanted, driver.prefers) = (speed, lane.map(|lane| lane.min(last)));
                driver.time_gap = time_gap;
            }
        }
        let mut car = Vehicle::new(&traffic.network, at, 0.0, speed, Pilot::Driver(driver));
        car.target_speed = wanted;
        (car, style)
    }
}

impl Scene for OnHighway {
    const TELLS: &'static [&'static str] = &["crashed", "off_road", "speed", "lane"];
    const SPREAD: [f64; 2] = SPREAD;

    /// Cars stand in for a flow: each is on a lane drawn evenly, ahead of all before it by a distance that grows with
    /// its speed and is less the more lanes there are.
    fn begin(&mut self, traffic: &mut Traffic, luck: &mut Luck) -> Vec<usize> {
        let release = traffic.release;
        let n_lanes = u32::try_from(traffic.network.lanes.len()).expect("a few");
        let next = |luck: &mut Luck, front: Option<f64>, speed: f64, spacing: f64| {
            let (metres, seconds) = release.spacing;
            let offset = spacing * (metres + seconds * speed) * (-f64::from(n_lanes) / 8.0).exp();
            front.unwrap_or(3.0 * offset) + offset * luck.between(0.9, 1.1)
        };
        let lane = |luck: &mut Luck| luck.below(n_lanes) as usize;

        let own = lane(luck);
        let mut front = next(luck, None, START, 2.0);
        let at = traffic.network.lanes[own].point([front, 0.0]);
        let pilot = if self.task == Task::Original {
            Pilot::Cruise(Cruise::new(SPEEDS, START))
        } else {
            Pilot::Held
        };
        traffic.vehicles.push(Vehicle::new(&traffic.network, at, 0.0, START, pilot));
        let mut styles = vec![0];
        for _ in 0..self.cars {
            let lane = lane(luck);
            let (least, most) = release.start;
            let speed = luck.between(least * release.limit, most * release.limit);
            front = next(luck, Some(front), speed, 1.0);
            let at = traffic.network.lanes[lane].point([front, 0.0]);
            let (car, style) = self.other(traffic, at, speed, luck);
            traffic.vehicles.push(car);
            styles.push(style);
        }
        styles
    }

    fn pays(&mut self, traffic: &Traffic, _: usize, tells: &mut [f32]) -> (f64, bool) {
        let car = &traffic.vehicles[0];
        let on_road = car.on_road(&traffic.network);
        #[expect(clippy::cast_precision_loss, reason = "a few lanes")]
        let lane = traffic.network.number(car.lane) as f32;
        let flag = |is: bool| f32::from(u8::from(is));
        tells.copy_from_slice(&[flag(car.crashed), flag(!on_road), single(car.speed), lane]);
        let over = car.crashed || self.task != Task::Original && !on_road;
        (paid(traffic, self.goal), over)
    }

    /// 20 m behind the agent and 80 m ahead, all lanes and 2 m beside them; more where the agent has left the road.
    fn window(&self, traffic: &Traffic, [x, y]: Point) -> Window {
        let beside = WIDTH / 2.0 + 2.0;
        let last = traffic.network.lanes[traffic.network.lanes.len() - 1].point([0.0, 0.0])[1];
        let (top, bottom) = ((y - 4.0).min(-beside), (y + 4.0).max(last + beside));
        Window { low: [x - 20.0, top], size: [100.0, bottom - top] }
    }
}

/// What a highway pays the agent:
///
/// ```text
/// (−crashed + 0.1 lane + 0.4 clip((v − 20) / 10, 0, 1) + 1) / 1.5
/// ```
///
/// on the road and 0 off it, where the lane is 1 on that which pays the most and 0 on the farthest from it.
pub(super) fn paid(traffic: &Traffic, goal: usize) -> f64 {
    let (car, network) = (&traffic.vehicles[0], &traffic.network);
    if !car.on_road(network) {
        return 0.0;
    }
    let lane = if let Pilot::Cruise(_) = car.pilot { car.target_lane } else { car.lane };
    let farthest = goal.max(network.lanes.len() - 1 - goal).max(1);
    #[expect(clippy::cast_precision_loss, reason = "a few lanes")]
    let lane = 1.0 - network.number(lane).abs_diff(goal) as f64 / farthest as f64;
    let along = if traffic.release.pays_along { car.heading.cos() } else { 1.0 };
    let speed = ((car.speed * along - SPEEDS[0]) / (SPEEDS[2] - SPEEDS[0])).clamp(0.0, 1.0);
    let crashed = if car.crashed { 1.0 } else { 0.0 };
    (0.1 * lane + 0.4 * speed - crashed + 1.0) / 1.5
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::highway::driving_actions::{centres, spread};
    use crate::highway::release::Release;

    fn scene(task: Task, cars: usize) -> (OnHighway, Traffic) {
        let traffic = Traffic::new(highway(4, &Release::V1_1), &Release::V1_1);
        (OnHighway { task, cars, goal: 3 }, traffic)
    }

    /// The default actions are the centres of what drivers do without the agent, five times a second.
    #[test]
    fn actions_are_what_drivers_do() {
        let (mut scene, mut traffic) = scene(Task::Multi, 50);
        let (mut luck, mut did) = (Luck::numpy(0), Vec::new());
        for _ in 0..4 {
            traffic.vehicles.clear();
            scene.begin(&mut traffic, &mut luck);
            traffic.vehicles.remove(0);
            for frame in 0..600 {
                traffic.frame();
                if frame % 3 == 0 {
                    did.extend(traffic.vehicles.iter().map(|car| [car.steering, car.acceleration]));
                }
            }
            assert!(traffic.vehicles.iter().all(|car| !car.crashed));
        }
        let found = centres(&did, ACTIONS.len(), 3, &mut ChaCha8Rng::seed_from_u64(0));
        let near = |(a, b): (&[f64; 2], &[f64; 2])| (0..2).all(|i| (a[i] - b[i]).abs() < 1e-3);
        assert!(found.iter().zip(&ACTIONS).all(near), "{found:.4?}");
        let apart = spread(&did);
        assert!(near((&apart, &SPREAD)), "{apart:.4?}");
    }

    #[test]
    fn rewards_by_hand() {
        let (mut scene, mut traffic) = scene(Task::Single, 0);
        let mut pays = |x: [f64; 2], speed| {
            let car = Vehicle::new(&traffic.network, x, 0.0, speed, Pilot::Held);
            traffic.vehicles = vec![car];
            let mut told = [0.0; 4];
            let paid = scene.pays(&traffic, 0, &mut told);
            (paid, told)
        };
        // (0.1 · 1/3 + 0.4 · 0.5 + 1) / 1.5.
        let ((paid, over), told) = pays([300.0, 4.0], 25.0);
        assert!((paid - 37.0 / 45.0).abs() < 1e-12 && !over);
        assert_eq!(told, [0.0, 0.0, 25.0, 1.0]);
        assert_eq!(pays([300.0, 12.0], 35.0).0, (1.0, false));
        assert_eq!(pays([300.0, 14.1], 25.0), ((0.0, true), [0.0, 1.0, 25.0, 3.0]));
        // Another lane that pays.
        traffic.vehicles[0].at[1] = 12.0;
        assert!((super::paid(&traffic, 1) - 1.2 / 1.5).abs() < 1e-12);
        traffic.vehicles[0].crashed = true;
        assert!((super::paid(&traffic, 1) - 0.2 / 1.5).abs() < 1e-12);
    }

    /// After 30 s in each task most others do what they want.
    #[test]
    fn others_do_what_they_want() {
        let after = |task| {
            let (mut scene, mut traffic) = scene(task, 20);
            let mut styles = scene.begin(&mut traffic, &mut Luck::numpy(3));
            traffic.vehicles.remove(0);
            styles.remove(0);
            (0..450).for_each(|_| traffic.frame());
            (traffic, styles)
        };
        let (traffic, _) = after(Task::Adversarial);
        assert!(traffic.vehicles.iter().all(|car| car.speed == 0.0));
        let (traffic, _) = after(Task::Single);
        let right = traffic.vehicles.iter().filter(|car| car.lane == 3).count();
        // Evenly there would be five.
        assert!(right > 8, "{right}");
        let (traffic, styles) = after(Task::Multi);
        let there = styles
            .iter()
            .zip(&traffic.vehicles)
            .filter(|(style, car)| STYLES[**style].lane.is_none_or(|lane| lane == car.lane))
            .count();
        assert!(there > 10, "{there}");
        let (traffic, _) = after(Task::Original);
        let lanes: Vec<usize> = (0..4)
            .map(|lane| traffic.vehicles.iter().filter(|car| car.lane == lane).count())
            .collect();
        assert!(lanes.iter().all(|n| *n < 11), "{lanes:?}");
    }

    /// A driver who can only do the actions, each time that nearest to what it would: five times a second it stays on
    /// the road, once a second it does not.
    #[test]
    fn wheels_that_are_held_for_a_second_leave_the_road() {
        let off = |frames: usize| {
            let (mut scene, mut traffic) = scene(Task::Single, 10);
            let mut off = 0;
            for seed in 0..10 {
                traffic.vehicles.clear();
                scene.begin(&mut traffic, &mut Luck::numpy(seed));
                traffic.vehicles[0].target_speed = SPEEDS[2];
                for _ in 0..300 / frames {
                    let mut would = traffic.clone();
                    let mut driver = Driver::new([0.0, 0.0], 4.0);
                    (driver.timer, driver.prefers) = (2.0, Some(3));
                    would.vehicles[0].pilot = Pilot::Driver(driver);
                    would.decide();
                    let car = &would.vehicles[0];
                    // In about their standard deviations.
                    let far = |act: &[f64; 2]| {
                        ((act[0] - car.steering) / 0.04).hypot((act[1] - car.acceleration) / 1.4)
                    };
                    let act = ACTIONS.iter().min_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
                    traffic.vehicles[0].target_lane = car.target_lane;
                    [traffic.vehicles[0].steering, traffic.vehicles[0].acceleration] = *act;
                    (0..frames).for_each(|_| traffic.frame());
                    if !traffic.vehicles[0].on_road(&traffic.network) {
                        off += 1;
                        break;
                    }
                }
            }
            off
        };
        let (held, longer) = (off(3), off(15));
        assert!(held <= 1 && longer >= 7, "{held} and {longer} of 10");
    }
}
