//! Cars that follow lanes and never touch.
//!
//! Each car holds the cells from its middle up to where it can stop, and takes those ahead before it drives on. Where lanes
//! cross, join or part it takes all cells of the crossing, up to one behind it where it may stand, or none: so no car stands
//! in another's way, and junctions do not lock. Who has waited longer is asked first, and after a while no other may take
//! what he waits for. There are no traffic lights.
//!
//! Speed grows as in the intelligent driver model's free road (Treiber et al., 2000), `a (1 - (v/v_0)⁴)`, and is bounded so
//! that a car can stop within what it holds by braking with `BRAKING` (Gipps, 1981), and by its bends.

use std::collections::VecDeque;

use crate::body::Body;
use crate::centre::{Point, pose_along};
use crate::geometry::Pose;
use crate::space::Space;

/// Seconds of a step.
pub const DT: f64 = 0.05;
/// Metres a second squared, from rest. The model's usual value for towns is 1 to 2.
const ACCELERATION: f64 = 2.0;
/// Metres a second squared, with which cars slow down for what they see.
const BRAKING: f64 = 3.0;
/// Metres a second squared, with which they brake when somebody gets in their way.
const EMERGENCY: f64 = 8.0;
/// Metres a second squared, to the side in bends.
const SIDEWARDS: f64 = 2.0;
/// Least speed that bends ask for, in metres a second.
const SLOW: f64 = 2.0;
/// Speeds that cars like to drive at, in metres a second: 20 to 30 km/h.
const SPEEDS: [f64; 2] = [20.0 / 3.6, 30.0 / 3.6];
/// Metres that are taken beyond what is needed to stop.
const SPARE: f64 = 1.0;
/// Steps of waiting after which others may not take what is waited for; after as many more they may, and so on.
const IMPATIENT: u32 = 100;
/// Steps of waiting after which another way is looked for.
const LOST: u32 = 400;
/// Most cells of a crossing.
const MOST_CROSSED: usize = 1_000;
/// How often a place for a car is looked for.
const TRIES: usize = 100;
/// What nobody holds.
const NOBODY: usize = usize::MAX;
/// Who is not one of the cars: the agent.
const AGENT: usize = usize::MAX - 1;

/// A car of the traffic.
#[derive(Clone, Debug, PartialEq)]
pub struct Car {
    /// Where its middle is.
    pub pose: Pose,
    /// Metres a second.
    pub speed: f64,
    /// Its lane, and those that it will take.
    pub lanes: VecDeque<usize>,
    /// Metres driven on its lane.
    pub along: f64,
    /// Speed on a free road, in metres a second.
    likes: f64,
    /// Cells that it holds, from that of its middle on.
    holds: VecDeque<usize>,
    /// Which of its lanes the last of them is on.
    reached: usize,
    /// Metres from its middle to the end of what it holds.
    room: f64,
    /// Steps that it has stood still.
    waits: u32,
}

/// Who holds which cells.
#[derive(Clone, Debug)]
pub(crate) struct Held {
    /// By cell: the car.
    by: Vec<usize>,
    /// By cell: who alone may take it.
    claimed: Vec<usize>,
    /// By cell: how many bodies of the agent are in the way.
    blocked: Vec<u16>,
}

/// The cars of a town.
#[derive(Clone, Debug)]
pub struct Traffic {
    /// All cars.
    pub cars: Vec<Car>,
    pub(crate) held: Held,
    /// Cars by how long they have waited.
    order: Vec<usize>,
}

impl Held {
    fn new(space: &Space) -> Self {
        let n = space.cells.len();
        Self { by: vec![NOBODY; n], claimed: vec![NOBODY; n], blocked: vec![0; n] }
    }

    /// Whether a car may be in a cell.
    fn is_free(&self, space: &Space, cell: usize, car: usize) -> bool {
        self.blocked[cell] == 0
            && space
                .clashes(cell)
                .iter()
                .all(|other| self.by[*other] == NOBODY || self.by[*other] == car)
    }

