//! Training networks.

use ivx_data::{Dataset, Form};
use ivx_op::{Ctx, OpError};
use rand_chacha::ChaCha8Rng;

use super::descend::{Rule, Turns, descend};
use super::graph::Var;
use super::live::Live;
use super::loss::Loss;
use super::module::{Mode, batch};
use super::network::{outputs, singles};
use super::optim::Pull;
use super::optimiser::Optimiser;
use crate::{NetModel, PRIOR};

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
    /// How far inputs are moved against the network, as a share of each one's range; 0 for no adversarial training.
    pub adversarial: f64,
    /// How many updates.
    pub steps: u64,
}

/// The network after updates that lower
///
/// ```text
/// 1/N Σ_i loss(y_i, f(x_i; θ)) + strength/2 ‖θ - centre‖²
/// ```
///
/// where the second term is the pull; with adversarial training the loss of `x + ε sign(∇_x loss)` is added to that of
/// `x`. A prior network inside `net` is added to `f`, and stays. Batches go
/// through the data in an order drawn anew for every pass, and leave out what does not fill one. Progress
/// is kept with `ctx`, and goes on from there.
///
/// # Errors
/// If it is told to end.
///
/// # Panics
/// If an array is missing, or there are no data.
pub fn fit(
    mut net: NetModel,
    data: &Dataset,
    how: &Training<'_>,
    ctx: &Ctx,
) -> Result<NetModel, OpError> {
    let mut live = Live::some(&net.nets, str::is_empty);
    let mut batches = Batches::new(&net, data, how.batch);
    let mut dropout = ctx.rng("dropout", &[]);
    let rule = Rule { optimiser: how.optimiser, pull: how.pull, steps: how.steps };
    let reach = reach(data, how.adversarial);
    descend(&mut live, &[""], rule, ctx, |live, t| {
        batches.turn(t, ctx);
        dropout.set_stream(t);
        dropout.set_word_pos(0);
        let of = |x: Var, dropout: &mut ChaCha8Rng| {
            objective(live, (&net.form, how.loss), (x, &batches), dropout)
        };
        let (graph, shape) = (&live.graph, batch(batches.turns.size(), &net.form.input));
        let shown = &batches.x.shown;
        if how.adversarial == 0.0 {
            return of(graph.input(shape, shown), &mut dropout);
        }
        let slope = graph.frozen(|| {
            let x = graph.variable(shape, shown);
            graph.backward(of(x, &mut dropout.clone()));
            graph.grad(x)
        });
        let plain = of(graph.input(shape, shown), &mut dropout.clone());
        let moved = graph.input(shape, &against(shown, &slope, &reach));
        graph.add(plain, of(moved, &mut dropout))
    })?;
    live.put_into(&mut net.nets);
    Ok(net)
}

/// How far each number of an input moves: a share of its range in the data; nothing is looked at where none moves.
fn reach(data: &Dataset, share: f64) -> Vec<f32> {
    if share == 0.0 {
        return Vec::new();
    }
    let width = data.form.input_len();
    let columns = (0..width).map(|i| {
        let column = data.x.iter().skip(i).step_by(width);
        let ends = column
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
        share * (ends.1 - ends.0)
    });
    singles(&columns.collect::<Vec<_>>())
}

/// `x + ε sign(slope)`.
fn against(x: &[f32], slope: &[f32], reach: &[f32]) -> Vec<f32> {
    let moved = x.iter().zip(slope).zip(reach.iter().cycle());
    moved
        .map(|((x, slope), reach)| if *slope == 0.0 { *x } else { x + reach * slope.signum() })
        .collect()
}

/// The loss of inputs of the batch at hand.
fn objective(
    live: &Live,
    (form, loss): (&Form, &dyn Loss),
    (x, batches): (Var, &Batches),
    dropout: &mut ChaCha8Rng,
) -> Var {
    let (input, target) = (&form.input[..], &form.target[..]);
    let (n, graph, body) = (batches.turns.size(), &live.graph, live.body(""));
    let mut f = body.module.pass(graph, body.params, (x, input), &mut Mode::Train(dropout));
    if !batches.prior.shown.is_empty() {
        f = graph.add(f, graph.input(graph.shape(f), &batches.prior.shown));
    }
    loss.of(graph, form, f, graph.input(batch(n, target), &batches.y.shown))
}

/// Observations in single precision, and those of the batch at hand.
struct Batches {
    x: Column,
    y: Column,
    /// What the prior network adds; nothing without one.
    prior: Column,
    /// Which are shown.
    turns: Turns,
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
        let turns = Turns::new(n, size);
        let column = |all: Vec<f32>| {
            let (width, shown) =
                (all.len() / n, if turns.are_whole() { all.clone() } else { Vec::new() });
            Column { all, width, shown }
        };
        let x = singles(&data.x);
        let prior = if net.prior_scale == 0.0 {
            Vec::new()
        } else {
            let prior = outputs(net, PRIOR, &x).into_iter();
            singles(&prior.map(|y| net.prior_scale * y).collect::<Vec<_>>())
        };
        Self { y: column(singles(&data.y)), prior: column(prior), x: column(x), turns }
    }

    /// Shows the batch of step `t`.
    fn turn(&mut self, t: u64, ctx: &Ctx) {
        if self.turns.are_whole() {
            return;
        }
        let items = self.turns.turn(t, ctx);
        for column in [&mut self.x, &mut self.y, &mut self.prior] {
            column.shown.clear();
            for &i in items {
                column.shown.extend(&column.all[i * column.width..][..column.width]);
            }
        }
    }
}

#[cfg(test)]
mod tests;
