//! The reward curve as data at given places.

use ivx_data::{Dataset, Form};
use ivx_op::{Ctx, Facts, Op, OpError, Shapes, declare};

use super::{Points, Reward};

declare! {
    /// Given actions and their mean rewards, without noise, to learn from.
    pub struct Observe = "observe" @ 1 -> Dataset {
        /// The reward curve.
        reward: Box<dyn Reward>;
        /// The actions.
        at: Box<dyn Points>;
    }
    shapes pairs;
}

#[expect(clippy::unnecessary_wraps, reason = "shapes may not be known")]
fn pairs(_: &Facts<'_>) -> Option<Shapes> {
    Some(Form::default().shapes())
}

impl Op for Observe {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        let points = self.at.places()?;
        let rewards = points.iter().map(|&a| self.reward.mean(a)).collect();
        Ok(Dataset::pairs(points, rewards))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Grid, Sinusoids};
    use super::*;

    #[test]
    fn each_place_has_what_the_curve_is_there() {
        let reward = || Box::new(Sinusoids {});
        let at = Box::new(Grid { low: -1.0, high: 1.0, points: 3 });
        let data = Observe { reward: reward(), at }.run(&Ctx::new("observe", 0, None)).unwrap();
        assert_eq!(data.x, [-1.0, 0.0, 1.0]);
        assert_eq!(data.y, [-1.0, 0.0, 1.0].map(|a| reward().mean(a)));
    }
}