    /// Whether nobody who has waited longer wants to be where a car in this cell is in the way.
    fn is_unclaimed(&self, space: &Space, cell: usize, car: usize) -> bool {
        let mine = |other: &usize| [NOBODY, car].contains(&self.claimed[*other]);
        space.clashes(cell).iter().all(mine)
    }

    /// Whether the agent may be where it touches cars in these cells.
    pub(crate) fn lets(&self, cells: &[usize]) -> bool {
        cells
            .iter()
            .all(|cell| self.by[*cell] == NOBODY && [NOBODY, AGENT].contains(&self.claimed[*cell]))
    }

    /// Puts the agent in the way of cars in these cells.
    pub(crate) fn block(&mut self, cells: &[usize]) {
        for cell in cells {
            self.blocked[*cell] += 1;
        }
    }

    /// Takes it out of the way again.
    pub(crate) fn unblock(&mut self, cells: &[usize]) {
        for cell in cells {
            self.blocked[*cell] -= 1;
        }
    }

    /// Lets nobody but the agent take these cells.
    pub(crate) fn claim(&mut self, cells: &[usize]) {
        for cell in cells {
            if self.claimed[*cell] == NOBODY {
                self.claimed[*cell] = AGENT;
            }
        }
    }

    /// Lets everybody take them again.
    pub(crate) fn disclaim(&mut self, cells: &[usize]) {
        for cell in cells {
            if self.claimed[*cell] == AGENT {
                self.claimed[*cell] = NOBODY;
            }
        }
    }
}

/// At most `n` cars at places drawn at random: fewer where a town has no room for them.
///
/// - `centres`: of each lane.
/// - `away`: bodies that no car may touch.
/// - `draw`: uniform in `[0, 1)`.
pub fn traffic(
    space: &Space,
    centres: &[Vec<Point>],
    n: usize,
    away: &[Body],
    draw: &mut dyn FnMut() -> f64,
) -> Traffic {
    let mut held = Held::new(space);
    let cells: Vec<usize> = away.iter().flat_map(|body| space.touched(body)).collect();
    held.block(&cells);
    let mut cars: Vec<Car> = Vec::new();
    for _ in 0..if space.cells.is_empty() { 0 } else { n } {
        let id = cars.len();
        let place = (0..TRIES)
            .map(|_| pick(space.cells.len(), draw))
            .find(|cell| !space.cells[*cell].is_contested && held.is_free(space, *cell, id));
        let Some(cell) = place else { continue };
        held.by[cell] = id;
        let at = space.cells[cell];
        cars.push(Car {
            pose: pose_along(&centres[at.lane], at.along),
            speed: 0.0,
            lanes: VecDeque::from([at.lane]),
            along: at.along,
            likes: SPEEDS[0] + draw() * (SPEEDS[1] - SPEEDS[0]),
            holds: VecDeque::from([cell]),
            reached: 0,
            room: at.length,
            waits: 0,
        });
    }
    held.unblock(&cells);
    let order = (0..cars.len()).collect();
    Traffic { cars, held, order }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "a number below n, of which there are few"
)]
fn pick(n: usize, draw: &mut dyn FnMut() -> f64) -> usize {
    ((draw() * n as f64) as usize).min(n.saturating_sub(1))
}

impl Traffic {
    /// What the cars take up.
    pub fn bodies(&self) -> impl Iterator<Item = Body> + '_ {
        self.cars.iter().map(|car| Body::car(car.pose, [0.0, 0.0]))
    }

    /// Lets all cars drive for `DT` seconds.
    ///
    /// - `centres`: of each lane.
    /// - `draw`: uniform in `[0, 1)`; chooses among lanes.
    pub fn step(&mut self, space: &Space, centres: &[Vec<Point>], draw: &mut dyn FnMut() -> f64) {
        let waits = |car: &usize| std::cmp::Reverse(self.cars[*car].waits);
        self.order.sort_by_key(|car| (waits(car), *car));
        for place in 0..self.order.len() {
            let id = self.order[place];
            let car = &mut self.cars[id];
            let wishes = wished(car, space);
            let needs = wishes * DT + wishes * wishes / (2.0 * BRAKING) + SPARE;
            while car.room < needs && take(car, id, space, &mut self.held, draw) {}
            let stops = BRAKING * ((DT * DT + 2.0 * car.room / BRAKING).sqrt() - DT);
            let mut speed = wishes.min(stops).max(0.0);
            if let Some(gap) = obstacle(car, space, &self.held) {
                let brakes = (2.0 * EMERGENCY * (gap - SPARE).max(0.0)).sqrt();
                speed = speed.min(brakes).max(car.speed - EMERGENCY * DT).max(0.0).min(speed);
            }
            drive(car, speed, space, &mut self.held);
            car.pose = pose_along(&centres[car.lanes[0]], car.along);
            car.waits = if speed < 0.1 { car.waits + 1 } else { 0 };
        }
    }
}

