//! Breakout (Young & Tian, 2019).
//!
//! A paddle at the bottom keeps a ball in play that breaks three rows of bricks at the top, for a reward of 1 each.
//! The ball moves along diagonals, comes back from walls and bricks, and is lost below the paddle, which ends the
//! game. A paddle that is below the ball sends it up; one that is only where the ball goes sends it back where it came
//! from. A ball that broke a brick flies through others until it is in a free cell. When it comes down after the last
//! one there are new ones.

use super::board::{Board, Cells, LAST, on_board};
use super::{Game, Move};
use crate::luck::Luck;

const BRICKS: Cells = Cells::row(1).or(Cells::row(2)).or(Cells::row(3));

/// The game.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Breakout {
    /// The column of the paddle.
    pub(super) paddle: i32,
    /// The column and row of the ball.
    pub(super) ball: (i32, i32),
    /// Where it was before.
    pub(super) trail: (i32, i32),
    /// Where it moves to: by -1 or 1 each.
    pub(super) heading: (i32, i32),
    /// The bricks that are left.
    pub(super) bricks: Cells,
    /// Whether the ball is among bricks since it broke one.
    pub(super) struck: bool,
}

impl Breakout {
    pub(super) fn new() -> Self {
        Self {
            paddle: 4,
            ball: (0, 3),
            trail: (0, 3),
            heading: (1, 1),
            bricks: BRICKS,
            struck: false,
        }
    }
}

impl Game for Breakout {
    fn n_channels(&self) -> usize {
        4
    }

    fn reset(&mut self, luck: &mut Luck) {
        *self = Self::new();
        if luck.below(2) == 1 {
            self.ball.0 = LAST;
            self.heading.0 = -1;
        }
        self.trail = self.ball;
    }

    fn act(&mut self, chosen: Move, _: &mut Luck) -> (f32, bool) {
        self.paddle = (self.paddle + chosen.across()).clamp(0, LAST);
        self.trail = self.ball;
        let (before, above) = self.ball;
        let (mut x, mut y) = (before + self.heading.0, above + self.heading.1);
        let (mut reward, mut over, mut struck) = (0.0, false, false);
        if !on_board(x) {
            x = before;
            self.heading.0 *= -1;
        }
        if y < 0 {
            y = 0;
            self.heading.1 = 1;
        } else if self.bricks.has(x, y) {
            struck = true;
            if !self.struck {
                reward = 1.0;
                self.bricks = self.bricks.without(Cells::cell(x, y));
                y = above;
                self.heading.1 *= -1;
            }
        } else if y == LAST {
            if self.bricks.is_empty() {
                self.bricks = BRICKS;
            }
            if before == self.paddle || x == self.paddle {
                y = above;
                self.heading.1 = -1;
                if before != self.paddle {
                    self.heading.0 *= -1;
                }
            } else {
                over = true;
            }
        }
        self.struck = struck;
        self.ball = (x, y);
        (reward, over)
    }

    fn draw(&self, board: &mut Board<'_>) {
        board.mark(0, self.paddle, LAST);
        board.mark(1, self.ball.0, self.ball.1);
        board.mark(2, self.trail.0, self.trail.1);
        board.mark_all(3, self.bricks);
    }

    fn ramp(&self) -> Option<u32> {
        None
    }
}
