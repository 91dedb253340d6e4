//! A grid with coins of three colours.

use ivx_data::form::failed;
use ivx_data::{Act, Actions, Columns, End, Field, Kind, Misfit, Outline, Picture, Shape};
use ivx_op::{Facts, OpError, Wrong, declare};

use crate::env::{Entries, Env, Row, Spec, World};
use crate::luck::Luck;
use crate::paint;

declare! {
    /// CoinGrid: a walled grid of 7 × 7 cells with coins of three colours (§B.1.3, Example 4.1). The agent turns left,
    /// turns right or goes forward as in Minigrid (Chevalier-Boisvert et al., 2018); it collects a coin by entering
    /// its cell, and a task is what coins of each colour pay (Eqn. 4.7); nothing else pays.
    ///
    /// Seen are five masks of the grid: green coins, red coins, yellow coins, walls, and the agent. It tells how many
    /// coins of each colour a step has collected, which are the cumulants of Eqn. 4.6.
    ///
    /// Where the thesis is silent, this is our reading: the walls of the border are among the 7 × 7 cells; the agent's
    /// own cell is marked as well as the one in front of it; there are two coins of each colour, anywhere, and no
    /// other walls; the agent starts in any other cell and faces anywhere; yellow coins pay nothing in the tasks of
    /// Table 4.2; an episode ends when no coin of any colour is left, whatever the task, and else after 120 steps.
    pub struct CoinGrid = "coin_grid" @ 1 {
        /// What a coin pays: a red one, a green one and, if there is a third number, a yellow one.
        pays: Vec<f64> = vec![1.0, 1.0], in -1e6..=1e6;
        /// How many coins there are of each colour.
        coins: usize = 2, in 1.0..=5.0;
        /// How many inner cells are walls. They shut no coin in.
        walls: usize = 0, in 0.0..=8.0;
        /// After how many steps an episode is cut off.
        limit: u64 = 120, in 1.0..=1e6;
        /// Whether the cell in front of the agent has a sixth mask of its own. Without, it cannot be seen in which of the
        /// two cells the agent is, and in which direction it goes on: the world is no Markov decision process.
        front_apart: bool = false;
    }
    rule colours_are_paid_for;
}

/// How many cells a row has, and how many rows there are.
const SIDE: usize = 7;
const CELLS: usize = SIDE * SIDE;
/// Those within the walls of the border.
const INNER: usize = (SIDE - 2) * (SIDE - 2);

impl Env for CoinGrid {
    fn spec(&self) -> Result<Spec, Misfit> {
        task(&self.pays)?;
        Ok(Spec {
            sees: vec![self.field()],
            does: Actions::named(&["LEFT", "RIGHT", "FORWARD"]),
            tells: ["green", "red", "yellow"].map(str::to_owned).to_vec(),
            limit: Some(self.limit),
        })
    }

    fn open(&self) -> Result<Box<dyn World>, OpError> {
        let pays = task(&self.pays).map_err(failed)?;
        let state = Coins::default();
        Ok(Box::new(Collecting {
            sees: self.field(),
            pays,
            coins: self.coins,
            walls: self.walls,
            state,
        }))
    }

    fn is_drawn(&self) -> bool {
        true
    }

    fn pays(&self) -> bool {
        self.pays.iter().any(|pays| *pays != 0.0)
    }
}

impl CoinGrid {
    fn field(&self) -> Field {
        Field::new("grid", &[if self.front_apart { 6 } else { 5 }, SIDE, SIDE], Kind::Bit)
    }
}

fn colours_are_paid_for(facts: &Facts<'_>) -> Result<(), Wrong> {
    let Some(pays) = facts.arg::<Vec<f64>>("pays") else { return Ok(()) };
    let wrong = |Misfit { message, help }| Wrong { arg: "pays", message, help };
    task(&pays).map(|_| ()).map_err(wrong)
}

/// What coins pay, in the order of [`Coins::coins`].
fn task(pays: &[f64]) -> Result<[f64; 3], Misfit> {
    match *pays {
        [red, green] => Ok([green, red, 0.0]),
        [red, green, yellow] => Ok([green, red, yellow]),
        _ => Err(Misfit::new(
            format!(
                "coins are red, green and yellow, and {} numbers say what they pay",
                pays.len()
            ),
            "give two numbers, for red and green coins, or three, the last for yellow ones",
        )),
    }
}

