//! A course of fruits, other objects and walls with gaps: a small `FruitBot`.

use ivx_data::form::failed;
use ivx_data::{Act, Actions, End, Field, Kind, Misfit};
use ivx_op::{Facts, OpError, Wrong, declare};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use crate::env::{Env, Row, Spec, World};
use crate::luck::Luck;

declare! {
    /// FruitGrid: a small `FruitBot` (§4.3, §B.1.4) for machines without Procgen (Cobbe et al., 2020). The agent is
    /// carried along a course, one row a step, and goes sideways. Walls cross the course, each with a gap that is to be
    /// passed: a step into a wall ends the episode. Fruits and other objects are met in the cell that a step leads to,
    /// and are gone then; beyond the last row lie presents, whose row ends the episode. What each is paid with are the
    /// defaults of `FruitBot`: 1 for a fruit, -4 for another object, 10 for the end. Other tasks pay otherwise:
    /// `pays: [1.0, 1.0, 10.0]` for whoever collects both, `pays: [-4.0, 1.0, 10.0]` for whoever avoids fruits.
    ///
    /// Seen are four masks of the 16 × 16 cells ahead: fruits, other objects, walls, and the agent, who is in the last
    /// row; presents are marked as fruits and as objects, doors as walls and as objects. It tells how many fruits,
    /// objects and ends a step has met, which are cumulants of all such tasks.
    ///
    /// The thesis has `FruitBot` itself, of which this keeps what decides: things of two kinds that differ in worth,
    /// walls that have to be passed, levels that are drawn, and a course on which nobody can stop. As in the easy form
    /// of `FruitBot` it is 60 rows long, with five walls whose gaps are 20 to 40 % of its width (3 to 6 columns), and no
    /// doors. What follows is our choice. The 15 actions of Procgen are combinations of keys of which `FruitBot` reads
    /// left, right and one more; here they are six: `STAY`, `LEFT` and `RIGHT` by one column, `FAR LEFT` and `FAR RIGHT`
    /// by two, and `FIRE`, which throws a key straight ahead: if what it meets first is a door, that door is open.
    /// Without doors it does what `STAY` does. Only the cell that a step leads to counts, also where it leads past
    /// another one. Walls are 8 rows apart or more, there 4, so that one can get from anywhere behind a wall through
    /// the next one. There are 20 to 39 fruits and as many objects, twice those of `FruitBot`, since who goes straight
    /// meets those of 1 column of 16, and there of about a fifth of the width. An episode ends at a wall or in the last
    /// row, after 60 steps, so that it needs no limit. Who acts evenly is paid -1.2 on average and who knows the level up to
    /// 23.9 (2000 levels).
    pub struct FruitGrid = "fruit_grid" @ 1 {
        /// What a fruit pays, what another object, and what the end of the course.
        pays: Vec<f64> = vec![1.0, -4.0, 10.0], in -1e6..=1e6;
        /// How many walls there are.
        walls: usize = 5, in 0.0..=7.0;
        /// How probably the gap of a wall is shut by a door.
        doors: f64 = 0.0, in 0.0..=1.0;
        /// How many levels there are, which are the same on all seeds; with 0 each episode has one of all that there
        /// could be.
        levels: u64 = 0, in 0.0..=2_147_483_648.0;
        /// The number of the first of them: others than those of `first: 0` are levels to test with.
        first: u64 = 0, in 0.0..=2_147_483_648.0;
    }
    rule tasks_and_levels_are_sound;
}

/// What is done: the first is to stay in the column.
const LEFT: usize = 1;
const RIGHT: usize = 2;
const FAR_LEFT: usize = 3;
const FAR_RIGHT: usize = 4;
const FIRE: usize = 5;

/// How many rows and columns are seen.
const SIDE: usize = 16;
const CELLS: usize = SIDE * SIDE;
/// The row of presents: the course begins in row 0.
const END: usize = 60;
/// How many rows a wall is at least behind the one before, so that all columns are in reach: 7 steps of two columns
/// lead from a wall to any other column, and one is left for a key.
const APART: usize = 8;
/// How many rows there are behind the last wall, as in `FruitBot`.
const LAST: usize = 4;
/// All columns of a row.
const ALL: u16 = u16::MAX;
/// How many levels there are.
const LEVELS: u64 = 1 << 31;

