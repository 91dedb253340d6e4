//! The reward curve at places.

use ivx_op::{Array, Ctx, Op, OpError, declare};

use super::{Points, Reward, curve};

declare! {
    /// The mean reward of each action.
    pub struct RewardAt = "reward_at" @ 1 -> Array [x] {
        /// The reward curve.
        reward: Box<dyn Reward>;
        /// The actions.
        at: Box<dyn Points>;
    }
}

impl Op for RewardAt {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let points = self.at.points()?;
        let rewards = points.iter().map(|&a| self.reward.mean(a)).collect();
        Ok(curve(points, rewards))
    }
}
