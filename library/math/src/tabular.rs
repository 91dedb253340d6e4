//! Models that have a number for everything, in closed form (§C.2.1).

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
    use super::*;

    #[test]
    fn what_was_frequent_is_probable_and_what_was_not_tried_stays() {
        let t = |state, action, next| Transition { state, action, reward: 0.0, next, ended: false };
        let batch = [t(0, 1, 1), t(0, 1, 1), t(0, 1, 0), t(1, 0, 0)];
        let counts = transition_counts((2, 2), &batch);
        assert_eq!(counts, [0.0, 0.0, 1.0, 2.0, 1.0, 0.0, 0.0, 0.0]);
        let before = probabilities(&[0.0, 3.0_f64.ln(), 9.0, 9.0, 9.0, 9.0, 0.0, 0.0], 2);
        let likely = most_likely(&counts, &before, 2);
        let expected = [0.25, 0.75, 1.0 / 3.0, 2.0 / 3.0, 1.0, 0.0, 0.5, 0.5];
        assert!(likely.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{likely:?}");
    }
}
