//! Cars on roads, frame by frame.

use std::cell::OnceCell;

use super::collision::Contact;
use super::lane::Point;
use super::network::Network;
use super::release::Release;
use super::vehicle::{Pilot, Vehicle};

/// All cars, and the roads that they drive on. The first is the agent's.
#[derive(Clone, Debug)]
pub(super) struct Traffic {
    pub(super) network: Network,
    pub(super) vehicles: Vec<Vehicle>,
    pub(super) release: &'static Release,
    /// Where the cars are, one after the other, to be looked through.
    places: Vec<Point>,
    /// Those on each lane, once somebody asked.
    on: Vec<OnceCell<Vec<(f64, usize)>>>,
}

impl Traffic {
    pub(super) fn new(network: Network, release: &'static Release) -> Self {
        let on = vec![OnceCell::new(); network.lanes.len()];
        Self { network, vehicles: Vec::new(), release, places: Vec::new(), on }
    }

    /// Goes on by a fifteenth of a second: all decide in their order, each knowing which lanes those before want, then
    /// all move, then it is seen who ran into whom.
    pub(super) fn frame(&mut self) {
        self.decide();
        self.go();
    }

    /// Lets all pilots decide.
    pub(super) fn decide(&mut self) {
        self.find_places();
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
        self.find_places();
        for i in 0..self.vehicles.len() {
            let near = Contact::near(&self.vehicles[i], self.release);
            let [x, y] = self.places[i];
            for j in i + 1..self.vehicles.len() {
                let at = self.places[j];
                if (at[0] - x).abs() <= near && (at[1] - y).abs() <= near {
                    self.touch(i, j);
                }
            }
        }
    }

    /// Lets two cars run into each other, if they do.
    fn touch(&mut self, i: usize, j: usize) {
        let Contact { now, apart } =
            Contact::of(&self.vehicles[i], &self.vehicles[j], self.release);
        if let Some(apart) = apart {
            self.vehicles[i].impact = Some(apart.map(|x| x / 2.0));
            self.vehicles[j].impact = Some(apart.map(|x| -x / 2.0));
        }
        if now {
            self.vehicles[i].crashed = true;
            self.vehicles[j].crashed = true;
        }
    }

    fn find_places(&mut self) {
        self.on.iter_mut().for_each(|lane| drop(lane.take()));
        self.places.clear();
        self.places.extend(self.vehicles.iter().map(|car| car.at));
    }

    /// The cars in front of car `i` and behind it as if it were on a lane, while all decide. Of several at one place the
    /// last is in front, and the first behind.
    pub(super) fn neighbours(&self, i: usize, lane: usize) -> (Option<usize>, Option<usize>) {
        let own = self.network.lanes[lane].local(self.places[i])[0];
        let (mut front, mut rear) = (None, None);
        let (mut nearest, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
        for &(along, j) in self.on(lane) {
            if own <= along && along <= nearest && j != i {
                (front, nearest) = (Some(j), along);
            }
            if along < own && along > last {
                (rear, last) = (Some(j), along);
            }
        }
        (front, rear)
    }

    /// The cars on a lane or no farther than 1 m beside it, and how far along it each is.
    fn on(&self, lane: usize) -> &[(f64, usize)] {
        self.on[lane].get_or_init(|| {
            let course = &self.network.lanes[lane];
            let places = self.places.iter().map(|at| course.local(*at)).zip(0..);
            places
                .filter(|(place, _)| course.has(*place, 1.0))
                .map(|(place, j)| (place[0], j))
                .collect()
        })
    }
}