/// Where everything is in [`CoinGrid`].
///
/// Cells are numbered row after row from the top left, border included, and a set of cells is a mask: bit `i` is 1 if
/// cell `i` is in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coins {
    /// The cells of green, of red and of yellow coins.
    pub coins: [u64; 3],
    /// Those of walls, with the border.
    pub walls: u64,
    /// That of the agent, within the border.
    pub at: usize,
    /// Where it faces: east, south, west or north.
    pub faces: usize,
}

impl Coins {
    /// The walls of the border.
    pub const BORDER: u64 = border();

    /// Turns left (0) or right (1) or goes forward (2), and says whether a green, a red or a yellow coin was collected.
    pub fn step(&mut self, action: usize) -> [bool; 3] {
        match action {
            0 => self.faces = (self.faces + 3) % 4,
            1 => self.faces = (self.faces + 1) % 4,
            _ if has(self.walls, self.ahead()) => {}
            _ => {
                self.at = self.ahead();
                let collected = self.coins.map(|coins| has(coins, self.at));
                self.coins = self.coins.map(|coins| coins & !(1 << self.at));
                return collected;
            }
        }
        [false; 3]
    }

    /// Writes what is seen: masks of green, red and yellow coins, walls, and the agent with the cell in front of it; where
    /// there is room for six, this one has a mask of its own.
    pub fn show(&self, seen: &mut [u8]) {
        let [green, red, yellow] = self.coins;
        let (agent, front) = (1 << self.at, 1 << self.ahead());
        let both = if seen.len() > 5 * CELLS { agent } else { agent | front };
        let masks = [green, red, yellow, self.walls, both, front];
        seen.fill(0);
        for (channel, mut mask) in seen.chunks_exact_mut(CELLS).zip(masks) {
            while mask != 0 {
                channel[mask.trailing_zeros() as usize] = 1;
                mask &= mask - 1;
            }
        }
    }

    /// Walls, coins as discs of their colours, and the agent as a triangle whose tip is where it faces.
    fn picture(&self) -> Picture {
        let cells = |mask| (0..CELLS).filter(move |cell| has(mask, *cell));
        let mut shapes = vec![paint::floor(SIDE, SIDE)];
        shapes.extend(paint::lines(SIDE, SIDE));
        shapes.extend(cells(self.walls).map(|wall| paint::cell(wall, SIDE, paint::WALL)));
        for (coins, colour) in self.coins.into_iter().zip(COLOURS) {
            shapes.extend(cells(coins).map(|coin| Shape {
                outline: Outline::Circle(paint::middle(coin, SIDE), 0.3),
                colour,
            }));
        }
        let [x, y] = paint::middle(self.at, SIDE);
        let (ahead, aside) = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]
            .map(|(dx, dy)| ([dx, dy], [-dy, dx]))[self.faces];
        let corner = |along: f64, across: f64| {
            [x + along * ahead[0] + across * aside[0], y + along * ahead[1] + across * aside[1]]
        };
        let outline =
            Outline::Polygon(vec![corner(0.38, 0.0), corner(-0.3, 0.3), corner(-0.3, -0.3)]);
        shapes.push(Shape { outline, colour: paint::AGENT });
        Picture { size: [7.0; 2], shapes }
    }

    /// The cell in front of the agent.
    fn ahead(&self) -> usize {
        match self.faces {
            0 => self.at + 1,
            1 => self.at + SIDE,
            2 => self.at - 1,
            _ => self.at - SIDE,
        }
    }

    /// An episode's start: walls, coins by colour and the agent are drawn in this order, each from the cells left.
    fn drawn(luck: &mut Luck, coins: usize, walls: usize) -> Self {
        loop {
            let mut places = Places::new();
            let mut drawn = |n| (0..n).fold(0, |mask, _| mask | 1 << places.next(luck));
            let mut state = Self { walls: Self::BORDER | drawn(walls), ..Self::default() };
            state.coins = [(); 3].map(|()| drawn(coins));
            state.at = places.next(luck);
            state.faces = luck.below(4) as usize;
            if state.reaches_all() {
                return state;
            }
        }
    }

    /// Whether the agent can go to every coin.
    fn reaches_all(&self) -> bool {
        let mut reached: u64 = 1 << self.at;
        loop {
            let near = reached << 1 | reached >> 1 | reached << SIDE | reached >> SIDE;
            let more = reached | near & !self.walls;
            if more == reached {
                return self.coins.iter().all(|coins| coins & !reached == 0);
            }
            reached = more;
        }
    }
}

