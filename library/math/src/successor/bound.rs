//! How far generalised policy improvement may fall short on a new task (§B.3).

/// How wrong what is known of tasks and policies may be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// `Φ_max`, the length of the longest cumulant.
    pub largest_cumulant: f64,
    /// `δ_r`, how far the reward of any task, the new one too, is from `Φ w` anywhere.
    pub reward: f64,
    /// `δ_Ψ`, how far the successor features of any policy are from the true ones anywhere, in length.
    pub features: f64,
}

/// How far the values of any policy may be from `Ψ w` where rewards are `Φ w` but for these errors (Lemma 2.1).
///
/// ```text
/// ‖q^π - Ψ^π w‖_∞ ≤ δ_max / (1 - γ),   δ_max = ‖r - Φ w‖_∞
/// ```
///
/// The thesis has `δ_r`, a vector, on the right side of Eqn. B.10: its proof (Eqn. B.11c) ends in the largest error of any
/// state, and the error in the state itself is no bound.
///
/// - `errors`: `r - Φ w`, of each state and action.
///
/// # Panics
/// If the discount is not in `[0, 1)`.
#[must_use]
pub fn reward_error_bound(errors: &[f64], discount: f64) -> f64 {
    errors.iter().map(|e| e.abs()).fold(0.0, f64::max) / ahead(discount)
}

/// By how much the values of the policy that was improved on a new task may be below the best, from each of the tasks whose
/// best policies are known (Eqn. B.9): `[K]`.
///
/// ```text
/// q*(s, a) - q^π(s, a) ≤ 2/(1 - γ) [Φ_max ‖w_j - w'‖ + 2 δ_r + ‖w'‖ δ_Ψ + δ_r / (1 - γ)]
/// ```
///
/// Rewards are those of the tasks and not `Φ w`, and the policy `j` is the best of its task. The proof in the thesis leaves
/// out brackets: the errors of features and of rewards are each within `2/(1 - γ)`.
///
/// - `preferences`: `w_j` of each task, `[d]`.
/// - `w`: `w'` of the new task, `[d]`.
///
/// # Panics
/// If the discount is not in `[0, 1)`, or preferences are not as long as each other.
#[must_use]
pub fn transfer_bounds(
    preferences: &[Vec<f64>],
    w: &[f64],
    errors: &Errors,
    discount: f64,
) -> Vec<f64> {
    let Errors { largest_cumulant, reward, features } = *errors;
    let values = norm(w) * features + reward / ahead(discount);
    let bound = |task: &Vec<f64>| {
        assert_eq!(task.len(), w.len(), "preferences as long as those of the new task");
        let apart: Vec<f64> = task.iter().zip(w).map(|(a, b)| a - b).collect();
        2.0 / ahead(discount) * (largest_cumulant * norm(&apart) + 2.0 * reward + values)
    };
    preferences.iter().map(bound).collect()
}

/// The same from the task of the least bound, since it holds for all.
///
/// # Panics
/// As [`transfer_bounds`], and if there is no task.
#[must_use]
pub fn transfer_bound(preferences: &[Vec<f64>], w: &[f64], errors: &Errors, discount: f64) -> f64 {
    crate::order::min(&transfer_bounds(preferences, w, errors, discount))
}

