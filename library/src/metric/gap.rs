//! What a decision costs against the truth (Example 2.8).

use ivx_data::Decision;
use ivx_op::{Array, Ctx, One, Op, OpError, declare};
use ivx_world::Reward;

declare! {
    /// The optimality gap: the highest true reward among the candidates, less that of the choice.
    pub struct Regret = "regret" @ 1 -> Array {
        /// The decision.
        decision: One<Decision>;
        /// The true reward.
        under: Box<dyn Reward>;
    }
}

impl Op for Regret {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let rewards = self.decision.candidates.iter().map(|&a| self.under.mean(a));
        let best = rewards.fold(f64::NEG_INFINITY, f64::max);
        Ok(Array::scalar(best - self.under.mean(self.decision.action)))
    }
}

declare! {
    /// The hallucination gap: the reward the agent believes in, less the true reward of its choice.
    pub struct Hallucination = "hallucination" @ 1 -> Array {
        /// The decision.
        decision: One<Decision>;
        /// The true reward.
        under: Box<dyn Reward>;
    }
}

impl Op for Hallucination {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        Ok(Array::scalar(self.decision.believed - self.under.mean(self.decision.action)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_world::Sinusoids;

    #[test]
    fn both_gaps_of_one_decision() {
        // r*(0) = 0.2 and r*(1/2) = 1.05, the better of the two.
        let decision = Decision { action: 0.0, believed: 1.5, candidates: vec![0.0, 0.5] };
        let ctx = Ctx::new("", 0, None);
        let (decision, under) = (One(decision), || Box::new(Sinusoids {}));
        let regret = Regret { decision: decision.clone(), under: under() }.run(&ctx).unwrap();
        assert!((regret.values[0] - 0.85).abs() < 1e-12);
        let hallucination = Hallucination { decision, under: under() }.run(&ctx).unwrap();
        assert!((hallucination.values[0] - 1.3).abs() < 1e-12);
    }
}
