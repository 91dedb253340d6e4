//! Forests.

use std::sync::Arc;

use ivx_data::Form;
use ivx_math::moments::real;
use ivx_math::tree::Tree;
use ivx_op::Tensors;

use super::{Function, log_shares, n_outputs, trees};

pub(super) const KIND: &str = "forest";

/// The mean of trees, whose targets are numbers or the shares of classes.
#[derive(Clone, Debug, PartialEq)]
pub struct Forest(pub Vec<Tree>);

impl Function for Forest {
    fn kind(&self) -> &'static str {
        KIND
    }

    fn tensors(&self) -> Tensors {
        let mut tensors = Tensors::default();
        trees::put(&self.0, &mut tensors);
        tensors
    }

    fn predict(&self, form: &Form, xs: &[f64]) -> Vec<f64> {
        let of_one = |x: &[f64]| {
            let mut mean = vec![0.0; n_outputs(form)];
            for tree in &self.0 {
                mean.iter_mut()
                    .zip(tree.value(tree.leaf(x)))
                    .for_each(|(sum, value)| *sum += value);
            }
            for sum in &mut mean {
                *sum /= real(self.0.len());
            }
            if form.classes.is_some() { log_shares(&mean) } else { mean }
        };
        xs.chunks_exact(form.input_len()).flat_map(of_one).collect()
    }
}

pub(super) fn read(form: &Form, tensors: &mut Tensors) -> Option<Arc<dyn Function>> {
    let trees = trees::take(tensors, form.input_len(), n_outputs(form))?;
    (!trees.is_empty()).then(|| Arc::new(Forest(trees)) as _)
}
