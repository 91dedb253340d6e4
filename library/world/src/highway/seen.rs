//! What a car sees of the others.

use super::lane::norm;
use super::traffic::Traffic;

/// How far behind a car is still seen, in metres.
const BEHIND: f64 = 10.0;

/// How a car sees.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sight {
    /// How many others.
    pub(super) others: usize,
    /// Whether others are seen where they are, and not from where the car is.
    pub(super) absolute: bool,
    /// What is seen as 1 of `x`, `y` and their speeds; what is more, is seen as 1. Without, all is seen as it is.
    pub(super) scale: Option<[f64; 4]>,
}

/// `x`, `y` and their speeds.
pub(super) type Seen = [f64; 4];

impl Sight {
    /// The cars that car `i` sees, nearest first along the lane that it is on. Those far away or well behind are not
    /// seen.
    pub(super) fn others(&self, traffic: &Traffic, i: usize) -> Vec<usize> {
        let (car, lane) = (&traffic.vehicles[i], &traffic.network.lanes[traffic.vehicles[i].lane]);
        let own = lane.local(car.at)[0];
        let mut nearest: Vec<(f64, usize)> = Vec::with_capacity(self.others + 1);
        for (j, other) in traffic.vehicles.iter().enumerate() {
            let apart = [0, 1].map(|d| other.at[d] - car.at[d]);
            if j == i || norm(apart) >= traffic.release.sight {
                continue;
            }
            let ahead = lane.local(other.at)[0] - own;
            let place = nearest.partition_point(|(distance, _)| *distance <= ahead.abs());
            if ahead > -BEHIND && place < self.others {
                nearest.insert(place, (ahead.abs(), j));
                nearest.truncate(self.others);
            }
        }
        nearest.into_iter().map(|(_, j)| j).collect()
    }

    /// What car `i` sees: itself, then others in this order, then zeros for those that there are not.
    pub(super) fn rows<'a>(
        &'a self,
        traffic: &'a Traffic,
        i: usize,
        others: &'a [usize],
    ) -> impl Iterator<Item = Seen> + 'a {
        let state = |j: usize| {
            let car = &traffic.vehicles[j];
            let ([x, y], [vx, vy]) = (car.at, car.velocity());
            [x, y, vx, vy]
        };
        let own = state(i);
        let from = if self.absolute { [0.0; 4] } else { own };
        let relative = move |j: &usize| {
            let other = state(*j);
            [0, 1, 2, 3].map(|d| other[d] - from[d])
        };
        let missing = std::iter::repeat_n([0.0; 4], self.others.saturating_sub(others.len()));
        let rows = std::iter::once(own).chain(others.iter().map(relative));
        rows.map(|row| self.scaled(row)).chain(missing)
    }

    fn scaled(&self, row: Seen) -> Seen {
        let Some(scale) = self.scale else { return row };
        [0, 1, 2, 3].map(|d| (row[d] / scale[d]).clamp(-1.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::highway::release::Release;
    use crate::highway::roads::highway;
    use crate::highway::vehicle::{Pilot, Vehicle};

    #[test]
    fn the_nearest_are_seen_and_who_is_behind_is_not() {
        let mut traffic = Traffic::new(highway(3, &Release::V1_1), &Release::V1_1);
        for (x, y, speed) in [
            (200.0, 4.0, 25.0),
            (230.0, 0.0, 20.0),
            (192.0, 8.0, 30.0),
            (189.9, 0.0, 30.0),
            (379.0, 4.0, 15.0),
            (381.0, 4.0, 15.0),
        ] {
            let car = Vehicle::new(&traffic.network, [x, y], 0.0, speed, Pilot::Held);
            traffic.vehicles.push(car);
        }
        let mut sight = Sight { others: 4, absolute: false, scale: None };
        let others = sight.others(&traffic, 0);
        assert_eq!(others, [2, 1, 4]);
        let rows: Vec<Seen> = sight.rows(&traffic, 0, &others).collect();
        let expected = [
            [200.0, 4.0, 25.0, 0.0],
            [-8.0, 4.0, 5.0, 0.0],
            [30.0, -4.0, -5.0, 0.0],
            [179.0, 0.0, -10.0, 0.0],
            [0.0; 4],
        ];
        assert_eq!(rows, expected);
        sight.scale = Some([100.0, 8.0, 50.0, 50.0]);
        sight.absolute = true;
        let rows: Vec<Seen> = sight.rows(&traffic, 0, &others[..1]).collect();
        assert_eq!(rows[..3], [[1.0, 0.5, 0.5, 0.0], [1.0, 1.0, 0.6, 0.0], [0.0; 4]]);
        sight.others = 1;
        assert_eq!(sight.others(&traffic, 0), [2]);
    }
}
