//! What a world looks like.

use ivx_data::form::failed;
use ivx_data::{Columns, Picture};
use ivx_op::{Ctx, Facts, Op, OpError, Wrong, declare};

use crate::env::{Env, Row};
use crate::luck::Luck;

declare! {
    /// A picture of a world at the start of an episode: the first of those in which `evaluate` lets an agent act on the
    /// same seed. `picture` and `heatmap` show it.
    ///
    /// Of `coin_grid()` and of finite worlds of cells it has a unit a cell, row after row from the top; of `highway(..)`
    /// and `roundabout()` a unit a metre, and shows what is about the agent: its car is green, and others are blue. Other
    /// worlds are not drawn.
    pub struct Scene = "scene" @ 1, stochastic -> Picture {
        /// The world.
        of: Box<dyn Env>;
    }
    rule can_be_drawn;
}

const NOT_DRAWN: &str = "this world gives no picture of itself";

fn can_be_drawn(facts: &Facts<'_>) -> Result<(), Wrong> {
    match facts.arg::<Box<dyn Env>>("of") {
        Some(world) if !world.is_drawn() => Err(Wrong {
            arg: "of",
            message: NOT_DRAWN.to_owned(),
            help: "use one that does: `coin_grid()`, `highway(..)`, `roundabout()`, or a finite one of cells such as \
                   `gridworld()` or `grid_map([..])`; `transition_graph` shows the states of other finite ones"
                .to_owned(),
        }),
        _ => Ok(()),
    }
}

impl Op for Scene {
    fn run(&self, ctx: &Ctx) -> Result<Picture, OpError> {
        let spec = self.of.spec().map_err(failed)?;
        let mut world = self.of.open()?;
        let mut luck = Luck::of(ctx, "evaluate", 0, 0);
        let (mut seen, mut told) = (Columns::zeros(spec.sees, 1), vec![0.0; spec.tells.len()]);
        world.reset(&mut luck, &mut Row::of(&mut seen, 0, &mut told));
        world.draw().ok_or_else(|| OpError::Failed(NOT_DRAWN.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use ivx_data::{Outline, Values};
    use ivx_op::{Artifact as _, Lit, Part};

    use super::*;
    use crate::lanes::Lanes;
    use crate::{
        Acrobot, CartPole, Chain, CoinGrid, GoalWorld, Gridworld, Highway, Minatar, Roundabout,
    };

    fn coin_grid() -> Box<dyn Env> {
        Box::new(CoinGrid {
            pays: vec![1.0, 1.0],
            coins: 2,
            walls: 3,
            limit: 9,
            front_apart: false,
        })
    }

    #[test]
    fn worlds_are_drawn_that_say_so() {
        let release = || "1.1".to_owned();
        let worlds: [(Box<dyn Env>, bool); 9] = [
            (coin_grid(), true),
            (Box::new(GoalWorld { size: 3, goal: vec![0, 1], trap: vec![1, 1] }), true),
            (Box::new(Gridworld { size: 5, wind: 0.0 }), true),
            (
                Box::new(Highway {
                    task: "multi".to_owned(),
                    actions: None,
                    cars: 9,
                    lanes: 4,
                    lane: 3,
                    frames: 3,
                    seconds: 9,
                    release: release(),
                }),
                true,
            ),
            (
                Box::new(Roundabout {
                    task: "exit".to_owned(),
                    exit: 3,
                    actions: None,
                    frames: 3,
                    seconds: 9,
                    release: release(),
                }),
                true,
            ),
            (Box::new(Chain { cells: 3, slip: 0.0, goal: true }), false),
            (Box::new(CartPole {}), false),
            (Box::new(Acrobot {}), false),
            (
                Box::new(Minatar {
                    game: "breakout".to_owned(),
                    sticky: 0.1,
                    ramping: true,
                    limit: 9,
                }),
                false,
            ),
        ];
        for (of, is_drawn) in worlds {
            assert_eq!(of.is_drawn(), is_drawn, "{of:?}");
            let picture = Scene { of }.run(&Ctx::new("scene", 0, None));
            assert_eq!(picture.is_ok(), is_drawn);
            if let Ok(picture) = picture {
                assert_eq!(Picture::decode(&picture.encode()), Some(picture));
            }
        }
    }

    #[test]
    fn what_cannot_be_drawn_is_refused_before_anything_runs() {
        let check = |world: Part| {
            let args = [("of".to_owned(), Lit::Part(world))].into();
            let (over, shapes) = (BTreeMap::new(), BTreeMap::new());
            let given = &["of"];
            let facts = Facts { args: &args, given, over: &over, seen: &over, shapes: &shapes };
            can_be_drawn(&facts).map_err(|wrong| wrong.message)
        };
        assert_eq!(check(Part::new("cart_pole")), Err(NOT_DRAWN.to_owned()));
        let cells = Part::new("gridworld").with("size", 5_i64).with("wind", 0.0);
        assert_eq!(check(cells), Ok(()));
    }

    /// What is drawn is what `evaluate` begins with on the seed.
    #[test]
    fn the_picture_is_of_the_first_episode_of_the_seed() {
        let draw = |seed| Scene { of: coin_grid() }.run(&Ctx::new("scene", seed, None)).unwrap();
        assert_ne!(draw(3), draw(4));
        for seed in 0..5 {
            let lanes =
                Lanes::open(&*coin_grid(), 2, &Ctx::new("evaluate", seed, None), ("evaluate", 0))
                    .unwrap();
            let Values::U8(seen) = lanes.seen().values(0) else { panic!("bytes") };
            let green: Vec<usize> = (0..49).filter(|cell| seen[*cell] == 1).collect();
            let picture = draw(seed);
            let discs = picture.shapes.iter().filter_map(|shape| match shape.outline {
                Outline::Circle([x, y], _) => Some([x, y]),
                _ => None,
            });
            let expected: Vec<[f64; 2]> =
                green.iter().map(|cell| crate::paint::middle(*cell, 7)).collect();
            assert_eq!(discs.take(2).collect::<Vec<_>>(), expected);
        }
    }
}
