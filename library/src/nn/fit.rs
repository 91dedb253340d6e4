//! Training networks.

use std::collections::BTreeMap;

use ivx_op::{Ctx, Data, Tensors};
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;

use super::graph::Graph;
use super::loss::Loss;
use super::module::{Mode, batch};
use super::network::{PRIOR, load, outputs, singles};
use super::optim::{Moments, Pull};
use super::optimiser::{Optimiser, Step};
use super::params::{ParamId, Params};
use crate::artifact::{Dataset, NetModel};

/// How a network is trained.
#[derive(Clone, Copy, Debug)]
pub struct Training<'a> {
    /// What its outputs are measured by.
    pub loss: &'a dyn Loss,
    /// How the objective is lowered.
    pub optimiser: &'a dyn Optimiser,
    /// The pull of the prior over the parameters.
    pub pull: Pull,
    /// How many observations an update looks at; all where there are not more, or it is 0.
    pub batch: usize,
    /// How many updates.
    pub steps: u64,
}

/// The network after updates that lower
///
/// ```text
/// 1/N Σ_i loss(y_i, f(x_i; θ)) + strength/2 ‖θ - centre‖²
/// ```
///
/// where the second term is the pull. A prior network inside `net` is added to `f`, and stays. Batches go
/// through the data in an order drawn anew for every pass, and leave out what does not fill one. Progress
/// is kept with `ctx`, and goes on from there.
///
/// # Panics
/// If an array is missing, or there are no data.
#[must_use]
pub fn fit(mut net: NetModel, data: &Dataset, how: &Training<'_>, ctx: &Ctx) -> NetModel {
    let (graph, params) = load(&net, "");
    let mut moments = graph.params().moments();
    let mut batches = Batches::new(&net, data, how.batch);
    let mut dropout = ctx.rng("dropout", &[]);
    let state = ctx.resume().and_then(|bytes| restore(&bytes, &mut graph.params(), &mut moments));
    for t in state.unwrap_or(0)..how.steps {
        ctx.checkpoint(|| keep(t, &graph.params(), &moments));
        batches.turn(t, ctx);
        dropout.set_stream(t);
        dropout.set_word_pos(0);
        backward(&graph, &params, (&net, how.loss), &batches, &mut dropout);
        let step = Step { t, total: how.steps, pull: how.pull };
        how.optimiser.step(&step, &mut graph.params(), &mut moments);
    }
    for param in graph.params().arrays() {
        let found = net.params.iter_mut().find(|(name, ..)| *name == param.name);
        let (.., values) = found.expect("networks have an array for every layer");
        values.clone_from(&param.value);
    }
    net
}

/// Leaves the gradients of the loss of a batch in the parameters; returns the loss.
fn backward(
    graph: &Graph<f32>,
    params: &[ParamId],
    (net, loss): (&NetModel, &dyn Loss),
    batches: &Batches,
    dropout: &mut ChaCha8Rng,
) -> f32 {
    graph.begin();
    let (input, target) = (&net.form.input[..], &net.form.target[..]);
    let (x, y) = (&batches.x.shown, &batches.y.shown);
    let n = batches.shown;
    let x = graph.input(batch(n, input), x);
    let mut f = net.module.pass(graph, params, (x, input), &mut Mode::Train(dropout));
    if !batches.prior.shown.is_empty() {
        f = graph.add(f, graph.input(graph.shape(f), &batches.prior.shown));
    }
    let loss = loss.of(graph, &net.form, f, graph.input(batch(n, target), y));
    graph.backward(loss);
    graph.scalar(loss)
}

/// Observations in single precision, and those of the batch at hand.
struct Batches {
    x: Column,
    y: Column,
    /// What the prior network adds; nothing without one.
    prior: Column,
    /// How many are shown at a time.
    shown: usize,
    /// The order of this pass through the data, and which pass it is; none where all are shown.
    order: Option<(Vec<usize>, Option<u64>)>,
}

/// Numbers of every observation, and those that are shown.
struct Column {
    all: Vec<f32>,
    width: usize,
    shown: Vec<f32>,
}

impl Batches {
    fn new(net: &NetModel, data: &Dataset, size: usize) -> Self {
        let n = data.len();
        let whole = size == 0 || n <= size;
        let column = |all: Vec<f32>| {
            let (width, shown) = (all.len() / n, if whole { all.clone() } else { Vec::new() });
            Column { all, width, shown }
        };
        let x = singles(&data.x);
        let prior = if net.prior_scale == 0.0 {
            Vec::new()
        } else {
            let prior = outputs(net, PRIOR, &x).into_iter();
            singles(&prior.map(|y| net.prior_scale * y).collect::<Vec<_>>())
        };
        Self {
            y: column(singles(&data.y)),
            prior: column(prior),
            x: column(x),
            shown: if whole { n } else { size },
            order: (!whole).then(|| ((0..n).collect(), None)),
        }
    }

    /// Shows the batch of step `t`.
    fn turn(&mut self, t: u64, ctx: &Ctx) {
        let Some((order, of)) = &mut self.order else { return };
        let in_a_pass = (order.len() / self.shown) as u64;
        let (pass, place) = (t / in_a_pass, t % in_a_pass);
        if *of != Some(pass) {
            order.sort_unstable();
            order.shuffle(&mut ctx.rng("batches", &[&pass.to_string()]));
            *of = Some(pass);
        }
        let from = usize::try_from(place).expect("below the number of data") * self.shown;
        for column in [&mut self.x, &mut self.y, &mut self.prior] {
            column.shown.clear();
            for &i in &order[from..from + self.shown] {
                column.shown.extend(&column.all[i * column.width..][..column.width]);
            }
        }
    }
}

/// The kind of a training that is not done.
const UNFINISHED: &str = "Unfinished";

/// A training before step `t`, as bytes.
fn keep(t: u64, params: &Params<f32>, moments: &[Moments<f32>]) -> Vec<u8> {
    let mut arrays = BTreeMap::new();
    let mut put = |name: String, values: &[f32]| {
        arrays.insert(name, Data::F32(vec![values.len()], values.to_vec()));
    };
    for (param, moments) in params.arrays().iter().zip(moments) {
        put(param.name.clone(), &param.value);
        put(format!("{}.first", param.name), &moments.first);
        put(format!("{}.second", param.name), &moments.second);
    }
    Tensors { arrays }.encode(UNFINISHED, &t)
}

/// The step that a training goes on with; `None`, and nothing changed, if the bytes are not of one
/// of these parameters.
fn restore(bytes: &[u8], params: &mut Params<f32>, moments: &mut [Moments<f32>]) -> Option<u64> {
    let (mut tensors, t): (_, u64) = Tensors::decode(UNFINISHED, bytes)?;
    let mut take = |name: String, n: usize| {
        tensors.f32(&name).map(|(_, values)| values).filter(|values| values.len() == n)
    };
    let mut read = Vec::new();
    for (param, moments) in params.arrays().iter().zip(&*moments) {
        let first = take(format!("{}.first", param.name), moments.first.len())?;
        let second = take(format!("{}.second", param.name), moments.second.len())?;
        read.push((take(param.name.clone(), param.value.len())?, Moments { first, second }));
    }
    for ((value, kept), (param, moments)) in read.into_iter().zip(params.values_mut().zip(moments))
    {
        param.copy_from_slice(&value);
        *moments = kept;
    }
    Some(t)
}

#[cfg(test)]
mod tests;
