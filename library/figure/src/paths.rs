//! Where agents went.

use ivx_data::{Episode, Rollouts, Walks};
use ivx_op::{Ctx, Figure, One, Op, OpError, declare, shown};
use ivx_world::{Env, Finite, Mdp, world_is_finite};

use super::drawing::{Axis, Drawing, Form, Mark, Series, Stroke, Tint};
use super::page::count;
use super::render::render;

declare! {
    /// Episodes as paths over the cells of a world (Figure 2.6a), from a circle to an arrow. Cells that end an
    /// episode, and those of a map that pay otherwise than most, are coloured and say what coming there pays; walls are
    /// black.
    pub struct Paths = "paths" @ 1 -> Figure {
        /// The episodes.
        of: One<Rollouts>;
        /// The world that they are of.
        r#in: Box<dyn Env>;
        /// How many are drawn: the first of them.
        episodes: usize = 6, in 1.0..=49.0;
        /// Above the cells.
        title: String = "";
    }
    rule world_is_finite;
}

/// More cells than these cannot be told apart.
const MOST: usize = 1600;

/// So many cells beside each other have room for a number.
const ROOM: usize = 20;

impl Op for Paths {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let mdp = ivx_world::mdp(&*self.r#in)?;
        let n = mdp.n_states();
        let columns = self.r#in.finite().and_then(Finite::columns).unwrap_or(n);
        let walks = self.of.walks()?;
        fits(&walks, &mdp, columns)?;
        let rows = n.div_ceil(columns);
        let place = |s: usize| (count(s % columns), count(rows - 1 - s / columns));
        let is_wall = |s| self.r#in.finite().is_some_and(|finite| finite.is_wall(s));
        let notable = mdp.notable(is_wall);
        let cells = (0..n).flat_map(|s| {
            if is_wall(s) {
                wall(place(s))
            } else {
                cell(mdp.terminal[s], notable[s], place(s), columns <= ROOM)
            }
        });
        let cells = cells.collect();
        let mut series = vec![Series { marks: cells, ..Series::default() }];
        let shown = walks.episodes.iter().take(self.episodes).enumerate();
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

/// Whether there is something to draw, and every step is one that the world can make.
fn fits(walks: &Walks, mdp: &Mdp, columns: usize) -> Result<(), OpError> {
    let (n, of) = (mdp.n_states(), walks.n_states);
    let steps = walks.episodes.iter().flat_map(|e| e.states.windows(2).zip(&e.actions));
    let why = if n > MOST || columns > 100 {
        format!("{n} cells are too many to be drawn")
    } else if walks.episodes.is_empty() {
        "there are no episodes to draw".to_owned()
    } else if of != n || walks.actions != mdp.actions {
        format!("the episodes are of another world: of {of} states, and this one has {n}")
    } else if let Some((pair, action)) =
        { steps }.find(|(pair, action)| mdp.next(pair[0], **action)[pair[1]] == 0.0)
    {
        let (action, pair) = (&mdp.actions[*action], (pair[0], pair[1]));
        format!(
            "the episodes are of another world: in this one {action} does not lead from {} to {}",
            pair.0, pair.1
        )
    } else {
        return Ok(());
    };
    Err(OpError::Failed(why))
}

/// How far a path lies from the middles of its cells, so that those of several are seen.
fn apart(i: usize) -> f64 {
    [0.0, 0.12, -0.12, 0.24, -0.24, 0.36, -0.36][i % 7]
}

/// A cell that nobody comes to.
fn wall(at: (f64, f64)) -> Vec<Mark> {
    let (size, form, text) = ((1.0, 1.0), Form::Rectangle, String::new());
    vec![Mark::Shape { at, size, form, tint: Tint::Black, text }]
}

/// A cell, and what it pays, if that is not the usual: in its lower corner where there is room.
fn cell(ends: bool, pays: Option<f64>, at: (f64, f64), has_room: bool) -> Vec<Mark> {
    let tint = match (ends, pays) {
        (_, Some(pays)) if pays != 0.0 => Tint::of(pays),
        (true, _) => Tint::Grey,
        (false, _) => Tint::White,
    };
    let (size, form, text) = ((1.0, 1.0), Form::Rectangle, String::new());
    let mut marks = vec![Mark::Shape { at, size, form, tint, text }];
    let pays = pays.map(|pays| shown(pays).replace('-', "−"));
    // A longer number begins further left, and ends where a shorter one does.
    let long = pays.as_ref().map_or(0, |text| text.chars().count().saturating_sub(2));
    let left = 0.3 - 0.06 * count(long.min(5));
    let corner = if has_room { (at.0 + left, at.1 - 0.45) } else { (at.0, at.1 - 0.4) };
    marks.extend(pays.map(|pays| Mark::Text(corner.0, corner.1, pays)));
    marks
}

fn path(episode: &Episode, by: f64, place: impl Fn(usize) -> (f64, f64)) -> Series {
    let at = |s: &usize| {
        let (x, y) = place(*s);
        (x + by, y + by)
    };
    let mut way: Vec<(f64, f64)> = episode.states.iter().map(at).collect();
    way.dedup();
    let (size, text) = ((0.28, 0.28), String::new());
    let start = Mark::Shape { at: way[0], size, form: Form::Circle, tint: Tint::White, text };
    let mut marks = vec![start, Mark::Line(Stroke::Solid, way.clone())];
    if let [.., from, to] = way[..] {
        marks.push(Mark::Arrow { from, to, bend: 0.0, text: String::new() });
    }
    Series { marks, ..Series::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_world::GoalWorld;

    fn paths(walks: &[(&[usize], &[usize])], n_states: usize) -> Result<String, String> {
        let actions = ["UP", "DOWN", "LEFT", "RIGHT"].map(str::to_owned).to_vec();
        let episodes = walks.iter().map(|(states, actions)| {
            let (states, rewards) = (states.to_vec(), vec![0.0; actions.len()]);
            Episode { states, actions: actions.to_vec(), rewards, ended: true }
        });
        let of = One(Walks { n_states, actions, episodes: episodes.collect() }.into());
        let r#in = Box::new(GoalWorld { size: 3, goal: vec![0, 1], trap: vec![1, 1] });
        let paths = Paths { of, r#in, episodes: 1, title: String::new() };
        let figure = paths.run(&Ctx::new("paths", 0, None));
        figure.map(|figure| figure.files["svg"].clone()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_path_goes_from_cell_to_cell_and_ends_are_coloured() {
        // Down from the top right corner, against the wall, and back.
        let walk: (&[_], &[_]) = (&[2, 5, 5, 2, 1], &[1, 3, 0, 2]);
        let found = paths(&[walk, walk], 9).unwrap();
        assert_eq!(found.matches("<rect x=").count(), 9);
        assert_eq!((found.matches(">1<").count(), found.matches(">−1<").count()), (1, 1));
        let way = found.lines().find(|line| line.contains("<polyline")).unwrap();
        let way = way.split('"').nth(1).unwrap();
        assert_eq!(way.split(' ').count(), 4, "{way}");
        assert!(way.starts_with("112.2,24.2 112.2,68.2 112.2,24.2 68.2,24.2"), "{way}");
    }

    #[test]
    fn episodes_of_another_world_are_refused() {
        let why = |walks: &[(&[usize], &[usize])], n| paths(walks, n).unwrap_err();
        let another = "the episodes are of another world: ";
        let fewer = why(&[(&[2, 1], &[2])], 4);
        assert_eq!(fewer, format!("{another}of 4 states, and this one has 9"));
        let jumps = why(&[(&[2, 5], &[2])], 9);
        assert_eq!(jumps, format!("{another}in this one LEFT does not lead from 2 to 5"));
        assert_eq!(why(&[], 9), "there are no episodes to draw");
    }
}
