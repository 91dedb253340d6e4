//! Where policies lead (§C.1.2).

use ivx_math::markov_chain::{hits, induced, occupancy};
use ivx_op::{Array, Ctx, Dim, Labels, One, Op, OpError, declare};
use ivx_world::{Env, world_is_finite};

declare! {
    /// How probably a policy is in a state after each number of steps from another on, by the Markov chain that it
    /// makes with the environment: `(P^π)^l[from, to]`, from `l` = 0 on.
    pub struct Reach = "reach" @ 1 -> Array [l] {
        /// The probability of each action in each state.
        policy: One<Array>;
        /// The environment.
        r#in: Box<dyn Env>;
        /// Where it starts.
        from: usize, in 0.0..;
        /// Where it may come to.
        to: usize, in 0.0..;
        /// The most steps.
        steps: usize = 150, in 0.0..=1e6, unit "steps";
        /// Whether to have been there counts, and not only to be there.
        ever: bool = false;
    }
    rule world_is_finite;
}

impl Op for Reach {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let mdp = ivx_world::mdp(&*self.r#in)?;
        let n_states = mdp.n_states();
        if let Some(state) = [self.from, self.to].into_iter().find(|state| *state >= n_states) {
            return Err(OpError::Failed(format!("there is no state {state} among {n_states}")));
        }
        let chain = induced(&mdp.model(), mdp.policy(&self.policy)?);
        let reached = if self.ever { hits } else { occupancy };
        let steps = Labels::count(self.steps + 1);
        Ok(Array::series(Dim::new("l", steps), reached(&chain, (self.from, self.to), self.steps)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::UniformPolicy;
    use super::*;
    use ivx_world::Chain;

    #[test]
    fn a_walk_of_three_cells_by_hand() {
        let ctx = Ctx::new("reach", 0, None);
        let env = || Box::new(Chain { cells: 3, slip: 0.0, goal: false });
        let reach = |ever, to| {
            let policy = One(UniformPolicy { r#in: env() }.run(&ctx).unwrap());
            Reach { policy, r#in: env(), from: 0, to, steps: 2, ever }.run(&ctx)
        };
        assert_eq!(reach(false, 2).unwrap().values, [0.0, 0.0, 0.25]);
        assert_eq!(reach(false, 0).unwrap().values, [1.0, 0.5, 0.5]);
        assert_eq!(reach(true, 1).unwrap().values, [0.0, 0.5, 0.75]);
        assert!(reach(false, 3).is_err());
    }
}
