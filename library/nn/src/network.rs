//! Networks as plain arrays: before training, while they predict, and from elsewhere.

use std::collections::BTreeSet;

use ivx_data::Form;
use ivx_data::Misfit;
use ivx_data::form::of_one_shape;
use rand_chacha::ChaCha8Rng;

use super::live::Live;
use super::loss::{Loss, variance};
use super::module::{Mode, batch};
use super::net::{Net, headed};
use super::real::Real as _;
use crate::{Head, NetModel, Networks, PRIOR, joined};

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
    of_one_shape(form)?;
    let module = headed(net, &form.input, &loss.outputs(form)?)?;
    let nets = Networks::drawn([(String::new(), module)].into(), rng);
    Ok(NetModel { nets, form: form.clone(), head: loss.head(), prior_scale: 0.0 })
}

/// What a network puts out for inputs one after the other, its prior network included: for every target
/// its mean, or a logit for each class.
///
/// # Panics
/// If an array is missing, or the inputs are no whole number of items.
#[must_use]
pub fn predict(net: &NetModel, xs: &[f64]) -> Vec<f64> {
    let outputs = all_outputs(net, xs);
    if net.head.says_std() { halves(net, &outputs, 0) } else { outputs }
}

/// The standard deviation that a network puts out for every target; none if it puts out none.
///
/// # Panics
/// As [`predict`].
#[must_use]
pub fn stds(net: &NetModel, xs: &[f64]) -> Option<Vec<f64>> {
    let std: fn(f64) -> f64 = match net.head {
        Head::Gaussian => f64::exp,
        Head::GaussianVariance => |z: f64| variance(z).sqrt(),
        Head::Mean | Head::Logits => return None,
    };
    Some(halves(net, &all_outputs(net, xs), 1).into_iter().map(std).collect())
}

/// The means of Gaussians, or what stands behind them.
fn halves(net: &NetModel, outputs: &[f64], half: usize) -> Vec<f64> {
    let width = net.form.target.last().copied().unwrap_or(1);
    outputs.chunks_exact(2 * width).flat_map(|row| row[half * width..][..width].to_vec()).collect()
}

/// What a network puts out, with what its prior network adds.
fn all_outputs(net: &NetModel, xs: &[f64]) -> Vec<f64> {
    let xs = singles(xs);
    let mut outputs = outputs(net, "", &xs);
    if net.prior_scale != 0.0 {
        let prior = self::outputs(net, PRIOR, &xs);
        outputs.iter_mut().zip(prior).for_each(|(y, prior)| *y += net.prior_scale * prior);
    }
    outputs
}

/// What the network of a name puts out.
pub(super) fn outputs(net: &NetModel, name: &str, xs: &[f32]) -> Vec<f64> {
    let live = Live::some(&net.nets, |other| other == name);
    let (graph, body) = (&live.graph, live.body(name));
    let width = net.form.input_len();
    let mut all = Vec::new();
    for xs in xs.chunks(AT_ONCE * width) {
        assert!(xs.len().is_multiple_of(width), "whole items");
        graph.begin();
        let x = graph.input(batch(xs.len() / width, &net.form.input), xs);
        let input = (x, &net.form.input[..]);
        let y = graph.still(|| body.module.pass(graph, body.params, input, &mut Mode::Predict));
        all.extend(graph.value(y).into_iter().map(f64::from));
    }
    all
}

/// Numbers in the precision of networks.
#[must_use]
pub fn singles(values: &[f64]) -> Vec<f32> {
    values.iter().map(|&x| f32::of(x)).collect()
}

/// Whether a network that others wrote can be evaluated.
///
/// # Errors
/// What is wrong with it.
pub fn check(net: &NetModel) -> Result<(), String> {
    let Form { input, target, classes, .. } = &net.form;
    let of_form = input.iter().chain(target).chain(classes).copied().max().unwrap_or(0);
    if net.module().largest().max(of_form) > LARGEST {
        return Err(format!("it has layers or shapes that are too large: above {LARGEST}"));
    }
    if classes.is_some_and(|n| n < 2) {
        return Err("it tells fewer than two classes apart".to_owned());
    }
    of_one_shape(&net.form).map_err(|misfit| misfit.message)?;
    let outputs = net.module().output(input).map_err(|misfit| misfit.message)?;
    let wanted = match (net.head, net.form.classes) {
        (Head::Mean, None) => net.form.target_len(),
        (Head::Gaussian | Head::GaussianVariance, None) => 2 * net.form.target_len(),
        (Head::Logits, Some(2)) if outputs.iter().product::<usize>() == net.form.target_len() => {
            net.form.target_len()
        }
        (Head::Logits, Some(classes)) => classes * net.form.target_len(),
        (Head::Mean | Head::Gaussian | Head::GaussianVariance, Some(_)) | (Head::Logits, None) => {
            return Err("what it puts out are not its targets".to_owned());
        }
    };
    if outputs.iter().product::<usize>() != wanted {
        let found: usize = outputs.iter().product();
        return Err(format!("it puts out {found} numbers, and its targets take {wanted}"));
    }
    let arrays = &net.nets.arrays;
    let mut known = BTreeSet::new();
    for (own, module) in &net.nets.modules {
        for array in module.arrays() {
            let name = joined(own, &array.name);
            if !arrays.iter().any(|(own, found, _)| *own == name && *found == array.shape) {
                let shape = array.shape;
                return Err(format!("the array `{name}` of shape {shape:?} is not there"));
            }
            known.insert(name);
        }
    }
    match arrays.iter().find(|(name, ..)| !known.contains(name)) {
        Some((name, ..)) => Err(format!("the array `{name}` belongs to no layer")),
        None => Ok(()),
    }
}
