//! Finite Markov decision processes.

use ivx_data::pairs;
use ivx_math::bellman::Model;
use ivx_math::moments::real;
use ivx_op::{Array, Ctx, Dim, Labels, Op, OpError, declare};

use super::of_is_finite;
use crate::Env;

/// A finite Markov decision process (Eqn. 2.27), whose rewards are known where an action is taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Mdp {
    /// What the actions are called.
    pub actions: Vec<&'static str>,
    /// `p(s' | s, a)`: `[S, A, S]`. A terminal state is left by no action.
    pub transitions: Vec<f64>,
    /// The reward of each action in each state: `[S, A]`, 0 in terminal states.
    pub rewards: Vec<f64>,
    /// Which states end an episode: `[S]`.
    pub terminal: Vec<bool>,
    /// How probably an episode starts in each state: `[S]`.
    pub start: Vec<f64>,
}

impl Mdp {
    /// One in which every action in a state leads to one state of its own, or to nowhere with probability
    /// left over: `step` says of a state and an action where it leads.
    ///
    /// Rewards are those of entering a state. Episodes start in any state that is not terminal.
    pub(super) fn moving(
        actions: Vec<&'static str>,
        entered: &[Option<f64>],
        step: impl Fn(usize, usize) -> (usize, f64),
    ) -> Self {
        let (n, terminal): (_, Vec<bool>) =
            (entered.len(), entered.iter().map(Option::is_some).collect());
        let mut transitions = vec![0.0; n * actions.len() * n];
        let mut rewards = vec![0.0; n * actions.len()];
        for s in 0..n {
            for a in 0..actions.len() {
                let pair = s * actions.len() + a;
                let (to, moves) = if terminal[s] { (s, 1.0) } else { step(s, a) };
                transitions[pair * n + to] += moves;
                transitions[pair * n + s] += 1.0 - moves;
                if !terminal[s] {
                    rewards[pair] = moves * entered[to].unwrap_or(0.0);
                }
            }
        }
        let open = real(terminal.iter().filter(|end| !**end).count());
        let start = terminal.iter().map(|end| if *end { 0.0 } else { 1.0 / open }).collect();
        Self { actions, transitions, rewards, terminal, start }
    }

    /// How many states there are.
    #[must_use]
    pub fn n_states(&self) -> usize {
        self.terminal.len()
    }

    /// How many actions there are.
    #[must_use]
    pub fn n_actions(&self) -> usize {
        self.actions.len()
    }

    /// How probably each state follows.
    #[must_use]
    pub fn next(&self, state: usize, action: usize) -> &[f64] {
        self.model().next(state, action)
    }

    /// The reward of an action.
    #[must_use]
    pub fn reward(&self, state: usize, action: usize) -> f64 {
        self.model().reward(state, action)
    }

    /// What follows actions and what they pay, without names.
    #[must_use]
    pub fn model(&self) -> Model<'_> {
        let Self { transitions, rewards, terminal, .. } = self;
        Model { transitions, rewards, terminal }
    }

    /// The dimension of the states, by number.
    #[must_use]
    pub fn states(&self) -> Dim {
        Dim::new("state", Labels::count(self.n_states()))
    }

    /// The dimensions of what is said of each action in each state.
    #[must_use]
    pub fn pairs(&self) -> Vec<Dim> {
        let names: Vec<String> = self.actions.iter().map(|name| (*name).to_owned()).collect();
        pairs(self.n_states(), &names)
    }

    /// The numbers of an array over states and actions.
    ///
    /// # Errors
    /// If it is over anything else.
    pub fn table<'a>(&self, x: &'a Array) -> Result<&'a [f64], OpError> {
        table(x, &self.pairs())
    }

    /// The probability of each action in each state.
    ///
    /// # Errors
    /// If the array is no policy in this environment.
    pub fn policy<'a>(&self, x: &'a Array) -> Result<&'a [f64], OpError> {
        policy(x, &self.pairs())
    }
}

fn table<'a>(x: &'a Array, pairs: &[Dim]) -> Result<&'a [f64], OpError> {
    if x.dims == pairs {
        return Ok(&x.values);
    }
    let found: Vec<String> = x.dims.iter().map(|d| format!("{} `{}`", d.len(), d.name)).collect();
    Err(OpError::Failed(format!(
        "expected numbers over {} `state` and {} `action` of this environment, found {}",
        pairs[0].len(),
        pairs[1].len(),
        if found.is_empty() { "one number".to_owned() } else { found.join(" by ") }
    )))
}

/// The probability of each action in each state, which are these.
///
/// # Errors
/// If the array is no policy of them.
pub fn policy<'a>(x: &'a Array, pairs: &[Dim]) -> Result<&'a [f64], OpError> {
    let policy = table(x, pairs)?;
    for (s, row) in policy.chunks(pairs[1].len()).enumerate() {
        let total: f64 = row.iter().sum();
        if row.iter().any(|p| !(0.0..).contains(p)) || (total - 1.0).abs() > 1e-9 {
            let what = "are no distribution over the actions";
            return Err(OpError::Failed(format!("the numbers {row:?} in state {s} {what}")));
        }
    }
    Ok(policy)
}

declare! {
    /// The probability that a state follows an action in a state (Eqn. 2.25).
    pub struct Transitions = "transitions" @ 1 -> Array [state, action, next] {
        /// The environment.
        of: Box<dyn Env>;
    }
    rule of_is_finite;
}

impl Op for Transitions {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let mdp = super::mdp(&*self.of)?;
        let mut dims = mdp.pairs();
        dims.push(Dim { name: "next".to_owned(), ..mdp.states() });
        Ok(Array { dims, values: mdp.transitions })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Chain, Finite as _};
    use super::*;

    #[test]
    fn what_is_no_policy_is_explained() {
        let mdp = Chain { cells: 3, slip: 0.1, goal: true }.mdp().unwrap();
        let policy = |values: Vec<f64>| {
            let policy = Array { dims: mdp.pairs(), values };
            mdp.policy(&policy).map(<[f64]>::to_vec).map_err(|error| error.to_string())
        };
        assert_eq!(policy(vec![0.5; 6]), Ok(vec![0.5; 6]));
        let why = "the numbers [0.5, 0.25] in state 2 are no distribution over the actions";
        assert_eq!(policy(vec![0.5, 0.5, 0.5, 0.5, 0.5, 0.25]), Err(why.into()));
        let why = mdp.table(&Array::series(mdp.states(), vec![0.0; 3])).unwrap_err().to_string();
        let expected = "expected numbers over 3 `state` and 2 `action` of this environment";
        assert_eq!(why, format!("{expected}, found 3 `state`"));
    }
}
