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
    descend(&mut live, &[""], rule, ctx, |live, t| {
        batches.turn(t, ctx);
        dropout.set_stream(t);
        dropout.set_word_pos(0);
        objective(live, (&net.form, how.loss), &batches, &mut dropout)
    })?;
    live.put_into(&mut net.nets);
    Ok(net)
}

/// The loss of the batch at hand.
fn objective(
    live: &Live,
    (form, loss): (&Form, &dyn Loss),
    batches: &Batches,
    dropout: &mut ChaCha8Rng,
) -> Var {
    let (input, target) = (&form.input[..], &form.target[..]);
    let (n, graph, body) = (batches.turns.size(), &live.graph, live.body(""));
    let x = graph.input(batch(n, input), &batches.x.shown);
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
