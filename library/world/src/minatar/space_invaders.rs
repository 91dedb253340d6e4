//! Space Invaders (Young & Tian, 2019).
//!
//! A cannon at the bottom shoots at aliens above, for a reward of 1 each. The aliens move sideways all together until
//! one is at an edge, and from there a row down and back. Of the aliens whose column is closest to the cannon the
//! lowest shoots back. With few aliens left they move faster. A new wave follows when all are shot, a little faster
//! than the one before. The game is over when a bullet or an alien reaches the cannon, or an alien the bottom.

use super::board::{Board, Cells, LAST};
use super::{Game, Move};
use crate::luck::Luck;

const SHOT_PAUSE: u32 = 5;
const ALIEN_MOVE_PAUSE: u32 = 12;
const ALIEN_SHOT_PAUSE: u32 = 10;
const LEAST_MOVE_PAUSE: u32 = 6;

/// The game.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SpaceInvaders {
    pub(super) ramping: bool,
    /// The column of the cannon.
    pub(super) cannon: i32,
    /// The bullets of the player.
    pub(super) bullets: Cells,
    /// Those of the aliens.
    pub(super) alien_bullets: Cells,
    /// The aliens.
    pub(super) aliens: Cells,
    /// Whether they move to the right.
    pub(super) rightwards: bool,
    /// How many frames there are at most between two of their moves.
    pub(super) move_pause: u32,
    /// How many are left of them.
    pub(super) move_wait: u32,
    /// How many frames are left until an alien shoots.
    pub(super) alien_shot_wait: u32,
    /// How many frames are left until the player may.
    pub(super) shot_wait: u32,
    /// How often it became more difficult.
    pub(super) ramp: u32,
}

/// A wave: four rows of six.
fn wave() -> Cells {
    let rows = (0..4).map(Cells::row).fold(Cells::NONE, Cells::or);
    let columns = (2..8).map(Cells::column).fold(Cells::NONE, Cells::or);
    rows.and(columns)
}

impl SpaceInvaders {
    pub(super) fn new(ramping: bool) -> Self {
        Self {
            ramping,
            cannon: 5,
            bullets: Cells::NONE,
            alien_bullets: Cells::NONE,
            aliens: wave(),
            rightwards: false,
            move_pause: ALIEN_MOVE_PAUSE,
            move_wait: ALIEN_MOVE_PAUSE,
            alien_shot_wait: ALIEN_SHOT_PAUSE,
            shot_wait: 0,
            ramp: 0,
        }
    }

    /// Moves the aliens: whether one is at the bottom, from where there is no way down.
    fn move_aliens(&mut self) -> bool {
        let edge = Cells::column(if self.rightwards { 9 } else { 0 });
        if self.aliens.and(edge).is_empty() {
            self.aliens = if self.rightwards { self.aliens.right() } else { self.aliens.left() };
            return false;
        }
        self.rightwards = !self.rightwards;
        let landed = !self.aliens.and(Cells::row(9)).is_empty();
        self.aliens = self.aliens.rolled_down();
        landed
    }

    /// The alien that shoots: of two columns that are equally close it is that on the left.
    fn shooter(&self) -> Cells {
        let columns =
            (0..10).zip(0..).map(|(column, x)| (x, self.aliens.and(Cells::column(column))));
        let (x, column) = columns
            .filter(|(_, column)| !column.is_empty())
            .min_by_key(|(x, _)| (x - self.cannon).abs())
            .expect("there are always aliens");
        let y = (0..=LAST).rev().find(|y| column.has(x, *y)).expect("one of the column");
        Cells::cell(x, y)
    }
}

impl Game for SpaceInvaders {
    fn n_channels(&self) -> usize {
        6
    }

    fn reset(&mut self, _: &mut Luck) {
        *self = Self::new(self.ramping);
    }

    fn act(&mut self, chosen: Move, _: &mut Luck) -> (f32, bool) {
        let mut over = false;
        if chosen == Move::Fire && self.shot_wait == 0 {
            self.bullets = self.bullets.or(Cells::cell(self.cannon, LAST));
            self.shot_wait = SHOT_PAUSE;
        }
        self.cannon = (self.cannon + chosen.across()).clamp(0, LAST);
        let cannon = Cells::cell(self.cannon, LAST);

        self.bullets = self.bullets.up();
        self.alien_bullets = self.alien_bullets.down();
        over |= !self.alien_bullets.and(cannon).is_empty();
        over |= !self.aliens.and(cannon).is_empty();
        if self.move_wait == 0 {
            self.move_wait = self.move_pause.min(self.aliens.count());
            over |= self.move_aliens();
            over |= !self.aliens.and(cannon).is_empty();
        }
        if self.alien_shot_wait == 0 {
            self.alien_shot_wait = ALIEN_SHOT_PAUSE;
            self.alien_bullets = self.alien_bullets.or(self.shooter());
        }

        let shot = self.aliens.and(self.bullets);
        self.aliens = self.aliens.without(shot);
        self.bullets = self.bullets.without(shot);

        self.shot_wait = self.shot_wait.saturating_sub(1);
        self.move_wait -= 1;
        self.alien_shot_wait -= 1;
        if self.aliens.is_empty() {
            if self.ramping && self.move_pause > LEAST_MOVE_PAUSE {
                self.move_pause -= 1;
                self.ramp += 1;
            }
            self.aliens = wave();
        }
        #[expect(clippy::cast_precision_loss, reason = "there are at most 24 aliens")]
        let reward = shot.count() as f32;
        (reward, over)
    }

    fn draw(&self, board: &mut Board<'_>) {
        board.mark(0, self.cannon, LAST);
        board.mark_all(1, self.aliens);
        board.mark_all(if self.rightwards { 3 } else { 2 }, self.aliens);
        board.mark_all(4, self.bullets);
        board.mark_all(5, self.alien_bullets);
    }

    fn ramp(&self) -> Option<u32> {
        Some(self.ramp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_game_is_over_when_an_alien_cannot_go_down() {
        let landed = |y| {
            let aliens = Cells::cell(0, y);
            let mut game = SpaceInvaders { aliens, move_wait: 0, ..SpaceInvaders::new(true) };
            game.act(Move::Stay, &mut Luck::numpy(0)).1
        };
        assert_eq!([8, 9].map(landed), [false, true]);
    }

    #[test]
    fn each_wave_is_faster_up_to_a_limit() {
        let pauses = |ramping| {
            let mut game = SpaceInvaders::new(ramping);
            let pauses = [(); 8].map(|()| {
                game.aliens = Cells::cell(5, 5);
                game.bullets = Cells::cell(5, 6);
                assert_eq!(game.act(Move::Stay, &mut Luck::numpy(0)), (1.0, false));
                assert_eq!(game.aliens, wave());
                game.move_pause
            });
            (pauses, game.ramp)
        };
        assert_eq!(pauses(true), ([11, 10, 9, 8, 7, 6, 6, 6], 6));
        assert_eq!(pauses(false), ([12; 8], 0));
    }
}
