//! What agents experienced.

use ivx_op::{Artifact, Data, Dim, Labels, Tensors};

/// Episodes of an agent in a finite environment (Eqn. 2.35).
#[derive(Clone, Debug, PartialEq)]
pub struct Rollouts {
    /// How many states the environment has.
    pub n_states: usize,
    /// What its actions are called.
    pub actions: Vec<String>,
    /// The episodes, in order.
    pub episodes: Vec<Episode>,
}

/// One episode of `T` steps.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Episode {
    /// Where the agent was: `[T + 1]`.
    pub states: Vec<usize>,
    /// What it did there: `[T]`.
    pub actions: Vec<usize>,
    /// What it received for it: `[T]`.
    pub rewards: Vec<f64>,
    /// Whether its last state is terminal; if not, it was cut off.
    pub ended: bool,
}

impl Rollouts {
    /// The dimension of the states, by number.
    #[must_use]
    pub fn states(&self) -> Dim {
        Dim::new("state", Labels::count(self.n_states))
    }

    /// The dimensions of what is said of each action in each state.
    #[must_use]
    pub fn pairs(&self) -> Vec<Dim> {
        vec![self.states(), Dim::new("action", Labels::Names(self.actions.clone()))]
    }
}

impl Artifact for Rollouts {
    const KIND: &'static str = "Rollouts";

    fn encode(&self) -> Vec<u8> {
        let column = |name: &str, of: &dyn Fn(&Episode) -> Vec<f64>| {
            let values: Vec<f64> = self.episodes.iter().flat_map(of).collect();
            (name.to_owned(), Data::F64(vec![values.len()], values))
        };
        #[expect(clippy::cast_precision_loss, reason = "states and steps are far below 2^53")]
        let numbers = |of: &[usize]| of.iter().map(|i| *i as f64).collect::<Vec<f64>>();
        let arrays = [
            column("length", &|e| numbers(&[e.actions.len()])),
            column("ended", &|e| vec![f64::from(u8::from(e.ended))]),
            column("states", &|e| numbers(&e.states)),
            column("actions", &|e| numbers(&e.actions)),
            column("rewards", &|e| e.rewards.clone()),
        ];
        Tensors { arrays: arrays.into() }.encode(Self::KIND, &(self.n_states, &self.actions))
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, (n_states, actions)) =
            Tensors::decode::<(usize, Vec<String>)>(Self::KIND, bytes)?;
        let mut column = |name| tensors.f64(name).map(|(_, values)| values);
        let (lengths, ended) = (column("length")?, column("ended")?);
        let (states, acted, rewards) = (column("states")?, column("actions")?, column("rewards")?);
        let (mut states, mut acted) = (states.into_iter().map(index), acted.into_iter().map(index));
        let mut rewards = rewards.into_iter();
        let mut episodes = Vec::new();
        for (length, ended) in lengths.into_iter().map(index).zip(ended) {
            let episode = Episode {
                states: states.by_ref().take(length + 1).collect(),
                actions: acted.by_ref().take(length).collect(),
                rewards: rewards.by_ref().take(length).collect(),
                ended: ended == 1.0,
            };
            let in_range = episode.states.iter().all(|s| *s < n_states)
                && episode.actions.iter().all(|a| *a < actions.len());
            let whole = episode.states.len() == length + 1
                && episode.actions.len() == length
                && episode.rewards.len() == length;
            if !in_range || !whole {
                return None;
            }
            episodes.push(episode);
        }
        Some(Self { n_states, actions, episodes })
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it was an index")]
fn index(x: f64) -> usize {
    x as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn survives_the_round_trip() {
        let walked = Episode {
            states: vec![0, 2, 1],
            actions: vec![1, 0],
            rewards: vec![0.5, -1.0],
            ended: true,
        };
        let cut = Episode { states: vec![2], ..Episode::default() };
        let actions = vec!["LEFT".to_owned(), "RIGHT".to_owned()];
        let rollouts = Rollouts { n_states: 3, actions, episodes: vec![walked, cut] };
        let bytes = rollouts.encode();
        assert_eq!(Rollouts::decode(&bytes), Some(rollouts.clone()));
        // A state that is none is no artifact.
        let fewer = Rollouts { n_states: 2, ..rollouts };
        assert_eq!(Rollouts::decode(&fewer.encode()), None);
    }
}
