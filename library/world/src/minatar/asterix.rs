//! Asterix (Young & Tian, 2019).
//!
//! The player moves freely in the middle eight rows. Enemies and treasures enter on either side, one in a row at a
//! time, and cross the board. A treasure that meets the player pays 1; an enemy ends the game. With time both become
//! faster and more frequent.

use super::board::{Board, LAST, on_board};
use super::{Game, Move};
use crate::luck::Luck;

const SPAWN_PAUSE: u32 = 10;
const MOVE_PAUSE: u32 = 5;
const RAMP_PAUSE: i32 = 100;
const LANES: usize = 8;

/// The game.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Asterix {
    pub(super) ramping: bool,
    /// The column and row of the player.
    pub(super) player: (i32, i32),
    /// At most one in each row, from the second.
    pub(super) lanes: [Option<Crosser>; LANES],
    /// How many frames there are between two that enter.
    pub(super) spawn_pause: u32,
    /// How many are left of them.
    pub(super) spawn_wait: u32,
    /// How many frames there are between two moves.
    pub(super) move_pause: u32,
    /// How many are left of them.
    pub(super) move_wait: u32,
    /// How many frames are left until it becomes more difficult.
    pub(super) ramp_wait: i32,
    /// How often it did.
    pub(super) ramp: u32,
}

/// Who crosses the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crosser {
    /// The column.
    pub(super) x: i32,
    /// -1 to the left, 1 to the right.
    pub(super) heading: i32,
    /// Whether it is a treasure, and no enemy.
    pub(super) treasure: bool,
}

impl Asterix {
    pub(super) fn new(ramping: bool) -> Self {
        Self {
            ramping,
            player: (5, 5),
            lanes: [None; LANES],
            spawn_pause: SPAWN_PAUSE,
            spawn_wait: SPAWN_PAUSE,
            move_pause: MOVE_PAUSE,
            move_wait: MOVE_PAUSE,
            ramp_wait: RAMP_PAUSE,
            ramp: 0,
        }
    }

    /// Lets one enter in a row that is free, if there is one.
    fn spawn(&mut self, luck: &mut Luck) {
        let heading = if luck.unit() < 0.5 { 1 } else { -1 };
        let treasure = luck.unit() < 1.0 / 3.0;
        let n_free = self.lanes.iter().filter(|lane| lane.is_none()).count();
        if n_free == 0 {
            return;
        }
        let place = luck.below(u32::try_from(n_free).expect("at most eight"));
        let mut free = self.lanes.iter_mut().filter(|lane| lane.is_none());
        let lane = free.nth(place as usize).expect("one of those that are free");
        *lane = Some(Crosser { x: if heading > 0 { 0 } else { LAST }, heading, treasure });
    }

    fn become_harder(&mut self) {
        if self.spawn_pause == 1 && self.move_pause == 1 {
            return;
        }
        if self.ramp_wait >= 0 {
            self.ramp_wait -= 1;
            return;
        }
        if self.move_pause > 1 && self.ramp % 2 == 1 {
            self.move_pause -= 1;
        }
        if self.spawn_pause > 1 {
            self.spawn_pause -= 1;
        }
        self.ramp += 1;
        self.ramp_wait = RAMP_PAUSE;
    }
}

impl Game for Asterix {
    fn n_channels(&self) -> usize {
        4
    }

    fn reset(&mut self, _: &mut Luck) {
        *self = Self::new(self.ramping);
    }

    fn act(&mut self, chosen: Move, luck: &mut Luck) -> (f32, bool) {
        let (mut reward, mut over) = (0.0, false);
        if self.spawn_wait == 0 {
            self.spawn(luck);
            self.spawn_wait = self.spawn_pause;
        }
        self.player.0 = (self.player.0 + chosen.across()).clamp(0, LAST);
        self.player.1 = (self.player.1 + chosen.down()).clamp(1, LAST - 1);

        let mut meet = |lane: &mut Option<Crosser>, row| {
            if let Some(Crosser { x, treasure, .. }) = *lane
                && (x, row) == self.player
            {
                if treasure {
                    *lane = None;
                    reward += 1.0;
                } else {
                    over = true;
                }
            }
        };
        for (lane, row) in self.lanes.iter_mut().zip(1..) {
            meet(lane, row);
        }
        if self.move_wait == 0 {
            self.move_wait = self.move_pause;
            for (lane, row) in self.lanes.iter_mut().zip(1..) {
                if let Some(crosser) = lane {
                    crosser.x += crosser.heading;
                    if !on_board(crosser.x) {
                        *lane = None;
                    }
                }
                meet(lane, row);
            }
        }
        self.spawn_wait -= 1;
        self.move_wait -= 1;
        if self.ramping {
            self.become_harder();
        }
        (reward, over)
    }

    fn draw(&self, board: &mut Board<'_>) {
        board.mark(0, self.player.0, self.player.1);
        for (lane, row) in self.lanes.iter().zip(1..) {
            if let Some(crosser) = lane {
                board.mark(if crosser.treasure { 3 } else { 1 }, crosser.x, row);
                board.mark(2, crosser.x - crosser.heading, row);
            }
        }
    }

    fn ramp(&self) -> Option<u32> {
        Some(self.ramp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_enters_if_all_rows_are_taken() {
        let lane = Some(Crosser { x: 3, heading: 1, treasure: false });
        let mut game = Asterix { lanes: [lane; LANES], spawn_wait: 0, ..Asterix::new(true) };
        let (mut luck, mut same) = (Luck::numpy(0), Luck::numpy(0));
        game.act(Move::Stay, &mut luck);
        assert_eq!((game.lanes, game.spawn_wait), ([lane; LANES], SPAWN_PAUSE - 1));
        // The side and the kind were drawn all the same.
        same.unit();
        same.unit();
        assert_eq!(luck.bits(), same.bits());
    }

    #[test]
    fn it_becomes_harder_until_somebody_enters_and_all_move_in_each_frame() {
        let mut game = Asterix::new(true);
        let mut pauses = vec![];
        for _ in 0..2_000 {
            game.become_harder();
            pauses.push((game.spawn_pause, game.move_pause));
        }
        pauses.dedup();
        let expected =
            [(10, 5), (9, 5), (8, 4), (7, 4), (6, 3), (5, 3), (4, 2), (3, 2), (2, 1), (1, 1)];
        assert_eq!((pauses, game.ramp), (expected.to_vec(), 9));
    }
}
