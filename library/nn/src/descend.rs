//! Lowering a loss step by step, in batches that go through the data anew in every pass.

use std::collections::BTreeMap;

use ivx_op::{Ctx, Data, OpError, Tensors, shown};
use rand::seq::SliceRandom as _;

use super::graph::{Graph, Var};
use super::optim::{Moments, Pull};
use super::optimiser::{Optimiser, Step};
use super::params::Params;

/// How a loss is lowered.
#[derive(Clone, Copy, Debug)]
pub struct Descent<'a> {
    /// The rule of an update.
    pub optimiser: &'a dyn Optimiser,
    /// The pull of the prior over the parameters.
    pub pull: Pull,
    /// How many updates.
    pub steps: u64,
}

/// Updates the parameters of `graph` by the gradients of what `loss` makes on it, a scalar, at each step.
///
/// Progress is kept with `ctx`, and goes on from there.
///
/// # Errors
/// If it is told to end.
pub fn descend(
    graph: &Graph<f32>,
    how: &Descent<'_>,
    ctx: &Ctx,
    mut loss: impl FnMut(&Graph<f32>, u64) -> Var,
) -> Result<(), OpError> {
    let mut moments = graph.params().moments();
    let state = ctx.resume().and_then(|bytes| restore(&bytes, &mut graph.params(), &mut moments));
    for t in state.unwrap_or(0)..how.steps {
        ctx.checkpoint(|| keep(t, &graph.params(), &moments))?;
        graph.begin();
        let loss = loss(graph, t);
        ctx.tell(t, how.steps, || format!("loss {}", shown(graph.scalar(loss).into())));
        graph.backward(loss);
        let step = Step { t, total: how.steps, pull: how.pull };
        how.optimiser.step(&step, &mut graph.params(), &mut moments);
    }
    Ok(())
}

/// Which of `n` items a step looks at: all, or so many at a time, in an order drawn anew for every pass, leaving out
/// what does not fill a batch.
#[derive(Debug)]
pub struct Turns {
    order: Vec<usize>,
    size: usize,
    pass: Option<u64>,
}

impl Turns {
    /// Batches of `size` of `n` items, of all where there are not more, or it is 0.
    #[must_use]
    pub fn new(n: usize, size: usize) -> Self {
        let size = if size == 0 { n } else { size.min(n) };
        Self { order: (0..n).collect(), size, pass: None }
    }

    /// Whether every step looks at all, in their order.
    #[must_use]
    pub fn are_whole(&self) -> bool {
        self.size == self.order.len()
    }

    /// How many items a step looks at.
    #[must_use]
    pub fn size(&self) -> usize {
        self.size
    }

    /// How many steps a pass through the items has.
    ///
    /// # Panics
    /// If there are no items.
    #[must_use]
    pub fn in_a_pass(&self) -> u64 {
        (self.order.len() / self.size) as u64
    }

    /// The items of step `t`.
    ///
    /// # Panics
    /// If there are no items, or so many that a step's place among them is no index.
    pub fn turn(&mut self, t: u64, ctx: &Ctx) -> &[usize] {
        if self.are_whole() {
            return &self.order;
        }
        let (pass, place) = (t / self.in_a_pass(), t % self.in_a_pass());
        if self.pass != Some(pass) {
            self.order.iter_mut().enumerate().for_each(|(i, item)| *item = i);
            self.order.shuffle(&mut ctx.rng("batches", &[&pass.to_string()]));
            self.pass = Some(pass);
        }
        let from = usize::try_from(place).expect("below the number of items") * self.size;
        &self.order[from..from + self.size]
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
