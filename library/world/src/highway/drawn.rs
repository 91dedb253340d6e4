//! Traffic as a picture.

use ivx_data::{Outline, Picture, Shape};
use ivx_math::moments::real;

use super::lane::{Course, Lane, Point, WIDTH, norm};
use super::network::Road;
use super::traffic::Traffic;
use super::vehicle::{BREADTH, LENGTH};

/// What is beside roads, roads, and the lines on them.
const MEADOW: [u8; 3] = [234, 240, 228];
const ROAD: [u8; 3] = [150, 150, 150];
const LINE: [u8; 3] = [255, 255, 255];
/// The agent's car and those of others, as highway-env has them: green and blue, which readers tell apart who see less of
/// colours (Okabe and Ito).
const AGENT: [u8; 3] = [0, 158, 115];
const OTHERS: [u8; 3] = [0, 64, 160];

/// How long the lines between lanes are, and from the start of one to that of the next, in metres.
const DASH: f64 = 3.0;
const APART: f64 = 7.5;
/// By how much roads are longer than their lanes, so that those which follow each other leave no gap.
const LAP: f64 = 0.5;

/// Roads and cars as they stand in a window: the agent's car lies over others.
pub(super) fn picture(traffic: &Traffic, window: Window) -> Picture {
    let network = &traffic.network;
    let lanes = |road: &Road| &network.lanes[road.first..][..road.n];
    let mut shapes = vec![window.meadow()];
    shapes.extend(network.roads.iter().map(|road| window.road(lanes(road))));
    let between = network.roads.iter().flat_map(|road| &lanes(road)[..road.n - 1]);
    shapes.extend(between.flat_map(|lane| window.dashes(lane)));
    let alone =
        network.roads.iter().filter(|road| road.n == 1).map(|road| &network.lanes[road.first]);
    shapes.extend(alone.filter(|lane| is_straight(lane)).map(|lane| window.left(lane)));
    for (i, car) in traffic.vehicles.iter().enumerate().rev() {
        let outline = Outline::rectangle(window.place(car.at), [LENGTH, BREADTH], car.heading);
        shapes.push(Shape { outline, colour: if i == 0 { AGENT } else { OTHERS } });
    }
    let is_near = |shape: &Shape| window.shows(&shape.outline);
    shapes.retain(is_near);
    Picture { size: window.size, shapes }
}

fn is_straight(lane: &Lane) -> bool {
    matches!(lane.course, Course::Straight(_))
}

/// What is shown: from the least `x` and `y` on, so wide and so high, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window {
    pub(super) low: Point,
    pub(super) size: [f64; 2],
}

impl Window {
    fn place(&self, at: Point) -> Point {
        [at[0] - self.low[0], at[1] - self.low[1]]
    }

    /// Whether something of a shape may be seen: the least rectangle about it reaches in.
    fn shows(&self, outline: &Outline) -> bool {
        let (Outline::Polygon(places) | Outline::Line(places, _)) = outline else { return true };
        (0..2).all(|d| {
            let of = places.iter().map(|place| place[d]);
            of.clone().any(|x| x > 0.0) && of.clone().any(|x| x < self.size[d])
        })
    }

    fn meadow(&self) -> Shape {
        let middle = self.size.map(|side| side / 2.0);
        Shape { outline: Outline::rectangle(middle, self.size, 0.0), colour: MEADOW }
    }

    /// From where to where along a lane it may be in sight.
    fn sight(&self, lane: &Lane) -> (f64, f64) {
        let (least, most) = (-LAP, lane.length + LAP);
        if !is_straight(lane) {
            return (least, most);
        }
        let middle = [0, 1].map(|d| self.low[d] + self.size[d] / 2.0);
        let (along, reach) = (lane.local(middle)[0], norm(self.size) / 2.0 + LAP);
        ((along - reach).clamp(least, most), (along + reach).clamp(least, most))
    }

