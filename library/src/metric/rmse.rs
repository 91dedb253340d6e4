//! How far a model's predictions lie from data.

use ivx_op::{Array, Ctx, One, Op, OpError, declare};

use crate::artifact::{Dataset, Model};
use crate::math::moments::mean;

declare! {
    /// The root mean squared error of a model on data.
    pub struct Rmse = "rmse" @ 2 -> Array {
        /// The model.
        model: One<Model>;
        /// The data.
        on: One<Dataset>;
    }
}

impl Op for Rmse {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        if self.on.x.is_empty() {
            return Err(OpError::Failed("there are no data to measure the error on".to_owned()));
        }
        let predicted = self.model.predict(&self.on.x);
        let squares = predicted.iter().zip(&self.on.y).map(|(p, y)| (p - y).powi(2));
        Ok(Array::scalar(mean(&squares.collect::<Vec<_>>()).sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_one_and_seven() {
        // The line x is wrong by 1 and by 7: √((1 + 49) / 2) = 5.
        let model = || One(Model::Polynomial(vec![0.0, 1.0]));
        let on = One(Dataset { x: vec![0.0, 2.0], y: vec![1.0, -5.0] });
        let ctx = Ctx::new("rmse", 0, None);
        assert_eq!(Rmse { model: model(), on }.run(&ctx), Ok(Array::scalar(5.0)));
        assert!(Rmse { model: model(), on: One(Dataset::default()) }.run(&ctx).is_err());
    }
}
