//! How probable plans are under several models, and which way they would be more so.

use crate::real::Real;

use super::member::{Member, PlanWeights, Step, std};

/// `½ ln 2π`.
const HALF_LN_2_PI: f64 = 0.918_938_533_204_672_7;

/// How many items go through a model at once.
const AT_ONCE: usize = 64;

/// Scores plans by the log densities of several models (Eqns. 3.2 to 3.4),
///
/// ```text
/// ln q(a | s; θ_k) = Σ_t ln N(a_t; a_{t-1} + δ_t, diag σ_t²),  (δ_t, σ_t) = f(h_t),  h_t = GRU(a_{t-1}, h_{t-1})
/// ```
///
/// from `a_0 = 0` and the states `h_0 = z_k(s)` that each model makes of what is seen. What does not depend on the plan,
/// the first step and what the second takes from it, is computed once; and gradients pass only through models that
/// matter. Nothing is allocated after the first plans of a size.
#[derive(Debug)]
pub struct Scorer<F> {
    members: Vec<Member<F>>,
    steps: usize,
    rows: usize,
    /// Of each model.
    seen: Vec<Seen<F>>,
    /// Step `t ≥ 1` of model `k` is at `k (steps - 1) + t - 1`.
    passes: Vec<Step<F>>,
    /// How many items those are of, and how many are in use.
    room: usize,
    items: usize,
    /// Of each model and step: `e = (a_t - a_{t-1} - δ_t) / σ_t`, `1/σ_t` and the slope of `σ_t`, `[items, dims]` each.
    errors: Vec<[Vec<F>; 3]>,
    places: Vec<F>,
    grad_state: Vec<F>,
    grad_places: Vec<F>,
    spare: Vec<F>,
    moved: Vec<F>,
}

/// What a model makes of the rows that are seen, whatever the plan.
#[derive(Clone, Debug)]
struct Seen<F> {
    first: Step<F>,
    /// `h_1 W + b`, wide.
    of_state: Vec<F>,
}

impl<F: Real> Scorer<F> {
    pub(super) fn of(members: Vec<Member<F>>, steps: usize) -> Self {
        let sizes = |member: &Member<F>| (member.units(), member.dims());
        let alike = members.windows(2).all(|two| sizes(&two[0]) == sizes(&two[1]));
        assert!(!members.is_empty() && alike && steps > 0, "models of plans of one size");
        Self {
            members,
            steps,
            rows: 0,
            seen: Vec::new(),
            passes: Vec::new(),
            room: 0,
            items: 0,
            errors: Vec::new(),
            places: Vec::new(),
            grad_state: Vec::new(),
            grad_places: Vec::new(),
            spare: Vec::new(),
            moved: Vec::new(),
        }
    }

    /// Models of plans of so many steps.
    ///
    /// # Panics
    /// If there are none, they have other sizes, or plans have no steps.
    #[must_use]
    pub fn new(models: &[PlanWeights<F>], steps: usize) -> Self {
        Self::of(models.iter().map(Member::new).collect(), steps)
    }

    /// How many models there are.
    #[must_use]
    pub fn models(&self) -> usize {
        self.members.len()
    }

    /// How many numbers a plan is.
    #[must_use]
    pub fn len(&self) -> usize {
        self.steps * self.members[0].dims()
    }

    /// Whether plans are nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many situations are seen.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Sees situations by the states that each model makes of them.
    ///
    /// - `states`: `[models, rows, units]`
    ///
    /// # Panics
    /// If they are of another length.
    pub fn see(&mut self, states: &[F]) {
        let units = self.members[0].units();
        let rows = states.len() / (self.members.len() * units);
        assert_eq!(states.len(), self.members.len() * rows * units, "a state a model and row");
        if rows != self.rows || self.seen.is_empty() {
            let of = |member: &Member<F>| {
                let first = Step::new(member, rows);
                Seen { of_state: first.of_state.clone(), first }
            };
            self.seen = self.members.iter().map(of).collect();
            self.rows = rows;
        }
        let start = &mut self.places;
        start.clear();
        start.resize(rows * self.members[0].dims(), F::zero());
        let models = self.members.iter().zip(&mut self.seen);
        for ((member, seen), states) in models.zip(states.chunks_exact(rows * units)) {
            member.remember(states, &mut seen.first.of_state);
            seen.first.before.copy_from_slice(states);
            member.forward(start, &mut seen.first);
            member.remember(&seen.first.after, &mut seen.of_state);
        }
    }

