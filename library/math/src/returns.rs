//! Targets of values from what followed (§2.3.2).

/// What an agent received, and what it thought of where it was.
#[derive(Clone, Copy, Debug)]
pub struct Path<'a> {
    /// The reward on leaving each state: `[T]`.
    pub rewards: &'a [f64],
    /// What each state is thought to be worth, and the last: `[T + 1]`.
    pub values: &'a [f64],
    /// Whether an episode ended with each reward, so that what follows is worth nothing: `[T]`; nothing
    /// ended where there are none.
    pub ends: &'a [bool],
}

impl Path<'_> {
    fn goes_on(&self, t: usize) -> f64 {
        if self.ends.get(t).is_some_and(|end| *end) { 0.0 } else { 1.0 }
    }

    fn check(&self) {
        assert_eq!(self.values.len(), self.rewards.len() + 1, "a value more than rewards");
    }
}

/// The target over `k` steps: rewards up to there, and then the value of that state (Eqn. 2.43); near the
/// end, of the last. Over one step it is TD(0) (Eqn. 2.41).
///
/// # Panics
/// If the numbers of rewards and values do not go together.
#[must_use]
pub fn k_step(path: &Path<'_>, discount: f64, k: usize) -> Vec<f64> {
    path.check();
    let n = path.rewards.len();
    let target = |t: usize| {
        let end = t.saturating_add(k).min(n);
        let back = |g, i: usize| path.rewards[i] + discount * path.goes_on(i) * g;
        (t..end).rev().fold(path.values[end], back)
    };
    (0..n).map(target).collect()
}

/// The λ-return: the average of the targets over any number of steps, each weighing `λ` times the one before.
/// At 0 it is TD(0), and at 1 the return of Monte-Carlo (Eqn. 2.38), from the last value on.
///
/// ```text
/// G_t = r_{t+1} + γ ((1 - λ) v(s_{t+1}) + λ G_{t+1})
/// ```
///
/// # Panics
/// If the numbers of rewards and values do not go together.
#[must_use]
pub fn lambda_returns(path: &Path<'_>, discount: f64, lambda: f64) -> Vec<f64> {
    path.check();
    let mut returns = vec![0.0; path.rewards.len()];
    let mut after = path.values[path.rewards.len()];
    for t in (0..returns.len()).rev() {
        let ahead = (1.0 - lambda) * path.values[t + 1] + lambda * after;
        after = path.rewards[t] + discount * path.goes_on(t) * ahead;
        returns[t] = after;
    }
    returns
}

/// Generalised advantages (Schulman et al., 2016): λ-returns over the values of the states.
///
/// # Panics
/// If the numbers of rewards and values do not go together.
#[must_use]
pub fn advantages(path: &Path<'_>, discount: f64, lambda: f64) -> Vec<f64> {
    let returns = lambda_returns(path, discount, lambda);
    returns.iter().zip(path.values).map(|(g, v)| g - v).collect()
}

/// The same where some episodes were cut off: they are worth what the state is that they were left in, and
/// nothing is said of them by what follows.
///
/// - `cut`: where, and what the state left behind is worth; `[T]`.
///
/// # Panics
/// If the numbers do not go together.
#[must_use]
pub fn advantages_cut(
    path: &Path<'_>,
    cut: &[Option<f64>],
    discount: f64,
    lambda: f64,
) -> Vec<f64> {
    path.check();
    assert_eq!(cut.len(), path.rewards.len(), "as many as rewards");
    let mut advantages = vec![0.0; cut.len()];
    let mut after = 0.0;
    for t in (0..cut.len()).rev() {
        let next = cut[t].unwrap_or(path.values[t + 1]);
        let error = path.rewards[t] + discount * path.goes_on(t) * next - path.values[t];
        let trace = if cut[t].is_some() { 0.0 } else { path.goes_on(t) };
        after = error + discount * lambda * trace * after;
        advantages[t] = after;
    }
    advantages
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATH: Path<'static> =
        Path { rewards: &[1.0, 0.0, 2.0], values: &[9.0, 9.0, 8.0, 4.0], ends: &[] };

    #[test]
    fn targets_by_hand() {
        assert_eq!(k_step(&PATH, 0.5, 1), [1.0 + 4.5, 4.0, 2.0 + 2.0]);
        // 1 + ½·0 + ¼·8;  0 + ½·2 + ¼·4;  2 + ½·4.
        assert_eq!(k_step(&PATH, 0.5, 2), [3.0, 2.0, 4.0]);
        // 2 + ½·4 = 4;  ½(½·8 + ½·4) = 3;  1 + ½(½·9 + ½·3) = 4.
        assert_eq!(lambda_returns(&PATH, 0.5, 0.5), [4.0, 3.0, 4.0]);
        assert_eq!(lambda_returns(&PATH, 0.5, 0.0), k_step(&PATH, 0.5, 1));
        assert_eq!(lambda_returns(&PATH, 0.5, 1.0), k_step(&PATH, 0.5, usize::MAX));
        assert_eq!(advantages(&PATH, 0.5, 0.5), [-5.0, -6.0, -4.0]);
    }

    #[test]
    fn nothing_follows_an_end() {
        let path = Path { ends: &[false, true, false], ..PATH };
        assert_eq!(lambda_returns(&path, 0.5, 1.0), [1.0, 0.0, 4.0]);
        assert_eq!(k_step(&path, 0.5, 3), [1.0, 0.0, 4.0]);
    }

    #[test]
    fn what_is_cut_off_is_worth_where_it_was_left() {
        let none = [None; 3];
        assert_eq!(advantages_cut(&PATH, &none, 0.5, 0.5), advantages(&PATH, 0.5, 0.5));
        // 0 + ½·20 − 9 = 1, and then 1 + ½·9 − 9 + ¼·1.
        let cut = [None, Some(20.0), None];
        assert_eq!(advantages_cut(&PATH, &cut, 0.5, 0.5), [-3.25, 1.0, -4.0]);
    }
}
