//! Nearest neighbours.

use std::sync::Arc;

use ivx_data::{Dataset, Form, Misfit};
use ivx_nn::{Fitted, Model, Neighbours};
use ivx_op::{Ctx, OpError, declare};

use super::Learner;
use super::targets::{are_numbers_or_classes, are_sound};

declare! {
    /// The mean target of the `k` nearest data, or the shares of classes among them (Fix and Hodges, 1951).
    ///
    /// Nearness is Euclidean, so that inputs are best brought to one scale; of data as near the earlier count. Inputs of
    /// any shape are vectors of their numbers. A class that none of the nearest has is impossible, with an infinite
    /// `nll` where it is right.
    pub struct Knn = "knn" @ 1 {
        /// How many.
        k: usize = 5, in 1.0..;
    }
}

impl Learner for Knn {
    fn train(&self, data: &Dataset, _: u64, _: &Ctx) -> Result<Model, OpError> {
        are_sound(data)?;
        if self.k > data.len() {
            let why = format!("there are {} data, and `k` is {}", data.len(), self.k);
            return Err(OpError::Failed(why));
        }
        let Dataset { form, x, y } = data.clone();
        Ok(Model::Fitted(Fitted { form, function: Arc::new(Neighbours { x, y, k: self.k }) }))
    }

    fn fits(&self, form: &Form) -> Result<(), Misfit> {
        are_numbers_or_classes("knn", form)
    }

    fn memory(&self, form: &Form, n: u64) -> u64 {
        2 * 8 * n * (form.input_len() + form.target_len()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CTX: Ctx = Ctx::new("train", 0, None);

    #[test]
    fn all_neighbours_are_the_mean_and_one_is_the_nearest() {
        let data = Dataset::pairs(vec![0.0, 1.0, 3.0], vec![2.0, 4.0, 9.0]);
        let at = |k| Knn { k }.train(&data, 0, &CTX).map(|model| model.predict(&[1.2, 9.0]));
        assert_eq!(at(1), Ok(vec![4.0, 9.0]));
        assert_eq!(at(2), Ok(vec![3.0, 6.5]));
        assert_eq!(at(3), Ok(vec![5.0, 5.0]));
        assert_eq!(at(4).unwrap_err().to_string(), "there are 3 data, and `k` is 4");
    }

    /// The nearest of a wave are closer to it than its mean by far, and one by one they follow its noise.
    #[test]
    fn neighbours_follow_a_wave() {
        let wave = |x: f64| (6.0 * x).sin();
        let x: Vec<f64> = (0..200).map(|i| f64::from(i) / 200.0).collect();
        let noisy =
            x.iter().enumerate().map(|(i, x)| wave(*x) + if i % 2 == 0 { 0.2 } else { -0.2 });
        let data = Dataset::pairs(x.clone(), noisy.collect());
        let rmse = |k| {
            let model = Knn { k }.train(&data, 0, &CTX).unwrap();
            let errors = model.predict(&x).into_iter().zip(&x).map(|(y, x)| (y - wave(*x)).powi(2));
            ivx_math::moments::mean(&errors.collect::<Vec<f64>>()).sqrt()
        };
        let (one, some, all) = (rmse(1), rmse(8), rmse(200));
        assert!(some < 0.5 * one && some < 0.2 * all, "{one}, {some} and {all}");
    }

    #[test]
    fn classes_have_shares() {
        let form = Form { input: vec![2], target: vec![], classes: Some(3), ..Form::default() };
        let x = vec![0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 5.0, 5.0];
        let data = Dataset { form, x, y: vec![2.0, 2.0, 0.0, 1.0] };
        let model = Knn { k: 3 }.train(&data, 0, &CTX).unwrap();
        let shares = model.class_shares(&[0.1, 0.1]);
        let expected = [1.0 / 3.0, 0.0, 2.0 / 3.0];
        assert!(shares.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{shares:?}");
    }
}
