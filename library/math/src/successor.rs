//! Successor features in finite processes: what a policy will gather of each cumulant (§4.1).

mod bound;
mod improve;
mod preferences;
#[cfg(test)]
mod tests;

pub use bound::{Errors, largest_norm, reward_error_bound, transfer_bound, transfer_bounds};
pub use improve::{Selected, certain_policy, improved_policy, select_action};
pub use preferences::Preferences;

use nalgebra::DMatrix;

/// A controlled Markov process with cumulants, which are rewards that are vectors.
#[derive(Clone, Copy, Debug)]
pub struct Process<'a> {
    /// `p(s' | s, a)`: `[S, A, S]`.
    pub transitions: &'a [f64],
    /// The expected cumulants `Φ(s, a)` of each action in each state: `[S, A, d]`. Rewards are cumulants of one number.
    pub cumulants: &'a [f64],
    /// Which states end an episode, so that nothing is gathered in them: `[S]`.
    pub terminal: &'a [bool],
}

impl Process<'_> {
    /// How many states there are.
    #[must_use]
    pub fn n_states(&self) -> usize {
        self.terminal.len()
    }

    /// How many actions there are.
    #[must_use]
    pub fn n_actions(&self) -> usize {
        self.transitions.len() / self.n_states().pow(2)
    }

    /// How many numbers a cumulant has.
    #[must_use]
    pub fn n_features(&self) -> usize {
        self.cumulants.len() / (self.n_states() * self.n_actions())
    }

    fn check(&self) {
        let pairs = self.n_states() * self.n_actions();
        assert_eq!(
            self.transitions.len(),
            pairs * self.n_states(),
            "one state to each that follows"
        );
        assert!(self.n_features() > 0, "there is a cumulant");
        assert_eq!(self.cumulants.len(), pairs * self.n_features(), "cumulants of each pair");
    }
}

/// The successor features of a policy, exactly (Eqns. 4.9a, 4.10c): `[S, A, d]`.
///
/// ```text
/// Ψ^π(s, a) = Φ(s, a) + γ Σ_s' p(s' | s, a) Σ_a' π(a' | s') Ψ^π(s', a')
/// ```
///
/// In a terminal state they are 0. Where cumulants are rewards, they are the action values of the policy. They are the
/// solution of a linear system of as many equations as there are states; `None` if it has none, as where `discount` is 1
/// and an episode may go on for ever.
///
/// - `policy`: `[S, A]`.
///
/// # Panics
/// If the numbers do not go together.
#[must_use]
pub fn successor_features(
    process: &Process<'_>,
    policy: &[f64],
    discount: f64,
) -> Option<Vec<f64>> {
    process.check();
    let (n, n_actions, d) = (process.n_states(), process.n_actions(), process.n_features());
    assert_eq!(policy.len(), n * n_actions, "one probability a pair");
    // (I - γ P^π) V = Φ^π, and V is 0 where an episode ended.
    let chain = |s: usize, to: usize| -> f64 {
        let stays = f64::from(u8::from(s == to));
        if process.terminal[s] || process.terminal[to] {
            return stays;
        }
        let follow = |a: usize| policy[s * n_actions + a] * next(process, s * n_actions + a)[to];
        stays - discount * (0..n_actions).map(follow).sum::<f64>()
    };
    let system = DMatrix::from_fn(n, n, chain);
    let once = DMatrix::from_row_slice(n, d, &under(process, policy, process.cumulants));
    let solved = system.clone().lu().solve(&once)?;
    let left = (&system * &solved - &once).amax();
    if left.is_nan() || left > 1e-6 * once.amax().max(1.0) {
        return None;
    }
    let solved: Vec<f64> = solved.transpose().iter().copied().collect();
    let mut features = vec![0.0; process.cumulants.len()];
    for (pair, psi) in features.chunks_mut(d).enumerate() {
        if !process.terminal[pair / n_actions] {
            let after = ahead(process, &solved, pair);
            let now = &process.cumulants[pair * d..];
            psi.iter_mut().zip(now).zip(after).for_each(|((y, x), v)| *y = x + discount * v);
        }
    }
    Some(features)
}

/// The cumulants that successor features of a policy explain, which undoes [`successor_features`] (Eqn. B.8a): `[S, A, d]`.
///
/// ```text
/// Φ(s, a) = Ψ(s, a) - γ Σ_s' p(s' | s, a) Σ_a' π(a' | s') Ψ(s', a')
/// ```
///
/// - `features`: `[S, A, d]`; those of terminal states do not count, and neither do the cumulants of `process` but for
///   how many numbers they have.
/// - `policy`: `[S, A]`.
///
/// # Panics
/// If the numbers do not go together.
#[must_use]
pub fn explained_cumulants(
    process: &Process<'_>,
    features: &[f64],
    policy: &[f64],
    discount: f64,
) -> Vec<f64> {
    process.check();
    assert_eq!(features.len(), process.cumulants.len(), "as many features as cumulants");
    assert_eq!(policy.len() * process.n_features(), features.len(), "one probability a pair");
    let (n_actions, d) = (process.n_actions(), process.n_features());
    let states = under(process, policy, features);
    let mut cumulants = features.to_vec();
    for (pair, phi) in cumulants.chunks_mut(d).enumerate() {
        if process.terminal[pair / n_actions] {
            phi.fill(0.0);
        } else {
            let after = ahead(process, &states, pair);
            phi.iter_mut().zip(after).for_each(|(x, v)| *x -= discount * v);
        }
    }
    cumulants
}

/// What each action is worth to one who prefers `w`: generalised policy evaluation (Eqn. 4.12), and of cumulants the
/// rewards (Eqn. 4.5).
///
/// ```text
/// q^{π,w}(s, a) = Ψ^π(s, a)ᵀ w
/// ```
///
/// - `features`: `[.., d]`; one number for each vector.
/// - `w`: `[d]`.
///
/// # Panics
/// If the vectors are not as long as `w`.
#[must_use]
pub fn preferred(features: &[f64], w: &[f64]) -> Vec<f64> {
    assert!(!w.is_empty() && features.len().is_multiple_of(w.len()), "vectors as long as `w`");
    features.chunks(w.len()).map(|row| dot(row, w)).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// How probably each state follows a pair of a state and an action.
fn next<'a>(process: &Process<'a>, pair: usize) -> &'a [f64] {
    &process.transitions[pair * process.n_states()..][..process.n_states()]
}

/// `Σ_a π(a | s) x(s, a)`, and 0 in terminal states: `[S, d]`.
fn under(process: &Process<'_>, policy: &[f64], x: &[f64]) -> Vec<f64> {
    let (n_actions, d) = (process.n_actions(), process.n_features());
    let mut states = vec![0.0; process.n_states() * d];
    for (pair, (x, probability)) in x.chunks(d).zip(policy).enumerate() {
        let s = pair / n_actions;
        if !process.terminal[s] {
            let sums = states[s * d..][..d].iter_mut().zip(x);
            sums.for_each(|(sum, x)| *sum += probability * x);
        }
    }
    states
}

/// `Σ_s' p(s' | s, a) v(s')` of one pair: `[d]`.
fn ahead(process: &Process<'_>, states: &[f64], pair: usize) -> Vec<f64> {
    let d = process.n_features();
    let mut sums = vec![0.0; d];
    for (p, v) in next(process, pair).iter().zip(states.chunks(d)) {
        sums.iter_mut().zip(v).for_each(|(sum, v)| *sum += p * v);
    }
    sums
}
