//! Freeway (Young & Tian, 2019).
//!
//! A chicken at the bottom crosses eight lanes, for a reward of 1 whenever it reaches the top, from where it starts
//! again. It is slow, and moves in every third frame at most. A car that hits it sends it back to the bottom.
//!
//! Cars leave on one side and come back on the other; each has a direction and one of five speeds, both of which
//! change whenever the chicken has crossed. The trail of a car tells its direction, and the channel of the trail its
//! speed. The game is over with the frame that follows 2,500 others.

use super::board::{Board, LAST, on_board};
use super::{Game, Move};
use crate::luck::Luck;

const CHICKEN: i32 = 4;
const REST: u32 = 3;
const FRAMES: u32 = 2500;
const LANES: usize = 8;

/// The game.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Freeway {
    /// One in each row, from the second.
    pub(super) cars: [Car; LANES],
    /// The row of the chicken.
    pub(super) chicken: i32,
    /// How many frames it rests.
    pub(super) rest: u32,
    /// How many frames are left.
    pub(super) left: u32,
}

/// A car.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Car {
    /// Its column.
    pub(super) x: i32,
    /// How many frames it waits.
    pub(super) wait: u32,
    /// How many frames it waits between moves.
    pub(super) pause: u32,
    /// -1 to the left, 1 to the right.
    pub(super) heading: i32,
}

impl Freeway {
    pub(super) fn new() -> Self {
        Self { cars: [Car::default(); LANES], chicken: LAST, rest: REST, left: FRAMES }
    }

    fn change_speeds(&mut self, luck: &mut Luck) {
        for car in &mut self.cars {
            car.pause = 1 + luck.below(5);
            car.wait = car.pause;
        }
        for car in &mut self.cars {
            car.heading = if luck.unit() < 0.5 { -1 } else { 1 };
        }
    }
}

impl Game for Freeway {
    fn n_channels(&self) -> usize {
        7
    }

    fn reset(&mut self, luck: &mut Luck) {
        *self = Self::new();
        self.change_speeds(luck);
    }

    fn act(&mut self, chosen: Move, luck: &mut Luck) -> (f32, bool) {
        let mut reward = 0.0;
        let step = chosen.down();
        if step != 0 && self.rest == 0 {
            self.rest = REST;
            self.chicken = (self.chicken + step).clamp(0, LAST);
        }
        if self.chicken == 0 {
            reward = 1.0;
            self.change_speeds(luck);
            self.chicken = LAST;
        }
        for (car, row) in self.cars.iter_mut().zip(1..) {
            if (car.x, row) == (CHICKEN, self.chicken) {
                self.chicken = LAST;
            }
            if car.wait > 0 {
                car.wait -= 1;
                continue;
            }
            car.wait = car.pause;
            car.x += car.heading;
            if !on_board(car.x) {
                car.x = LAST - LAST * i32::from(car.heading > 0);
            }
            if (car.x, row) == (CHICKEN, self.chicken) {
                self.chicken = LAST;
            }
        }
        self.rest = self.rest.saturating_sub(1);
        let over = self.left == 0;
        self.left = self.left.saturating_sub(1);
        (reward, over)
    }

    fn draw(&self, board: &mut Board<'_>) {
        board.mark(0, CHICKEN, self.chicken);
        for (car, row) in self.cars.iter().zip(1..) {
            board.mark(1, car.x, row);
            let behind = (car.x - car.heading).rem_euclid(LAST + 1);
            board.mark(1 + car.pause as usize, behind, row);
        }
    }

    fn ramp(&self) -> Option<u32> {
        None
    }
}