/// The speed that a car would have after the step if nobody were in its way.
fn wished(car: &Car, space: &Space) -> f64 {
    let free = ACCELERATION * (1.0 - (car.speed / car.likes).powi(4));
    let mut speed = car.speed + free * DT;
    let mut gap = 0.0;
    for cell in car.holds.iter().map(|cell| &space.cells[*cell]) {
        let bend = (SIDEWARDS / cell.curvature.max(1e-6)).sqrt().max(SLOW);
        speed = speed.min((bend * bend + 2.0 * BRAKING * gap).sqrt());
        gap += cell.length;
    }
    speed.max(0.0)
}

/// Metres from a car's middle to the first cell that it holds where the agent is in its way.
fn obstacle(car: &Car, space: &Space, held: &Held) -> Option<f64> {
    let own = space.cells[car.holds[0]];
    let mut gap = own.along - car.along;
    for cell in &car.holds {
        if held.blocked[*cell] > 0 {
            return Some(gap.max(0.0));
        }
        gap += space.cells[*cell].length;
    }
    None
}

/// Takes the next cell, or all of a crossing; whether it could.
fn take(
    car: &mut Car,
    id: usize,
    space: &Space,
    held: &mut Held,
    draw: &mut dyn FnMut() -> f64,
) -> bool {
    let mut wanted: Vec<usize> = Vec::new();
    let mut from = car.holds[car.holds.len() - 1];
    let mut lane = car.reached;
    while wanted.len() < MOST_CROSSED {
        let next = if from + 1 < space.of_lane(car.lanes[lane]).end {
            from + 1
        } else {
            if lane + 1 == car.lanes.len() {
                let choices = space.next(car.lanes[lane]);
                car.lanes.push_back(choices[pick(choices.len(), draw)]);
            }
            lane += 1;
            space.of_lane(car.lanes[lane]).start
        };
        wanted.push(next);
        if !space.cells[next].is_contested {
            break;
        }
        from = next;
    }
    let crossing = wanted.len() > 1;
    let is_open = |cell: &usize| held.by[*cell] == NOBODY && held.is_free(space, *cell, id);
    let free = wanted.iter().all(is_open);
    let claims = (car.waits / IMPATIENT) % 2 == 1;
    if free && (!crossing || wanted.iter().all(|cell| held.is_unclaimed(space, *cell, id))) {
        for cell in wanted {
            held.by[cell] = id;
            if held.claimed[cell] == id {
                held.claimed[cell] = NOBODY;
            }
            car.room += space.cells[cell].length;
            car.holds.push_back(cell);
        }
        car.reached = lane;
        return true;
    }
    if crossing && car.waits >= IMPATIENT {
        let exit = wanted[wanted.len() - 1];
        let open = claims && held.is_free(space, exit, id);
        for cell in &wanted {
            if open && held.claimed[*cell] == NOBODY {
                held.claimed[*cell] = id;
            } else if !open && held.claimed[*cell] == id {
                held.claimed[*cell] = NOBODY;
            }
        }
    }
    if car.waits > 0 && car.waits.is_multiple_of(LOST) {
        car.lanes.truncate(car.reached + 1);
    }
    false
}