    /// Makes room for so many items at once.
    fn make_room(&mut self, items: usize) {
        self.items = items;
        if self.room == items {
            return;
        }
        let (member, later) = (&self.members[0], self.steps - 1);
        let dims = member.dims();
        self.passes.clear();
        self.errors.clear();
        for member in &self.members {
            self.passes.extend((0..later).map(|_| Step::new(member, items)));
            self.errors.extend(
                (0..self.steps).map(|_| std::array::from_fn(|_| vec![F::zero(); items * dims])),
            );
        }
        self.grad_state = vec![F::zero(); items * member.wide()];
        self.spare = self.grad_state.clone();
        self.grad_places = vec![F::zero(); items * dims];
        self.room = items;
    }

    /// The log density of each plan under each model.
    ///
    /// - `plans`: `[rows, n, steps · dims]`
    /// - `scores`: `[rows, n, models]`
    ///
    /// # Panics
    /// If they are of other lengths.
    pub fn scores(&mut self, plans: &[F], n: usize, scores: &mut [F]) {
        let (len, models, items) = (self.len(), self.models(), self.rows * n);
        assert_eq!((plans.len(), scores.len()), (items * len, items * models), "plans and scores");
        let at_once = if n == 1 { items } else { items.min(AT_ONCE) };
        let mut from = 0;
        while from < items {
            // What does not fill the room goes with some of those before it.
            let first = from.min(items - at_once);
            self.make_room(at_once);
            let plans = &plans[first * len..][..at_once * len];
            self.score(plans, (first, n), &mut scores[first * models..][..at_once * models]);
            from += at_once;
        }
    }

    fn score(&mut self, plans: &[F], (first, n): (usize, usize), scores: &mut [F]) {
        for k in 0..self.models() {
            for t in 0..self.steps {
                self.advance(k, t, plans, (first, n));
                self.measure(k, t, plans, (first, n));
            }
            let models = self.models();
            let all = &self.errors[k * self.steps..][..self.steps];
            let dims = self.members[k].dims();
            for (item, score) in scores.iter_mut().skip(k).step_by(models).enumerate() {
                let mut sum = F::zero();
                for [errors, precisions, _] in all {
                    let of = item * dims..(item + 1) * dims;
                    for (&e, &p) in errors[of.clone()].iter().zip(&precisions[of]) {
                        sum += F::of(-0.5) * e * e + p.ln() - F::of(HALF_LN_2_PI);
                    }
                }
                *score = sum;
            }
        }
    }

    /// Computes what model `k` says of step `t`, where that depends on the plans.
    fn advance(&mut self, k: usize, t: usize, plans: &[F], (first, n): (usize, usize)) {
        if t == 0 {
            return;
        }
        let (len, member, seen) = (self.len(), &self.members[k], &self.seen[k]);
        let dims = member.dims();
        self.places.clear();
        let before = plans.chunks_exact(len).map(|plan| &plan[(t - 1) * dims..t * dims]);
        before.for_each(|places| self.places.extend(places));
        let passes = &mut self.passes[k * (self.steps - 1)..][..self.steps - 1];
        let (done, step) = passes.split_at_mut(t - 1);
        let step = &mut step[0];
        if let Some(last) = done.last() {
            step.before.copy_from_slice(&last.after);
            member.remember(&step.before, &mut step.of_state);
        } else {
            let (units, width) = (member.units(), seen.of_state.len() / self.rows);
            let items = step.before.chunks_exact_mut(units);
            let items = items.zip(step.of_state.chunks_exact_mut(width));
            for (item, (before, of_state)) in items.enumerate() {
                let row = ((first + item) / n).min(self.rows - 1);
                before.copy_from_slice(&seen.first.after[row * units..][..units]);
                of_state.copy_from_slice(&seen.of_state[row * width..][..width]);
            }
        }
        member.forward(&self.places, step);
    }

