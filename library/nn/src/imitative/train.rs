//! How an imitative model learns from plans.

use ivx_data::{Dataset, Form};
use ivx_op::{Ctx, OpError};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::model::steps_of;
use super::{CELL, HEAD, Imitative};
use crate::descend::{Rule, Turns, descend};
use crate::graph::{Graph, Shape, Var};
use crate::live::Live;
use crate::module::Mode;
use crate::network::singles;
use crate::real::Real;
use crate::seen::{log_std, state};
use crate::world::Body;

/// How an imitative model is trained.
#[derive(Clone, Copy, Debug)]
pub struct PlanTraining<'a> {
    /// How the objective is lowered, and for how long.
    pub rule: Rule<'a>,
    /// How many observations an update looks at; all where there are not more, or it is 0.
    pub batch: usize,
    /// The standard deviation of the noise that is added to the places of plans.
    pub noise: f64,
}

/// The model after updates that lower
///
/// ```text
/// −1/N Σ_i ln q(a_i | s_i; θ) + strength/2 ‖θ - centre‖²
/// ```
///
/// where the second term is the pull of the prior. Progress is kept with `ctx`, and goes on from there.
///
/// # Errors
/// If it is told to end.
///
/// # Panics
/// If there are no data, or they are of another form.
pub fn fit_plans(
    mut model: Imitative,
    data: &Dataset,
    how: &PlanTraining<'_>,
    ctx: &Ctx,
) -> Result<Imitative, OpError> {
    let mut live = Live::of(&model.nets);
    let form = &data.form;
    let (width, len) = (form.input_len(), form.target_len());
    let mut turns = Turns::new(data.len(), how.batch);
    let mut dropout = ctx.rng("dropout", &[]);
    let (xs, plans) = (singles(&data.x), singles(&data.y));
    let (mut x, mut plan) = (Vec::new(), Vec::new());
    descend(&mut live, &[""], how.rule, ctx, |live, t| {
        x.clear();
        plan.clear();
        for &i in turns.turn(t, ctx) {
            x.extend(&xs[i * width..][..width]);
            plan.extend(&plans[i * len..][..len]);
        }
        let mut noise = ctx.rng("noise", &[&t.to_string()]);
        if how.noise > 0.0 {
            for place in &mut plan {
                let drawn: f64 = StandardNormal.sample(&mut noise);
                *place += f32::of(how.noise * drawn);
            }
        }
        dropout.set_stream(t);
        dropout.set_word_pos(0);
        let log_q = log_density(live, form, (&x, &plan), &mut dropout);
        live.graph.affine(live.graph.mean(log_q), -1.0, 0.0)
    })?;
    live.put_into(&mut model.nets);
    Ok(model)
}

/// `ln q(a | s)` of each observation.
pub(super) fn log_density(
    live: &Live,
    form: &Form,
    (xs, plans): (&[f32], &[f32]),
    dropout: &mut ChaCha8Rng,
) -> Var {
    let (steps, _) = steps_of(form).expect("data of plans");
    let state = state(live, form, xs, &mut Mode::Train(dropout));
    plan_log_density(&live.graph, (live.body(CELL), live.body(HEAD)), state, (plans, steps))
}

/// `ln q(a | s)` of plans of so many steps, one an item of the states that their cell begins with.
///
/// - `plans`: `[items, steps, dims]`
///
/// # Panics
/// If the networks are no cell and its head, or there is not a plan a state.
pub fn plan_log_density<F: Real>(
    graph: &Graph<F>,
    (cell, head): (Body<'_>, Body<'_>),
    state: Var,
    (plans, steps): (&[F], usize),
) -> Var {
    let n = graph.shape(state).n;
    let dims = plans.len() / (n * steps);
    let column = |of: &dyn Fn(&[F], usize) -> F| {
        graph.filled(Shape::vectors(n, dims), |out| {
            for (plan, out) in plans.chunks_exact(steps * dims).zip(out.chunks_exact_mut(dims)) {
                out.iter_mut().enumerate().for_each(|(d, out)| *out = of(plan, d));
            }
        })
    };
    let mut states = vec![state];
    let each = (0..steps).map(|t| {
        let before = move |plan: &[F], d| if t == 0 { F::zero() } else { plan[(t - 1) * dims + d] };
        let mode = &mut Mode::Predict;
        let x = (column(&before), &[1, dims][..]);
        let h = cell.module.go_on(graph, cell.params, x, &mut states, mode);
        let width = [graph.shape(h).width()];
        let said = head.module.pass(graph, head.params, (h, &width), mode);
        let moved = column(&|plan, d| plan[t * dims + d] - before(plan, d));
        let missed = graph.sub(moved, graph.columns(said, 0, dims));
        let log_std = log_std(graph, graph.columns(said, dims, dims));
        graph.sum_items(graph.gaussian_log_prob(missed, log_std))
    });
    each.reduce(|sum, next| graph.add(sum, next)).expect("plans have steps")
}
