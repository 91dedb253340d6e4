//! The plans that a model of a few modes finds most probable.

use ivx_data::form::{failed, form, model_of_data, same, wrong};
use ivx_data::{Dataset, Misfit};
use ivx_nn::{Model, Multimodal, plan_sizes};
use ivx_op::{Array, Ctx, Dim, Facts, Labels, One, Op, OpError, Wrong, declare, record};

record! {
    /// The modes of a model where something was seen, the most probable first.
    pub struct Foretold = "Modes" {
        /// Their places.
        plans: Array [row, mode, step, dim];
        /// The natural logarithm of how probable each is.
        worth: Array [row, mode];
    }
}

declare! {
    /// The plans that a model of a few modes finds most probable at each observation, the first of equals first: such as
    /// `mtp`, `multipath` and `covernet` learn.
    pub struct Modes = "modes" @ 1 -> Foretold {
        /// The model.
        model: One<Model>;
        /// Where plans are wanted; their targets are not looked at.
        on: One<Dataset>;
        /// How many; the model must have as many.
        modes: usize = 5, in 1.0..=100_000.0;
    }
    rule has_modes;
}

/// What the checker calls the number of a model's modes.
pub(crate) const MODES: &str = "modes";

fn has_modes(facts: &Facts<'_>) -> Result<(), Wrong> {
    model_of_data(facts)?;
    if let Some(form) = form(facts, "on") {
        plan_sizes("`modes`", &form).map_err(wrong("on"))?;
    }
    let Some(model) = facts.shapes("model") else { return Ok(()) };
    match (model.get(MODES).map(Vec::as_slice), facts.arg::<usize>("modes")) {
        (None, _) => Err(wrong("model")(none())),
        (Some([n]), Some(wanted)) => are_enough(*n, wanted).map_err(wrong("modes")),
        _ => Ok(()),
    }
}

fn none() -> Misfit {
    let message = "the model has no modes: use one that `mtp`, `multipath` or `covernet` learned";
    Misfit::new(message.to_owned(), "of an imitative model, `plans` finds some")
}

fn are_enough(n: usize, wanted: usize) -> Result<(), Misfit> {
    if wanted <= n {
        return Ok(());
    }
    let message = format!("the model has {n} modes, and {wanted} are asked for");
    Err(Misfit::new(message, &format!("ask for {n} at most, by `modes: {n}`")))
}

impl Op for Modes {
    fn run(&self, _: &Ctx) -> Result<Foretold, OpError> {
        let (data, form) = (&*self.on, &self.on.form);
        same(&self.model.form(), form).map_err(failed)?;
        let (steps, dims) = plan_sizes("`modes`", form).map_err(failed)?;
        let (model, _) = Multimodal::within(&self.model).ok_or_else(|| failed(none()))?;
        are_enough(model.modes().n(steps * dims), self.modes).map_err(failed)?;
        let (plans, worth) = model.best(form, &data.x, self.modes);
        if let Some(at) = worth.iter().position(|worth| worth.is_nan()) {
            let (row, mode) = (at / self.modes, at % self.modes);
            let why = format!("how probable mode {mode} of row {row} is, is no number");
            return Err(OpError::Failed(why));
        }
        let sizes = [("row", data.len()), ("mode", self.modes), ("step", steps), ("dim", dims)];
        let dims = sizes.map(|(name, n)| Dim::new(name, Labels::count(n)));
        Ok(Foretold {
            worth: Array { dims: dims[..2].to_vec(), values: worth },
            plans: Array { dims: dims.to_vec(), values: plans },
        })
    }
}
