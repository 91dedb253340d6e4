//! Worlds that pay otherwise.

use ivx_math::moments::real;
use ivx_op::{Facts, Function, Inputs, OpError, Wrong, declare};

use super::{Finite, Mdp, Paid, is_finite};
use crate::Env;

/// What a step is said to be.
#[derive(Clone, Copy, Debug)]
pub struct Taken;

impl Inputs for Taken {
    const NAMES: &'static [&'static str] = &["state", "action", "next", "reward", "row", "column"];
}

declare! {
    /// A world with a table of states that pays what a function of the spec says of each step, in the place of its own
    /// rewards: `let shaped(reward: Float, next: Float) = reward - 0.1 * next`, and `rewarded(world, by: shaped)`.
    ///
    /// The function is given, by the names of its arguments, the numbers of the `state`, the `action` and the `next` state,
    /// the `reward` that the world itself pays, and the `row` and the `column` of the next state, from 0 at the top left,
    /// where states are cells; otherwise all are in one row.
    pub struct Rewarded = "rewarded" @ 1 {
        /// The world.
        world: Box<dyn Env>;
        /// What a step pays.
        by: Function<Taken>;
    }
    rule of_a_finite_world;
}

fn of_a_finite_world(facts: &Facts<'_>) -> Result<(), Wrong> {
    is_finite(facts, "world")
}

impl Rewarded {
    fn inner(&self) -> Option<&dyn Finite> {
        self.world.finite()
    }
}

impl Finite for Rewarded {
    fn mdp(&self) -> Result<Mdp, OpError> {
        let of = super::mdp(&*self.world)?;
        let (n, n_actions) = (of.n_states(), of.n_actions());
        let columns = self.columns().unwrap_or(n);
        let mut paid = vec![0.0; n * n_actions * n];
        for (s, a) in (0..n).flat_map(|s| (0..n_actions).map(move |a| (s, a))) {
            if of.terminal[s] {
                continue;
            }
            let follow: Vec<usize> = (0..n).filter(|next| of.next(s, a)[*next] > 0.0).collect();
            let each = |of: &dyn Fn(usize) -> f64| follow.iter().map(|next| of(*next)).collect();
            let given: [Vec<f64>; 6] = [
                each(&|_| real(s)),
                each(&|_| real(a)),
                each(&real),
                each(&|next| of.paid(s, a, next)),
                each(&|next| real(next / columns)),
                each(&|next| real(next % columns)),
            ];
            let pays = self.by.over(&given.each_ref().map(Vec::as_slice), follow.len());
            for (next, pays) in follow.into_iter().zip(pays) {
                if !pays.is_finite() {
                    let action = &of.actions[a];
                    let why = format!("the function pays {pays} for {action} from {s} to {next}");
                    return Err(OpError::Failed(why));
                }
                paid[(s * n_actions + a) * n + next] = pays;
            }
        }
        Ok(Mdp::paying(of.actions, of.transitions, Paid::Leading(paid), of.terminal, of.start))
    }

    fn columns(&self) -> Option<usize> {
        self.inner().and_then(Finite::columns)
    }

    fn pays(&self) -> bool {
        let pays = |mdp: Mdp| match mdp.paid {
            Paid::Leading(paid) => paid.iter().any(|paid| *paid != 0.0),
            _ => true,
        };
        self.mdp().map_or(true, pays)
    }

    fn is_wall(&self, state: usize) -> bool {
        self.inner().is_some_and(|inner| inner.is_wall(state))
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Formula, Maths, Node};

    use super::*;
    use crate::{CartPole, Chain, Gridworld};

    /// `of(inputs)` of a function with these arguments.
    fn rewarded(world: Box<dyn Env>, inputs: &[&str], maths: Maths) -> Rewarded {
        let places = (0..inputs.len()).map(Node::Input).collect();
        let inputs = inputs.iter().map(|name| (*name).to_owned()).collect();
        let by = Function::new(&Formula { inputs, body: Node::Of(maths, places) });
        Rewarded { world, by }
    }

    #[test]
    fn steps_pay_what_the_function_says() {
        // In a chain of three, 2 · 1 for the step to the goal, where it was 1.
        let chain = || Box::new(Chain { cells: 3, slip: 0.5, goal: true });
        let by_hand = rewarded(chain(), &["next", "reward"], Maths::Mul);
        let mdp = by_hand.mdp().unwrap();
        assert_eq!((mdp.paid(1, 1, 2), mdp.rewards[3]), (2.0, 2.0));
        assert_eq!(mdp.rewards[..3], [0.0; 3]);
        // LEFT from 1 stays with ½: the mean of 1 and 0.
        let coming = rewarded(chain(), &["next"], Maths::Abs).mdp().unwrap();
        assert_eq!(
            (coming.rewards[2], coming.paid(1, 0, 1), coming.paid(1, 0, 0)),
            (0.5, 1.0, 0.0)
        );
        assert_eq!(coming.rewards[4..], [0.0; 2]);
    }

    #[test]
    fn cells_have_rows_and_columns() {
        // 0 1
        // 2 3
        let world = || Box::new(Gridworld { size: 2, wind: 0.0 });
        assert!(!Env::pays(&*world()));
        let rows = rewarded(world(), &["row"], Maths::Abs);
        assert_eq!((Finite::pays(&rows), Finite::columns(&rows)), (true, Some(2)));
        let rows = rows.mdp().unwrap();
        // South from 1, north and east from it.
        assert_eq!([2, 0, 3].map(|a| rows.reward(1, a)), [1.0, 0.0, 0.0]);
        let columns = rewarded(world(), &["column"], Maths::Abs).mdp().unwrap();
        assert_eq!([2, 0, 1].map(|a| columns.reward(1, a)), [1.0, 1.0, 0.0]);
    }

    #[test]
    fn what_is_no_reward_and_no_table_is_told() {
        let why =
            rewarded(Box::new(Gridworld { size: 2, wind: 0.0 }), &["state"], Maths::Log).mdp();
        assert_eq!(why.unwrap_err().to_string(), "the function pays -inf for N from 0 to 0");
        let pole = rewarded(Box::new(CartPole {}), &["state"], Maths::Abs).mdp();
        assert!(pole.unwrap_err().to_string().contains("no table of states"));
    }
}
