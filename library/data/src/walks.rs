//! Episodes in finite worlds.

use ivx_op::{Dim, Labels, OpError};

use crate::{Act, Actions, End, Field, Kind, Trajectories, Values};

/// Episodes in a finite world, as numbers of states and actions.
#[derive(Clone, Debug, PartialEq)]
pub struct Walks {
    /// How many states the world has.
    pub n_states: usize,
    /// What its actions are called.
    pub actions: Vec<String>,
    /// The episodes, in order.
    pub episodes: Vec<Episode>,
}

/// One episode of `T` steps in a finite world.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Episode {
    /// Where the agent was: `[T + 1]`.
    pub states: Vec<usize>,
    /// What it did there: `[T]`.
    pub actions: Vec<usize>,
    /// What it received for it: `[T]`; none where that is not to be known.
    pub rewards: Vec<f64>,
    /// Whether its last state is terminal; if not, it was cut off.
    pub ended: bool,
}

/// How many states there are where a world shows the number of its state and nothing else, and how many actions.
#[must_use]
pub fn finite(sees: &[Field], does: &Actions) -> Option<(usize, usize)> {
    match (sees, does) {
        ([Field { shape, kind: Kind::Index(n), .. }], Actions::Discrete(names))
            if shape.is_empty() =>
        {
            Some((*n, names.len()))
        }
        _ => None,
    }
}

/// The dimensions of what is said of each of some actions in each of `n` states.
#[must_use]
pub fn pairs(n: usize, actions: &[String]) -> Vec<Dim> {
    let states = Dim::new("state", Labels::count(n));
    vec![states, Dim::new("action", Labels::Names(actions.to_vec()))]
}

/// What episodes of other worlds are told.
pub const NOT_FINITE: &str = "these episodes are not of a world that is a table of states";

impl Walks {
    /// The dimension of the states, by number.
    #[must_use]
    pub fn states(&self) -> Dim {
        Dim::new("state", Labels::count(self.n_states))
    }

    /// The dimensions of what is said of each action in each state.
    #[must_use]
    pub fn pairs(&self) -> Vec<Dim> {
        pairs(self.n_states, &self.actions)
    }

    /// The same as trajectories.
    ///
    /// # Panics
    /// If there are more states or actions than a trajectory can name.
    #[must_use]
    pub fn trajectories(&self) -> Trajectories {
        let sees = vec![Field::new("state", &[], Kind::Index(self.n_states))];
        let mut paths = Trajectories::new(sees, Actions::Discrete(self.actions.clone()));
        for episode in &self.episodes {
            for state in &episode.states {
                Act::Index(*state).append(&mut paths.seen);
            }
            for action in &episode.actions {
                Act::Index(*action).append(&mut paths.acts);
            }
            let end = if episode.ended { End::Terminal } else { End::Limit };
            paths.episodes.push((episode.actions.len(), end));
        }
        paths
    }

    /// Those of trajectories, without rewards.
    ///
    /// # Errors
    /// If their world is no table of states.
    pub fn of(paths: &Trajectories) -> Result<Self, OpError> {
        let failed = || OpError::Failed(NOT_FINITE.to_owned());
        let (n_states, _) = finite(paths.seen.fields(), &paths.does).ok_or_else(failed)?;
        let (Values::Index(states), Values::Index(acts), Actions::Discrete(actions)) =
            (paths.seen.values(0), paths.acts.values(0), &paths.does)
        else {
            return Err(failed());
        };
        let places = |of: &[u32]| of.iter().map(|place| *place as usize).collect();
        let episodes = paths.each().map(|(seen, done, steps, end)| Episode {
            states: places(&states[seen..=seen + steps]),
            actions: places(&acts[done..done + steps]),
            rewards: Vec::new(),
            ended: end == End::Terminal,
        });
        Ok(Self { n_states, actions: actions.clone(), episodes: episodes.collect() })
    }
}
