//! What others did, for somebody to learn from.

use ivx_op::{Artifact, Data, Shapes, Tensors};
use serde::{Deserialize, Serialize};

use crate::{Trajectories, trajectories};

/// Episodes of others without what they paid (§4.2): who learns from them cannot read what it must not know.
#[derive(Clone, Debug, PartialEq)]
pub struct Demonstrations {
    /// What was seen and done.
    pub paths: Trajectories,
    /// What those who acted are called.
    pub names: Vec<String>,
    /// Whose each episode is, by place among the names.
    pub whose: Vec<usize>,
}

#[derive(Serialize, Deserialize)]
struct Facts {
    world: trajectories::Facts,
    names: Vec<String>,
}

impl Artifact for Demonstrations {
    const KIND: &'static str = "Demonstrations";

    fn encode(&self) -> Vec<u8> {
        let mut tensors = Tensors::default();
        self.paths.store(&mut tensors);
        #[expect(clippy::cast_precision_loss, reason = "names are far below 2^53")]
        let whose = self.whose.iter().map(|i| *i as f64).collect();
        tensors.arrays.insert("whose".to_owned(), Data::F64(vec![self.whose.len()], whose));
        let facts = Facts { world: self.paths.facts(), names: self.names.clone() };
        tensors.encode(Self::KIND, &facts)
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, Facts { world, names }) = Tensors::decode::<Facts>(Self::KIND, bytes)?;
        let (_, whose) = tensors.f64("whose")?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place")]
        let whose: Vec<usize> = whose.into_iter().map(|i| i as usize).collect();
        let paths = Trajectories::take(&mut tensors, world)?;
        let sound = whose.len() == paths.episodes.len() && whose.iter().all(|i| *i < names.len());
        sound.then_some(Self { paths, names, whose })
    }

    fn later(shapes: &Shapes) -> Option<Self> {
        Some(Self { paths: Trajectories::later(shapes)?, names: Vec::new(), whose: Vec::new() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Episode, Walks};

    #[test]
    fn they_survive_the_round_trip() {
        let step = Episode { states: vec![0, 1], actions: vec![0], ..Episode::default() };
        let actions = vec!["GO".to_owned()];
        let walks = Walks { n_states: 2, actions, episodes: vec![step.clone(), step] };
        let names = vec!["red".to_owned(), "green".to_owned()];
        let shown = Demonstrations { paths: walks.trajectories(), names, whose: vec![1, 0] };
        assert_eq!(Demonstrations::decode(&shown.encode()), Some(shown.clone()));
        let unknown = Demonstrations { whose: vec![1, 2], ..shown };
        assert_eq!(Demonstrations::decode(&unknown.encode()), None);
    }
}
