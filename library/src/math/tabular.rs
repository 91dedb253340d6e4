//! Losses of values and models that have a number for everything, with their gradients (§C.2.1).

use super::moments::real;
use super::policy::boltzmann;

/// What followed an action once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition {
    /// Where it was taken.
    pub state: usize,
    /// What was done.
    pub action: usize,
    /// What it paid.
    pub reward: f64,
    /// Where it led.
    pub next: usize,
    /// Whether that ended the episode, so that nothing follows.
    pub ended: bool,
}

/// A loss and its gradient by each number of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Loss {
    /// The mean over a batch.
    pub value: f64,
    /// In the shape of the table.
    pub gradient: Vec<f64>,
}

/// How far the targets of expected SARSA lie above the values of what was done: `[B]`.
///
/// ```text
/// δ = r + γ Σ_a' π(a' | s') q(s', a') - q(s, a)
/// ```
///
/// - `q`, `policy`: `[S, A]`.
#[must_use]
pub fn td_errors(
    q: &[f64],
    policy: &[f64],
    n_actions: usize,
    discount: f64,
    batch: &[Transition],
) -> Vec<f64> {
    let value = |s: usize| {
        let actions = q[s * n_actions..][..n_actions].iter().zip(&policy[s * n_actions..]);
        actions.map(|(q, p)| q * p).sum::<f64>()
    };
    let error = |t: &Transition| {
        let follows = if t.ended { 0.0 } else { discount * value(t.next) };
        t.reward + follows - q[t.state * n_actions + t.action]
    };
    batch.iter().map(error).collect()
}

/// The loss of expected SARSA: the mean of `δ²` over a batch, whose targets have no gradient.
///
/// - `q`, `policy`: `[S, A]`.
#[must_use]
pub fn expected_sarsa_loss(
    q: &[f64],
    policy: &[f64],
    n_actions: usize,
    discount: f64,
    batch: &[Transition],
) -> Loss {
    let errors = td_errors(q, policy, n_actions, discount, batch);
    squared(q.len(), n_actions, batch, errors)
}

/// The loss of learned rewards: the mean squared error over a batch.
///
/// - `rewards`: `[S, A]`.
#[must_use]
pub fn reward_loss(rewards: &[f64], n_actions: usize, batch: &[Transition]) -> Loss {
    let errors = batch.iter().map(|t| t.reward - rewards[t.state * n_actions + t.action]);
    squared(rewards.len(), n_actions, batch, errors.collect())
}

/// The mean of squared errors, each of which falls as the number of what was done rises.
fn squared(n: usize, n_actions: usize, batch: &[Transition], errors: Vec<f64>) -> Loss {
    let share = 1.0 / real(batch.len());
    let mut loss = Loss { value: 0.0, gradient: vec![0.0; n] };
    for (t, error) in batch.iter().zip(errors) {
        loss.value += share * error * error;
        loss.gradient[t.state * n_actions + t.action] -= 2.0 * share * error;
    }
    loss
}

/// The loss of a learned model (Eqn. 2.51): the mean negative log-probability, in nats, of the states that
/// followed.
///
/// - `logits`: `[S, A, S]`; the softmax of each row is `p(· | s, a)`.
#[must_use]
pub fn transition_loss(
    logits: &[f64],
    (n_states, n_actions): (usize, usize),
    batch: &[Transition],
) -> Loss {
    let share = 1.0 / real(batch.len());
    let mut loss = Loss { value: 0.0, gradient: vec![0.0; logits.len()] };
    for t in batch {
        let row = (t.state * n_actions + t.action) * n_states;
        let (logits, slopes) = (&logits[row..][..n_states], &mut loss.gradient[row..][..n_states]);
        loss.value -= share * log_softmax(logits, t.next);
        slopes.iter_mut().zip(boltzmann(logits, 1.0)).for_each(|(slope, p)| *slope += share * p);
        slopes[t.next] -= share;
    }
    loss
}

