//! What models of plans share: the sizes of plans, how a state is made of what is seen, and how a spread is read.

use ivx_data::{Form, Misfit};

use crate::curve::Curve;
use crate::graph::{Graph, Shape, Var};
use crate::live::Live;
use crate::module::{Mode, Module, batch};
use crate::net::{Net, headed};
use crate::networks::Networks;
use crate::real::Real;

/// What sees an input, and what makes a state of it and of the numbers beside it.
pub(crate) const SEE: &str = "see";
pub(crate) const MERGE: &str = "merge";

/// The least standard deviation of a place.
pub(crate) const FLOOR: f64 = 1e-3;

/// How many steps plans of a form have, and how many numbers a place is.
///
/// # Errors
/// If targets are no plans, which `what` is of.
pub fn plan_sizes(what: &str, form: &Form) -> Result<(usize, usize), Misfit> {
    match (&form.target[..], form.classes) {
        ([steps, dims], None) if *steps > 0 && *dims > 0 => Ok((*steps, *dims)),
        _ => {
            let message =
                format!("{what} is of plans, and the data are {}", ivx_data::form::told(form));
            Err(Misfit::new(message, "give data whose targets are sequences of places"))
        }
    }
}

/// What sees inputs of a form, up to so many numbers.
///
/// # Errors
/// Why it does not fit.
pub(crate) fn see(net: &dyn Net, form: &Form, features: usize) -> Result<Module, Misfit> {
    headed(net, &form.input, &[features])
}

/// Layers of these widths, each with the positive part of what it puts out.
pub(crate) fn relu(widths: &[usize], mut inputs: usize) -> Vec<Module> {
    let layer = |outputs: &usize| {
        let layer = Module::Dense { inputs, outputs: *outputs, curve: Curve::Relu };
        inputs = *outputs;
        layer
    };
    widths.iter().map(layer).collect()
}

/// Whether it is dense layers one after the other.
pub(crate) fn is_dense(module: &Module) -> bool {
    let is = |layer: &Module| matches!(layer, Module::Dense { .. });
    matches!(module, Module::Sequence(layers) if layers.iter().all(is))
}

/// How many numbers come out where an input of a shape goes in; none if it does not fit, or they are no vector.
pub(crate) fn ends(module: &Module, input: &[usize]) -> Option<usize> {
    match module.output(input).ok()?[..] {
        [len] => Some(len),
        _ => None,
    }
}

/// How many numbers a state has that networks make of what is seen; none if they do not fit observations of the form.
pub(crate) fn state_len(nets: &Networks, form: &Form) -> Option<usize> {
    let (see, merge) = (nets.modules.get(SEE)?, nets.modules.get(MERGE)?);
    let seen = ends(see, &form.input)?.checked_add(form.beside)?;
    if is_dense(merge) { ends(merge, &[seen]) } else { None }
}

/// The states of `xs`, each an input and the numbers beside it.
pub(crate) fn state(live: &Live, form: &Form, xs: &[f32], mode: &mut Mode<'_>) -> Var {
    let (graph, width) = (&live.graph, form.input_len());
    assert!(xs.len().is_multiple_of(width), "whole inputs");
    let (n, own) = (xs.len() / width, width - form.beside);
    let rows = |from: usize, len: usize| {
        move |out: &mut [f32]| {
            let rows = xs.chunks_exact(width).zip(out.chunks_exact_mut(len));
            rows.for_each(|(row, out)| out.copy_from_slice(&row[from..from + len]));
        }
    };
    let x = graph.filled(batch(n, &form.input), rows(0, own));
    let see = live.body(SEE);
    let mut seen = see.module.pass(graph, see.params, (x, &form.input), mode);
    if form.beside > 0 {
        let beside = graph.filled(Shape::vectors(n, form.beside), rows(own, form.beside));
        seen = graph.concat(&[seen, beside]);
    }
    let merge = live.body(MERGE);
    let shape = [graph.shape(seen).width()];
    merge.module.pass(graph, merge.params, (seen, &shape), mode)
}

/// `ln σ` of what a network puts out for it: `σ = ln(1 + e^z) + 0.001`.
pub(crate) fn log_std<F: Real>(graph: &Graph<F>, z: Var) -> Var {
    let floor = F::of(FLOOR);
    let spread = graph.curve(z, Curve::Softplus);
    graph.map(spread, |x| (x + floor).ln(), move |x, _| (x + floor).recip())
}