    /// So far across a lane from one place along it to another.
    fn course(&self, lane: &Lane, (from, to): (f64, f64), across: f64) -> Vec<Point> {
        let steps = match lane.course {
            Course::Straight(_) => 1,
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a metre each"
            )]
            _ => (to - from).ceil() as usize,
        };
        let along = (0..=steps).map(|i| from + (to - from) * real(i) / real(steps));
        along.map(|along| self.place(lane.point([along, across]))).collect()
    }

    /// A road: from the left of its first lane to the right of its last.
    fn road(&self, lanes: &[Lane]) -> Shape {
        let (left, right) = (&lanes[0], &lanes[lanes.len() - 1]);
        let mut corners = self.course(left, self.sight(left), -WIDTH / 2.0);
        corners.extend(self.course(right, self.sight(right), WIDTH / 2.0).into_iter().rev());
        Shape { outline: Outline::Polygon(corners), colour: ROAD }
    }

    /// The line to the left of a lane, beyond which others drive the other way.
    fn left(&self, lane: &Lane) -> Shape {
        let places = self.course(lane, self.sight(lane), -WIDTH / 2.0);
        Shape { outline: Outline::Line(places, 0.3), colour: LINE }
    }

    /// The broken line to the right of a lane, which begins where the lane does.
    fn dashes(&self, lane: &Lane) -> Vec<Shape> {
        let (from, to) = self.sight(lane);
        let mut dashes = Vec::new();
        let mut start = (from.max(0.0) / APART).floor() * APART;
        while start < to.min(lane.length) {
            let ends = (start, (start + DASH).min(lane.length));
            let outline = Outline::Line(self.course(lane, ends, WIDTH / 2.0), 0.2);
            dashes.push(Shape { outline, colour: LINE });
            start += APART;
        }
        dashes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::highway::release::Release;
    use crate::highway::roads::{highway, roundabout};
    use crate::highway::vehicle::{Pilot, Vehicle};

    fn traffic(network: super::super::network::Network, cars: &[(Point, f64)]) -> Traffic {
        let mut traffic = Traffic::new(network, &Release::V1_1);
        for (at, heading) in cars {
            let car = Vehicle::new(&traffic.network, *at, *heading, 20.0, Pilot::Held);
            traffic.vehicles.push(car);
        }
        traffic
    }

    fn of(picture: &Picture, colour: [u8; 3]) -> Vec<&Outline> {
        let shapes = picture.shapes.iter().filter(|shape| shape.colour == colour);
        shapes.map(|shape| &shape.outline).collect()
    }

    #[test]
    fn cars_in_sight_lie_on_the_road() {
        let cars =
            [([200.0, 4.0], 0.0), ([220.0, 0.5], 0.1), ([283.0, 8.0], 0.0), ([177.6, 8.0], 0.0)];
        let traffic = traffic(highway(3, &Release::V1_1), &cars);
        let picture = picture(&traffic, Window { low: [180.0, -4.0], size: [100.0, 16.0] });
        assert_eq!(picture.size, [100.0, 16.0]);
        // The third is out of sight, and of the fourth the bumper is seen.
        assert_eq!(of(&picture, AGENT), [&Outline::rectangle([20.0, 8.0], [5.0, 2.0], 0.0)]);
        let others = [([-2.4, 12.0], 0.0), ([40.0, 4.5], 0.1)];
        let others = others.map(|(at, turned)| match Outline::rectangle(at, [5.0, 2.0], turned) {
            Outline::Polygon(corners) => corners,
            other => panic!("{other:?}"),
        });
        for (found, expected) in of(&picture, OTHERS).iter().zip(&others) {
            let Outline::Polygon(found) = found else { panic!("a polygon") };
            let near = |(a, b): (&Point, &Point)| norm([a[0] - b[0], a[1] - b[1]]) < 1e-9;
            assert!(found.iter().zip(expected).all(near), "{found:?}");
        }
        assert_eq!(of(&picture, OTHERS).len(), 2);
        // Lanes are 4 m wide, and the first is about y = 0, 4 m from the top.
        let [Outline::Polygon(road)] = of(&picture, ROAD)[..] else { panic!("one road") };
        let side = |y| road.iter().filter(move |corner| corner[1] == y).map(|corner| corner[0]);
        for y in [2.0, 14.0] {
            assert!(side(y).any(|x| x < 0.0) && side(y).any(|x| x > 100.0), "{road:?}");
        }
        // Every 7.5 m, from 180 on.
        let dashes = of(&picture, LINE);
        let first = Outline::Line(vec![[0.0, 6.0], [3.0, 6.0]], 0.2);
        assert!(dashes.contains(&&first) && dashes.len() == 2 * 14, "{dashes:?}");
        // The agent's car is on top.
        assert_eq!(picture.shapes.last().unwrap().colour, AGENT);
    }

    #[test]
    fn a_ring_is_round_and_far_arms_are_left_out() {
        let traffic = traffic(roundabout(), &[([2.0, 45.0], -1.5)]);
        let all = picture(&traffic, Window { low: [-60.0; 2], size: [120.0; 2] });
        assert_eq!((of(&all, ROAD).len(), of(&all, AGENT).len()), (24, 1));
        for ring in of(&all, ROAD).iter().take(1) {
            let Outline::Polygon(corners) = ring else { panic!("a polygon") };
            let radii = corners.iter().map(|[x, y]| norm([x - 60.0, y - 60.0]));
            assert!(radii.clone().all(|r| (r - 18.0).abs() < 1e-9 || (r - 26.0).abs() < 1e-9));
            assert!(corners.len() > 20);
        }
        // In each arm both lanes have the line between them.
        let lines =
            of(&all, LINE).iter().filter(|line| matches!(line, Outline::Line(_, 0.3))).count();
        assert_eq!(lines, 8);
        // To the south of it there is one arm, of two roads.
        let south = picture(&traffic, Window { low: [-20.0, 60.0], size: [40.0; 2] });
        assert_eq!((of(&south, ROAD).len(), of(&south, AGENT).len()), (2, 0));
    }
}
