//! What cannot be on the road at the same time.
//!
//! Lanes are cut into cells of at most a metre. A car is in the cell of its middle; two cells clash if a car in one and a
//! car in the other could touch. Whoever drives takes the cells up to where it can stop, and none that clashes with another's:
//! so cars never touch, whatever lanes cross, join or part (`traffic.rs`).

use crate::body::Body;
use crate::centre::{Point, pose_along};
use crate::geometry::wrapped;
use crate::grid::Grid;
use crate::lanes::Network;

/// Most metres of a cell.
const CELL: f64 = 1.0;
/// Most cells of a lane.
const MOST_CELLS: f64 = 1e5;
/// What is kept free at the ends and at the sides of cars, in metres: more than they move and turn between the poses that
/// are looked at.
const MARGIN: [f64; 2] = [0.3, 0.3];
/// How far lanes that follow each other are in line, in metres: more than two cars are long.
const IN_LINE: f64 = 12.0;

/// A piece of a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// The lane.
    pub lane: usize,
    /// Where it starts on the lane, in metres driven.
    pub along: f64,
    /// In metres.
    pub length: f64,
    /// Radians a metre, either way.
    pub curvature: f64,
    /// Whether cars on other lanes than those before and behind can be in the way, or come from elsewhere.
    pub is_contested: bool,
}

/// The cells of all lanes on which cars can go on for ever.
#[derive(Clone, Debug)]
pub struct Space {
    /// Lane by lane, in the direction of driving.
    pub cells: Vec<Cell>,
    /// The first cell of each lane of the network; as many as `cells` for lanes that have none.
    first: Vec<usize>,
    /// Lanes that follow, of those that have cells.
    next: Vec<Vec<usize>>,
    /// Where the clashes of each cell start in `clashes`.
    starts: Vec<usize>,
    /// Cells that clash with each, itself among them.
    clashes: Vec<usize>,
    /// A car at the start, in the middle and at the end of each cell.
    bodies: Vec<[Body; 3]>,
    /// Cells by where cars in them can be.
    grid: Grid<usize>,
}

/// Cuts the lanes of a network.
///
/// - `centres`: of each lane.
#[must_use]
pub fn space(network: &Network, centres: &[Vec<Point>]) -> Space {
    let next = endless(network);
    let mut cells: Vec<Cell> = Vec::new();
    let mut first = Vec::with_capacity(centres.len());
    for (lane, points) in centres.iter().enumerate() {
        first.push(cells.len());
        let length = points.last().map_or(0.0, |point| point.along);
        let n_cells = if next[lane].is_empty() { 0.0 } else { (length / CELL).ceil().max(1.0) };
        // A broken file can have lanes that are far longer than their roads.
        let n_cells = n_cells.min(MOST_CELLS);
        let starts =
            std::iter::successors(Some(0.0), |k| Some(k + 1.0)).take_while(|k| *k < n_cells);
        for k in starts {
            let [along, end] = [k, k + 1.0].map(|k| length * k / n_cells);
            let turned = pose_along(points, end).yaw - pose_along(points, along).yaw;
            let curvature = wrapped(turned).abs() / (end - along).max(0.1);
            cells.push(Cell { lane, along, length: end - along, curvature, is_contested: false });
        }
    }
    let bodies: Vec<[Body; 3]> =
        cells.iter().map(|cell| bodies(cell, &centres[cell.lane])).collect();
    let boxed: Vec<([f64; 4], usize)> =
        bodies.iter().enumerate().map(|(g, bodies)| (around(bodies), g)).collect();
    let grid = Grid::of(&boxed, 8.0);
    let (mut starts, mut clashes) = (vec![0], Vec::new());
    // By which cell each was looked at last: boxes can be near in several cells of the grid.
    let mut seen = vec![usize::MAX; cells.len()];
    for (own, g) in &boxed {
        let from = clashes.len();
        for h in grid.within(*own) {
            if std::mem::replace(&mut seen[*h], *g) != *g && clash(&bodies[*g], &bodies[*h]) {
                clashes.push(*h);
            }
        }
        clashes[from..].sort_unstable();
        starts.push(clashes.len());
    }
    let mut space = Space { cells, first, next, starts, clashes, bodies, grid };
    for lane in 0..centres.len() {
        let in_line = space.in_line(lane);
        for g in space.of_lane(lane) {
            let other = |h: &usize| !in_line.contains(&space.cells[*h].lane);
            space.cells[g].is_contested = space.clashes(g).iter().any(other);
        }
    }
    space
}

