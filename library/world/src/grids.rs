//! Several lists of places as one.

use ivx_op::{OpError, declare};

use super::Points;

declare! {
    /// The places of several lists, one list after the other.
    pub struct Grids = "grids" @ 1 {
        /// The lists.
        parts: Vec<Box<dyn Points>>;
    }
}

impl Points for Grids {
    fn places(&self) -> Result<Vec<f64>, OpError> {
        let mut all = Vec::new();
        for part in &self.parts {
            all.extend(part.places()?);
        }
        if all.is_empty() {
            return Err(OpError::Failed("the grids name no places".to_owned()));
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Grid;
    use super::*;

    #[test]
    fn lists_follow_each_other() {
        let part = |low, high| Box::new(Grid { low, high, points: 2 }) as _;
        let grids = Grids { parts: vec![part(1.0, 2.0), part(-2.0, -1.0)] };
        assert_eq!(grids.points().unwrap(), [1.0, 2.0, -2.0, -1.0]);
        assert!(Grids { parts: vec![] }.points().is_err());
    }

    #[test]
    fn a_place_is_a_label_of_its_own() {
        let part = |low, high| Box::new(Grid { low, high, points: 2 }) as _;
        let overlapping = Grids { parts: vec![part(1.5, 2.0), part(0.5, 1.5)] };
        assert_eq!(overlapping.places().unwrap(), [1.5, 2.0, 0.5, 1.5]);
        let message = overlapping.points().unwrap_err().to_string();
        assert_eq!(message, "two of the places are `1.5`, and each is a label of its own");
    }
}