/// Those of green, red and yellow coins, which readers tell apart who see less of colours (Okabe and Ito).
const COLOURS: [[u8; 3]; 3] = [[0, 158, 115], [213, 94, 0], [240, 200, 40]];

const fn border() -> u64 {
    let (mut mask, mut cell) = (0, 0);
    while cell < CELLS {
        let (row, column) = (cell / SIDE, cell % SIDE);
        if row == 0 || row == SIDE - 1 || column == 0 || column == SIDE - 1 {
            mask |= 1 << cell;
        }
        cell += 1;
    }
    mask
}

fn has(mask: u64, cell: usize) -> bool {
    mask >> cell & 1 == 1
}

/// The inner cells, drawn without putting back.
struct Places {
    cells: [usize; INNER],
    n_left: usize,
}

impl Places {
    fn new() -> Self {
        let inner = |i| (i / (SIDE - 2) + 1) * SIDE + i % (SIDE - 2) + 1;
        Self { cells: std::array::from_fn(inner), n_left: INNER }
    }

    fn next(&mut self, luck: &mut Luck) -> usize {
        let drawn = luck.below(u32::try_from(self.n_left).expect("far fewer")) as usize;
        self.n_left -= 1;
        self.cells.swap(drawn, self.n_left);
        self.cells[self.n_left]
    }
}

/// A grid while its coins are collected.
struct Collecting {
    sees: Field,
    pays: [f64; 3],
    coins: usize,
    walls: usize,
    state: Coins,
}

impl World for Collecting {
    fn reset(&mut self, luck: &mut Luck, row: &mut Row<'_>) {
        self.state = Coins::drawn(luck, self.coins, self.walls);
        self.state.show(row.bytes(0));
        row.told().fill(0.0);
    }

    fn step(&mut self, act: Act<'_>, _: &mut Luck, row: &mut Row<'_>) -> (f64, End) {
        let collected = self.state.step(act.index()).map(|one| f32::from(u8::from(one)));
        self.state.show(row.bytes(0));
        row.told().copy_from_slice(&collected);
        let reward =
            collected.iter().zip(self.pays).map(|(one, pays)| f64::from(*one) * pays).sum();
        (reward, if self.state.coins == [0; 3] { End::Terminal } else { End::No })
    }

    fn entries(&self) -> Option<Entries> {
        let mut entries = Entries {
            sides: [SIDE; 2],
            cells: Vec::new(),
            seen: Columns::zeros(vec![self.sees.clone()], 0),
            acts: Vec::new(),
        };
        let free = |cell: &usize| !has(self.state.walls, *cell);
        for (cell, faces) in (0..CELLS).filter(free).flat_map(|cell| (0..4).map(move |f| (cell, f)))
        {
            // From behind, where that is no wall.
            let back = Coins { at: cell, faces: (faces + 2) % 4, ..self.state };
            let at = back.ahead();
            // What was there is collected.
            let coins = self.state.coins.map(|coins| coins & !(1 << at));
            let from = Coins { coins, at, faces, ..self.state };
            if free(&at) {
                entries.seen.resize(entries.acts.len() + 1);
                let mut none = [];
                from.show(Row::of(&mut entries.seen, entries.acts.len(), &mut none).bytes(0));
                entries.cells.push(cell);
                entries.acts.push(2);
            }
        }
        Some(entries)
    }

    fn draw(&self) -> Option<Picture> {
        // Before the first episode there is no border.
        (self.state.walls != 0).then(|| self.state.picture())
    }
}

#[cfg(test)]
mod tests;
