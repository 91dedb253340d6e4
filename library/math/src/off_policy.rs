//! Targets of values from what another policy did.

use super::returns::Path;

/// What lies ahead of each step, one of another policy `μ`.
#[derive(Clone, Copy, Debug)]
pub struct Ahead<'a> {
    /// The reward of each step: `[T]`.
    pub rewards: &'a [f64],
    /// Whether an episode ended with it: `[T]`; nothing ended where there are none.
    pub ends: &'a [bool],
    /// What the next state is worth under the policy: `Σ_a π(a | s_{t+1}) q(s_{t+1}, a)`, `[T]`.
    pub values: &'a [f64],
    /// What the next action is worth: `q(s_{t+1}, a_{t+1})`, `[T]`; the last is not asked for.
    pub taken: &'a [f64],
    /// How much likelier the policy takes it than `μ`: `π(a_{t+1} | s_{t+1}) / μ(a_{t+1} | s_{t+1})`, `[T]`;
    /// the last is not asked for.
    pub ratios: &'a [f64],
}

/// The targets of Retrace (Munos et al., 2016): `[T]`. They follow what `μ` did as far as the policy may have
/// done it too.
///
/// ```text
/// G_t = r_{t+1} + γ (v(s_{t+1}) + c_{t+1} (G_{t+1} - q(s_{t+1}, a_{t+1})))
/// c_t = λ min(1, π(a_t | s_t) / μ(a_t | s_t))
/// ```
///
/// The last bootstraps with `v` alone.
///
/// # Panics
/// If the numbers do not go together.
#[must_use]
pub fn retrace(ahead: &Ahead<'_>, discount: f64, lambda: f64) -> Vec<f64> {
    let n = ahead.rewards.len();
    let lengths = [ahead.values.len(), ahead.taken.len(), ahead.ratios.len()];
    assert_eq!(lengths, [n; 3], "as many as rewards");
    let mut targets = vec![0.0; n];
    let mut surprise = 0.0;
    for t in (0..n).rev() {
        let goes_on = if ahead.ends.get(t).is_some_and(|end| *end) { 0.0 } else { discount };
        targets[t] = ahead.rewards[t] + goes_on * (ahead.values[t] + surprise);
        if t > 0 {
            let trace = lambda * ahead.ratios[t - 1].min(1.0);
            surprise = trace * (targets[t] - ahead.taken[t - 1]);
        }
    }
    targets
}

/// The settings of V-trace.
#[derive(Clone, Copy, Debug)]
pub struct VTrace {
    /// What a reward one step later is worth.
    pub discount: f64,
    /// The weight of one more step.
    pub lambda: f64,
    /// Above which ratios do not count more in values: `ρ̄`.
    pub clip: f64,
    /// Above which they do not in advantages.
    pub advantage_clip: f64,
}

/// What V-trace makes of a path.
#[derive(Clone, Debug, PartialEq)]
pub struct Traced {
    /// How far the targets of the states lie above their values: `[T]`.
    pub errors: Vec<f64>,
    /// What the actions are worth: `[T]`.
    pub action_values: Vec<f64>,
    /// Advantages of the actions, for a policy to climb: `[T]`.
    pub advantages: Vec<f64>,
}

/// V-trace (Espeholt et al., 2018), whose traces fade by `λ`.
///
/// ```text
/// q_t = r_{t+1} + γ (v(s_{t+1}) + λ e_{t+1})
/// e_t = min(ρ̄, ρ_t) (r_{t+1} + γ v(s_{t+1}) - v(s_t)) + γ λ min(1, ρ_t) e_{t+1}
/// ```
///
/// Where `ρ̄` is 1, errors are `min(1, ρ_t) (q_t - v(s_t))`.
///
/// - `ratios`: `ρ_t = π(a_t | s_t) / μ(a_t | s_t)`, `[T]`.
///
/// # Panics
/// If the numbers do not go together.
#[must_use]
pub fn v_trace(path: &Path<'_>, ratios: &[f64], by: &VTrace) -> Traced {
    let n = path.rewards.len();
    assert_eq!(path.values.len(), n + 1, "a value more than rewards");
    assert_eq!(ratios.len(), n, "as many as rewards");
    let zeros = vec![0.0; n];
    let mut traced =
        Traced { errors: zeros.clone(), action_values: zeros.clone(), advantages: zeros };
    let mut after = 0.0;
    for t in (0..n).rev() {
        let goes_on = if path.ends.get(t).is_some_and(|end| *end) { 0.0 } else { by.discount };
        let (value, next, ratio) = (path.values[t], path.values[t + 1], ratios[t]);
        let q = path.rewards[t] + goes_on * (next + by.lambda * after);
        let error = path.rewards[t] + goes_on * next - value;
        after = ratio.min(by.clip) * error + goes_on * by.lambda * ratio.min(1.0) * after;
        traced.errors[t] = after;
        traced.action_values[t] = q;
        traced.advantages[t] = ratio.min(by.advantage_clip) * (q - value);
    }
    traced
}

