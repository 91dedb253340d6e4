//! Worlds whose states are cells of a grid, as pictures.

use ivx_data::{Outline, Picture, Shape};
use ivx_math::moments::real;

use super::{Finite, Mdp, Paid};
use crate::paint;

impl Mdp {
    /// What is worth saying of each state: what coming there pays. Where rewards are said of states, it is not what most
    /// pay that end no episode; elsewhere, it is that of an end, where it can be read off a step that leads there for
    /// certain.
    pub fn notable(&self, is_wall: impl Fn(usize) -> bool) -> Vec<Option<f64>> {
        let states = 0..self.n_states();
        match &self.paid {
            Paid::Coming(pays) => {
                let open = states.clone().filter(|s| !self.terminal[*s] && !is_wall(*s));
                let usual = most_frequent(open.map(|s| pays[s]).collect());
                states.map(|s| Some(pays[s]).filter(|pays| Some(*pays) != usual)).collect()
            }
            _ => states.map(|s| self.terminal[s].then(|| self.entered(s)).flatten()).collect(),
        }
    }

    /// What coming to a state pays, if a step leads there for certain.
    fn entered(&self, state: usize) -> Option<f64> {
        let n_actions = self.n_actions();
        let pairs = (0..self.n_states()).flat_map(|s| (0..n_actions).map(move |a| (s, a)));
        let mut leads = pairs.filter(|&(s, a)| s != state && self.next(s, a)[state] == 1.0);
        leads.next().map(|(s, a)| self.reward(s, a))
    }
}

fn most_frequent(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.chunk_by(|a, b| a == b).max_by_key(|same| same.len()).map(|same| same[0])
}

/// How the states of a process are laid out.
pub(super) struct Cells {
    columns: usize,
    walls: Vec<bool>,
}

impl Cells {
    /// Those of a process of `n` states, if they are cells.
    pub(super) fn of(finite: &dyn Finite, n: usize) -> Option<Self> {
        let columns = finite.columns()?;
        Some(Self { columns, walls: (0..n).map(|s| finite.is_wall(s)).collect() })
    }

    /// Cells that end an episode, or that pay otherwise than most, in colours, walls, and the agent as a disc.
    pub(super) fn picture(&self, mdp: &Mdp, state: usize) -> Picture {
        let Self { columns, walls } = self;
        let (columns, rows) = (*columns, walls.len().div_ceil(*columns));
        let notable = mdp.notable(|s| walls[s]);
        let colour = |s: usize| match notable[s] {
            _ if walls[s] => None,
            Some(pays) if pays > 0.0 => Some(paint::PAYS),
            Some(pays) if pays < 0.0 => Some(paint::COSTS),
            _ => mdp.terminal[s].then_some(paint::ENDS),
        };
        let states = || 0..walls.len();
        let mut shapes = vec![paint::floor(columns, rows)];
        shapes.extend(states().filter_map(|s| Some(paint::cell(s, columns, colour(s)?))));
        shapes.extend(paint::lines(columns, rows));
        let walls = states().filter(|s| walls[*s]);
        shapes.extend(walls.map(|s| paint::cell(s, columns, paint::WALL)));
        let agent = Outline::Circle(paint::middle(state, columns), 0.3);
        shapes.push(Shape { outline: agent, colour: paint::AGENT });
        Picture { size: [columns, rows].map(real), shapes }
    }
}

#[cfg(test)]
mod tests {
    use ivx_data::{Act, Columns};
    use ivx_op::{Fields, Part};

    use super::*;
    use crate::env::{Env, Row};
    use crate::luck::Luck;
    use crate::{Chain, GoalWorld, GridMap};

    /// One step to the right in
    ///
    /// ```text
    /// S a G
    /// # . P
    /// ```
    #[test]
    fn cells_walls_and_the_agent_are_drawn() {
        let map = ["SaG", "#.P"].map(str::to_owned).to_vec();
        let legend = Fields(Part::default().with("a", 0.5).args);
        let env =
            GridMap { map, goal: 1.0, pit: -1.0, step: 0.0, legend, wind: 0.0, updraft: vec![] };
        let mut world = env.open().unwrap();
        let mut seen = Columns::zeros(Env::spec(&env).unwrap().sees, 1);
        let mut luck = Luck::numpy(0);
        world.reset(&mut luck, &mut Row::of(&mut seen, 0, &mut []));
        world.step(Act::Index(3), &mut luck, &mut Row::of(&mut seen, 0, &mut []));
        let picture = world.draw().unwrap();
        assert_eq!(picture.size, [3.0, 2.0]);
        let of = |colour| {
            let shapes = picture.shapes.iter().filter(move |shape| shape.colour == colour);
            shapes.map(|shape| shape.outline.clone()).collect::<Vec<_>>()
        };
        let cell = |x, y| Outline::rectangle([x, y], [1.0; 2], 0.0);
        assert_eq!(of(paint::PAYS), [cell(1.5, 0.5), cell(2.5, 0.5)]);
        assert_eq!(of(paint::COSTS), [cell(2.5, 1.5)]);
        assert_eq!(of(paint::WALL), [cell(0.5, 1.5)]);
        assert_eq!(of(paint::AGENT), [Outline::Circle([1.5, 0.5], 0.3)]);
        assert_eq!(picture.shapes.len(), 1 + 3 + (4 + 3) + 1 + 1);
    }

    #[test]
    fn what_stands_out_is_read_off_the_process() {
        let mdp = GoalWorld { size: 3, goal: vec![0, 1], trap: vec![1, 1] }.mdp().unwrap();
        let said: Vec<(usize, f64)> = mdp
            .notable(|_| false)
            .into_iter()
            .enumerate()
            .filter_map(|(s, x)| Some((s, x?)))
            .collect();
        assert_eq!(said, [(1, 1.0), (4, -1.0)]);
        // States that are no cells are no picture.
        let chain = Chain { cells: 3, slip: 0.0, goal: true };
        assert!(!chain.is_drawn() && chain.open().unwrap().draw().is_none());
    }
}
