//! Where agents were.

use ivx_data::Rollouts;
use ivx_op::{Array, Ctx, One, Op, OpError, declare};

declare! {
    /// How often each action was taken in each state.
    pub struct Visits = "visits" @ 1 -> Array [state, action] {
        /// The episodes.
        of: One<Rollouts>;
    }
    rule super::of_is_walked;
}

impl Op for Visits {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let walks = self.of.walks()?;
        let width = walks.actions.len();
        let mut values = vec![0.0; walks.n_states * width];
        for (state, action) in walks.episodes.iter().flat_map(|e| e.states.iter().zip(&e.actions)) {
            values[state * width + action] += 1.0;
        }
        Ok(Array { dims: walks.pairs(), values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agent::strolls;

    #[test]
    fn every_step_is_counted() {
        let of = One(Rollouts::from(strolls(1)));
        let found = Visits { of }.run(&Ctx::new("visits", 0, None)).unwrap();
        assert_eq!(found.values, [0.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    }
}
