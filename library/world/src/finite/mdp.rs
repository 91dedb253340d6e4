//! Finite Markov decision processes.

use ivx_data::pairs;
use ivx_math::bellman::Model;
use ivx_math::moments::real;
use ivx_op::{Array, Ctx, Dim, Labels, Op, OpError, declare};

use super::of_is_finite;
use crate::Env;

/// A finite Markov decision process (Eqn. 2.27).
#[derive(Clone, Debug, PartialEq)]
pub struct Mdp {
    /// What the actions are called.
    pub actions: Vec<String>,
    /// `p(s' | s, a)`: `[S, A, S]`. A terminal state is left by no action.
    pub transitions: Vec<f64>,
    /// The mean reward of each action in each state: `[S, A]`, 0 in terminal states.
    pub rewards: Vec<f64>,
    /// What is paid where that depends on what follows.
    pub paid: Paid,
    /// Which states end an episode: `[S]`.
    pub terminal: Vec<bool>,
    /// How probably an episode starts in each state: `[S]`.
    pub start: Vec<f64>,
}

/// What is paid on a step, beside what an action pays wherever it leads.
#[derive(Clone, Debug, PartialEq)]
pub enum Paid {
    /// Nothing: the mean rewards are all that there is.
    Acting,
    /// By the state that is come to: `[S]`.
    Coming(Vec<f64>),
    /// By the state, the action and what follows: `[S, A, S]`.
    Leading(Vec<f64>),
}

/// Names of actions.
pub(super) fn named(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

impl Mdp {
    /// One whose steps pay by where they lead, and whose mean rewards follow from that.
    pub(super) fn paying(
        actions: Vec<String>,
        transitions: Vec<f64>,
        paid: Paid,
        terminal: Vec<bool>,
        start: Vec<f64>,
    ) -> Self {
        let rewards = vec![0.0; terminal.len() * actions.len()];
        let mut mdp = Self { actions, transitions, rewards, paid, terminal, start };
        let (n, width) = (mdp.n_states(), mdp.n_actions());
        for pair in (0..n * width).filter(|pair| !mdp.terminal[pair / width]) {
            let (s, a) = (pair / width, pair % width);
            let follow = mdp.next(s, a).iter().enumerate().filter(|(_, p)| **p > 0.0);
            mdp.rewards[pair] = follow.map(|(next, p)| p * mdp.by_next(pair, next)).sum();
        }
        mdp
    }

    /// The same where actions pay besides, wherever they lead: `[S, A]`, or nothing.
    pub(super) fn with_rewards(mut self, besides: &[f64]) -> Self {
        let width = self.n_actions();
        if besides.is_empty() {
            return self;
        }
        if let Paid::Coming(coming) = &self.paid {
            let by_next =
                besides.iter().flat_map(|pays| coming.iter().map(move |more| pays + more));
            self.paid = Paid::Leading(by_next.collect());
        }
        for (pair, pays) in besides.iter().enumerate() {
            if !self.terminal[pair / width] {
                self.rewards[pair] += pays;
            }
        }
        self
    }

    /// What a step pays.
    #[must_use]
    pub fn paid(&self, state: usize, action: usize, next: usize) -> f64 {
        let pair = state * self.n_actions() + action;
        match self.paid {
            Paid::Acting => self.rewards[pair],
            _ if self.terminal[state] => 0.0,
            _ => self.by_next(pair, next),
        }
    }

    fn by_next(&self, pair: usize, next: usize) -> f64 {
        match &self.paid {
            Paid::Acting => 0.0,
            Paid::Coming(paid) => paid[next],
            Paid::Leading(paid) => paid[pair * self.n_states() + next],
        }
    }

    /// One in which every action in a state leads to one state of its own, or to nowhere with probability
    /// left over: `step` says of a state and an action where it leads.
    ///
    /// Rewards are those of entering a state. Episodes start in any state that is not terminal.
    pub(super) fn moving(
        actions: Vec<String>,
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
        Self { actions, transitions, rewards, paid: Paid::Acting, terminal, start }
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

    /// The mean reward of an action.
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
        pairs(self.n_states(), &self.actions)
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
