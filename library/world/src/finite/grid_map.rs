//! Cells drawn as text.

use ivx_data::Misfit;
use ivx_op::{Facts, Fields, OpError, Part, Wrong, declare};

use super::mdp::named;
use super::{Finite, Mdp, Paid};

declare! {
    /// Cells drawn as text, a list with one string a row: `.` is free, `#` a wall, `S` a start, `G` a goal and `P` a pit,
    /// which end the episode, and a digit pays so much whenever a step ends there. So does a letter of the `legend`.
    ///
    /// Moves go north, west, south and east, and walls and edges hold back. With the wind's probability an action is
    /// ignored, and one of the four drawn evenly takes its place. An episode starts in any `S`, or where there is none in
    /// any free cell. States are numbered row after row from the top left, walls too, though nobody comes there.
    pub struct GridMap = "grid_map" @ 1 {
        /// The rows, from the top.
        map: Vec<String>;
        /// What coming to a goal pays.
        goal: f64 = 1.0;
        /// What coming to a pit pays.
        pit: f64 = -1.0;
        /// What every step pays besides.
        step: f64 = 0.0;
        /// What a step that ends at a letter pays, as in `(a: 0.5, b: -2.0)`.
        legend: Fields = Part::default();
        /// How probably an action is ignored.
        wind: f64 = 0.0, in 0.0..=1.0;
        /// By how many cells each column blows north whoever leaves a cell of it, as far as nothing holds back (Sutton and
        /// Barto, 2018, Example 6.5); where empty, by none.
        updraft: Vec<usize> = Vec::<i64>::new(), in 0.0..=40.0;
    }
    rule is_drawn;
}

/// More cells than these have too many transitions.
const MOST: usize = 1600;

/// What a map says.
struct Cells {
    columns: usize,
    walls: Vec<bool>,
    /// What a step that ends there pays.
    pays: Vec<f64>,
    terminal: Vec<bool>,
    start: Vec<f64>,
}

impl GridMap {
    /// The cells; or which argument is wrong, and why.
    fn cells(&self) -> Result<Cells, (&'static str, Misfit)> {
        let wrong = |arg, message: String, help: &str| Err((arg, Misfit::new(message, help)));
        let rows: Vec<Vec<char>> = self.map.iter().map(|row| row.chars().collect()).collect();
        let columns = rows.first().map_or(0, Vec::len);
        if let Some(i) = rows.iter().position(|row| row.len() != columns) {
            let message = format!(
                "row {} of the map has {} cells, and the first has {columns}",
                i + 1,
                rows[i].len()
            );
            return wrong("map", message, "draw every row as long as the first");
        }
        let all = rows.concat();
        if all.is_empty() || all.len() > MOST {
            let message = format!("a map has 1 to {MOST} cells, and this one has {}", all.len());
            return wrong("map", message, "draw it with a string for each row");
        }
        for (name, value) in &self.legend.0 {
            let mut letters = name.chars();
            let is_letter = matches!((letters.next(), letters.next()), (Some(letter), None) if !"SGP".contains(letter));
            if !is_letter || value.as_f64().is_none() {
                let message = format!("`{name}: {value}` is no letter with a number");
                let help =
                    "a legend is such as `(a: 0.5)`, with letters other than `S`, `G` and `P`";
                return wrong("legend", message, help);
            }
            if !all.iter().any(|cell| name.chars().eq([*cell])) {
                let message = format!("the map has no `{name}`");
                return wrong("legend", message, "leave it out, or draw it on the map");
            }
        }
        if !self.updraft.is_empty() && self.updraft.len() != columns {
            let message =
                format!("there are {} updrafts, and {columns} columns", self.updraft.len());
            return wrong("updraft", message, "give one for each column of the map");
        }
        let pays = |cell: char| match cell {
            '.' | '#' | 'S' => Some(0.0),
            'G' => Some(self.goal),
            'P' => Some(self.pit),
            _ => cell
                .to_digit(10)
                .map(f64::from)
                .or_else(|| self.legend.0.get(&cell.to_string())?.as_f64()),
        };
        if let Some(strange) = all.iter().find(|cell| pays(**cell).is_none()) {
            let message = format!("the map has `{strange}`, which says nothing");
            let help = "cells are `.`, `#`, `S`, `G`, `P`, a digit, or a letter that `legend` says the reward of";
            return wrong("map", message, help);
        }
        let ends = |cell: char| matches!(cell, 'G' | 'P' | '#');
        let is_start = |cell: char| if all.contains(&'S') { cell == 'S' } else { !ends(cell) };
        let n_starts = all.iter().filter(|cell| is_start(**cell)).count();
        if n_starts == 0 {
            return wrong("map", "no cell of the map is free".to_owned(), "draw one as `.` or `S`");
        }
        let share = 1.0 / ivx_math::moments::real(n_starts);
        Ok(Cells {
            columns,
            walls: all.iter().map(|cell| *cell == '#').collect(),
            pays: all.iter().map(|cell| self.step + pays(*cell).unwrap_or(0.0)).collect(),
            terminal: all.iter().map(|cell| ends(*cell)).collect(),
            start: all.iter().map(|cell| if is_start(*cell) { share } else { 0.0 }).collect(),
        })
    }
}

