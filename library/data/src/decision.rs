//! What an agent decided, and what it believed.

use ivx_op::{Artifact, Data, Tensors};

/// The action chosen among candidates.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// The action.
    pub action: f64,
    /// The reward the agent believes it will receive, under the objective it maximised.
    pub believed: f64,
    /// The actions it could choose.
    pub candidates: Vec<f64>,
}

impl Artifact for Decision {
    const KIND: &'static str = "Decision";

    fn encode(&self) -> Vec<u8> {
        let candidates = Data::F64(vec![self.candidates.len()], self.candidates.clone());
        let chosen = Data::F64(vec![2], vec![self.action, self.believed]);
        let arrays = [("candidates".to_owned(), candidates), ("chosen".to_owned(), chosen)];
        Tensors { arrays: arrays.into() }.encode(Self::KIND, &())
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, ()) = Tensors::decode(Self::KIND, bytes)?;
        let (_, candidates) = tensors.f64("candidates")?;
        let (_, chosen) = tensors.f64("chosen")?;
        let [action, believed] = chosen.try_into().ok()?;
        Some(Self { action, believed, candidates })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn survives_the_round_trip() {
        let decision = Decision { action: 0.5, believed: 2.0, candidates: vec![0.0, 0.5] };
        assert_eq!(Decision::decode(&decision.encode()), Some(decision));
    }
}
