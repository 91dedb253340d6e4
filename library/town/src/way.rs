//! The right of way of the agent's car: cars take it for one that follows its route.
//!
//! As they do, it holds points of its route up to where it can stop, and all of a crossing or none (`traffic.rs`); whoever
//! drives by other rules takes what it wants, and cars stop where they can.

use crate::body::Body;
use crate::route::{ROUTE_STEP, Waypoint};
use crate::space::Space;
use crate::traffic::Held;

/// What is kept free at the ends and the sides of the agent's car, in metres: it does not follow its route exactly.
const MARGIN: [f64; 2] = [0.3, 0.3];
/// Points before and behind one where the route goes to another lane on which it is in the way of cars on both.
const BEFORE: usize = 3;
const CHANGE: usize = 18;
/// Steps that it may stand although it need not, before a crossing is no longer kept for it.
const PATIENCE: u32 = 100;
/// Steps of waiting after which others may not take the crossing that it waits for; after as many more they may, and so on:
/// who waits for somebody who waits for it goes on then.
const IMPATIENT: u32 = 60;
/// A car is slower than this, in metres a second, when it stands.
const STANDS: f64 = 0.1;

/// What the agent holds of its route.
#[derive(Clone, Debug)]
pub(crate) struct Way {
    /// By point of the route: cells in which cars could touch the agent there.
    touched: Vec<Vec<usize>>,
    /// By point of the route: whether cars come from elsewhere.
    crossing: Vec<bool>,
    /// Points that are held: from the first up to the second, which is not.
    held: [usize; 2],
    /// Points whose cells others may not take.
    claimed: [usize; 2],
    idle: u32,
    waits: u32,
}

/// What cars see of a route, of which nothing is held.
pub(crate) fn way(space: &Space, route: &[Waypoint]) -> Way {
    let bodies = route.iter().map(|point| Body::car(point.pose, MARGIN));
    let touched: Vec<Vec<usize>> = bodies.map(|body| space.touched(&body)).collect();
    let crosses = |k: usize| {
        // Cells clash before and behind alike: its own is in the middle.
        let on_lane = |cell: &&usize| space.cells[**cell].lane == route[k].lane;
        let own: Vec<&usize> = touched[k].iter().filter(on_lane).collect();
        own.get(own.len() / 2).is_some_and(|cell| space.cells[**cell].is_contested)
    };
    let mut crossing: Vec<bool> = (0..route.len()).map(crosses).collect();
    // Who goes to the lane beside its own is in the way of two, and must not stop there either.
    for (k, pair) in route.windows(2).enumerate() {
        let [before, behind] = [pair[0].lane, pair[1].lane];
        if before != behind && !space.in_line(before).contains(&behind) {
            let end = (k + CHANGE).min(route.len());
            crossing[k.saturating_sub(BEFORE)..end].fill(true);
        }
    }
    Way { touched, crossing, held: [0, 0], claimed: [0, 0], idle: 0, waits: 0 }
}

impl Way {
    /// Holds what the agent needs from now on, and lets go of what is behind it.
    ///
    /// - `at`: the point of the route where it is; `None` where it is away from the route.
    /// - `needs`: metres of the route.
    pub(crate) fn keep(&mut self, held: &mut Held, at: Option<usize>, speed: f64, needs: f64) {
        let Some(at) = at else {
            self.give_up(held);
            return;
        };
        if at < self.held[0] || at > self.held[1] {
            self.give_up(held);
        }
        if self.held[0] == self.held[1] {
            self.held = [at, at];
        }
        while self.held[0] < at {
            held.unblock(&self.touched[self.held[0]]);
            self.held[0] += 1;
        }
        self.count(at, speed);
        if self.idle > PATIENCE {
            self.give_up(held);
            return;
        }
        while metres(self.held[1].saturating_sub(at)) < needs && self.take(held) {}
    }

    /// Takes the next point, or all of a crossing; whether it could.
    fn take(&mut self, held: &mut Held) -> bool {
        let from = self.held[1];
        if from >= self.touched.len() {
            return false;
        }
        let ends = (from..self.touched.len()).find(|k| !self.crossing[*k]);
        let to = ends.map_or(self.touched.len(), |k| k + 1);
        // What it holds already is no reason against it: only cars are.
        let free = self.touched[from..to].iter().all(|cells| held.lets(cells));
        if free {
            self.touched[from..to].iter().for_each(|cells| held.block(cells));
            self.held[1] = to;
        }
        if free && self.claimed[1] > self.claimed[0] {
            self.disclaim(held);
        }
        // Behind a car one only waits.
        let crossing = to > from + 1;
        let claims = (self.waits / IMPATIENT) % 2 == 1;
        if !claims {
            self.disclaim(held);
        }
        if !free && crossing && claims && self.claimed[0] == self.claimed[1] {
            self.claimed = [from, to];
            self.touched[from..to].iter().for_each(|cells| held.claim(cells));
        }
        free
    }

    fn disclaim(&mut self, held: &mut Held) {
        for cells in &self.touched[self.claimed[0]..self.claimed[1]] {
            held.disclaim(cells);
        }
        self.claimed = [0, 0];
    }

    /// Lets go of everything.
    pub(crate) fn give_up(&mut self, held: &mut Held) {
        for cells in &self.touched[self.held[0]..self.held[1]] {
            held.unblock(cells);
        }
        self.held = [0, 0];
        self.disclaim(held);
    }

    fn count(&mut self, at: usize, speed: f64) {
        let stands = speed < STANDS;
        let may_go = self.held[1] > at + 3;
        self.waits = if stands && !may_go { self.waits + 1 } else { 0 };
        if stands && may_go {
            self.idle += 1;
        } else if !stands {
            self.idle = 0;
        }
    }

    /// Metres from a point of the route to the last that is held.
    pub(crate) fn room(&self, at: usize) -> f64 {
        metres(self.held[1].saturating_sub(at + 1))
    }

    /// Whether all of the route ahead is held.
    pub(crate) fn is_whole(&self) -> bool {
        self.held[1] == self.touched.len()
    }
}

#[expect(clippy::cast_precision_loss, reason = "routes have far fewer points")]
fn metres(n_points: usize) -> f64 {
    n_points as f64 * ROUTE_STEP
}