/// Lanes that follow each driving lane, without those that come to an end somewhere.
fn endless(network: &Network) -> Vec<Vec<usize>> {
    let n_lanes = network.lanes.len();
    let mut lives: Vec<bool> = (0..n_lanes).map(|lane| network.is_driven(lane)).collect();
    let next = |lives: &[bool], lane: usize| -> Vec<usize> {
        network.lanes[lane].next.iter().copied().filter(|next| lives[*next]).collect()
    };
    let mut ended: Vec<usize> = (0..n_lanes).filter(|lane| lives[*lane]).collect();
    while let Some(lane) = ended.pop() {
        if lives[lane] && next(&lives, lane).is_empty() {
            lives[lane] = false;
            ended.extend(&network.lanes[lane].before);
        }
    }
    (0..n_lanes).map(|lane| if lives[lane] { next(&lives, lane) } else { Vec::new() }).collect()
}

/// A car at the start, in the middle and at the end of a cell.
fn bodies(cell: &Cell, points: &[Point]) -> [Body; 3] {
    [0.0, 0.5, 1.0]
        .map(|share| Body::car(pose_along(points, cell.along + share * cell.length), MARGIN))
}

fn around(bodies: &[Body; 3]) -> [f64; 4] {
    let bounds = bodies.map(|body| body.bounds());
    let fold =
        |i: usize, f: fn(f64, f64) -> f64| bounds.iter().map(|b| b[i]).reduce(f).unwrap_or(0.0);
    [fold(0, f64::min), fold(1, f64::min), fold(2, f64::max), fold(3, f64::max)]
}

fn clash(one: &[Body; 3], other: &[Body; 3]) -> bool {
    let [a, b] = [one[1].pose, other[1].pose];
    // Half a cell on either side, and corners that touch.
    let far = 2.0 * one[1].reach() + CELL;
    let [dx, dy] = [a.x - b.x, a.y - b.y];
    dx * dx + dy * dy < far * far && one.iter().any(|a| other.iter().any(|b| a.overlaps(b)))
}

impl Space {
    /// The cells of a lane.
    #[must_use]
    pub fn of_lane(&self, lane: usize) -> std::ops::Range<usize> {
        self.first[lane]..self.first.get(lane + 1).copied().unwrap_or(self.cells.len())
    }

    /// Lanes on which a car can go on.
    #[must_use]
    pub fn next(&self, lane: usize) -> &[usize] {
        &self.next[lane]
    }

    /// Cells in which no other car may be while one is in this, itself among them.
    #[must_use]
    pub fn clashes(&self, cell: usize) -> &[usize] {
        &self.clashes[self.starts[cell]..self.starts[cell + 1]]
    }

    /// Cells in which cars could touch a body.
    #[must_use]
    pub fn touched(&self, body: &Body) -> Vec<usize> {
        let mut cells: Vec<usize> = self.grid.within(body.bounds()).copied().collect();
        cells.sort_unstable();
        cells.dedup();
        cells.retain(|cell| self.bodies[*cell].iter().any(|car| car.overlaps(body)));
        cells
    }