impl Cells {
    /// Where so many cells along a column and a row lead, cell by cell as far as nothing holds back.
    fn moved(&self, from: usize, down: i64, right: i64) -> usize {
        let (mut cell, rows) = (from, self.walls.len() / self.columns);
        let steps = [(0, right.signum(), right), (down.signum(), 0, down)];
        for (by_row, by_column, n) in steps {
            for _ in 0..n.unsigned_abs() {
                let along = |place: usize, by: i64, end: usize| {
                    let next = if by < 0 {
                        place.checked_sub(1)
                    } else {
                        Some(place + usize::from(by > 0))
                    };
                    next.filter(|next| *next < end)
                };
                let row = along(cell / self.columns, by_row, rows);
                let column = along(cell % self.columns, by_column, self.columns);
                let Some((row, column)) = row.zip(column) else { break };
                let next = row * self.columns + column;
                if self.walls[next] {
                    break;
                }
                cell = next;
            }
        }
        cell
    }
}

/// Rows down and columns to the right, of each action.
const MOVES: [(i64, i64); 4] = [(-1, 0), (0, -1), (1, 0), (0, 1)];

impl Finite for GridMap {
    fn columns(&self) -> Option<usize> {
        self.map.first().map(|row| row.chars().count())
    }

    fn mdp(&self) -> Result<Mdp, OpError> {
        let cells = self.cells().map_err(|(_, misfit)| OpError::Failed(misfit.message))?;
        let n = cells.walls.len();
        let mut transitions = vec![0.0; n * MOVES.len() * n];
        for s in 0..n {
            let blown = self.updraft.get(s % cells.columns).copied().unwrap_or(0);
            let blown = i64::try_from(blown).expect("it is at most 40");
            let leads =
                MOVES.map(
                    |(down, right)| {
                        if cells.terminal[s] { s } else { cells.moved(s, down - blown, right) }
                    },
                );
            for (a, lead) in leads.into_iter().enumerate() {
                let next = &mut transitions[(s * MOVES.len() + a) * n..][..n];
                next[lead] += 1.0 - self.wind;
                for other in leads {
                    next[other] += self.wind / 4.0;
                }
            }
        }
        let Cells { pays, terminal, start, .. } = cells;
        let actions = named(&["N", "W", "S", "E"]);
        Ok(Mdp::paying(actions, transitions, Paid::Coming(pays), terminal, start))
    }

    fn pays(&self) -> bool {
        self.cells().is_ok_and(|cells| {
            let open = cells.pays.iter().zip(&cells.walls).filter(|(_, wall)| !**wall);
            open.into_iter().any(|(pays, _)| *pays != 0.0)
        })
    }

    fn is_wall(&self, state: usize) -> bool {
        self.map.iter().flat_map(|row| row.chars()).nth(state) == Some('#')
    }
}

fn is_drawn(facts: &Facts<'_>) -> Result<(), Wrong> {
    let drawn = || {
        Some(GridMap {
            map: facts.arg("map")?,
            legend: facts.arg("legend")?,
            updraft: facts.arg("updraft")?,
            goal: 1.0,
            pit: -1.0,
            step: 0.0,
            wind: 0.0,
        })
    };
    let cells = drawn().map_or(Ok(()), |grid| grid.cells().map(drop));
    cells.map_err(|(arg, Misfit { message, help })| Wrong { arg, message, help })
}

#[cfg(test)]
mod tests {
    use ivx_op::Lit;

    use super::*;

    fn grid(map: &[&str]) -> GridMap {
        GridMap {
            map: map.iter().map(|row| (*row).to_owned()).collect(),
            goal: 1.0,
            pit: -1.0,
            step: 0.0,
            legend: Fields::default(),
            wind: 0.0,
            updraft: Vec::new(),
        }
    }

    /// Where each action leads for certain.
    fn leads(mdp: &Mdp, s: usize) -> [usize; 4] {
        [0, 1, 2, 3].map(|a| mdp.next(s, a).iter().position(|p| *p == 1.0).unwrap())
    }

