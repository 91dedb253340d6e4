//! What the three ways to learn modes lower, one number an observation.

use crate::graph::{Graph, Shape, Var};
use crate::real::Real;
use crate::seen::log_std;

/// That of multiple-trajectory prediction (Cui et al., 2019):
///
/// ```text
/// −ln π_m* + α/T Σ_t ‖y_t − ŷ_m*,t‖₂,  m* = argmin_m 1/T Σ_t ‖y_t − ŷ_m,t‖₂
/// ```
///
/// Which mode is nearest has no gradient.
///
/// - `said`: `[items, modes + modes × steps × dims]`, the logits and behind them the plans.
/// - `plans`: `[items, steps, dims]`, what came.
pub(super) fn made_losses<F: Real>(
    graph: &Graph<F>,
    said: Var,
    (plans, steps): (&[F], usize),
    weight: f64,
) -> Var {
    let Shape { n, .. } = graph.shape(said);
    let (len, width) = (plans.len() / n, graph.shape(said).width());
    let (modes, dims) = (width / (1 + len), len / steps);
    let made = graph.value(said);
    let nearest = graph.filled(Shape::vectors(n, 1), |out| {
        let items = made.chunks_exact(width).zip(plans.chunks_exact(len));
        for (out, (said, plan)) in out.iter_mut().zip(items) {
            let nearest = nearest(&said[modes..], plan, |a, b| displacement(a, b, dims));
            *out = index(nearest);
        }
    });
    let logits = graph.columns(said, 0, modes);
    let own = graph.gather(graph.columns(said, modes, modes * len), nearest, len);
    let apart = graph.sub(graph.input(Shape::vectors(n, len), plans), own);
    let apart = graph.lengths(graph.reshape(apart, Shape::vectors(n * steps, dims)));
    let apart = graph.sum_items(graph.reshape(apart, Shape::vectors(n, steps)));
    let apart = graph.affine(apart, weight / ivx_math::moments::real(steps), 0.0);
    graph.add(graph.cross_entropy(logits, nearest), apart)
}

/// That of `MultiPath` (Chai et al., 2019), whose deviations do not correlate:
///
/// ```text
/// −ln π_k* − Σ_t ln N(y_t; a_k*,t + μ_k*,t, diag σ_k*,t²),  σ = ln(1 + e^z) + 0.001
/// ```
///
/// - `said`: `[items, anchors + anchors × 2 × steps × dims]`, the logits and behind them, anchor by anchor, `μ` and what
///   makes `σ`.
/// - `apart`: `[items, steps, dims]`, how far what came is from the nearest anchor: `y − a_k*`.
/// - `nearest`: which anchor that is, of each item.
pub(super) fn moved_losses<F: Real>(
    graph: &Graph<F>,
    said: Var,
    apart: &[F],
    nearest: &[usize],
) -> Var {
    let (n, width) = (nearest.len(), graph.shape(said).width());
    let len = apart.len() / n;
    let anchors = width / (1 + 2 * len);
    let nearest = indices(graph, nearest);
    let logits = graph.columns(said, 0, anchors);
    let behind = graph.columns(said, anchors, anchors * 2 * len);
    let own = graph.gather(behind, nearest, 2 * len);
    let missed = graph.input(Shape::vectors(n, len), apart);
    let missed = graph.sub(missed, graph.columns(own, 0, len));
    let log_std = log_std(graph, graph.columns(own, len, len));
    let log_density = graph.sum_items(graph.gaussian_log_prob(missed, log_std));
    graph.sub(graph.cross_entropy(logits, nearest), log_density)
}

/// That of `CoverNet` with fixed trajectories (Phan-Minh et al., 2020): `−ln π_k*` of the nearest anchor.
pub(super) fn chosen_losses<F: Real>(graph: &Graph<F>, logits: Var, nearest: &[usize]) -> Var {
    graph.cross_entropy(logits, indices(graph, nearest))
}

/// That of a plan for each command, of which the one that is given learns: the mean of `|y − ŷ|` over its numbers.
///
/// - `said`: `[items, commands × steps × dims]`.
pub(super) fn commanded_losses<F: Real>(
    graph: &Graph<F>,
    said: Var,
    plans: &[F],
    given: &[usize],
) -> Var {
    let n = given.len();
    let len = plans.len() / n;
    let own = graph.gather(said, indices(graph, given), len);
    let apart = graph.absolute(own, graph.input(Shape::vectors(n, len), plans));
    graph.affine(graph.sum_items(apart), ivx_math::moments::real(len).recip(), 0.0)
}

fn indices<F: Real>(graph: &Graph<F>, of: &[usize]) -> Var {
    graph.filled(Shape::vectors(of.len(), 1), |out| {
        out.iter_mut().zip(of).for_each(|(out, i)| *out = index(*i));
    })
}

fn index<F: Real>(i: usize) -> F {
    F::of(ivx_math::moments::real(i))
}

/// Which of `modes` is nearest to a plan, the first of equals.
///
/// # Panics
/// If there are none.
pub(super) fn nearest<F: Real>(modes: &[F], plan: &[F], apart: impl Fn(&[F], &[F]) -> F) -> usize {
    let apart: Vec<F> = modes.chunks_exact(plan.len()).map(|mode| apart(mode, plan)).collect();
    (0..apart.len())
        .reduce(|best, i| if apart[i] < apart[best] { i } else { best })
        .expect("there are modes")
}

/// How far two plans are apart on average over steps, times the number of steps: `Σ_t ‖a_t − b_t‖₂`.
pub(super) fn displacement<F: Real>(a: &[F], b: &[F], dims: usize) -> F {
    let steps = a.chunks_exact(dims).zip(b.chunks_exact(dims));
    steps.map(|(a, b)| squared_distance(a, b).sqrt()).sum()
}

/// `‖a − b‖₂²` of all numbers of two plans.
pub(super) fn squared_distance<F: Real>(a: &[F], b: &[F]) -> F {
    a.iter().zip(b).map(|(&a, &b)| (a - b) * (a - b)).sum()
}
