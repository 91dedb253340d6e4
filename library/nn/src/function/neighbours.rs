//! What is known of the nearest.

use std::sync::Arc;

use ivx_data::Form;
use ivx_math::moments::{mean, real};
use ivx_math::neighbours::nearest;
use ivx_op::{Data, Tensors};

use super::{Function, log_shares};

pub(super) const KIND: &str = "neighbours";

/// The mean target of the nearest data, or the shares of classes among them.
#[derive(Clone, Debug, PartialEq)]
pub struct Neighbours {
    /// Inputs of the data, one after the other.
    pub x: Vec<f64>,
    /// Their targets.
    pub y: Vec<f64>,
    /// How many are asked; no more than there are.
    pub k: usize,
}

impl Function for Neighbours {
    fn kind(&self) -> &'static str {
        KIND
    }

    fn tensors(&self) -> Tensors {
        let flat = |values: &[f64]| Data::F64(vec![values.len()], values.to_vec());
        let arrays = [("x", flat(&self.x)), ("y", flat(&self.y)), ("k", flat(&[real(self.k)]))];
        Tensors { arrays: arrays.map(|(name, data)| (name.to_owned(), data)).into() }
    }

    fn predict(&self, form: &Form, xs: &[f64]) -> Vec<f64> {
        let width = form.target_len();
        let of_one = |x: &[f64]| {
            let near = nearest(&self.x, x, self.k);
            let column = |t: usize| near.iter().map(move |i| self.y[i * width + t]);
            match form.classes {
                None => (0..width).map(|t| mean(&column(t).collect::<Vec<_>>())).collect(),
                Some(n) => {
                    let mut shares = vec![0.0; n];
                    for class in column(0) {
                        #[expect(
                            clippy::cast_possible_truncation,
                            clippy::cast_sign_loss,
                            reason = "a class"
                        )]
                        let class = class as usize;
                        shares[class] += 1.0 / real(self.k);
                    }
                    log_shares(&shares)
                }
            }
        };
        xs.chunks_exact(form.input_len()).flat_map(of_one).collect()
    }
}

pub(super) fn read(form: &Form, tensors: &mut Tensors) -> Option<Arc<dyn Function>> {
    let ((_, x), (_, y), (_, k)) = (tensors.f64("x")?, tensors.f64("y")?, tensors.f64("k")?);
    let n = y.len() / form.target_len().max(1);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
    let k = *k.first()? as usize;
    let classes_are = |n: usize| y.iter().all(|class| (0..n).any(|k| real(k) == *class));
    let fits = x.len() == n * form.input_len()
        && y.len() == n * form.target_len()
        && (1..=n).contains(&k)
        && x.iter().all(|x| x.is_finite())
        && form.classes.is_none_or(|n| form.target.is_empty() && classes_are(n));
    fits.then(|| Arc::new(Neighbours { x, y, k }) as _)
}
