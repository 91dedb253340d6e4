//! A belief over finitely many lotteries.

use ivx_math::moments::uniform;
use ivx_op::{OpError, declare};

use super::{Belief, Lottery, Weighted, distribution};

declare! {
    /// A belief that one of several lotteries is the true one.
    pub struct BeliefOver = "belief" @ 1 {
        /// The lotteries held possible.
        models: Vec<Box<dyn Lottery>>;
        /// How probable each is; they sum to 1. Without weights all are equally probable.
        weights: Vec<f64> = Vec::<f64>::new(), in 0.0..=1.0;
    }
}

impl Belief for BeliefOver {
    fn models(&self) -> Result<Weighted<'_>, OpError> {
        let (n_models, n_weights) = (self.models.len(), self.weights.len());
        if n_models == 0 {
            return Err(OpError::Failed("the belief holds no lottery possible".to_owned()));
        }
        if n_weights == 0 {
            return Ok((&self.models, uniform(n_models)));
        }
        if n_models != n_weights {
            return Err(OpError::Failed(format!(
                "the belief has {n_models} models but {n_weights} weights"
            )));
        }
        distribution("weights", &self.weights)?;
        Ok((&self.models, self.weights.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Discrete;
    use super::*;

    fn weights(n_models: usize, weights: &[f64]) -> Result<Vec<f64>, String> {
        let sure = || Box::new(Discrete { outcomes: vec![1.0], probabilities: vec![1.0] }) as _;
        let models = (0..n_models).map(|_| sure()).collect();
        let belief = BeliefOver { models, weights: weights.to_vec() };
        belief.models().map(|(_, weights)| weights).map_err(|error| error.to_string())
    }

    #[test]
    fn models_are_equally_probable_by_default() {
        assert_eq!(weights(4, &[]), Ok(vec![0.25; 4]));
        assert_eq!(weights(2, &[0.75, 0.25]), Ok(vec![0.75, 0.25]));
    }

    #[test]
    fn what_is_no_distribution_is_explained() {
        assert_eq!(weights(0, &[]), Err("the belief holds no lottery possible".into()));
        assert_eq!(weights(2, &[1.0]), Err("the belief has 2 models but 1 weights".into()));
        assert_eq!(weights(2, &[0.5, 1.0]), Err("the weights sum to 1.5, not to 1".into()));
    }
}
