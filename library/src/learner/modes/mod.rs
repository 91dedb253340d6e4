//! How forecasts of a few modes are learned: baselines of imitative models.

mod cil;
mod covernet;
mod mtp;
mod multipath;

use std::fmt::Debug;
use std::sync::Arc;

use ivx_data::{Dataset, Form, Misfit};
use ivx_nn::{
    Anchored, Fitted, ModeNets, ModeTraining, Model, Modes, Module, Multimodal, Optimiser, Rule,
    Turns, fit_modes, plan_sizes,
};
use ivx_op::{Array, Ctx, Dim, OpError};

pub use cil::Cil;
pub use covernet::CoverNet;
pub use mtp::Mtp;
pub use multipath::MultiPath;

use super::targets::are_sound;
use super::{Learner, Prior};

/// How many anchors there are thought to be as long as they are not known.
const THOUGHT: usize = 64;

/// How modes are learned, whatever they are.
struct Learning<'a> {
    nets: ModeNets<'a>,
    prior: &'a dyn Prior,
    optimiser: &'a dyn Optimiser,
    batch: usize,
    weight: f64,
}

impl Learning<'_> {
    fn train(&self, modes: Modes, data: &Dataset, steps: u64, ctx: &Ctx) -> Result<Model, OpError> {
        are_sound(data)?;
        let form = &data.form;
        let initial = Multimodal::drawn(&self.nets, modes, form, &mut ctx.rng("init", &[]));
        let initial = initial.map_err(ivx_data::form::failed)?;
        let pull = self.prior.pull(1.0, ivx_math::moments::real(data.len()));
        let rule = Rule { optimiser: self.optimiser, pull, steps };
        let how = ModeTraining { rule, batch: self.batch, weight: self.weight };
        let model = fit_modes(initial, data, &how, ctx)?;
        if !model.networks().are_finite() {
            let message =
                format!("training diverged within {steps} steps: lower the learning rate");
            return Err(OpError::Failed(message));
        }
        Ok(Model::Fitted(Fitted { form: form.clone(), function: Arc::new(model) }))
    }

    fn memory(&self, modes: &Modes, form: &Form, n: u64) -> u64 {
        let Ok(modules) = self.nets.modules(form, modes) else { return 0 };
        let params: u64 = modules.values().map(Module::n_params).sum();
        let at_once = if self.batch == 0 { n } else { n.min(self.batch as u64) };
        let state = [self.nets.features + form.beside];
        let merged = modules["merge"].output(&state).unwrap_or_default();
        let outputs = modules["see"].n_outputs(&form.input)
            + modules["merge"].n_outputs(&state)
            + modules["head"].n_outputs(&merged);
        let data = n.saturating_mul(4 * (form.input_len() + form.target_len()) as u64);
        // A parameter, its gradient, two running averages and two copies; an output, its gradient and a temporary.
        (params * 24).saturating_add(outputs.saturating_mul(at_once * 12)).saturating_add(data)
    }
}

/// Fixed plans as the modes of a model of observations of a form; as many as may be where they are still to be computed.
fn anchored(how: Anchored, anchors: &Array, form: &Form) -> Result<Modes, Misfit> {
    let (steps, dims) = plan_sizes("a model of modes", form)?;
    if anchors.dims.is_empty() {
        return Ok(Modes::Anchored(how, vec![0.0; THOUGHT * steps * dims]));
    }
    let sizes: Vec<usize> = anchors.dims.iter().map(Dim::len).collect();
    if sizes[0] == 0 || sizes[1..] != [steps, dims] {
        let told = sizes.iter().map(usize::to_string).collect::<Vec<_>>().join(" × ");
        let message = format!(
            "the anchors are an array of {told}, and plans of the data of {steps} × {dims}"
        );
        return Err(Misfit::new(message, HELP));
    }
    if let Some(at) = anchors.values.iter().position(|x| !x.is_finite()) {
        let (plan, number, x) = (at / (steps * dims), at % (steps * dims), anchors.values[at]);
        let message = format!("number {number} of anchor {plan} is {x}");
        return Err(Misfit::new(message, HELP));
    }
    Ok(Modes::Anchored(how, anchors.values.clone()))
}

/// The same of anchors that were computed.
fn computed(how: Anchored, anchors: &Array, form: &Form) -> Result<Modes, OpError> {
    if anchors.dims.is_empty() {
        let why = "the anchors are a number, and plans are wanted: `plan_library` makes some";
        return Err(OpError::Failed(why.to_owned()));
    }
    anchored(how, anchors, form).map_err(ivx_data::form::failed)
}

const HELP: &str = "make the anchors of such data, by `plan_library(on: data)`";

/// What the checker knows of the number of anchors.
fn n_anchors(anchors: &Array) -> Vec<usize> {
    anchors.dims.first().map(Dim::len).into_iter().collect()
}

/// A learner of modes, which are all that one differs from another in.
trait OfModes: Debug + Send + Sync {
    fn learning(&self) -> Learning<'_>;

    /// What its modes are, of observations of a form; as many anchors as may be where they are still to be computed.
    fn kind(&self, form: &Form) -> Result<Modes, Misfit>;

    /// The same when all is computed.
    fn computed(&self, form: &Form) -> Result<Modes, OpError> {
        self.kind(form).map_err(ivx_data::form::failed)
    }

    /// What the checker knows of the number of its modes.
    fn n_modes(&self) -> Vec<usize>;
}

impl<T: OfModes> Learner for T {
    fn train(&self, data: &Dataset, steps: u64, ctx: &Ctx) -> Result<Model, OpError> {
        self.learning().train(self.computed(&data.form)?, data, steps, ctx)
    }

    fn fits(&self, form: &Form) -> Result<(), Misfit> {
        self.learning().nets.modules(form, &self.kind(form)?).map(drop)
    }

    fn memory(&self, form: &Form, n: u64) -> u64 {
        self.kind(form).map_or(0, |modes| self.learning().memory(&modes, form, n))
    }

    fn updates_in_a_pass(&self, n: usize) -> u64 {
        if n == 0 { 1 } else { Turns::new(n, self.learning().batch).in_a_pass() }
    }

    fn makes_networks(&self) -> bool {
        true
    }

    fn modes(&self) -> Option<Vec<usize>> {
        Some(self.n_modes())
    }
}

#[cfg(test)]
mod tests;
