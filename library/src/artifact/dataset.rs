//! Observed action and reward pairs.

use ivx_op::{Artifact, Data, Tensors};

/// Scalar inputs and outputs, pair by pair.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Dataset {
    /// Inputs, in the order drawn.
    pub x: Vec<f64>,
    /// Outputs, as many.
    pub y: Vec<f64>,
}

impl Dataset {
    /// The pairs at these places, repetitions included.
    ///
    /// # Panics
    /// If a place is out of bounds.
    #[must_use]
    pub fn pick(&self, places: &[usize]) -> Self {
        Self {
            x: places.iter().map(|&i| self.x[i]).collect(),
            y: places.iter().map(|&i| self.y[i]).collect(),
        }
    }
}

impl Artifact for Dataset {
    const KIND: &'static str = "Dataset";

    fn encode(&self) -> Vec<u8> {
        let column = |values: &[f64]| Data::F64(vec![values.len()], values.to_vec());
        let arrays = [("x".to_owned(), column(&self.x)), ("y".to_owned(), column(&self.y))];
        Tensors { arrays: arrays.into() }.encode(Self::KIND, &())
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, ()) = Tensors::decode(Self::KIND, bytes)?;
        let ((_, x), (_, y)) = (tensors.f64("x")?, tensors.f64("y")?);
        (x.len() == y.len()).then_some(Self { x, y })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn survives_the_round_trip() {
        let data = Dataset { x: vec![0.5, -1.0], y: vec![2.0, 3.0] };
        assert_eq!(Dataset::decode(&data.encode()), Some(data.clone()));
        assert_eq!(data.pick(&[1, 1]).y, [3.0, 3.0]);
    }
}
