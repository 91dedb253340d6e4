//! Which lanes there are, and which follow which.

use std::collections::VecDeque;

use super::lane::{Lane, Point};

/// Roads between nodes, each of some lanes side by side. A lane is known by its place among all, road after road.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Network {
    pub(super) lanes: Vec<Lane>,
    /// The road of each.
    road_of: Vec<usize>,
    pub(super) roads: Vec<Road>,
    /// What the nodes are called.
    pub(super) nodes: Vec<String>,
}

/// From which node to which, where its lanes are, and how many.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Road {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) first: usize,
    pub(super) n: usize,
}

/// A part of a route: a road, and a lane of it by number if one is meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leg {
    pub(super) road: usize,
    pub(super) lane: Option<usize>,
}

/// What is still to be driven; where it is empty, there is no plan.
pub(super) type Route = VecDeque<Leg>;

impl Network {
    /// Roads by the names of their nodes. Their order decides which lane is the closest where two are as close.
    pub(super) fn of(roads: Vec<(String, String, Vec<Lane>)>) -> Self {
        let mut network = Self { lanes: vec![], road_of: vec![], roads: vec![], nodes: vec![] };
        for (from, to, lanes) in roads {
            let [from, to] = [from, to].map(|name| network.named(name));
            let (first, n) = (network.lanes.len(), lanes.len());
            network.road_of.extend(vec![network.roads.len(); n]);
            network.roads.push(Road { from, to, first, n });
            network.lanes.extend(lanes);
        }
        network
    }

    fn named(&mut self, name: String) -> usize {
        self.node(&name).unwrap_or_else(|| {
            self.nodes.push(name);
            self.nodes.len() - 1
        })
    }

    /// The node of a name.
    pub(super) fn node(&self, name: &str) -> Option<usize> {
        self.nodes.iter().position(|node| node == name)
    }

    /// The road between two nodes by their names.
    pub(super) fn road(&self, from: &str, to: &str) -> Option<usize> {
        let ends = (self.node(from)?, self.node(to)?);
        self.roads.iter().position(|road| (road.from, road.to) == ends)
    }

    /// The road of a lane.
    pub(super) fn road_of(&self, lane: usize) -> Road {
        self.roads[self.road_of[lane]]
    }

    /// The number of a lane on its road.
    pub(super) fn number(&self, lane: usize) -> usize {
        lane - self.road_of(lane).first
    }

    /// Whether two lanes are of one road.
    pub(super) fn same_road(&self, lane: usize, other: usize) -> bool {
        self.road_of[lane] == self.road_of[other]
    }

    /// The lanes beside a lane, the one to the left first.
    pub(super) fn beside(&self, lane: usize) -> impl Iterator<Item = usize> + use<> {
        let road = self.road_of(lane);
        let left = (lane > road.first).then(|| lane - 1);
        let right = (lane + 1 < road.first + road.n).then_some(lane + 1);
        left.into_iter().chain(right)
    }

    /// The lane closest to a car, by where it is and where it heads:
    ///
    /// ```text
    /// argmin_lane |across| + max(along − length, 0) + max(−along, 0) + |heading − lane's|
    /// ```
    ///
    /// the first where two are as close. `guess` is looked at first, for speed.
    pub(super) fn closest(&self, at: Point, heading: f64, guess: usize) -> usize {
        let mut polar = None;
        let mut closest = guess;
        let mut best = self.lanes[guess].distance_heading(at, heading, f64::INFINITY, &mut polar);
        for (i, lane) in self.lanes.iter().enumerate() {
            let distance = lane.distance_heading(at, heading, best, &mut polar);
            if distance < best || distance == best && i < closest {
                (closest, best) = (i, distance);
            }
        }
        closest
    }

    /// The lane that follows one on a route, which is shortened; without a route, or where it leads elsewhere, the
    /// closest of those that follow. Where none does, it is the lane itself.
    pub(super) fn next_lane(&self, lane: usize, route: &mut Route, at: Point) -> usize {
        let road = self.road_of[lane];
        if route.front().is_some_and(|leg| leg.road == road) {
            route.pop_front();
        }
        let follows = |road: &usize| self.roads[*road].from == self.roads[self.road_of[lane]].to;
        let along = self.lanes[lane].local(at)[0];
        let ahead = self.lanes[lane].point([along, 0.0]);
        if let Some(leg) = route.front().filter(|leg| follows(&leg.road)) {
            return self.lane_of(leg.road, leg.lane, lane, ahead);
        }
        let roads = (0..self.roads.len()).filter(follows);
        let lanes = roads.map(|road| self.lane_of(road, None, lane, ahead));
        self.nearest(lanes, ahead).unwrap_or(lane)
    }