impl Env for FruitGrid {
    fn spec(&self) -> Result<Spec, Misfit> {
        task(&self.pays)?;
        levels(self.levels, self.first)?;
        Ok(Spec {
            sees: vec![Field::new("grid", &[4, SIDE, SIDE], Kind::Bit)],
            does: Actions::named(&["STAY", "LEFT", "RIGHT", "FAR LEFT", "FAR RIGHT", "FIRE"]),
            tells: ["fruit", "object", "end"].map(str::to_owned).to_vec(),
            limit: None,
        })
    }

    fn open(&self) -> Result<Box<dyn World>, OpError> {
        let pays = task(&self.pays).map_err(failed)?;
        let levels = levels(self.levels, self.first).map_err(failed)?;
        let how = (self.walls, self.doors);
        Ok(Box::new(Playing { pays, levels, how, course: Course::EMPTY }))
    }

    fn pays(&self) -> bool {
        self.pays.iter().any(|pays| *pays != 0.0)
    }
}

fn tasks_and_levels_are_sound(facts: &Facts<'_>) -> Result<(), Wrong> {
    let wrong = |arg| move |Misfit { message, help }| Wrong { arg, message, help };
    if let Some(pays) = facts.arg::<Vec<f64>>("pays") {
        task(&pays).map_err(wrong("pays"))?;
    }
    if let (Some(n), Some(first)) = (facts.arg("levels"), facts.arg("first")) {
        levels(n, first).map_err(wrong("first"))?;
    }
    Ok(())
}

/// What a fruit, another object and the end pay.
fn task(pays: &[f64]) -> Result<[f64; 3], Misfit> {
    pays.try_into().map_err(|_| {
        Misfit::new(
            format!("a task pays for fruits, other objects and the end, not for {}", pays.len()),
            "give three numbers, such as `[1.0, -4.0, 10.0]`",
        )
    })
}

/// The first level, and how many there are.
fn levels(n: u64, first: u64) -> Result<[u32; 2], Misfit> {
    let n = match (n, first) {
        (0, 0) => LEVELS,
        (0, _) => {
            let message = "`levels: 0` are all levels, of which none is the first";
            return Err(Misfit::new(message.to_owned(), "say how many `levels` follow it"));
        }
        _ if first + n > LEVELS => {
            let message = format!("the last of {n} levels from {first} on is beyond {LEVELS}");
            return Err(Misfit::new(message, "begin with an earlier one"));
        }
        _ => n,
    };
    Ok([first, n].map(|n| u32::try_from(n).expect("it is below 2³²")))
}

/// A course, and where the agent is on it. A set of cells of a row is a mask: bit `i` is 1 if column `i` is in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Course {
    fruits: [u16; END + 1],
    /// Other objects, and doors.
    objects: [u16; END + 1],
    walls: [u16; END + 1],
    row: usize,
    column: usize,
}

/// What a step met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Met {
    Nothing,
    Fruit,
    Object,
    Wall,
    End,
}

impl Course {
    /// One with presents only.
    const EMPTY: Self = {
        let mut rows = [0; END + 1];
        rows[END] = ALL;
        Self { fruits: rows, objects: rows, walls: [0; END + 1], row: 0, column: 0 }
    };

    /// A level: walls from the first to the last, then fruits, other objects, and where the agent is.
    fn drawn(luck: &mut Luck, walls: usize, doors: f64) -> Self {
        let mut course = Self::EMPTY;
        // What rows are left lie before one of the walls, or behind all.
        let mut before = [0; END];
        (0..END - LAST - APART * walls).for_each(|_| before[below(luck, walls + 1)] += 1);
        let mut row = 0;
        for more in &before[..walls] {
            row += APART + more;
            let width = 3 + below(luck, 4);
            course.walls[row] = !(((1 << width) - 1) << below(luck, SIDE - width + 1));
        }
        for row in (1..END).filter(|_| doors > 0.0) {
            if course.walls[row] != 0 && luck.unit() < doors {
                course.objects[row] = !course.walls[row];
                course.walls[row] = ALL;
            }
        }
        for is_fruit in [true, false] {
            for _ in 0..20 + below(luck, 20) {
                let (row, cell) = loop {
                    let (row, cell) = (1 + below(luck, END - 1), 1 << below(luck, SIDE));
                    let taken = course.fruits[row] | course.objects[row] | course.walls[row];
                    if course.walls[row] == 0 && taken & cell == 0 {
                        break (row, cell);
                    }
                };
                let of = if is_fruit { &mut course.fruits } else { &mut course.objects };
                of[row] |= cell;
            }
        }
        course.column = below(luck, SIDE);
        course
    }

