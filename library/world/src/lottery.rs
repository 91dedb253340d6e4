//! A lottery with finitely many outcomes.

use ivx_op::{OpError, declare};

use super::{Lottery, distribution};

declare! {
    /// A reward drawn from finitely many outcomes.
    pub struct Discrete = "lottery" @ 1 {
        /// The rewards that may come.
        outcomes: Vec<f64>;
        /// How probable each is; they sum to 1.
        probabilities: Vec<f64>, in 0.0..=1.0;
    }
}

impl Lottery for Discrete {
    fn atoms(&self) -> Result<(&[f64], &[f64]), OpError> {
        let (n_outcomes, n_probabilities) = (self.outcomes.len(), self.probabilities.len());
        if n_outcomes != n_probabilities {
            return Err(OpError::Failed(format!(
                "the lottery has {n_outcomes} outcomes but {n_probabilities} probabilities"
            )));
        }
        if n_outcomes == 0 {
            return Err(OpError::Failed("the lottery has no outcomes".to_owned()));
        }
        distribution("probabilities", &self.probabilities)?;
        Ok((&self.outcomes, &self.probabilities))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(outcomes: &[f64], probabilities: &[f64]) -> String {
        let (outcomes, probabilities) = (outcomes.to_vec(), probabilities.to_vec());
        Discrete { outcomes, probabilities }.atoms().unwrap_err().to_string()
    }

    #[test]
    fn what_is_no_distribution_is_explained() {
        assert_eq!(message(&[1.0], &[]), "the lottery has 1 outcomes but 0 probabilities");
        assert_eq!(message(&[1.0, 2.0], &[0.5, 0.25]), "the probabilities sum to 0.75, not to 1");
        assert_eq!(message(&[], &[]), "the lottery has no outcomes");
    }

    #[test]
    fn thirds_sum_to_one() {
        let thirds = Discrete { outcomes: vec![0.0, 1.0, 2.0], probabilities: vec![1.0 / 3.0; 3] };
        assert_eq!(thirds.atoms().unwrap().0, [0.0, 1.0, 2.0]);
    }
}
