//! Trying plans at random.

use ivx_data::Misfit;
use ivx_op::{OpError, declare};
use ivx_world::Luck;

use super::best::Best;
use super::{Objective, Planner, Planning, Space, sized};

declare! {
    /// The best of plans that are drawn: each number evenly between its bounds or among those that there are, and one
    /// without two bounds from a normal about its start with a standard deviation of 1. The start is tried besides.
    pub struct RandomShooting = "random_shooting" @ 1 {
        /// How many plans are drawn.
        samples: usize = 1_000, in 1.0..=1e6;
    }
}

impl Planner for RandomShooting {
    fn fits(&self, _: &Space, _: usize) -> Result<(), Misfit> {
        Ok(())
    }

    fn open(&self) -> Box<dyn Planning> {
        Box::new(Shooting { samples: self.samples, ..Shooting::default() })
    }
}

#[derive(Default)]
struct Shooting {
    samples: usize,
    /// `[rows, samples + 1, len]`, that of the start first.
    tried: Vec<f64>,
    worth: Vec<f64>,
}

impl Planning for Shooting {
    fn plan(
        &mut self,
        of: &mut dyn Objective,
        plans: &mut [f64],
        worth: &mut [f64],
        luck: &mut Luck,
    ) -> Result<(), OpError> {
        let (rows, len, n) = (of.rows(), of.len(), self.samples + 1);
        let tried = sized(&mut self.tried, rows * n * len);
        for (sample, i) in (0..n).flat_map(|sample| (0..len).map(move |i| (sample, i))) {
            let drawn = (sample > 0).then(|| draw(of.space(), i, luck));
            for row in 0..rows {
                let start = plans[row * len + i];
                tried[(row * n + sample) * len + i] = match drawn {
                    None => of.space().clip(i, start),
                    Some(Drawn::Number(x)) => x,
                    Some(Drawn::Away(by)) => of.space().clip(i, start + by),
                };
            }
        }
        let tried_worth = sized(&mut self.worth, rows * n);
        of.worth(&self.tried, n, tried_worth);
        let mut best = Best::none(plans, worth, len);
        best.see(&self.tried, &self.worth);
        best.found()
    }
}

#[derive(Clone, Copy)]
enum Drawn {
    Number(f64),
    /// So far from the start.
    Away(f64),
}

fn draw(space: &Space, i: usize, luck: &mut Luck) -> Drawn {
    match space {
        Space::Discrete(n) => {
            Drawn::Number(f64::from(luck.below(u32::try_from(*n).expect("far fewer"))))
        }
        Space::Continuous { low, high } if low[i].is_finite() && high[i].is_finite() => {
            Drawn::Number(luck.between(low[i], high[i]))
        }
        Space::Continuous { .. } => Drawn::Away(luck.normal()),
    }
}
