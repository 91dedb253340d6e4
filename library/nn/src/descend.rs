//! Lowering a loss step by step, in batches that go through the data anew in every pass.

use ivx_op::{Ctx, OpError, State, shown};
use rand::seq::SliceRandom as _;

use super::graph::Var;
use super::live::Live;
use super::optim::{Moments, Pull};
use super::optimiser::{Optimiser, Step};
use super::params::ParamId;

/// How a loss is lowered.
#[derive(Clone, Copy, Debug)]
pub struct Rule<'a> {
    /// The rule of an update.
    pub optimiser: &'a dyn Optimiser,
    /// The pull of the prior over the parameters.
    pub pull: Pull,
    /// How many updates there are in all.
    pub steps: u64,
}

/// The descent of one group of parameters of some networks, with its rule and moments. Several may share a graph.
#[derive(Debug)]
pub struct Descent<'a> {
    rule: Rule<'a>,
    group: Vec<ParamId>,
    moments: Vec<Moments<f32>>,
    done: u64,
}

impl<'a> Descent<'a> {
    /// That of the parameters whose names begin with one of `prefixes`, which an empty one does with all.
    #[must_use]
    pub fn new(live: &Live, prefixes: &[&str], rule: Rule<'a>) -> Self {
        let group = live.group(prefixes);
        let mut moments = live.graph.params().moments();
        for (place, moments) in moments.iter_mut().enumerate() {
            if !group.iter().any(|id| id.place() == place) {
                *moments = Moments::zeros(0);
            }
        }
        Self { rule, group, moments, done: 0 }
    }

    /// How many updates were made.
    #[must_use]
    pub fn done(&self) -> u64 {
        self.done
    }

    /// Updates the parameters by the gradients of what `loss` makes of the networks, a scalar, which is told.
    pub fn lower(&mut self, live: &Live, loss: impl FnOnce(&Live) -> Var) -> f64 {
        live.graph.begin();
        let loss = loss(live);
        let told = live.graph.scalar(loss).into();
        live.graph.backward(loss);
        let step = Step { t: self.done, total: self.rule.steps, pull: self.rule.pull };
        let mut params = live.graph.params();
        params.move_only(&self.group);
        self.rule.optimiser.step(&step, &mut params, &mut self.moments);
        self.done += 1;
        told
    }

    /// Walks over the moments and the count of updates.
    pub fn state(&mut self, state: &mut State) {
        state.count("done", &mut self.done);
        for (i, moments) in self.moments.iter_mut().enumerate() {
            state.numbers(&format!("{i}.first"), &mut moments.first);
            state.numbers(&format!("{i}.second"), &mut moments.second);
        }
    }
}

/// Lowers what `loss` makes of networks at each step until all is done, by the parameters whose names begin with one
/// of `group`.
///
/// Progress is kept with `ctx`, and goes on from there.
///
/// # Errors
/// If it is told to end.
pub fn descend(
    live: &mut Live,
    group: &[&str],
    rule: Rule<'_>,
    ctx: &Ctx,
    mut loss: impl FnMut(&Live, u64) -> Var,
) -> Result<(), OpError> {
    let mut descent = Descent::new(live, group, rule);
    let walk = |state: &mut State, descent: &mut Descent<'_>, live: &mut Live| {
        descent.state(state);
        state.within("live", |state| live.state(state));
    };
    if let Some(bytes) = ctx.resume() {
        State::restore(&bytes, |state| walk(state, &mut descent, live));
    }
    while descent.done < rule.steps {
        ctx.checkpoint(|| State::keep(|state| walk(state, &mut descent, live)))?;
        let t = descent.done;
        let lost = descent.lower(live, |live| loss(live, t));
        ctx.tell(t, rule.steps, || format!("loss {}", shown(lost)));
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
