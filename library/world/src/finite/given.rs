//! Finite worlds from numbers.

use ivx_data::Misfit;
use ivx_math::moments::real;
use ivx_op::{Array, Artifact, Facts, Labels, One, OpError, Wrong, declare};

use super::{Finite, Mdp, Paid};

declare! {
    /// A finite Markov decision process written out, with states and actions by number from 0.
    ///
    /// A state that ends an episode is left by no action, whatever is written of it.
    pub struct WrittenMdp = "mdp" @ 1 {
        /// How probably each state follows: for each state and each action a list over states, which sums to 1.
        transitions: Vec<Vec<Vec<f64>>>;
        /// What each action pays in each state: for each state a list over actions; where empty, nothing.
        rewards: Vec<Vec<f64>> = Vec::<Vec<f64>>::new();
        /// What coming to each state pays besides; where empty, nothing.
        coming: Vec<f64> = Vec::<f64>::new();
        /// How probably an episode starts in each state; where empty, evenly in all that do not end one.
        start: Vec<f64> = Vec::<f64>::new(), in 0.0..=1.0;
        /// Which states end an episode.
        terminal: Vec<usize> = Vec::<i64>::new(), in 0.0..;
        /// What the actions are called; where empty, by number.
        actions: Vec<String> = Vec::<&str>::new();
    }
    rule is_sound;
}

declare! {
    /// A finite Markov decision process of arrays that are computed, such as a learned model or what a program wrote.
    /// Dimensions may be in any order.
    ///
    /// A state that ends an episode is left by no action, whatever the arrays say of it.
    pub struct ComputedMdp = "mdp_of" @ 1 {
        /// How probably each state follows, over `state`, `action` and `next`: sums to 1 over `next`, up to 1e-6.
        transitions: One<Numbers>;
        /// What is paid: over `state` and `action`; by where it leads over `state`, `action` and `next`; or what coming to
        /// each `state` pays.
        rewards: One<Numbers>;
        /// How probably an episode starts in each `state`; where left out, evenly in all that do not end one.
        start: Option<One<Numbers>>;
        /// Which states end an episode: 1 for each `state` that does, and 0 for the others; where left out, none.
        terminal: Option<One<Numbers>>;
    }
}

/// An array of which nothing is known before it is computed, so that no rule looks at a world that is made of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Numbers(pub Array);

impl Artifact for Numbers {
    const KIND: &'static str = Array::KIND;

    fn encode(&self) -> Vec<u8> {
        self.0.encode()
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        Array::decode(bytes).map(Self)
    }
}

/// The parts of a process, flat, and how many states and actions there are.
struct Given {
    n: (usize, usize),
    transitions: Vec<f64>,
    paid: Paid,
    rewards: Vec<f64>,
    /// None for even.
    start: Option<Vec<f64>>,
    terminal: Vec<bool>,
    actions: Vec<String>,
}

/// Probabilities that sum to 1 up to this are scaled to do so.
const TOLERANCE: f64 = 1e-6;

impl Given {
    /// The process; or which argument is wrong, and why.
    fn mdp(mut self) -> Result<Mdp, (&'static str, Misfit)> {
        let (n_states, n_actions) = self.n;
        let wrong = |arg, message: String, help: &str| Err((arg, Misfit::new(message, help)));
        for (pair, next) in self.transitions.chunks_exact_mut(n_states).enumerate() {
            let (s, a) = (pair / n_actions, pair % n_actions);
            if self.terminal[s] {
                next.fill(0.0);
                next[s] = 1.0;
            } else if let Err(why) = scaled(next) {
                let message = format!("the probabilities after action {a} in state {s} {why}");
                return wrong(
                    "transitions",
                    message,
                    "let them sum to 1 over the states, up to 1e-6",
                );
            }
        }
        let open = self.terminal.iter().filter(|end| !**end).count();
        if open == 0 {
            let message = "every state ends an episode".to_owned();
            return wrong("terminal", message, "leave some that do not");
        }
        let even = || self.terminal.iter().map(|end| if *end { 0.0 } else { 1.0 / real(open) });
        let mut start = self.start.unwrap_or_else(|| even().collect());
        if let Err(why) = scaled(&mut start) {
            let message = format!("the probabilities of first states {why}");
            return wrong("start", message, "let them sum to 1 over the states, up to 1e-6");
        }
        if let Some(s) = (0..n_states).find(|&s| self.terminal[s] && start[s] > 0.0) {
            let message = format!("state {s} ends an episode, and one starts there");
            return wrong("start", message, "start elsewhere");
        }
        let numbers = match &self.paid {
            Paid::Acting => &self.rewards,
            Paid::Coming(paid) | Paid::Leading(paid) => paid,
        };
        if let Some(strange) = numbers.iter().chain(&self.rewards).find(|x| !x.is_finite()) {
            let message = format!("{strange} is no reward");
            return wrong("rewards", message, "give finite numbers");
        }
        let paying = Mdp::paying(self.actions, self.transitions, self.paid, self.terminal, start);
        Ok(paying.with_rewards(&self.rewards))
    }
}

