//! Networks as plain arrays: before training, while they predict, and from elsewhere.

use std::collections::BTreeSet;

use ivx_data::Form;
use ivx_data::Misfit;
use rand_chacha::ChaCha8Rng;

use super::graph::Graph;
use super::loss::Loss;
use super::module::{Mode, batch};
use super::net::{Net, headed};
use super::params::{ParamId, Params};
use super::real::Real as _;
use crate::{Head, NetModel};

/// The largest size of a layer that is read from a file.
const LARGEST: usize = 10_000_000;

/// How many items go through a network at once when it predicts.
const AT_ONCE: usize = 1024;

/// A network for observations of a form, with parameters drawn from `rng`.
///
/// # Errors
/// Why the architecture or the loss does not fit.
pub fn init(
    net: &dyn Net,
    loss: &dyn Loss,
    form: &Form,
    rng: &mut ChaCha8Rng,
) -> Result<NetModel, Misfit> {
    let module = headed(net, &form.input, &loss.outputs(form)?)?;
    let arrays = module.arrays().into_iter().map(|array| {
        let n = array.shape.iter().product();
        (array.name, array.shape, array.start.draw(n, rng))
    });
    let mut params: Vec<_> = arrays.collect();
    // By name, as they come back from a file.
    params.sort_by(|(a, ..), (b, ..)| a.cmp(b));
    Ok(NetModel { module, form: form.clone(), head: loss.head(), prior_scale: 0.0, params })
}

/// What a network puts out for inputs one after the other, its prior network included: for every target
/// its mean, or a logit for each class.
///
/// # Panics
/// If an array is missing, or the inputs are no whole number of items.
#[must_use]
pub fn predict(net: &NetModel, xs: &[f64]) -> Vec<f64> {
    let xs = singles(xs);
    let mut outputs = outputs(net, "", &xs);
    if net.prior_scale != 0.0 {
        let prior = self::outputs(net, PRIOR, &xs);
        outputs.iter_mut().zip(prior).for_each(|(y, prior)| *y += net.prior_scale * prior);
    }
    if net.head == Head::Gaussian {
        let width = net.form.target.last().copied().unwrap_or(1);
        outputs.chunks_exact(2 * width).flat_map(|row| row[..width].to_vec()).collect()
    } else {
        outputs
    }
}

/// What the names of a prior network's arrays begin with.
pub(super) const PRIOR: &str = "prior.";

/// What the layers whose arrays bear `prefix` put out.
pub(super) fn outputs(net: &NetModel, prefix: &str, xs: &[f32]) -> Vec<f64> {
    let (graph, params) = load(net, prefix);
    let width = net.form.input_len();
    let mut all = Vec::new();
    for xs in xs.chunks(AT_ONCE * width) {
        assert!(xs.len().is_multiple_of(width), "whole items");
        graph.begin();
        let x = graph.input(batch(xs.len() / width, &net.form.input), xs);
        let input = (x, &net.form.input[..]);
        let y = graph.still(|| net.module.pass(&graph, &params, input, &mut Mode::Predict));
        all.extend(graph.value(y).into_iter().map(f64::from));
    }
    all
}

/// The arrays that bear `prefix`, for passes through the network.
pub(super) fn load(net: &NetModel, prefix: &str) -> (Graph<f32>, Vec<ParamId>) {
    let mut params = Params::default();
    for array in net.module.arrays() {
        let name = format!("{prefix}{}", array.name);
        let found = net.params.iter().find(|(own, ..)| *own == name);
        let (.., values) = found.expect("networks have an array for every layer");
        if array.learns {
            params.add(name, array.shape, values.clone());
        } else {
            params.add_fixed(name, array.shape, values.clone());
        }
    }
    let ids = params.ids().collect();
    (Graph::new(params), ids)
}

pub(super) fn singles(values: &[f64]) -> Vec<f32> {
    values.iter().map(|&x| f32::of(x)).collect()
}

/// Whether a network that others wrote can be evaluated.
///
/// # Errors
/// What is wrong with it.
pub fn check(net: &NetModel) -> Result<(), String> {
    let Form { input, target, classes } = &net.form;
    let of_form = input.iter().chain(target).chain(classes).copied().max().unwrap_or(0);
    if net.module.largest().max(of_form) > LARGEST {
        return Err(format!("it has layers or shapes that are too large: above {LARGEST}"));
    }
    let outputs = net.module.output(input).map_err(|misfit| misfit.message)?;
    let wanted = match (net.head, net.form.classes) {
        (Head::Mean, None) => net.form.target_len(),
        (Head::Gaussian, None) => 2 * net.form.target_len(),
        (Head::Logits, Some(2)) if outputs.iter().product::<usize>() == net.form.target_len() => {
            net.form.target_len()
        }
        (Head::Logits, Some(classes)) => classes * net.form.target_len(),
        (Head::Mean | Head::Gaussian, Some(_)) | (Head::Logits, None) => {
            return Err("what it puts out are not its targets".to_owned());
        }
    };
    if outputs.iter().product::<usize>() != wanted {
        let found: usize = outputs.iter().product();
        return Err(format!("it puts out {found} numbers, and its targets take {wanted}"));
    }
    let prefixes = if net.prior_scale == 0.0 { &[""][..] } else { &["", PRIOR] };
    let mut known = BTreeSet::new();
    for prefix in prefixes {
        for array in net.module.arrays() {
            let name = format!("{prefix}{}", array.name);
            if !net.params.iter().any(|(own, found, _)| *own == name && *found == array.shape) {
                let shape = array.shape;
                return Err(format!("the array `{name}` of shape {shape:?} is not there"));
            }
            known.insert(name);
        }
    }
    match net.params.iter().find(|(name, ..)| !known.contains(name)) {
        Some((name, ..)) => Err(format!("the array `{name}` belongs to no layer")),
        None => Ok(()),
    }
}
