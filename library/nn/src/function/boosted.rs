//! Boosted trees.

use std::sync::Arc;

use ivx_data::Form;
use ivx_math::boost::Boosted;
use ivx_op::{Data, Tensors};

use super::{Function, n_outputs, trees};

pub(super) const KIND: &str = "boosted";

impl Function for Boosted {
    fn kind(&self) -> &'static str {
        KIND
    }

    fn tensors(&self) -> Tensors {
        let base = Data::F64(vec![self.base.len()], self.base.clone());
        let mut tensors = Tensors { arrays: [("base".to_owned(), base)].into() };
        trees::put(&self.trees, &mut tensors);
        tensors
    }

    fn predict(&self, form: &Form, xs: &[f64]) -> Vec<f64> {
        self.values(xs, form.input_len())
    }
}

pub(super) fn read(form: &Form, tensors: &mut Tensors) -> Option<Arc<dyn Function>> {
    let (_, base) = tensors.f64("base")?;
    let trees = trees::take(tensors, form.input_len(), 1)?;
    let wanted = if form.classes == Some(2) { form.target_len() } else { n_outputs(form) };
    let fits = base.len() == wanted && wanted > 0 && trees.len().is_multiple_of(wanted);
    fits.then(|| Arc::new(Boosted { base, trees }) as _)
}