    /// Lanes before and behind a lane, near enough to be touched by a car on it, and itself.
    pub(crate) fn in_line(&self, lane: usize) -> Vec<usize> {
        let mut lanes = vec![lane];
        self.follow(lane, IN_LINE, &mut lanes);
        // Who leads here is found from the other end.
        for other in self.before(lane) {
            let mut behind = Vec::new();
            self.follow(other, IN_LINE, &mut behind);
            if behind.contains(&lane) {
                lanes.push(other);
            }
        }
        lanes
    }

    fn follow(&self, lane: usize, room: f64, lanes: &mut Vec<usize>) {
        for next in &self.next[lane] {
            let new = !lanes.contains(next);
            if new {
                lanes.push(*next);
            }
            let last = self.of_lane(*next).next_back().map(|g| &self.cells[g]);
            let length = last.map_or(0.0, |cell| cell.along + cell.length);
            if length < room && new {
                self.follow(*next, room - length, lanes);
            }
        }
    }

    /// Lanes whose cells clash with one of this lane's.
    fn before(&self, lane: usize) -> Vec<usize> {
        let clashes = self.of_lane(lane).flat_map(|g| self.clashes(g));
        let mut lanes: Vec<usize> = clashes.map(|h| self.cells[*h].lane).collect();
        lanes.sort_unstable();
        lanes.dedup();
        lanes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::maps::town_map;
    use crate::town::{Town, town};

    impl Space {
        /// Lets each cell clash with none but itself.
        pub(crate) fn forget_clashes(&mut self) {
            self.clashes = (0..self.cells.len()).collect();
            self.starts = (0..=self.cells.len()).collect();
        }
    }

    fn bodies_of(town: &Town, cell: usize) -> [Body; 3] {
        bodies(&town.space.cells[cell], &town.centres[town.space.cells[cell].lane])
    }

    #[test]
    fn cells_clash_with_what_is_near_and_with_nothing_else() {
        let town = town(town_map("Town01").unwrap());
        let space = &town.space;
        for g in (0..space.cells.len()).step_by(97) {
            let expected: Vec<usize> = (0..space.cells.len())
                .filter(|h| {
                    bodies_of(&town, g)
                        .iter()
                        .any(|a| bodies_of(&town, *h).iter().any(|b| a.overlaps(b)))
                })
                .collect();
            assert_eq!(space.clashes(g), expected);
            assert!(expected.contains(&g));
        }
        // On a straight lane of its own: 5.3 m and 1 m of the cell, before and behind.
        let lane = town.network.lane(10, 0, 1).unwrap();
        let g = space.of_lane(lane).start + 50;
        let near = space.clashes(g);
        assert!((12..=14).contains(&near.len()) && !space.cells[g].is_contested, "{near:?}");
        let contested = space.cells.iter().filter(|cell| cell.is_contested).count();
        let in_junctions =
            space.cells.iter().filter(|cell| town.network.junction(cell.lane).is_some()).count();
        assert!(contested > 1_000 && contested < in_junctions + 200, "{contested} {in_junctions}");
    }

    #[test]
    fn all_cells_lead_on() {
        for name in ["Town01", "Town03"] {
            let town = town(town_map(name).unwrap());
            let space = &town.space;
            for lane in 0..town.network.lanes.len() {
                let leads = space.next(lane).iter().all(|next| !space.of_lane(*next).is_empty());
                assert!(leads && space.of_lane(lane).is_empty() == space.next(lane).is_empty());
            }
            // Three of Town03 end.
            let n_lost = (0..town.network.lanes.len())
                .filter(|lane| town.network.is_driven(*lane) && space.next(*lane).is_empty())
                .count();
            assert_eq!(n_lost > 0, name == "Town03", "{name}: {n_lost}");
        }
    }

    #[test]
    fn what_is_touched_is_found() {
        let town = town(town_map("Town01").unwrap());
        let g = 1_000;
        let car = bodies_of(&town, g)[1];
        assert!(town.space.touched(&car).contains(&g));
        let far = Body::car(Pose { x: 1e6, ..Pose::default() }, [0.0, 0.0]);
        assert!(town.space.touched(&far).is_empty());
    }
}
