//! The five games of `MinAtar` (Young & Tian, 2019, "`MinAtar`: An Atari-Inspired Testbed for Thorough and
//! Reproducible Reinforcement Learning Experiments"): games of the Atari 2600 made small, on a board of ten by ten
//! cells with a channel of bits for each kind of object.
//!
//! They are written from the published rules. What the rules leave open, such as what comes first within a step, was
//! found out from recorded games: with luck of `NumPy` (see [`Luck::numpy`]) each step is that of the original, bit
//! for bit.

mod asterix;
mod board;
mod breakout;
mod freeway;
mod seaquest;
mod space_invaders;
#[cfg(test)]
mod transitions;

use ivx_data::{Field, Kind, Misfit};
use ivx_op::{Facts, OpError, Wrong, declare};

use asterix::Asterix;
use board::{Board, SIDE};
use breakout::Breakout;
use freeway::Freeway;
use seaquest::Seaquest;
use space_invaders::SpaceInvaders;

use crate::env::{Env, Row, Spec, World};
use crate::luck::Luck;
use ivx_data::{Act, Actions, End};

declare! {
    /// A game of `MinAtar` (Young & Tian, 2019): `asterix`, `breakout`, `freeway`, `seaquest` or `space_invaders`, on
    /// a board of ten by ten cells.
    ///
    /// What is seen is the `grid`, channel by channel. All games have the same six actions, of which some do nothing
    /// in some.
    pub struct Minatar = "minatar" @ 1 {
        /// Which one.
        game: String;
        /// How probably the action before is taken once more, whatever is chosen.
        sticky: f64 = 0.1, in 0.0..=1.0;
        /// Whether a game becomes more difficult with time: all but Breakout and Freeway can.
        ramping: bool = true;
        /// After how many steps an episode is cut off, since a player who never loses would play on forever.
        limit: u64 = 10_000, in 1.0..;
    }
    rule known_game;
}

fn known_game(facts: &Facts<'_>) -> Result<(), Wrong> {
    match facts.arg::<String>("game") {
        Some(game) if Play::of(&game, 0.0, true).is_none() => {
            Err(Wrong { arg: "game", message: unknown(&game), help: HELP.to_owned() })
        }
        _ => Ok(()),
    }
}

fn unknown(game: &str) -> String {
    format!("no game of MinAtar is called {game:?}")
}

const HELP: &str =
    "say `\"asterix\"`, `\"breakout\"`, `\"freeway\"`, `\"seaquest\"` or `\"space_invaders\"`";

impl Minatar {
    fn play(&self) -> Option<Play> {
        Play::of(&self.game, self.sticky, self.ramping)
    }
}

impl Env for Minatar {
    fn spec(&self) -> Result<Spec, Misfit> {
        let play = self.play().ok_or_else(|| Misfit::new(unknown(&self.game), HELP))?;
        Ok(Spec {
            sees: vec![Field::new("grid", &[play.n_channels(), SIDE, SIDE], Kind::Bit)],
            does: Actions::named(&["no-op", "left", "up", "right", "down", "fire"]),
            tells: Vec::new(),
            limit: Some(self.limit),
        })
    }

    fn open(&self) -> Result<Box<dyn World>, OpError> {
        let play = self.play().ok_or_else(|| OpError::Failed(unknown(&self.game)))?;
        Ok(Box::new(play))
    }
}

/// What a player does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Move {
    Stay,
    Left,
    Up,
    Right,
    Down,
    Fire,
}

const MOVES: [Move; 6] = [Move::Stay, Move::Left, Move::Up, Move::Right, Move::Down, Move::Fire];

impl Move {
    /// By how much it leads to the right.
    fn across(self) -> i32 {
        i32::from(self == Self::Right) - i32::from(self == Self::Left)
    }

    /// By how much it leads down.
    fn down(self) -> i32 {
        i32::from(self == Self::Down) - i32::from(self == Self::Up)
    }
}

/// The rules of a game.
trait Game: Send {
    /// How many kinds of bits a cell has.
    fn n_channels(&self) -> usize;

    /// Starts anew.
    fn reset(&mut self, luck: &mut Luck);

    /// Goes on by a frame: the reward, and whether the game is over.
    fn act(&mut self, chosen: Move, luck: &mut Luck) -> (f32, bool);