fn log_softmax(logits: &[f64], place: usize) -> f64 {
    let highest = logits.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = logits.iter().map(|z| (z - highest).exp()).sum();
    logits[place] - highest - sum.ln()
}

/// The probabilities that logits stand for, row by row: `[S, A, S]`.
#[must_use]
pub fn probabilities(logits: &[f64], n_states: usize) -> Vec<f64> {
    logits.chunks(n_states).flat_map(|row| boltzmann(row, 1.0)).collect()
}

/// How often each state followed each action: `[S, A, S]`.
#[must_use]
pub fn transition_counts((n_states, n_actions): (usize, usize), batch: &[Transition]) -> Vec<f64> {
    let mut counts = vec![0.0; n_states * n_actions * n_states];
    for t in batch {
        counts[(t.state * n_actions + t.action) * n_states + t.next] += 1.0;
    }
    counts
}

/// The model of the least loss, in closed form: each state as probable as it was frequent. Where nothing
/// was tried, what was thought before stays.
///
/// - `counts`, `before`: `[S, A, S]`.
#[must_use]
pub fn most_likely(counts: &[f64], before: &[f64], n_states: usize) -> Vec<f64> {
    let rows = counts.chunks(n_states).zip(before.chunks(n_states));
    let row = |(counts, before): (&[f64], &[f64])| -> Vec<f64> {
        let n: f64 = counts.iter().sum();
        if n == 0.0 { before.to_vec() } else { counts.iter().map(|count| count / n).collect() }
    };
    rows.flat_map(row).collect()
}

#[cfg(test)]
mod tests {
    use rand::RngExt as _;
    use rand_distr::StandardNormal;

    use super::super::bellman::tests::{Random, apart};
    use super::super::bellman::{Model, backup, expected_values, fixed_point};
    use super::super::policy::pick;
    use super::*;
    use crate::nn::optim::{Adam, Moments, Pull, adam};

    const SIZES: (usize, usize) = (5, 3);

    fn numbers(n: usize, purpose: &str) -> Vec<f64> {
        let rng = ivx_op::Ctx::new("", 0, None).rng(purpose, &[]);
        rng.sample_iter(StandardNormal).take(n).collect()
    }

    /// Some of what happens in a model, but for one action in one state, which nobody tries.
    fn experience(random: &Random, n: usize) -> Vec<Transition> {
        let mut rng = ivx_op::Ctx::new("", 0, None).rng("experience", &[]);
        let mut draw = || {
            let (state, action) = (rng.random_range(0..5), rng.random_range(0..3));
            let next = pick(random.model().next(state, action), rng.random());
            let reward = random.model().reward(state, action);
            Transition { state, action, reward, next, ended: false }
        };
        let tried = std::iter::repeat_with(&mut draw).filter(|t| (t.state, t.action) != (4, 2));
        tried.take(n).collect()
    }

    fn fit(mut table: Vec<f64>, loss: impl Fn(&[f64]) -> Loss) -> Vec<f64> {
        let mut moments = Moments::zeros(table.len());
        for t in 0..3000 {
            let lr = if t < 2000 { 0.05 } else { 0.001 };
            let rule = Adam {
                lr,
                beta1: 0.9,
                beta2: 0.999,
                eps: 1e-8,
                weight_decay: 0.0,
                pull: Pull::NONE,
            };
            let gradient = loss(&table).gradient;
            adam(&rule, t, &mut table, &gradient, &mut moments);
        }
        table
    }

