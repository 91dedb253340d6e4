//! Even mixtures of models.

use std::sync::Arc;

use ivx_data::{Form, form};
use ivx_math::moments::{mean, variance};
use ivx_op::{Artifact as _, Data, Tensors};

use super::{Function, log_shares};
use crate::Model;

pub(super) const KIND: &str = "mixture";

/// The even mixture of models, of numbers as the normal distribution of its moments (Lakshminarayanan, Pritzel and
/// Blundell, 2017, §2.4), of classes as the mean of their probabilities:
///
/// ```text
/// μ = 1/M Σ μ_m,   σ² = 1/M Σ (σ_m² + μ_m²) − μ²,   p(k) = 1/M Σ p_m(k)
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Mixture {
    /// The models, at least one.
    pub members: Vec<Model>,
    /// The standard deviation of numbers under a member that says none.
    pub noise: f64,
}

impl Mixture {
    /// What each member gives for each observation: `[members][N * width]`.
    fn each(&self, of: impl Fn(&Model) -> Vec<f64>) -> Vec<Vec<f64>> {
        self.members.iter().map(of).collect()
    }
}

/// Of each number, one of every member.
fn across(each: &[Vec<f64>]) -> impl Iterator<Item = Vec<f64>> {
    (0..each[0].len()).map(|i| each.iter().map(|member| member[i]).collect())
}

impl Function for Mixture {
    fn kind(&self) -> &'static str {
        KIND
    }

    fn tensors(&self) -> Tensors {
        let members = self.members.iter().enumerate();
        let members = members.map(|(m, model)| (m.to_string(), Data::bytes(model.encode())));
        let noise = Data::F64(vec![1], vec![self.noise]);
        Tensors { arrays: members.chain([("noise".to_owned(), noise)]).collect() }
    }

    fn predict(&self, form: &Form, xs: &[f64]) -> Vec<f64> {
        let of_all =
            |each: Vec<Vec<f64>>| across(&each).map(|all| mean(&all)).collect::<Vec<f64>>();
        if form.classes.is_none() {
            return of_all(self.each(|model| model.predict(xs)));
        }
        log_shares(&of_all(self.each(|model| model.class_shares(xs))))
    }

    fn stds(&self, form: &Form, xs: &[f64]) -> Option<Vec<f64>> {
        if form.classes.is_some() {
            return None;
        }
        let means = self.each(|model| model.predict(xs));
        let stds =
            self.each(|model| model.stds(xs).unwrap_or_else(|| vec![self.noise; means[0].len()]));
        // The mean square less the square of the mean is the variance of the means, and does not cancel.
        let of_all = across(&means).zip(across(&stds)).map(|(means, stds)| {
            let squares: Vec<f64> = stds.iter().map(|std| std * std).collect();
            (mean(&squares) + variance(&means)).sqrt()
        });
        Some(of_all.collect())
    }
}

pub(super) fn read(form: &Form, tensors: &mut Tensors) -> Option<Arc<dyn Function>> {
    let (_, noise) = tensors.f64("noise")?;
    let n = tensors.arrays.len();
    let members = (0..n).map(|m| {
        let (_, bytes) = tensors.u8(&m.to_string())?;
        Model::decode(&bytes).filter(|model| form::same(&model.form(), form).is_ok())
    });
    let members: Vec<Model> = members.collect::<Option<_>>()?;
    let noise = *noise.first()?;
    (!members.is_empty()).then(|| Arc::new(Mixture { members, noise }) as _)
}