    /// How far the plans are from what model `k` says of step `t`.
    fn measure(&mut self, k: usize, t: usize, plans: &[F], (first, n): (usize, usize)) {
        let (len, dims) = (self.len(), self.members[k].dims());
        let [errors, precisions, slopes] = &mut self.errors[k * self.steps + t];
        for (item, plan) in plans.chunks_exact(len).enumerate() {
            let (shift, raw) = if t == 0 {
                self.seen[k].first.said((first + item) / n, dims)
            } else {
                self.passes[k * (self.steps - 1) + t - 1].said(item, dims)
            };
            for d in 0..dims {
                let from = if t == 0 { F::zero() } else { plan[(t - 1) * dims + d] };
                let (spread, slope) = std(raw[d]);
                let precision = spread.recip();
                errors[item * dims + d] = (plan[t * dims + d] - from - shift[d]) * precision;
                precisions[item * dims + d] = precision;
                slopes[item * dims + d] = slope;
            }
        }
    }

    /// The gradient of `Σ_k w_k ln q_k` of the plans that were scored last, which were one a row.
    ///
    /// - `weights`: `[rows, models]`; models whose weights are all 0 are not looked at
    /// - `slope`: `[rows, steps · dims]`
    ///
    /// # Panics
    /// If other plans were scored last.
    pub fn slope(&mut self, weights: &[F], slope: &mut [F]) {
        assert_eq!(
            (self.items, slope.len()),
            (self.rows, self.rows * self.len()),
            "one plan a row"
        );
        slope.fill(F::zero());
        let (models, len) = (self.models(), self.len());
        for k in 0..models {
            if weights.iter().skip(k).step_by(models).all(|w| *w == F::zero()) {
                continue;
            }
            let dims = self.members[k].dims();
            self.grad_state.fill(F::zero());
            for t in (0..self.steps).rev() {
                let [errors, precisions, slopes] = &self.errors[k * self.steps + t];
                for item in 0..self.items {
                    let weight = weights[item * models + k];
                    for d in 0..dims {
                        let at = item * dims + d;
                        let (e, precision) = (errors[at], precisions[at]);
                        let pull = weight * e * precision;
                        slope[item * len + t * dims + d] -= pull;
                        if t > 0 {
                            slope[item * len + (t - 1) * dims + d] += pull;
                            let step = &mut self.passes[k * (self.steps - 1) + t - 1];
                            let (shift, raw) = step.said_back(item, dims);
                            shift[d] = pull;
                            raw[d] = weight * (e * e - F::one()) * precision * slopes[at];
                        }
                    }
                }
                if t > 0 {
                    self.pass_back(k, t);
                    self.add_places(t - 1, slope);
                }
            }
        }
    }

    /// Adds what was passed back to places of step `t`.
    fn add_places(&self, t: usize, slope: &mut [F]) {
        let dims = self.members[0].dims();
        let rows = slope.chunks_exact_mut(self.len()).zip(self.grad_places.chunks_exact(dims));
        for (plan, grad) in rows {
            plan[t * dims..].iter_mut().zip(grad).for_each(|(slope, x)| *slope += *x);
        }
    }

    /// Passes what was put back into what model `k` said of step `t` on to its state and its places.
    fn pass_back(&mut self, k: usize, t: usize) {
        let step = &mut self.passes[k * (self.steps - 1) + t - 1];
        let (state, spare, places) = (&mut self.grad_state, &mut self.spare, &mut self.grad_places);
        self.members[k].backward(step, state, spare, places, t > 1);
    }

