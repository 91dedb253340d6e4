//! Finite decision processes as graphs.

use std::f64::consts::TAU;

use ivx_op::{Ctx, Figure, Op, OpError, declare, shown};
use ivx_world::{Env, Finite, Mdp, of_is_finite};

use super::drawing::{Axis, Drawing, Form, Mark, Series, Tint};
use super::page::count;
use super::render::render;
use super::text::chance;

declare! {
    /// The transition graph of a world (Figures 2.7 and 2.8): white nodes are states, black ones actions, and grey
    /// squares states that end an episode. Arrows say how probably a state follows, where that is not
    /// certain, and actions what they pay, where that is not 0.
    pub struct TransitionGraph = "transition_graph" @ 1 -> Figure {
        /// The world.
        of: Box<dyn Env>;
        /// Above the graph.
        title: String = "";
    }
    rule of_is_finite;
}

/// More arrows than these cannot be told apart.
const MOST: usize = 120;

/// And no more states in a row.
const ROW: usize = 12;

/// How far apart states are.
const APART: f64 = 3.0;

/// How large they are.
const WIDE: f64 = 0.9;

/// How far from them their actions are.
const OFF: f64 = 1.1;

impl Op for TransitionGraph {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let mdp = ivx_world::mdp(&*self.of)?;
        let n = mdp.n_states();
        let columns = self.of.finite().and_then(Finite::columns).unwrap_or(n);
        let acted = |pair: usize| !mdp.terminal[pair / mdp.n_actions()];
        let follow = mdp.transitions.chunks(n).enumerate().filter(|(pair, _)| acted(*pair));
        let n_arrows: usize =
            follow.map(|(_, next)| next.iter().filter(|p| **p > 0.0).count()).sum();
        if columns > ROW || n_arrows > MOST {
            return Err(OpError::Failed(format!(
                "{n} states with {} actions each are too many for a graph that can be read: show \
                 what is said of them as a `heatmap`",
                mdp.n_actions()
            )));
        }
        let rows = n.div_ceil(columns);
        let place = |s: usize| (APART * count(s % columns), APART * count(rows - 1 - s / columns));
        let mut marks = Vec::new();
        let is_wall = |s: &usize| self.of.finite().is_some_and(|finite| finite.is_wall(*s));
        for s in (0..n).filter(|s| !is_wall(s)) {
            if !mdp.terminal[s] {
                (0..mdp.n_actions()).for_each(|a| marks.extend(action(&mdp, (s, a), place)));
            }
            marks.push(state(&mdp, s, place(s)));
        }
        let axis = |n: usize| Axis {
            range: Some((-1.8, APART * count(n - 1) + 1.8)),
            bare: true,
            ..Axis::default()
        };
        let (x, y) = (axis(columns), axis(rows));
        let series = vec![Series { marks, ..Series::default() }];
        Ok(render(&Drawing { title: self.title.clone(), x, y, series, ..Drawing::default() }))
    }
}

fn state(mdp: &Mdp, state: usize, at: (f64, f64)) -> Mark {
    let (form, tint) = if mdp.terminal[state] {
        (Form::Rectangle, Tint::Grey)
    } else {
        (Form::Circle, Tint::White)
    };
    Mark::Shape { at, size: (WIDE, WIDE), form, tint, text: state.to_string() }
}

/// The node of an action between its state and where it leads, with what goes in and comes out.
fn action(
    mdp: &Mdp,
    (state, action): (usize, usize),
    place: impl Fn(usize) -> (f64, f64),
) -> Vec<Mark> {
    let from = place(state);
    let at = beside(mdp, (state, action), &place);
    let mut marks = vec![Mark::Arrow {
        from: short(at, from, WIDE / 2.0),
        to: short(from, at, 0.12),
        bend: 0.0,
        text: String::new(),
    }];
    let next = mdp.next(state, action);
    for (to, p) in next.iter().enumerate().filter(|(_, p)| **p > 0.0) {
        let text = if *p == 1.0 { String::new() } else { chance(*p) };
        let bend = if to == state { 0.45 } else { 0.2 };
        marks.push(Mark::Arrow { from: at, to: short(at, place(to), WIDE / 2.0), bend, text });
    }
    let size = (0.24, 0.24);
    marks.push(Mark::Shape {
        at,
        size,
        form: Form::Circle,
        tint: Tint::Black,
        text: String::new(),
    });
    let pays = mdp.reward(state, action);
    let pays = if pays == 0.0 { String::new() } else { format!(": {}", shown(pays)) };
    let text = format!("{}{pays}", mdp.actions[action]).replace('-', "−");
    // Outside of the circle that the actions of a state are on.
    let up = if at.1 < from.1 { -0.55 } else { 0.1 };
    marks.push(Mark::Text(at.0, at.1 + up, text));
    marks
}