    /// Goes on by a row.
    fn step(&mut self, action: usize) -> Met {
        self.column = match action {
            LEFT => self.column.saturating_sub(1),
            RIGHT => (self.column + 1).min(SIDE - 1),
            FAR_LEFT => self.column.saturating_sub(2),
            FAR_RIGHT => (self.column + 2).min(SIDE - 1),
            _ => self.column,
        };
        if action == FIRE {
            self.fire();
        }
        self.row += 1;
        let (row, cell) = (self.row, 1 << self.column);
        if self.walls[row] & cell != 0 {
            return Met::Wall;
        }
        let meets = [&mut self.fruits[row], &mut self.objects[row]].map(|of| {
            let is_there = *of & cell != 0;
            *of &= !cell;
            is_there
        });
        match meets {
            _ if row == END => Met::End,
            [true, _] => Met::Fruit,
            [_, true] => Met::Object,
            _ => Met::Nothing,
        }
    }

    /// Opens the door ahead, if a key meets one that is seen.
    fn fire(&mut self) {
        let (cell, seen) = (1 << self.column, self.row + 1..(self.row + SIDE).min(END));
        let met = seen.into_iter().find(|row| self.walls[*row] & cell != 0);
        if let Some(row) = met
            && self.objects[row] & cell != 0
        {
            self.walls[row] &= !self.objects[row];
            self.objects[row] = 0;
        }
    }

    /// Writes what is seen, the rows ahead above the agent's own.
    fn show(&self, seen: &mut [u8]) {
        seen.fill(0);
        let last = (self.row + SIDE).min(END + 1);
        for (channel, of) in
            seen.chunks_exact_mut(CELLS).zip([&self.fruits, &self.objects, &self.walls])
        {
            let rows = channel.rchunks_exact_mut(SIDE).zip(&of[self.row..last]);
            for (cells, mask) in rows.filter(|(_, mask)| **mask != 0) {
                cells.iter_mut().enumerate().for_each(|(i, cell)| *cell = (mask >> i & 1) as u8);
            }
        }
        seen[4 * CELLS - SIDE + self.column] = 1;
    }
}

/// A course while it is gone along.
struct Playing {
    pays: [f64; 3],
    /// The first level, and how many there are.
    levels: [u32; 2],
    /// How many walls, and how probable doors.
    how: (usize, f64),
    course: Course,
}

impl World for Playing {
    fn reset(&mut self, luck: &mut Luck, row: &mut Row<'_>) {
        let [first, n] = self.levels;
        let (level, (walls, doors)) = (first + luck.below(n), self.how);
        self.course = Course::drawn(&mut of_level(level), walls, doors);
        self.course.show(row.bytes(0));
        row.told().fill(0.0);
    }

    fn step(&mut self, act: Act<'_>, _: &mut Luck, row: &mut Row<'_>) -> (f64, End) {
        let met = self.course.step(act.index());
        self.course.show(row.bytes(0));
        let what = [Met::Fruit, Met::Object, Met::End].map(|what| met == what);
        row.told().copy_from_slice(&what.map(|is_met| f32::from(u8::from(is_met))));
        let paid =
            what.iter().zip(self.pays).map(|(is_met, pays)| if *is_met { pays } else { 0.0 });
        let over = matches!(met, Met::Wall | Met::End);
        (paid.sum(), if over { End::Terminal } else { End::No })
    }
}

/// The luck with which a level is drawn, wherever it is met.
fn of_level(level: u32) -> Luck {
    let mut seed = [0; 32];
    seed[..10].copy_from_slice(b"fruit_grid");
    seed[28..].copy_from_slice(&level.to_le_bytes());
    Luck::from(ChaCha8Rng::from_seed(seed))
}

/// One of `0..n`.
fn below(luck: &mut Luck, n: usize) -> usize {
    luck.below(u32::try_from(n).expect("far fewer")) as usize
}

#[cfg(test)]
mod tests;