/// Scales probabilities to sum to 1.
fn scaled(probabilities: &mut [f64]) -> Result<(), String> {
    if let Some(p) = probabilities.iter().find(|p| !(0.0..=1.0 + TOLERANCE).contains(*p)) {
        return Err(format!("have {p}"));
    }
    let total: f64 = probabilities.iter().sum();
    if (total - 1.0).abs() > TOLERANCE {
        return Err(format!("sum to {}, not to 1", ivx_op::shown_together(&[total, 1.0])[0]));
    }
    for p in probabilities {
        *p /= total;
    }
    Ok(())
}

fn by_number(n: usize) -> Vec<String> {
    (0..n).map(|i| i.to_string()).collect()
}

impl WrittenMdp {
    fn checked(&self) -> Result<Mdp, (&'static str, Misfit)> {
        let wrong = |arg, message: String, help: &str| Err((arg, Misfit::new(message, help)));
        let n_states = self.transitions.len();
        let n_actions = self.transitions.first().map_or(0, Vec::len);
        if n_states == 0 || n_actions == 0 {
            let message = "there are no states, or no actions".to_owned();
            return wrong("transitions", message, "write `[[[0.5, 0.5], [0.0, 1.0]], ..]`");
        }
        for (s, of) in self.transitions.iter().enumerate() {
            if of.len() != n_actions {
                let message =
                    format!("state {s} has {} actions, and the first has {n_actions}", of.len());
                return wrong("transitions", message, "write a list for each action");
            }
            if let Some(a) = of.iter().position(|next| next.len() != n_states) {
                let message = format!(
                    "after action {a} in state {s} there are {} states, and there are {n_states}",
                    of[a].len()
                );
                return wrong("transitions", message, "write a number for each state");
            }
        }
        let is_table =
            self.rewards.len() == n_states && self.rewards.iter().all(|of| of.len() == n_actions);
        if !self.rewards.is_empty() && !is_table {
            let message =
                format!("the rewards are not those of {n_actions} actions in {n_states} states");
            return wrong("rewards", message, "write a list over actions for each state");
        }
        let lists = [("coming", self.coming.len()), ("start", self.start.len())];
        for (arg, len) in lists {
            if len != 0 && len != n_states {
                let message = format!("`{arg}` has {len} numbers, and there are {n_states} states");
                return wrong(arg, message, "write a number for each state");
            }
        }
        if let Some(s) = self.terminal.iter().find(|s| **s >= n_states) {
            let message = format!("there is no state {s}: they are 0 to {}", n_states - 1);
            return wrong("terminal", message, "list the numbers of states");
        }
        if !self.actions.is_empty() && self.actions.len() != n_actions {
            let message =
                format!("there are {} names, and {n_actions} actions", self.actions.len());
            return wrong("actions", message, "name each of them");
        }
        let named = !self.actions.is_empty();
        let coming = self.coming.clone();
        Given {
            n: (n_states, n_actions),
            transitions: self.transitions.concat().concat(),
            paid: if coming.is_empty() { Paid::Acting } else { Paid::Coming(coming) },
            rewards: self.rewards.concat(),
            start: (!self.start.is_empty()).then(|| self.start.clone()),
            terminal: (0..n_states).map(|s| self.terminal.contains(&s)).collect(),
            actions: if named { self.actions.clone() } else { by_number(n_actions) },
        }
        .mdp()
    }
}

impl Finite for WrittenMdp {
    fn mdp(&self) -> Result<Mdp, OpError> {
        self.checked().map_err(|(_, misfit)| OpError::Failed(misfit.message))
    }

    fn pays(&self) -> bool {
        self.rewards.concat().iter().chain(&self.coming).any(|paid| *paid != 0.0)
    }
}

fn is_sound(facts: &Facts<'_>) -> Result<(), Wrong> {
    let written = || {
        Some(WrittenMdp {
            transitions: facts.arg("transitions")?,
            rewards: facts.arg("rewards")?,
            coming: facts.arg("coming")?,
            start: facts.arg("start")?,
            terminal: facts.arg("terminal")?,
            actions: facts.arg("actions")?,
        })
    };
    let mdp = written().map_or(Ok(()), |written| written.checked().map(drop));
    mdp.map_err(|(arg, Misfit { message, help })| Wrong { arg, message, help })
}