/// Where an action's node is: to the left of the way to where it mostly leads; where that is nowhere else, above, and
/// turned by a part of a circle for each action. Where that is taken, it is turned on.
fn beside(
    mdp: &Mdp,
    (state, action): (usize, usize),
    place: impl Fn(usize) -> (f64, f64),
) -> (f64, f64) {
    let (x, y) = place(state);
    let turned = |action: usize| {
        let next = mdp.next(state, action).iter().enumerate().filter(|(s, _)| *s != state);
        let away = next.filter(|(_, p)| **p > 0.0).map(|(s, p)| (place(s), *p));
        let (dx, dy) = away.fold((0.0, 0.0), |(dx, dy), ((to_x, to_y), p)| {
            (dx + p * (to_x - x), dy + p * (to_y - y))
        });
        if dx.hypot(dy) < 1e-9 {
            TAU * (0.25 + count(action) / count(mdp.n_actions()))
        } else {
            dy.atan2(dx) + TAU / 9.0
        }
    };
    let apart = TAU / 12.0;
    let near = |a: f64, b: f64| (a - b + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
    let mut taken: Vec<f64> = Vec::new();
    for action in 0..=action {
        let mut angle = turned(action);
        let is_free =
            |angle: f64| taken.iter().all(|other| near(*other, angle).abs() > apart * 0.99);
        // As often as there are actions, since more places than these are never taken.
        for _ in 0..mdp.n_actions() {
            if is_free(angle) {
                break;
            }
            angle += apart;
        }
        taken.push(angle);
    }
    let angle = taken[action];
    (x + OFF * angle.cos(), y + OFF * angle.sin())
}

/// A place on the way that is `by` short of its end.
fn short(from: (f64, f64), to: (f64, f64), by: f64) -> (f64, f64) {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let share = 1.0 - (by / dx.hypot(dy).max(1e-9)).min(1.0);
    (from.0 + share * dx, from.1 + share * dy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_world::{Chain, Gridworld};

    fn graph(of: Box<dyn Env>) -> Result<String, String> {
        let graph = TransitionGraph { of, title: String::new() };
        let figure = graph.run(&Ctx::new("transition_graph", 0, None));
        figure.map(|figure| figure.files["svg"].clone()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_chain_has_its_states_actions_and_chances() {
        let found = graph(Box::new(Chain { cells: 4, slip: 0.1, goal: true })).unwrap();
        // Three states to act in, with two actions each; the goal is a square.
        assert_eq!(found.matches("<circle").count(), 3 + 6);
        assert_eq!(found.matches(r##"fill="#d4d4d4""##).count(), 1);
        let texts = |text: &str| found.matches(&format!(">{text}<")).count();
        // LEFT in the first cell leads nowhere else, and so is certain to stay.
        assert_eq!([texts("LEFT"), texts("RIGHT"), texts("RIGHT: 1")], [3, 2, 1]);
        assert_eq!([texts("0.9"), texts("0.1"), texts("1")], [2, 2, 1]);
    }

    #[test]
    fn actions_there_and_back_are_on_two_sides() {
        let mdp = Chain { cells: 3, slip: 0.0, goal: false }.mdp().unwrap();
        let place = |s: usize| (APART * count(s), 0.0);
        let (right, left) = (beside(&mdp, (0, 1), place), beside(&mdp, (1, 0), place));
        assert!(right.1 > 0.3 && left.1 < -0.3, "{right:?} {left:?}");
        assert!(right.0 > 0.3 && left.0 < 2.7, "{right:?} {left:?}");
    }

    #[test]
    fn actions_that_do_the_same_are_told_apart() {
        let mdp = Gridworld { size: 2, wind: 1.0 }.mdp().unwrap();
        let place = |s: usize| (APART * count(s % 2), APART * count(s / 2));
        let nodes: Vec<(f64, f64)> = (0..4).map(|a| beside(&mdp, (0, a), place)).collect();
        for (i, a) in nodes.iter().enumerate() {
            for b in &nodes[..i] {
                assert!((a.0 - b.0).hypot(a.1 - b.1) > 0.4, "{nodes:?}");
            }
        }
    }

    #[test]
    fn what_is_too_large_is_refused() {
        let why = graph(Box::new(Gridworld { size: 5, wind: 0.3 })).unwrap_err();
        assert!(why.contains("25 states with 4 actions each are too many"), "{why}");
        assert!(graph(Box::new(Gridworld { size: 5, wind: 0.0 })).is_ok());
        assert!(graph(Box::new(Chain { cells: 13, slip: 0.0, goal: true })).is_err());
    }
}
