//! Markov chains: where a policy leads (§C.1.2).

use super::bellman::Model;

/// The chain that a policy and a model make together: `[S, S]`.
///
/// ```text
/// p^π(s' | s) = Σ_a π(a | s) p(s' | s, a)
/// ```
///
/// - `policy`: `[S, A]`.
#[must_use]
pub fn induced(model: &Model<'_>, policy: &[f64]) -> Vec<f64> {
    let n = model.n_states();
    let mut chain = vec![0.0; n * n];
    for (s, row) in chain.chunks_mut(n).enumerate() {
        for (a, probability) in
            policy[s * model.n_actions()..][..model.n_actions()].iter().enumerate()
        {
            let next = row.iter_mut().zip(model.next(s, a));
            next.for_each(|(sum, p)| *sum += probability * p);
        }
    }
    chain
}

/// How probably a chain is in a state after each of 0 to `steps` steps: `(P^l)[start, target]`, `[steps + 1]`.
///
/// - `chain`: `[S, S]`.
#[must_use]
pub fn occupancy(chain: &[f64], (start, target): (usize, usize), steps: usize) -> Vec<f64> {
    let mut at = certain(chain, start);
    let mut probabilities = vec![at[target]];
    for _ in 0..steps {
        at = step(chain, &at);
        probabilities.push(at[target]);
    }
    probabilities
}

/// How probably a chain has been in a state by each of 0 to `steps` steps: `[steps + 1]`.
///
/// - `chain`: `[S, S]`.
#[must_use]
pub fn hits(chain: &[f64], (start, target): (usize, usize), steps: usize) -> Vec<f64> {
    let mut at = certain(chain, start);
    let mut hit = std::mem::take(&mut at[target]);
    let mut probabilities = vec![hit];
    for _ in 0..steps {
        at = step(chain, &at);
        // What arrives is counted and goes no further.
        hit += std::mem::take(&mut at[target]);
        probabilities.push(hit);
    }
    probabilities
}

/// All of the probability in one state of a chain.
fn certain(chain: &[f64], state: usize) -> Vec<f64> {
    let n_states = chain.len().isqrt();
    (0..n_states).map(|s| f64::from(u8::from(s == state))).collect()
}

fn step(chain: &[f64], at: &[f64]) -> Vec<f64> {
    let mut next = vec![0.0; at.len()];
    for (probability, row) in at.iter().zip(chain.chunks(at.len())) {
        next.iter_mut().zip(row).for_each(|(sum, p)| *sum += probability * p);
    }
    next
}

#[cfg(test)]
mod tests {
    use super::super::bellman::tests::Random;
    use super::*;

    #[test]
    fn by_hand() {
        // From 0 to 1 by a half; from 1 back for sure.
        let chain = [0.5, 0.5, 1.0, 0.0];
        assert_eq!(occupancy(&chain, (0, 1), 3), [0.0, 0.5, 0.25, 0.375]);
        assert_eq!(hits(&chain, (0, 1), 3), [0.0, 0.5, 0.75, 0.875]);
        assert_eq!(hits(&chain, (0, 0), 2), [1.0, 1.0, 1.0]);
    }

    #[test]
    fn a_policy_and_a_model_make_a_chain() {
        for i in 0..20 {
            let random = Random::of(i);
            let chain = induced(&random.model(), &random.policy);
            assert!(chain.chunks(5).all(|row| (row.iter().sum::<f64>() - 1.0).abs() < 1e-14));
            let sum: f64 =
                (0..3).map(|a| random.policy[2 * 3 + a] * random.model().next(2, a)[4]).sum();
            assert!((chain[2 * 5 + 4] - sum).abs() < 1e-15);
            let (there, been) = (occupancy(&chain, (0, 4), 50), hits(&chain, (0, 4), 50));
            assert_eq!(there[..2], been[..2]);
            assert!(there.iter().zip(&been).all(|(there, been)| there <= been));
            assert!(been.is_sorted() && been[50] <= 1.0 + 1e-14);
        }
    }
}
