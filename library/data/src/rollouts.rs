//! What agents experienced.

use ivx_op::{Artifact, Data, OpError, Shapes, Tensors};
use serde::{Deserialize, Serialize};

use crate::{Trajectories, Walks, trajectories};

/// Episodes of somebody in a world, with what they paid (Eqn. 2.35).
#[derive(Clone, Debug, PartialEq)]
pub struct Rollouts {
    /// What was seen and done.
    pub paths: Trajectories,
    /// What each step paid.
    pub rewards: Vec<f64>,
    /// What the world told of each step besides, by name.
    pub tells: Vec<String>,
    /// Those numbers, as many a step as there are names.
    pub told: Vec<f32>,
}

impl Rollouts {
    /// None yet, of such a world.
    #[must_use]
    pub fn new(paths: Trajectories, tells: Vec<String>) -> Self {
        Self { paths, rewards: Vec::new(), tells, told: Vec::new() }
    }

    /// Adds all of others of such a world.
    ///
    /// # Panics
    /// If their fields are others.
    pub fn append(&mut self, others: &Self) {
        self.paths.append(&others.paths);
        self.rewards.extend(&others.rewards);
        self.told.extend(&others.told);
    }

    /// The same as numbers of states and actions.
    ///
    /// # Errors
    /// If the world is no table of states.
    pub fn walks(&self) -> Result<Walks, OpError> {
        let mut walks = Walks::of(&self.paths)?;
        for (episode, (_, done, steps, _)) in walks.episodes.iter_mut().zip(self.paths.each()) {
            episode.rewards = self.rewards[done..done + steps].to_vec();
        }
        Ok(walks)
    }
}

impl From<Walks> for Rollouts {
    fn from(walks: Walks) -> Self {
        let rewards = walks.episodes.iter().flat_map(|e| e.rewards.clone()).collect();
        Self { rewards, ..Self::new(walks.trajectories(), Vec::new()) }
    }
}

#[derive(Serialize, Deserialize)]
struct Facts {
    world: trajectories::Facts,
    tells: Vec<String>,
}

impl Artifact for Rollouts {
    const KIND: &'static str = "Rollouts";

    fn encode(&self) -> Vec<u8> {
        let Self { paths, rewards, tells, told } = self;
        let mut tensors = Tensors::default();
        paths.store(&mut tensors);
        let n = rewards.len();
        tensors.arrays.insert("rewards".to_owned(), Data::F64(vec![n], rewards.clone()));
        tensors.arrays.insert("told".to_owned(), Data::F32(vec![n, tells.len()], told.clone()));
        tensors.encode(Self::KIND, &Facts { world: paths.facts(), tells: tells.clone() })
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, Facts { world, tells }) = Tensors::decode::<Facts>(Self::KIND, bytes)?;
        let ((_, rewards), (shape, told)) = (tensors.f64("rewards")?, tensors.f32("told")?);
        let paths = Trajectories::take(&mut tensors, world)?;
        let n = paths.n_steps();
        (rewards.len() == n && shape == [n, tells.len()]).then_some(Self {
            paths,
            rewards,
            tells,
            told,
        })
    }

    fn later(shapes: &Shapes) -> Option<Self> {
        Some(Self::new(Trajectories::later(shapes)?, Vec::new()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Episode;

    #[test]
    fn finite_ones_survive_the_round_trip() {
        let walked = Episode {
            states: vec![0, 2, 1],
            actions: vec![1, 0],
            rewards: vec![0.5, -1.0],
            ended: true,
        };
        let cut = Episode { states: vec![2], ..Episode::default() };
        let actions = vec!["LEFT".to_owned(), "RIGHT".to_owned()];
        let walks = Walks { n_states: 3, actions, episodes: vec![walked, cut] };
        let rollouts = Rollouts::from(walks.clone());
        assert_eq!(Rollouts::decode(&rollouts.encode()), Some(rollouts.clone()));
        assert_eq!(rollouts.walks(), Ok(walks));
        let mut twice = rollouts.clone();
        twice.append(&rollouts);
        assert_eq!(Rollouts::decode(&twice.encode()), Some(twice.clone()));
        assert_eq!(twice.walks().unwrap().episodes.len(), 4);
        // What pays less often than it steps is no artifact.
        let fewer = Rollouts { rewards: vec![0.5], ..rollouts };
        assert_eq!(Rollouts::decode(&fewer.encode()), None);
    }
}