    /// The lane of a road that a car coming from `lane` takes: that meant or the one of the same number if there are as
    /// many, else the nearest.
    fn lane_of(&self, road: usize, meant: Option<usize>, lane: usize, ahead: Point) -> usize {
        let Road { first, n, .. } = self.roads[road];
        if self.road_of(lane).n == n {
            return first + meant.unwrap_or_else(|| self.number(lane));
        }
        self.nearest(first..first + n, ahead).expect("a road has lanes")
    }

    fn nearest(&self, lanes: impl Iterator<Item = usize>, at: Point) -> Option<usize> {
        let distance = |lane: usize| self.lanes[lane].distance(at);
        lanes.min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
    }

    /// The shortest route from a lane to a node: the lane, and roads of which no lane is meant. Without a way it is the
    /// lane alone.
    pub(super) fn route(&self, lane: usize, goal: usize) -> Route {
        let start = Leg { road: self.road_of[lane], lane: Some(self.number(lane)) };
        let mut queue = VecDeque::from([(self.road_of(lane).to, Route::from([start]))]);
        let mut reached = vec![false; self.nodes.len()];
        while let Some((node, route)) = queue.pop_front() {
            for (road, leads) in self.roads.iter().enumerate() {
                if leads.from != node || reached[leads.to] {
                    continue;
                }
                reached[leads.to] = true;
                let mut longer = route.clone();
                longer.push_back(Leg { road, lane: None });
                if leads.to == goal {
                    return longer;
                }
                queue.push_back((leads.to, longer));
            }
        }
        Route::from([start])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two lanes to the right from a to b, which forks: two lanes on to c, and one down to d.
    fn fork() -> Network {
        let lane = |start, end| Lane::straight(start, end, 20.0);
        let named = |from: &str, to: &str, lanes| (from.to_owned(), to.to_owned(), lanes);
        Network::of(vec![
            named("a", "b", vec![lane([0.0, 0.0], [10.0, 0.0]), lane([0.0, 4.0], [10.0, 4.0])]),
            named("b", "c", vec![lane([10.0, 0.0], [20.0, 0.0]), lane([10.0, 4.0], [20.0, 4.0])]),
            named("b", "d", vec![lane([10.0, 4.0], [10.0, 14.0])]),
        ])
    }

    #[test]
    fn a_route_says_which_lane_follows() {
        let net = fork();
        let to = |name| net.route(1, net.node(name).unwrap());
        let mut route = to("d");
        assert_eq!(route, [Leg { road: 0, lane: Some(1) }, Leg { road: 2, lane: None }]);
        assert_eq!(net.next_lane(1, &mut route, [9.0, 4.0]), 4);
        assert_eq!(route.len(), 1);
        // As many lanes: the number is kept, or the one meant is taken.
        assert_eq!(net.next_lane(1, &mut to("c"), [9.0, 4.0]), 3);
        let mut meant = Route::from([Leg { road: 1, lane: Some(0) }]);
        assert_eq!(net.next_lane(1, &mut meant, [9.0, 4.0]), 2);
        // Without a route the nearest follows, and at the end nothing does.
        assert_eq!(net.next_lane(0, &mut Route::new(), [9.0, 0.0]), 2);
        assert_eq!(net.next_lane(3, &mut Route::new(), [19.0, 0.0]), 3);
        assert_eq!(net.route(2, net.node("a").unwrap()), [Leg { road: 1, lane: Some(0) }]);
    }

    #[test]
    fn the_closest_lane_is_the_first_of_equals_whatever_was_guessed() {
        let net = fork();
        for guess in 0..5 {
            let closest = |at, heading| net.closest(at, heading, guess);
            assert_eq!([closest([5.0, 1.9], 0.0), closest([5.0, 2.0], 0.0)], [0, 0]);
            assert_eq!([closest([5.0, 2.1], 0.0), closest([10.0, 4.0], 1.5)], [1, 4]);
        }
        assert_eq!(net.beside(0).collect::<Vec<_>>(), [1]);
        assert_eq!(net.beside(3).collect::<Vec<_>>(), [2]);
        assert_eq!((net.number(3), net.same_road(0, 1), net.same_road(1, 2)), (1, true, false));
    }
}