#[cfg(test)]
mod tests {
    use super::super::returns::{advantages, lambda_returns};
    use super::*;

    const REWARDS: &[f64] = &[1.0, 0.0, 2.0];

    #[test]
    fn retrace_by_hand() {
        let ahead = Ahead {
            rewards: REWARDS,
            ends: &[],
            values: &[8.0, 4.0, 2.0],
            taken: &[2.0, 3.0, 99.0],
            ratios: &[0.5, 7.0, 99.0],
        };
        // 2 + ½·2 = 3;  ½ (4 + 1·(3 − 3)) = 2;  1 + ½ (8 + ½·(2 − 2)) = 5.
        assert_eq!(retrace(&ahead, 0.5, 1.0), [5.0, 2.0, 3.0]);
        // 0 + ½ (4 + 1·(3 − 1)) = 3;  1 + ½ (8 + ½·(3 − 2)) = 5.25; and half of each trace.
        let ahead = Ahead { taken: &[2.0, 1.0, 99.0], ..ahead };
        assert_eq!(retrace(&ahead, 0.5, 1.0), [5.25, 3.0, 3.0]);
        assert_eq!(retrace(&ahead, 0.5, 0.5), [1.0 + 0.5 * (8.0 + 0.25 * 0.5), 2.5, 3.0]);
        let ended = Ahead { ends: &[false, true, false], ..ahead };
        assert_eq!(retrace(&ended, 0.5, 1.0), [1.0 + 0.5 * (8.0 - 0.5 * 2.0), 0.0, 3.0]);
        // Without traces it is expected SARSA.
        assert_eq!(retrace(&ahead, 0.5, 0.0), [5.0, 2.0, 3.0]);
    }

    #[test]
    fn v_trace_of_ones_is_the_lambda_return() {
        let path = Path { rewards: REWARDS, values: &[9.0, 9.0, 8.0, 4.0], ends: &[] };
        let by = VTrace { discount: 0.5, lambda: 0.5, clip: 1.0, advantage_clip: 1.0 };
        let traced = v_trace(&path, &[1.0; 3], &by);
        assert_eq!(traced.errors, advantages(&path, 0.5, 0.5));
        assert_eq!(traced.advantages, traced.errors);
        assert_eq!(traced.action_values, lambda_returns(&path, 0.5, 0.5));
    }

    #[test]
    fn v_trace_by_hand() {
        let path = Path { rewards: &[1.0, 2.0], values: &[4.0, 2.0, 8.0], ends: &[] };
        let by = VTrace { discount: 0.5, lambda: 1.0, clip: 2.0, advantage_clip: 0.5 };
        // 2·(2 + 4 − 2) = 8, as 3 is clipped;  ¼·(1 + 1 − 4) + ½·¼·8 = ½;  q_0 = 1 + ½ (2 + 8) = 6.
        let traced = v_trace(&path, &[0.25, 3.0], &by);
        assert_eq!(traced.errors, [0.5, 8.0]);
        assert_eq!(traced.action_values, [6.0, 6.0]);
        assert_eq!(traced.advantages, [0.25 * 2.0, 0.5 * 4.0]);
        // What was not done by the policy at all says nothing.
        assert_eq!(v_trace(&path, &[0.0, 3.0], &by).errors[0], 0.0);
        let ended = Path { ends: &[true, false], ..path };
        assert_eq!(v_trace(&ended, &[1.0, 3.0], &by).errors, [-3.0, 8.0]);
    }
}
