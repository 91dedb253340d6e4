//! The two roads: a straight highway, and a roundabout of four arms.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::lane::{Lane, Point, WIDTH};
use super::network::Network;
use super::release::Release;

/// Straight lanes side by side, 10 km long.
pub(super) fn highway(n_lanes: usize, release: &Release) -> Network {
    let lane = |i: usize| {
        #[expect(clippy::cast_precision_loss, reason = "a few lanes")]
        let y = WIDTH * i as f64;
        Lane::straight([0.0, y], [10_000.0, y], release.limit)
    };
    let lanes = (0..n_lanes).map(lane).collect();
    Network::of(vec![("0".to_owned(), "1".to_owned(), lanes)])
}

/// How fast one may drive on a roundabout, in m/s.
const LIMIT: f64 = 20.0;
/// The radii of its two lanes.
const RADII: [f64; 2] = [20.0, 24.0];
/// The angle between the middle of an arm and where one enters or leaves the roundabout, in degrees.
const OPENING: f64 = 24.0;
/// How far from the centre an arm begins, and where it begins to bend towards the roundabout.
const FAR: f64 = 170.0;
const BENDS: f64 = 42.5;
/// How long a bend is, of how long a wave, and how high that is.
const BEND: f64 = 17.0;
const WAVE: f64 = 85.0;
const HEIGHT: f64 = 5.0;
/// How far the lanes of an arm are from its middle.
const ASIDE: f64 = 2.0;

/// The arcs of its ring from node to node, in degrees from the east, where angles grow towards the south.
const RING: [(&str, &str, f64, f64); 8] = [
    ("se", "ex", 90.0 - OPENING, OPENING),
    ("ex", "ee", OPENING, -OPENING),
    ("ee", "nx", -OPENING, OPENING - 90.0),
    ("nx", "ne", OPENING - 90.0, -90.0 - OPENING),
    ("ne", "wx", -90.0 - OPENING, OPENING - 180.0),
    ("wx", "we", OPENING - 180.0, -180.0 - OPENING),
    ("we", "sx", 180.0 - OPENING, 90.0 + OPENING),
    ("sx", "se", 90.0 + OPENING, 90.0 - OPENING),
];

/// Two lanes around the origin, driven against the clock as seen, and arms in the south, east, north and west.
///
/// Nodes are called as in highway-env: `se` is where one enters from the south, `sx` where one leaves to it, `ses` and
/// `sxs` are where the arm bends, and `ser` and `sxr` where it begins and ends. The order of roads is its, too.
pub(super) fn roundabout() -> Network {
    let mut roads = Vec::new();
    for (from, to, start, end) in RING {
        let lane = |radius| Lane::arc(radius, (start.to_radians(), end.to_radians()), LIMIT);
        roads.push((from.to_owned(), to.to_owned(), RADII.map(lane).to_vec()));
        if let Some(arm) = Arm::left_at(from) {
            roads.push((from.to_owned(), format!("{from}s"), vec![arm.exit()]));
        }
    }
    for (name, turns) in ARMS {
        let arm = Arm { turns };
        let mut road = |from, to, lane| {
            roads.push((format!("{name}{from}"), format!("{name}{to}"), vec![lane]));
        };
        let [far, bends] = [FAR, BENDS].map(|y| [ASIDE, y]);
        road("er", "es", arm.straight(far, bends));
        road("es", "e", arm.entry());
        let [bends, far] = [BENDS, FAR].map(|y| [-ASIDE, y]);
        road("xs", "xr", arm.straight(bends, far));
    }
    Network::of(roads)
}

/// The arms, and by how many right angles each is turned from the south.
const ARMS: [(&str, u8); 4] = [("s", 0), ("e", 1), ("n", 2), ("w", 3)];

/// An arm: that of the south turned by so many right angles.
struct Arm {
    turns: u8,
}

impl Arm {
    /// That which one leaves to at a node, if it is an exit.
    fn left_at(node: &str) -> Option<Self> {
        let name = node.strip_suffix('x')?;
        ARMS.iter().find(|arm| arm.0 == name).map(|(_, turns)| Self { turns: *turns })
    }

    fn straight(&self, from: Point, to: Point) -> Lane {
        Lane::straight(self.turned(from), self.turned(to), LIMIT)
    }

    fn turned(&self, [x, y]: Point) -> Point {
        match self.turns {
            0 => [x, y],
            1 => [y, -x],
            2 => [-x, -y],
            _ => [-y, x],
        }
    }

    /// The bend by which one comes to the roundabout.
    fn entry(&self) -> Lane {
        let x = ASIDE + HEIGHT;
        self.bend([x, BENDS], [x, BENDS - BEND], -FRAC_PI_2)
    }

    /// That by which one leaves it.
    fn exit(&self) -> Lane {
        let x = -ASIDE - HEIGHT;
        self.bend([x, BENDS - BEND], [x, BENDS], TAU / WAVE * (WAVE - BEND) - FRAC_PI_2)
    }

    fn bend(&self, from: Point, to: Point, phase: f64) -> Lane {
        let ends = (self.turned(from), self.turned(to));
        Lane::sine(ends, (HEIGHT, TAU / WAVE, phase), LIMIT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_lane_of_the_roundabout_is_followed_where_it_ends() {
        let network = roundabout();
        assert_eq!((network.lanes.len(), network.roads.len()), (32, 24));
        for road in &network.roads {
            let ends = network.lanes[road.first + road.n - 1];
            let end = ends.point([ends.length, 0.0]);
            for next in network.roads.iter().filter(|next| next.from == road.to) {
                let start = network.lanes[next.first + next.n - 1].point([0.0, 0.0]);
                let apart = (end[0] - start[0]).hypot(end[1] - start[1]);
                // Between the ring and a bend there is more than a car's length of nothing, as in the original.
                let most = if road.n == next.n { 1e-9 } else { 5.6 };
                assert!(apart < most, "{apart} between {road:?} and {next:?}");
            }
        }
    }
}
