//! What follows in a world that is a table of states.

use ivx_data::{Act, Columns, Values};

use super::Mdp;
use crate::foresight::Foresight;

/// Where one may be, and how probably: a step moves all probability at once, so that what plans return is their mean
/// return and not that of some luck.
///
/// ```text
/// b'(s') = Σ_s b(s) p(s' | s, a),   r = Σ_s b(s) r(s, a)
/// ```
pub(super) struct Foreseen {
    n_actions: usize,
    /// The states that may follow an action in a state, and how probably.
    follow: Vec<Vec<(usize, f64)>>,
    rewards: Vec<f64>,
    terminal: Vec<bool>,
    /// Where one may be after a step.
    next: Vec<f64>,
}

impl Foreseen {
    pub(super) fn of(mdp: &Mdp) -> Self {
        let possible = |row: &[f64]| {
            let each = row.iter().enumerate().filter(|(_, p)| **p > 0.0);
            each.map(|(state, p)| (state, *p)).collect()
        };
        Self {
            n_actions: mdp.n_actions(),
            follow: mdp.transitions.chunks_exact(mdp.n_states()).map(possible).collect(),
            rewards: mdp.rewards.clone(),
            terminal: mdp.terminal.clone(),
            next: vec![0.0; mdp.n_states()],
        }
    }
}

impl Foresight for Foreseen {
    fn width(&self) -> usize {
        self.terminal.len()
    }

    fn place(&self, seen: &Columns, row: usize, state: &mut [f64]) {
        let Values::Index(states) = seen.values(0) else { panic!("the number of a state") };
        state.fill(0.0);
        state[states[row] as usize] = 1.0;
    }

    fn step(&mut self, state: &mut [f64], act: Act<'_>) -> (f64, bool) {
        self.next.fill(0.0);
        let (mut reward, mut over) = (0.0, true);
        for (s, &is_here) in state.iter().enumerate().filter(|(_, p)| **p > 0.0) {
            // Nobody leaves a terminal state, and nothing is paid there.
            if self.terminal[s] {
                self.next[s] += is_here;
                continue;
            }
            let pair = s * self.n_actions + act.index();
            reward += is_here * self.rewards[pair];
            for &(to, p) in &self.follow[pair] {
                self.next[to] += is_here * p;
                over &= self.terminal[to];
            }
        }
        state.copy_from_slice(&self.next);
        (reward, over)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Chain, Finite as _, Gridworld};
    use super::*;
    use crate::Env as _;

    #[test]
    fn all_that_may_follow_is_weighed_by_hand() {
        // From the second of three cells LEFT slips with ¼ and RIGHT comes to the goal.
        let mut foresight = Chain { cells: 3, slip: 0.25, goal: true }.foresight().unwrap();
        let mut at = [0.0, 1.0, 0.0];
        assert_eq!(foresight.step(&mut at, Act::Index(0)), (0.0, false));
        assert_eq!(at, [0.75, 0.25, 0.0]);
        assert_eq!(foresight.step(&mut at, Act::Index(1)), (0.25, false));
        assert_eq!(at, [0.0, 0.75, 0.25]);
        assert_eq!(foresight.step(&mut at, Act::Index(1)), (0.75, true));
        assert_eq!(foresight.step(&mut at, Act::Index(1)), (0.0, true));
        assert_eq!(at, [0.0, 0.0, 1.0]);
    }

    #[test]
    fn the_most_probable_state_is_not_all_that_follows() {
        // East, blown with ½: 0.125 north, 0.25 to stay, 0.625 east, of which east alone is the most probable.
        let env = Gridworld { size: 2, wind: 0.5 };
        let mut foresight = env.foresight().unwrap();
        let mut at = [0.0, 0.0, 1.0, 0.0];
        foresight.step(&mut at, Act::Index(3));
        assert_eq!(at, env.mdp().unwrap().next(2, 3));
        assert_ne!(at, [0.0, 0.0, 0.0, 1.0]);
        let mut seen = Columns::zeros(env.spec().unwrap().sees, 2);
        let (Values::Index(states), _) = seen.values_mut(0) else { panic!("a state") };
        states[1] = 3;
        foresight.place(&seen, 1, &mut at);
        assert_eq!((at, foresight.width()), ([0.0, 0.0, 0.0, 1.0], 4));
    }
}
