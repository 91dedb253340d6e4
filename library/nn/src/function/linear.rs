//! Linear functions.

use std::sync::Arc;

use ivx_data::Form;
use ivx_math::affine::Affine;
use ivx_op::{Data, Tensors};

use super::{Function, n_outputs};

pub(super) const KIND: &str = "linear";

impl Function for Affine {
    fn kind(&self) -> &'static str {
        KIND
    }

    fn tensors(&self) -> Tensors {
        let n_outputs = self.intercepts.len();
        let shape = vec![self.weights.len() / n_outputs, n_outputs];
        let weights = Data::F64(shape, self.weights.clone());
        let intercepts = Data::F64(vec![n_outputs], self.intercepts.clone());
        let arrays = [("weights".to_owned(), weights), ("intercepts".to_owned(), intercepts)];
        Tensors { arrays: arrays.into() }
    }

    fn predict(&self, _: &Form, xs: &[f64]) -> Vec<f64> {
        self.values(xs)
    }
}

pub(super) fn read(form: &Form, tensors: &mut Tensors) -> Option<Arc<dyn Function>> {
    let ((shape, weights), (_, intercepts)) = (tensors.f64("weights")?, tensors.f64("intercepts")?);
    // Two classes have one logit, that of the second.
    let of_two = form.classes == Some(2) && intercepts.len() == form.target_len();
    let fits = shape == [form.input_len(), intercepts.len()]
        && (of_two || intercepts.len() == n_outputs(form))
        && !weights.is_empty();
    fits.then(|| Arc::new(Affine { weights, intercepts }) as _)
}