    /// The plans that model `k` makes of noise, `a_t = a_{t-1} + δ_t + σ_t x_t`: samples, if that is normal, and where it
    /// is 0 what the model takes to be the middle.
    ///
    /// - `noise`: `[rows, n, steps · dims]`, replaced by the plans
    ///
    /// # Panics
    /// If there is no such model, or `noise` is of another length.
    pub fn plans(&mut self, k: usize, noise: &mut [F], n: usize) {
        let (len, items) = (self.len(), self.rows * n);
        assert_eq!(noise.len(), items * len, "noise for every step");
        let at_once = if n == 1 { items } else { items.min(AT_ONCE) };
        self.make_room(at_once);
        let mut part = std::mem::take(&mut self.moved);
        for (i, noise) in noise.chunks_mut(at_once * len).enumerate() {
            part.clear();
            part.extend(&*noise);
            // What does not fill the room is made with others that are nothing.
            part.resize(at_once * len, F::zero());
            self.make(k, &mut part, (i * at_once, n));
            noise.copy_from_slice(&part[..noise.len()]);
        }
        self.moved = part;
    }

    fn make(&mut self, k: usize, noise: &mut [F], (first, n): (usize, usize)) {
        let (len, dims) = (self.len(), self.members[k].dims());
        for t in 0..self.steps {
            self.advance(k, t, noise, (first, n));
            for (item, plan) in noise.chunks_exact_mut(len).enumerate() {
                let (shift, raw) = if t == 0 {
                    self.seen[k].first.said(self.row((first, n), item), dims)
                } else {
                    self.passes[k * (self.steps - 1) + t - 1].said(item, dims)
                };
                for d in 0..dims {
                    let from = if t == 0 { F::zero() } else { plan[(t - 1) * dims + d] };
                    let x = plan[t * dims + d];
                    plan[t * dims + d] = from + shift[d] + std(raw[d]).0 * x;
                }
            }
        }
    }

    /// The row of an item, where the first of these is among all, and so many belong to a row.
    fn row(&self, (first, n): (usize, usize), item: usize) -> usize {
        ((first + item) / n).min(self.rows - 1)
    }

    /// The gradient by noise of what has the gradient `slope` by the plans that were made of it last, one a row.
    ///
    /// - `noise`: what the plans were made of, `[rows, steps · dims]`
    /// - `slope`: `[rows, steps · dims]`, replaced
    ///
    /// # Panics
    /// If other plans were made last.
    pub fn plans_back(&mut self, k: usize, noise: &[F], slope: &mut [F]) {
        let (len, dims) = (self.len(), self.members[k].dims());
        assert_eq!((self.items, slope.len()), (self.rows, self.moved.len()), "one plan a row");
        // Scoring in between has used the same memory.
        let plans = std::mem::take(&mut self.moved);
        (0..self.steps).for_each(|t| self.advance(k, t, &plans, (0, 1)));
        self.moved = plans;
        self.grad_state.fill(F::zero());
        for t in (0..self.steps).rev() {
            for item in 0..self.items {
                for d in 0..dims {
                    let at = item * len + t * dims + d;
                    let grad = slope[at];
                    let raw = if t == 0 {
                        self.seen[k].first.said(item, dims).1[d]
                    } else {
                        self.passes[k * (self.steps - 1) + t - 1].said(item, dims).1[d]
                    };
                    let (spread, bend) = std(raw);
                    slope[at] = grad * spread;
                    if t > 0 {
                        slope[at - dims] += grad;
                        let step = &mut self.passes[k * (self.steps - 1) + t - 1];
                        let (shift, raw) = step.said_back(item, dims);
                        shift[d] = grad;
                        raw[d] = grad * noise[at] * bend;
                    }
                }
            }
            if t > 0 {
                self.pass_back(k, t);
                self.add_places(t - 1, slope);
            }
        }
    }
}