    #[test]
    fn by_hand() {
        let t = |state, action, next, ended| Transition { state, action, reward: 1.0, next, ended };
        let (q, policy) = ([1.0, 2.0, 4.0, 8.0], [0.5, 0.5, 0.25, 0.75]);
        let batch = [t(0, 1, 1, false), t(1, 0, 0, true)];
        // 1 + ½ (¼·4 + ¾·8) − 2 = 2.5, and 1 − 4.
        assert_eq!(td_errors(&q, &policy, 2, 0.5, &batch), [2.5, -3.0]);
        let loss = expected_sarsa_loss(&q, &policy, 2, 0.5, &batch);
        assert_eq!(loss, Loss { value: 7.625, gradient: vec![0.0, -2.5, 3.0, 0.0] });
        let loss = reward_loss(&q, 2, &batch);
        assert_eq!(loss, Loss { value: 5.0, gradient: vec![0.0, 1.0, 3.0, 0.0] });
        // Three to one for what followed, in one of two rows.
        let logits = [0.0, 0.0, 0.0, 3.0_f64.ln(), 0.0, 0.0, 0.0, 0.0];
        let loss = transition_loss(&logits, (2, 2), &batch[..1]);
        assert!((loss.value + 0.75_f64.ln()).abs() < 1e-15);
        assert!(apart(&loss.gradient, &[0.0, 0.0, 0.25, -0.25, 0.0, 0.0, 0.0, 0.0]) < 1e-15);
        assert!(apart(&probabilities(&logits, 2)[..4], &[0.5, 0.5, 0.25, 0.75]) < 1e-15);
    }

    #[test]
    fn gradients_are_finite_differences() {
        let random = Random::of(0);
        let batch = experience(&random, 20);
        let check =
            |table: Vec<f64>, loss: &dyn Fn(&[f64]) -> Loss, value: &dyn Fn(&[f64]) -> f64| {
                let gradient = loss(&table).gradient;
                for i in 0..table.len() {
                    let moved = |by: f64| {
                        let mut table = table.clone();
                        table[i] += by;
                        value(&table)
                    };
                    let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                    assert!((difference - gradient[i]).abs() < 1e-8, "[{i}]");
                }
            };
        let model = |x: &[f64]| transition_loss(x, SIZES, &batch);
        check(numbers(75, "logits"), &model, &|x| model(x).value);
        let reward = |x: &[f64]| reward_loss(x, 3, &batch);
        check(numbers(15, "rewards"), &reward, &|x| reward(x).value);
        // Targets stay where they are.
        let q = numbers(15, "q");
        let errors = td_errors(&q, &random.policy, 3, 0.9, &batch);
        let held: Vec<Transition> = batch
            .iter()
            .zip(errors)
            .map(|(t, e)| Transition { reward: q[t.state * 3 + t.action] + e, ..*t })
            .collect();
        let sarsa = |x: &[f64]| expected_sarsa_loss(x, &random.policy, 3, 0.9, &batch);
        check(q.clone(), &sarsa, &|x| reward_loss(x, 3, &held).value);
    }

    #[test]
    fn learned_by_adam_they_are_the_closed_form_where_something_was_tried() {
        let random = Random::of(1);
        let batch = experience(&random, 400);
        let counts = transition_counts(SIZES, &batch);

        let logits = numbers(75, "logits");
        let likely = most_likely(&counts, &probabilities(&logits, 5), 5);
        let learned = fit(logits.clone(), |x| transition_loss(x, SIZES, &batch));
        assert_eq!(learned[70..], logits[70..]);
        assert!(apart(&probabilities(&learned, 5), &likely) < 1e-2);

        let rewards = fit(numbers(15, "rewards"), |x| reward_loss(x, 3, &batch));
        assert!(apart(&rewards[..14], &random.model().rewards[..14]) < 1e-6);

        let start = numbers(15, "q");
        let q = fit(start.clone(), |q| expected_sarsa_loss(q, &random.policy, 3, 0.9, &batch));
        let model = Model { transitions: &likely, rewards: &rewards, terminal: &[false; 5] };
        let sweep = |q: &[f64]| {
            let mut next = backup(&model, 0.9, &expected_values(&model, &random.policy, q));
            next[14] = start[14];
            next
        };
        let exact = fixed_point(sweep, 15, 1e-13, 10_000).expect("a contraction settles");
        assert!(apart(&q, &exact) < 1e-4, "{}", apart(&q, &exact));
    }
}
