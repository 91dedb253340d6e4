//! Models on a scale of the data's own.

use std::sync::Arc;

use ivx_data::{Form, form};
use ivx_math::standard::Scale;
use ivx_op::{Artifact as _, Data, Tensors};

use super::Function;
use crate::Model;

pub(super) const KIND: &str = "scaled";

/// A model that sees and says scaled numbers, of numbers in their own units.
#[derive(Clone, Debug, PartialEq)]
pub struct Scaled {
    /// The model.
    pub model: Model,
    /// The scale of inputs.
    pub x: Scale,
    /// The scale of targets.
    pub y: Scale,
}

impl Function for Scaled {
    fn kind(&self) -> &'static str {
        KIND
    }

    fn tensors(&self) -> Tensors {
        let of = |name: &str, values: &[f64]| {
            (name.to_owned(), Data::F64(vec![values.len()], values.to_vec()))
        };
        let arrays = [
            ("model".to_owned(), Data::bytes(self.model.encode())),
            of("x.means", &self.x.means),
            of("x.stds", &self.x.stds),
            of("y.means", &self.y.means),
            of("y.stds", &self.y.stds),
        ];
        Tensors { arrays: arrays.into() }
    }

    fn predict(&self, form: &Form, xs: &[f64]) -> Vec<f64> {
        let said = self.model.predict(&self.x.scaled(xs));
        // Of classes there are logits, which have no unit.
        if form.classes.is_some() { said } else { self.y.in_units(&said) }
    }

    fn stds(&self, _: &Form, xs: &[f64]) -> Option<Vec<f64>> {
        self.model.stds(&self.x.scaled(xs)).map(|stds| self.y.distances_in_units(&stds))
    }

    fn around(&self, change: &mut dyn FnMut(&Model) -> Option<Model>) -> Option<Arc<dyn Function>> {
        let model = change(&self.model)?;
        Some(Arc::new(Self { model, x: self.x.clone(), y: self.y.clone() }))
    }
}

pub(super) fn read(form: &Form, tensors: &mut Tensors) -> Option<Arc<dyn Function>> {
    let (_, bytes) = tensors.u8("model")?;
    let model = Model::decode(&bytes).filter(|model| form::same(&model.form(), form).is_ok())?;
    let mut scale = |name: &str, width: usize| {
        let (_, means) = tensors.f64(&format!("{name}.means"))?;
        let (_, stds) = tensors.f64(&format!("{name}.stds"))?;
        let fits = means.len() == width && stds.len() == width;
        (fits && stds.iter().all(|std| *std > 0.0)).then_some(Scale { means, stds })
    };
    let (x, y) = (scale("x", form.input_len())?, scale("y", form.target_len())?);
    Some(Arc::new(Scaled { model, x, y }))
}