/// Moves a car on, and lets go of what is behind it.
fn drive(car: &mut Car, speed: f64, space: &Space, held: &mut Held) {
    let moved = (speed * DT).min(car.room);
    car.speed = speed;
    car.room -= moved;
    car.along += moved;
    while car.holds.len() > 1 {
        let cell = &space.cells[car.holds[0]];
        if car.along < cell.along + cell.length {
            break;
        }
        let next = &space.cells[car.holds[1]];
        if next.along == 0.0 && (next.lane != cell.lane || car.holds[1] <= car.holds[0]) {
            car.along -= cell.along + cell.length;
            car.lanes.pop_front();
            car.reached -= 1;
        }
        held.by[car.holds[0]] = NOBODY;
        car.holds.pop_front();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::town_map;
    use crate::town::town;

    fn drawn(mut state: u64) -> impl FnMut() -> f64 {
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(99);
            f64::from(u32::try_from(state >> 32).unwrap()) / 4_294_967_296.0
        }
    }

    fn touches(cars: &[Car]) -> usize {
        let bodies: Vec<Body> = cars.iter().map(|car| Body::car(car.pose, [0.0, 0.0])).collect();
        let touching =
            |i: usize| bodies[..i].iter().filter(|other| bodies[i].overlaps(other)).count();
        (0..bodies.len()).map(touching).sum()
    }

    #[test]
    fn cars_that_see_only_their_own_cell_touch() {
        let mut town = town(town_map("Town02").unwrap());
        let mut draw = drawn(1);
        let careful = traffic(&town.space, &town.centres, 60, &[], &mut draw);
        let run = |mut traffic: Traffic, space: &Space, draw: &mut dyn FnMut() -> f64| {
            let steps = (0..1_000).map(|_| {
                traffic.step(space, &town.centres, draw);
                touches(&traffic.cars)
            });
            steps.sum::<usize>()
        };
        assert_eq!(run(careful.clone(), &town.space, &mut draw), 0);
        town.space.forget_clashes();
        assert!(run(careful, &town.space, &mut draw) > 100);
    }

    #[test]
    fn cars_stop_for_what_is_in_their_way_and_wait() {
        let town = town(town_map("Town01").unwrap());
        let mut draw = drawn(5);
        let mut traffic = traffic(&town.space, &town.centres, 1, &[], &mut draw);
        // On a long lane at speed, so that there is a place 15 m ahead.
        let place = loop {
            traffic.step(&town.space, &town.centres, &mut draw);
            let car = &traffic.cars[0];
            let place = car.holds[0] + 15;
            if car.speed > 5.0 && town.space.of_lane(car.lanes[0]).contains(&place) {
                break place;
            }
        };
        let cell = town.space.cells[place];
        let there = pose_along(&town.centres[cell.lane], cell.along);
        let body = Body::car(there, [0.0, 0.0]);
        let cells = town.space.touched(&body);
        traffic.held.block(&cells);
        let mut least = f64::INFINITY;
        for _ in 0..400 {
            let before = traffic.cars[0].speed;
            traffic.step(&town.space, &town.centres, &mut draw);
            least = least.min(traffic.cars[0].pose.distance(&there));
            assert!(before - traffic.cars[0].speed <= EMERGENCY * DT + 1e-9);
            assert!(!Body::car(traffic.cars[0].pose, [0.0, 0.0]).overlaps(&body));
        }
        assert!(traffic.cars[0].speed == 0.0 && least < 12.0, "{least}");
        traffic.held.unblock(&cells);
        (0..200).for_each(|_| traffic.step(&town.space, &town.centres, &mut draw));
        assert!(traffic.cars[0].speed > 3.0);
    }

    #[test]
    fn a_free_road_is_driven_at_the_liked_speed() {
        let town = town(town_map("Town04").unwrap());
        let mut draw = drawn(2);
        let mut traffic = traffic(&town.space, &town.centres, 1, &[], &mut draw);
        // From rest: v = a DT after a step, for a (1 - 0) = 2.
        traffic.step(&town.space, &town.centres, &mut draw);
        assert!((traffic.cars[0].speed - 0.1).abs() < 1e-12);
        let most = (0..2_000).map(|_| {
            traffic.step(&town.space, &town.centres, &mut draw);
            traffic.cars[0].speed
        });
        let most = most.fold(0.0, f64::max);
        let likes = traffic.cars[0].likes;
        assert!(most <= likes + 1e-9 && most > 0.97 * likes, "{most} {likes}");
    }
}