    /// Marks everything on an empty board.
    fn draw(&self, board: &mut Board<'_>);

    /// How often it became more difficult, if it does.
    fn ramp(&self) -> Option<u32>;
}

/// A game being played, with actions that stick.
pub struct Play {
    game: Box<dyn Game>,
    sticky: f64,
    last: usize,
}

impl Play {
    /// A game by its name.
    #[must_use]
    pub fn of(game: &str, sticky: f64, ramping: bool) -> Option<Self> {
        let game: Box<dyn Game> = match game {
            "asterix" => Box::new(Asterix::new(ramping)),
            "breakout" => Box::new(Breakout::new()),
            "freeway" => Box::new(Freeway::new()),
            "seaquest" => Box::new(Seaquest::new(ramping)),
            "space_invaders" => Box::new(SpaceInvaders::new(ramping)),
            _ => return None,
        };
        Some(Self { game, sticky, last: 0 })
    }

    /// How many kinds of bits a cell has.
    #[must_use]
    pub fn n_channels(&self) -> usize {
        self.game.n_channels()
    }

    /// Starts the game anew. As in the original the last action is kept and may stick.
    pub fn restart(&mut self, luck: &mut Luck) {
        self.game.reset(luck);
    }

    /// Takes an action, or the last one again: which it was, what it pays, and whether the game is over.
    ///
    /// # Panics
    /// If there is no such action.
    pub fn act(&mut self, action: usize, luck: &mut Luck) -> (usize, f32, bool) {
        // The original draws this number even if nothing sticks.
        if luck.unit() >= self.sticky {
            self.last = action;
        }
        let (reward, over) = self.game.act(MOVES[self.last], luck);
        (self.last, reward, over)
    }

    /// How often the game became more difficult since it started, if it does.
    #[must_use]
    pub fn ramp(&self) -> Option<u32> {
        self.game.ramp()
    }

    /// Writes the board: ten rows of ten cells for each channel.
    pub fn draw(&self, grid: &mut [u8]) {
        self.game.draw(&mut Board::empty(grid));
    }
}

impl std::fmt::Debug for Play {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Play").field("last", &self.last).finish_non_exhaustive()
    }
}

impl World for Play {
    fn reset(&mut self, luck: &mut Luck, row: &mut Row<'_>) {
        self.last = 0;
        self.restart(luck);
        self.draw(row.bytes(0));
    }

    fn step(&mut self, act: Act<'_>, luck: &mut Luck, row: &mut Row<'_>) -> (f64, End) {
        let (_, reward, over) = self.act(act.index(), luck);
        self.draw(row.bytes(0));
        (reward.into(), if over { End::Terminal } else { End::No })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_data::{Columns, Values};

    fn minatar(game: &str, sticky: f64) -> Minatar {
        Minatar { game: game.to_owned(), sticky, ramping: true, limit: 10_000 }
    }

    #[test]
    fn a_game_that_there_is_not_is_refused() {
        let error = minatar("pong", 0.0).spec().unwrap_err();
        assert_eq!(error.message, "no game of MinAtar is called \"pong\"");
        assert!(minatar("pong", 0.0).open().is_err());
    }

    /// An action of the episode before would stick, and the cannon move.
    #[test]
    fn an_episode_does_not_depend_on_the_one_before() {
        let env = minatar("space_invaders", 0.6);
        let mut seen = Columns::zeros(env.spec().unwrap().sees, 1);
        let mut episode = |world: &mut dyn World, action| {
            let mut luck = Luck::numpy(3);
            let mut row = Row::of(&mut seen, 0, &mut []);
            world.reset(&mut luck, &mut row);
            let mut grids = Vec::new();
            for _ in 0..5 {
                let mut row = Row::of(&mut seen, 0, &mut []);
                world.step(Act::Index(action), &mut luck, &mut row);
                let Values::U8(grid) = seen.values(0) else { panic!("bytes") };
                grids.push(grid.clone());
            }
            grids
        };
        let mut world = env.open().unwrap();
        let first = episode(&mut *world, 3);
        assert_ne!(episode(&mut *world, 1), first);
        assert_eq!(episode(&mut *world, 3), first);
    }
}