    #[test]
    fn walls_and_edges_hold_back_and_ends_end() {
        // 0 1 2
        // 3 # 5
        // 6 7 8
        let mdp = grid(&["..G", ".#.", "S.P"]).mdp().unwrap();
        assert_eq!(leads(&mdp, 3), [0, 3, 6, 3]);
        assert_eq!(leads(&mdp, 7), [7, 6, 7, 8]);
        assert_eq!([leads(&mdp, 4), leads(&mdp, 2)], [[4; 4], [2; 4]]);
        assert_eq!([0, 1, 2, 3].map(|a| mdp.reward(1, a)), [0.0, 0.0, 0.0, 1.0]);
        assert_eq!([0, 1, 2, 3].map(|a| mdp.reward(5, a)), [1.0, 0.0, -1.0, 0.0]);
        assert_eq!([0, 1, 2, 3].map(|a| mdp.reward(2, a)), [0.0; 4]);
        let of = |marked: &[usize]| (0..9).map(|s| marked.contains(&s)).collect::<Vec<_>>();
        assert_eq!(mdp.terminal, of(&[2, 4, 8]));
        assert_eq!(mdp.start, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        // Without a start it is any free cell.
        let anywhere = grid(&["..G", ".#.", "..P"]).mdp().unwrap();
        assert_eq!((anywhere.start[0], anywhere.start[4]), (1.0 / 6.0, 0.0));
    }

    #[test]
    fn wind_and_steps_by_hand() {
        // From the middle east: ½ + ⅛ to the goal; ⅛ back, and ¼ against the edges.
        let env = GridMap { wind: 0.5, step: -0.1, ..grid(&["S.G"]) };
        let mdp = env.mdp().unwrap();
        assert_eq!(mdp.next(1, 3), [0.125, 0.25, 0.625]);
        assert!((mdp.reward(1, 3) - (0.625 - 0.1)).abs() < 1e-12);
        // Where one came is what is paid.
        assert_eq!([0, 1, 2].map(|next| mdp.paid(1, 3, next)), [-0.1, -0.1, 0.9]);
    }

    #[test]
    fn digits_and_letters_pay_and_go_on() {
        let legend = Fields([("a".to_owned(), Lit::Real(-0.5))].into());
        let mdp = GridMap { legend, ..grid(&["S2a"]) }.mdp().unwrap();
        assert_eq!((mdp.reward(0, 3), mdp.reward(1, 3), mdp.reward(1, 0)), (2.0, -0.5, 2.0));
        assert!(!mdp.terminal.contains(&true));
    }

    /// The windy gridworld of Sutton and Barto, whose goal is 15 steps away.
    #[test]
    fn a_goal_under_updrafts_is_fifteen_steps_away() {
        let row = "..........".to_owned();
        let mut map = vec![row; 7];
        map[3] = "S......G..".to_owned();
        let updraft = vec![0, 0, 0, 1, 1, 1, 2, 2, 1, 0];
        let mdp = GridMap { map, updraft, ..grid(&[]) }.mdp().unwrap();
        // In the sixth column north is three up, south one up, and east one right and two up.
        assert_eq!(leads(&mdp, 46), [16, 25, 36, 27]);
        let mut reached = std::collections::BTreeSet::from([30]);
        let mut steps = 0;
        while !reached.contains(&37) {
            reached = reached.iter().flat_map(|s| leads(&mdp, *s)).collect();
            steps += 1;
        }
        assert_eq!(steps, 15);
    }

    #[test]
    fn what_is_no_map_is_told() {
        let why = |grid: &GridMap| grid.cells().err().map(|(arg, misfit)| (arg, misfit.message));
        let told = |arg, message: &str| Some((arg, message.to_owned()));
        let rows = told("map", "row 2 of the map has 1 cells, and the first has 2");
        assert_eq!(why(&grid(&["..", "."])), rows);
        assert_eq!(why(&grid(&[])), told("map", "a map has 1 to 1600 cells, and this one has 0"));
        assert_eq!(why(&grid(&[".x"])), told("map", "the map has `x`, which says nothing"));
        assert_eq!(why(&grid(&["#G"])), told("map", "no cell of the map is free"));
        let draughty = GridMap { updraft: vec![1], ..grid(&[".."]) };
        assert_eq!(why(&draughty), told("updraft", "there are 1 updrafts, and 2 columns"));
        let legend = Fields([("G".to_owned(), Lit::Int(1))].into());
        let taken = GridMap { legend, ..grid(&[".."]) };
        assert_eq!(why(&taken), told("legend", "`G: 1` is no letter with a number"));
        let legend = Fields([("a".to_owned(), Lit::Int(1))].into());
        let undrawn = GridMap { legend, ..grid(&[".."]) };
        assert_eq!(why(&undrawn), told("legend", "the map has no `a`"));
    }

    #[test]
    fn a_map_without_rewards_never_pays() {
        assert!(!grid(&["..", ".#"]).pays());
        assert!(!GridMap { goal: 0.0, ..grid(&[".G"]) }.pays());
        assert!(GridMap { step: -1.0, ..grid(&[".."]) }.pays() && grid(&[".1"]).pays());
        assert!(grid(&[".#"]).is_wall(1) && !grid(&[".#"]).is_wall(0));
        assert!(crate::Env::spec(&grid(&[".x"])).is_err());
    }
}