/// The length of the longest of some vectors: `Φ_max` of cumulants, and `δ_Ψ` of differences of successor features.
///
/// - `rows`: `[.., d]`.
#[must_use]
pub fn largest_norm(rows: &[f64], d: usize) -> f64 {
    rows.chunks(d).map(norm).fold(0.0, f64::max)
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn ahead(discount: f64) -> f64 {
    assert!((0.0..1.0).contains(&discount), "a discount in [0, 1)");
    1.0 - discount
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Random, apart, best, values};
    use super::super::{
        Preferences, certain_policy, improved_policy, preferred, successor_features,
    };
    use super::*;

    #[test]
    fn by_hand() {
        // 2/½ (2·5 + 2·¼ + 5·0.1 + ¼/½), with ‖(3, 4)‖ = 5.
        let errors = Errors { largest_cumulant: 2.0, reward: 0.25, features: 0.1 };
        let tasks = [vec![0.0, 0.0], vec![3.0, 4.0]];
        let bounds = transfer_bounds(&tasks, &[3.0, 4.0], &errors, 0.5);
        assert!(apart(&bounds, &[46.0, 6.0]) < 1e-12, "{bounds:?}");
        assert_eq!(transfer_bound(&tasks, &[3.0, 4.0], &errors, 0.5), bounds[1]);
        assert_eq!(largest_norm(&[3.0, 4.0, 0.0, -1.0], 2), 5.0);
    }

    #[test]
    fn an_error_that_is_the_same_everywhere_meets_the_lemma() {
        // One state that pays 1 for ever, of which ¾ is known: 4 - 3 = ¼ / (1 - ¾).
        assert_eq!(reward_error_bound(&[0.25], 0.75), 1.0);
        assert_eq!(reward_error_bound(&[0.25, -0.5], 0.75), 2.0);
    }

    /// Rewards of one task: what cumulants and preferences make of them, what they are, and the preferences nearest to
    /// them.
    fn task(random: &mut Random, noise: f64) -> (Vec<f64>, Vec<f64>) {
        let w = random.numbers(3, 1.0);
        let noise = random.numbers(15, noise);
        let rewards: Vec<f64> =
            preferred(&random.cumulants, &w).iter().zip(noise).map(|(r, e)| r + e).collect();
        let mut seen = Preferences::new(3);
        random.cumulants.chunks(3).zip(&rewards).for_each(|(phi, r)| seen.see(phi, *r));
        let nearest = seen.infer(0.0);
        (rewards, nearest)
    }

    fn residuals(random: &Random, (rewards, w): &(Vec<f64>, Vec<f64>)) -> Vec<f64> {
        preferred(&random.cumulants, w).iter().zip(rewards).map(|(known, r)| r - known).collect()
    }

    /// Lemma 2.1 with `δ_max`; with the error of the state itself it does not hold.
    #[test]
    fn values_are_as_far_off_as_the_largest_error_allows() {
        let mut beyond = 0;
        for i in 0..1000 {
            let mut random = Random::of(i);
            let task = task(&mut random, 0.5);
            let errors = residuals(&random, &task);
            let process = random.process();
            let (_, policy) = best(&process, &task.0, 0.9);
            let known = preferred(&successor_features(&process, &policy, 0.9).unwrap(), &task.1);
            let q = values(&process, &task.0, &policy, 0.9);
            let bound = reward_error_bound(&errors, 0.9);
            assert!(apart(&q, &known) <= bound + 1e-9);
            let of_itself = errors.iter().map(|e| reward_error_bound(&[*e], 0.9));
            let pairs = q.iter().zip(&known).zip(of_itself);
            beyond += usize::from(pairs.into_iter().any(|((q, k), b)| (q - k).abs() > b + 1e-9));
        }
        assert!(beyond > 500, "{beyond}");
    }

    /// What a bound may be made of: preferences of tasks and of the new one, errors, those of rewards one by one, and the
    /// discount.
    struct Known {
        tasks: Vec<Vec<f64>>,
        w: Vec<f64>,
        errors: Errors,
        residuals: Vec<f64>,
        discount: f64,
    }

    /// How often the values of the improved policy are farther below the best than a bound says, over 1 000 processes;
    /// in some the new task is one of the known, some features are right, and some rewards are.
    fn broken(bound: impl Fn(&Known) -> f64) -> usize {
        let mut broken = 0;
        for i in 0..1000 {
            let mut random = Random::of(i);
            let is = |place: u64| (i >> place).is_multiple_of(2);
            let discount = if is(0) { 0.5 } else { 0.9 };
            let noise = if is(1) { 0.0 } else { 0.5 };
            let tasks: Vec<_> = (0..3).map(|_| task(&mut random, noise)).collect();
            let new = if is(2) { tasks[0].clone() } else { task(&mut random, noise) };
            let off = if is(3) { 0.0 } else { 0.5 };
            let off: Vec<Vec<f64>> = tasks.iter().map(|_| random.numbers(45, off)).collect();
            let residuals = tasks.iter().chain([&new]).map(|task| residuals(&random, task));
            let residuals = residuals.collect::<Vec<_>>().concat();
            let process = random.process();
            let thought = tasks.iter().zip(&off).map(|(task, off)| {
                let (_, policy) = best(&process, &task.0, discount);
                let features = successor_features(&process, &policy, discount).unwrap();
                features.iter().zip(off).map(|(psi, e)| psi + e).collect::<Vec<f64>>()
            });
            let selected = improved_policy(&thought.collect::<Vec<_>>(), &new.1, 3);
            let actions: Vec<usize> = selected.iter().map(|s| s.action).collect();
            let (optimal, _) = best(&process, &new.0, discount);
            let improved = values(&process, &new.0, &certain_policy(&actions, 3), discount);
            let errors = Errors {
                largest_cumulant: largest_norm(process.cumulants, 3),
                reward: residuals.iter().map(|e| e.abs()).fold(0.0, f64::max),
                features: off.iter().map(|off| largest_norm(off, 3)).fold(0.0, f64::max),
            };
            let tasks = tasks.into_iter().map(|(_, w)| w).collect();
            let bound = bound(&Known { tasks, w: new.1, errors, residuals, discount });
            broken += usize::from(apart(&optimal, &improved) > bound + 1e-9);
        }
        broken
    }

    /// Theorem 2.2, and what is left of it without one of its terms, or with the least error of a reward for the
    /// largest.
    #[test]
    fn what_is_lost_on_a_new_task_is_bounded() {
        let with = |known: &Known, errors: Errors| {
            transfer_bound(&known.tasks, &known.w, &errors, known.discount)
        };
        assert_eq!(broken(|known| with(known, known.errors)), 0);
        let without = [
            broken(|known| with(known, Errors { largest_cumulant: 0.0, ..known.errors })),
            broken(|known| with(known, Errors { features: 0.0, ..known.errors })),
            broken(|known| with(known, Errors { reward: 0.0, ..known.errors })),
            broken(|known| {
                let least = known.residuals.iter().map(|e| e.abs()).fold(f64::INFINITY, f64::min);
                with(known, Errors { reward: least, ..known.errors })
            }),
        ];
        assert!(without.iter().all(|n| *n > 0), "{without:?}");
    }
}