/// The numbers of an array over these dimensions, in this order; none if it is over others.
fn over(array: &Array, names: &[&str], sizes: &[usize]) -> Option<Vec<f64>> {
    let places: Vec<usize> = names.iter().map(|name| array.dim(name)).collect::<Option<_>>()?;
    let fits = places.len() == array.dims.len()
        && places.iter().zip(sizes).all(|(d, size)| array.dims[*d].len() == *size);
    if !fits {
        return None;
    }
    let strides = array.strides();
    let mut values = Vec::with_capacity(array.values.len());
    for i in 0..array.values.len() {
        let (mut rest, mut at) = (i, 0);
        for (d, size) in places.iter().zip(sizes).rev() {
            at += rest % size * strides[*d];
            rest /= size;
        }
        values.push(array.values[at]);
    }
    Some(values)
}

impl Finite for ComputedMdp {
    fn mdp(&self) -> Result<Mdp, OpError> {
        let failed =
            |what: &str, over: &str| OpError::Failed(format!("the {what} are not over {over}"));
        let array = &self.transitions.0.0;
        let triple = ["state", "action", "next"];
        let size = |name: &str| array.dim(name).map(|d| array.dims[d].len());
        let unfit = || failed("transitions", "`state`, `action` and as many `next` as states");
        let (n_states, n_actions) = size("state").zip(size("action")).ok_or_else(unfit)?;
        let sizes = [n_states, n_actions, n_states];
        let transitions = over(array, &triple, &sizes).ok_or_else(unfit)?;
        let of_actions = array.dim("action").map(|d| &array.dims[d].labels);
        let actions = match of_actions {
            Some(Labels::Names(names)) => names.clone(),
            _ => by_number(n_actions),
        };
        let of_states = |given: &Option<One<Numbers>>, what: &str| {
            let numbers = given.as_ref().map(|given| {
                let of_states = || failed(what, "`state` as the transitions are");
                over(&given.0.0, &["state"], &[n_states]).ok_or_else(of_states)
            });
            numbers.transpose()
        };
        let rewards = &self.rewards.0.0;
        let (paid, rewards) = if let Some(of_pairs) = over(rewards, &triple[..2], &sizes[..2]) {
            (Paid::Acting, of_pairs)
        } else if let Some(leading) = over(rewards, &triple, &sizes) {
            (Paid::Leading(leading), Vec::new())
        } else {
            let coming = over(rewards, &["state"], &[n_states]);
            let unfit =
                || failed("rewards", "`state`, `action` and `next`, the first two or the first");
            (Paid::Coming(coming.ok_or_else(unfit)?), Vec::new())
        };
        let terminal = of_states(&self.terminal, "terminal states")?;
        let strange =
            terminal.iter().flatten().enumerate().find(|(_, end)| ![0.0, 1.0].contains(*end));
        if let Some((s, strange)) = strange {
            return Err(OpError::Failed(format!(
                "of state {s} the terminal states say {strange}, where 1 ends an episode and 0 does not"
            )));
        }
        let terminal = terminal.map_or_else(
            || vec![false; n_states],
            |ends| ends.iter().map(|end| *end != 0.0).collect(),
        );
        let start = of_states(&self.start, "first states")?;
        let n = (n_states, n_actions);
        Given { n, transitions, paid, rewards, start, terminal, actions }
            .mdp()
            .map_err(|(_, misfit)| OpError::Failed(misfit.message))
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::Dim;

    use super::*;
    use crate::Chain;

    /// Two states: the second action of the first leads to the end with ¾.
    fn written() -> WrittenMdp {
        WrittenMdp {
            transitions: vec![vec![vec![1.0, 0.0], vec![0.25, 0.75]], vec![vec![0.0, 0.0]; 2]],
            rewards: vec![vec![0.5, 0.0], vec![9.0, 9.0]],
            coming: vec![0.0, 4.0],
            start: vec![],
            terminal: vec![1],
            actions: vec![],
        }
    }

    #[test]
    fn a_written_process_by_hand() {
        let mdp = written().mdp().unwrap();
        assert_eq!(mdp.transitions, [1.0, 0.0, 0.25, 0.75, 0.0, 1.0, 0.0, 1.0]);
        assert_eq!(mdp.rewards, [0.5, 3.0, 0.0, 0.0]);
        assert_eq!([0, 1].map(|next| mdp.paid(0, 1, next)), [0.0, 4.0]);
        assert_eq!((&mdp.start[..], mdp.actions[1].as_str()), (&[1.0, 0.0][..], "1"));
        assert!(written().pays());
        assert!(!WrittenMdp { rewards: vec![], coming: vec![], ..written() }.pays());
    }

    #[test]
    fn what_is_no_process_is_told() {
        let check = |mdp: WrittenMdp, arg: &str, message: &str| {
            let (found, misfit) = mdp.checked().unwrap_err();
            assert_eq!((found, misfit.message.as_str()), (arg, message));
        };
        let mut off = written();
        off.transitions[0][1][1] = 0.5;
        let why = "the probabilities after action 1 in state 0 sum to 0.75, not to 1";
        check(off, "transitions", why);
        let mut thirds = written();
        thirds.transitions[0][0] = vec![0.333_333, 0.666_665];
        let why = "the probabilities after action 0 in state 0 sum to 0.999998, not to 1";
        check(thirds, "transitions", why);
        let mut negative = written();
        negative.transitions[0][0] = vec![1.5, -0.5];
        check(negative, "transitions", "the probabilities after action 0 in state 0 have 1.5");
        let mut ragged = written();
        ragged.transitions[1].pop();
        check(ragged, "transitions", "state 1 has 1 actions, and the first has 2");
        let rewards = vec![vec![1.0]];
        let why = "the rewards are not those of 2 actions in 2 states";
        check(WrittenMdp { rewards, ..written() }, "rewards", why);
        let coming = vec![0.0, f64::INFINITY];
        check(WrittenMdp { coming, ..written() }, "rewards", "inf is no reward");
        let why = "there is no state 2: they are 0 to 1";
        check(WrittenMdp { terminal: vec![2], ..written() }, "terminal", why);
        let why = "state 1 ends an episode, and one starts there";
        check(WrittenMdp { start: vec![0.5, 0.5], ..written() }, "start", why);
        let why = "`start` has 3 numbers, and there are 2 states";
        check(WrittenMdp { start: vec![0.0; 3], ..written() }, "start", why);
        check(
            WrittenMdp { terminal: vec![0, 1], ..written() },
            "terminal",
            "every state ends an episode",
        );
        let actions = vec!["GO".to_owned()];
        check(WrittenMdp { actions, ..written() }, "actions", "there are 1 names, and 2 actions");
    }

    /// The arrays of a chain make the chain, in any order of dimensions.
    #[test]
    fn arrays_of_a_world_are_that_world() {
        let chain = Chain { cells: 3, slip: 0.25, goal: true }.mdp().unwrap();
        let [state, action]: [Dim; 2] = chain.pairs().try_into().unwrap();
        let next = Dim { name: "next".to_owned(), ..state.clone() };
        let dims = vec![state.clone(), action.clone(), next.clone()];
        let one = |array: Array| One(Numbers(array));
        let transitions = Array { dims, values: chain.transitions.clone() };
        let (mut turned, n) = (vec![0.0; 18], 3);
        for (i, p) in transitions.values.iter().enumerate() {
            let (s, a, to) = (i / 6, i / n % 2, i % n);
            turned[(to * 2 + a) * n + s] = *p;
        }
        let turned = Array { dims: vec![next, action.clone(), state.clone()], values: turned };
        let ends = Array::series(state.clone(), vec![0.0, 0.0, 1.0]);
        let of = |transitions: &Array, rewards: Array| {
            let (transitions, terminal) = (one(transitions.clone()), Some(one(ends.clone())));
            ComputedMdp { transitions, rewards: one(rewards), start: None, terminal }.mdp()
        };
        let pairs =
            || Array { dims: vec![state.clone(), action.clone()], values: chain.rewards.clone() };
        assert_eq!(of(&transitions, pairs()).as_ref(), Ok(&chain));
        assert_eq!(of(&turned, pairs()).as_ref(), Ok(&chain));
        // By where a step ends it pays the same.
        let coming = of(&turned, ends.clone()).unwrap();
        assert_eq!((coming.rewards, coming.start), (chain.rewards.clone(), chain.start.clone()));
        let leading = [0.0, 0.0, 1.0].repeat(6);
        let leading =
            of(&turned, Array { dims: transitions.dims.clone(), values: leading }).unwrap();
        assert_eq!((&leading.rewards, leading.paid(1, 1, 2)), (&chain.rewards, 1.0));
        let (one_of, rewards) = (one(transitions.clone()), one(pairs()));
        let numbered = Some(one(Array::series(state.clone(), vec![0.0, 0.0, 2.0])));
        let numbered =
            ComputedMdp { transitions: one_of, rewards, start: None, terminal: numbered }.mdp();
        let why = numbered.unwrap_err().to_string();
        assert!(why.starts_with("of state 2 the terminal states say 2"), "{why}");
        let why = of(&transitions, Array::scalar(1.0)).unwrap_err().to_string();
        assert!(why.starts_with("the rewards are not over"), "{why}");
        let why = of(&pairs(), pairs()).unwrap_err().to_string();
        assert!(why.starts_with("the transitions are not over"), "{why}");
    }
}
