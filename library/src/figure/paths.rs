//! Where agents went.

use ivx_op::{Ctx, Figure, One, Op, OpError, declare, shown};

use super::drawing::{Axis, Drawing, Form, Mark, Series, Stroke, Tint};
use super::page::count;
use super::render::render;
use crate::artifact::{Episode, Rollouts};
use crate::env::{Env, Mdp};

declare! {
    /// Episodes as paths over the states of a world (Figure 2.6a), which are the cells of a grid, row after row from
    /// the top. States that end an episode are coloured, and say what coming there pays.
    pub struct Paths = "paths" @ 1 -> Figure {
        /// The episodes.
        of: One<Rollouts>;
        /// The world that they are of.
        r#in: Box<dyn Env>;
        /// How many are drawn: the first of them.
        episodes: usize = 6, in 1.0..=49.0;
        /// How many cells a row has; where 0, as many as there are rows if that is possible, and else all of
        /// them.
        columns: usize = 0, in 0.0..=1e4;
        /// Above the cells.
        title: String = "";
    }
}

impl Op for Paths {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let mdp = self.r#in.mdp()?;
        let n = mdp.n_states();
        if n != self.of.n_states {
            let message =
                format!("the episodes are of {} states, the world has {n}", self.of.n_states);
            return Err(OpError::Failed(message));
        }
        let columns = match self.columns {
            0 if n.isqrt().pow(2) == n => n.isqrt(),
            0 => n,
            given => given.min(n),
        };
        let rows = n.div_ceil(columns);
        let place = |s: usize| (count(s % columns), count(rows - 1 - s / columns));
        let cells = (0..n).flat_map(|s| cell(&mdp, s, place(s))).collect();
        let mut series = vec![Series { marks: cells, ..Series::default() }];
        let shown = self.of.episodes.iter().take(self.episodes).enumerate();
        series.extend(shown.map(|(i, episode)| path(episode, apart(i), place)));
        let axis = |n: usize| Axis {
            range: Some((-0.55, count(n) - 0.45)),
            bare: true,
            ..Axis::default()
        };
        let (x, y) = (axis(columns), axis(rows));
        Ok(render(&Drawing { title: self.title.clone(), x, y, series, ..Drawing::default() }))
    }
}

/// How far a path lies from the middles of its cells, so that those of several are seen.
fn apart(i: usize) -> f64 {
    [0.0, 0.12, -0.12, 0.24, -0.24, 0.36, -0.36][i % 7]
}

/// A cell, and in its lower corner what it pays.
fn cell(mdp: &Mdp, state: usize, at: (f64, f64)) -> Vec<Mark> {
    let pays = mdp.terminal[state].then(|| entered(mdp, state)).flatten();
    let tint = match (mdp.terminal[state], pays) {
        (true, Some(pays)) if pays != 0.0 => Tint::of(pays),
        (true, _) => Tint::Grey,
        (false, _) => Tint::White,
    };
    let (size, form, text) = ((1.0, 1.0), Form::Rectangle, String::new());
    let mut marks = vec![Mark::Shape { at, size, form, tint, text }];
    let pays = pays.map(|pays| shown(pays).replace('-', "−"));
    marks.extend(pays.map(|pays| Mark::Text(at.0 + 0.34, at.1 - 0.47, pays)));
    marks
}

/// What coming to a state pays, where that can be read off a step that leads there for certain.
fn entered(mdp: &Mdp, state: usize) -> Option<f64> {
    let pairs = (0..mdp.n_states()).flat_map(|s| (0..mdp.n_actions()).map(move |a| (s, a)));
    let mut leads = pairs.filter(|&(s, a)| s != state && mdp.next(s, a)[state] == 1.0);
    leads.next().map(|(s, a)| mdp.reward(s, a))
}

fn path(episode: &Episode, by: f64, place: impl Fn(usize) -> (f64, f64)) -> Series {
    let at = |s: &usize| {
        let (x, y) = place(*s);
        (x + by, y + by)
    };
    let mut way: Vec<(f64, f64)> = episode.states.iter().map(at).collect();
    way.dedup();
    let mut marks = vec![Mark::Points(way[..1].to_vec()), Mark::Line(Stroke::Solid, way.clone())];
    if let [.., from, to] = way[..] {
        marks.push(Mark::Arrow { from, to, bend: 0.0, text: String::new() });
    }
    Series { marks, ..Series::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::env::GoalWorld;

    fn paths(states: Vec<usize>, n_states: usize) -> Result<String, String> {
        let actions = ["UP", "DOWN", "LEFT", "RIGHT"].map(str::to_owned).to_vec();
        let episode = Episode { states, ended: true, ..Episode::default() };
        let of = One(Rollouts { n_states, actions, episodes: vec![episode.clone(), episode] });
        let r#in = Box::new(GoalWorld { size: 3, goal: vec![0, 1], trap: vec![1, 1] });
        let paths = Paths { of, r#in, episodes: 1, columns: 0, title: String::new() };
        let figure = paths.run(&Ctx::new("paths", 0, None));
        figure.map(|figure| figure.files["svg"].clone()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_path_goes_from_cell_to_cell_and_ends_are_coloured() {
        // Down from the top right corner, against the wall, and back.
        let found = paths(vec![2, 5, 5, 2, 1], 9).unwrap();
        assert_eq!(found.matches("<rect x=").count(), 9);
        assert_eq!((found.matches(">1<").count(), found.matches(">−1<").count()), (1, 1));
        let way = found.lines().find(|line| line.contains("<polyline")).unwrap();
        let way = way.split('"').nth(1).unwrap();
        assert_eq!(way.split(' ').count(), 4, "{way}");
        assert!(way.starts_with("112.2,24.2 112.2,68.2 112.2,24.2 68.2,24.2"), "{way}");
    }

    #[test]
    fn episodes_of_another_world_are_refused() {
        let why = paths(vec![2, 1], 4).unwrap_err();
        assert_eq!(why, "the episodes are of 4 states, the world has 9");
    }
}
