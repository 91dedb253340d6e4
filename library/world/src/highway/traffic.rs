//! Cars on roads, frame by frame.

use super::collision::Contact;
use super::network::Network;
use super::release::Release;
use super::vehicle::{Pilot, Vehicle};

/// All cars, and the roads that they drive on. The first is the agent's.
#[derive(Clone, Debug)]
pub(super) struct Traffic {
    pub(super) network: Network,
    pub(super) vehicles: Vec<Vehicle>,
    pub(super) release: &'static Release,
}

impl Traffic {
    pub(super) fn new(network: Network, release: &'static Release) -> Self {
        Self { network, vehicles: Vec::new(), release }
    }

    /// Goes on by a fifteenth of a second: all decide in their order, each knowing which lanes those before want, then
    /// all move, then it is seen who ran into whom.
    pub(super) fn frame(&mut self) {
        self.decide();
        self.go();
    }

    /// Lets all pilots decide.
    pub(super) fn decide(&mut self) {
        for i in 0..self.vehicles.len() {
            match self.vehicles[i].pilot {
                Pilot::Driver(_) => self.drive(i),
                Pilot::Cruise(_) => {
                    let car = &mut self.vehicles[i];
                    car.follow_road(&self.network);
                    car.steering = car.steering_to_lane(&self.network, self.release);
                    car.acceleration = car.towards_speed();
                }
                Pilot::Held => {}
            }
        }
    }

    /// Moves all cars.
    pub(super) fn go(&mut self) {
        for car in &mut self.vehicles {
            car.step(&self.network);
        }
        for i in 1..self.vehicles.len() {
            let (before, [one, others @ ..]) = self.vehicles.split_at_mut(i - 1) else { continue };
            debug_assert_eq!(before.len(), i - 1, "all but those after");
            for other in others {
                let Contact { now, apart } = Contact::of(one, other, self.release);
                if let Some(apart) = apart {
                    one.impact = Some(apart.map(|x| x / 2.0));
                    other.impact = Some(apart.map(|x| -x / 2.0));
                }
                if now {
                    (one.crashed, other.crashed) = (true, true);
                }
            }
        }
    }

    /// The cars in front of car `i` and behind it as if it were on a lane. Of several at one place the last is in
    /// front, and the first behind.
    pub(super) fn neighbours(&self, i: usize, lane: usize) -> (Option<usize>, Option<usize>) {
        let lane = &self.network.lanes[lane];
        let own = lane.local(self.vehicles[i].at)[0];
        let (mut front, mut rear) = (None, None);
        let (mut nearest, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
        for (j, car) in self.vehicles.iter().enumerate() {
            let place = lane.local(car.at);
            if j == i || !lane.has(place, 1.0) {
                continue;
            }
            let along = place[0];
            if own <= along && along <= nearest {
                (front, nearest) = (Some(j), along);
            }
            if along < own && along > last {
                (rear, last) = (Some(j), along);
            }
        }
        (front, rear)
    }
}
