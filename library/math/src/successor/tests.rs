//! Examples 4.1, 4.2 and 4.4 of the thesis, and what the properties are tried on.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::bellman::{self, Model, fixed_point, optimality};
use crate::policy::{boltzmann, greedy};

/// A random process of five states, three actions and cumulants of three numbers.
pub(super) struct Random {
    pub(super) transitions: Vec<f64>,
    pub(super) cumulants: Vec<f64>,
    pub(super) rng: ChaCha8Rng,
}

impl Random {
    pub(super) fn of(i: u64) -> Self {
        let mut rng = ivx_op::Ctx::new("", 0, None).rng("process", &[&i.to_string()]);
        let row = |rng: &mut ChaCha8Rng| -> Vec<f64> {
            let row: Vec<f64> = (0..5).map(|_| rng.random::<f64>().powi(3)).collect();
            row.iter().map(|p| p / row.iter().sum::<f64>()).collect()
        };
        let transitions = (0..15).flat_map(|_| row(&mut rng)).collect();
        let cumulants = (0..45).map(|_| rng.random::<f64>() * 2.0 - 1.0).collect();
        Self { transitions, cumulants, rng }
    }

    pub(super) fn process(&self) -> Process<'_> {
        Process {
            transitions: &self.transitions,
            cumulants: &self.cumulants,
            terminal: &[false; 5],
        }
    }

    /// So many numbers up to `scale` in size.
    pub(super) fn numbers(&mut self, n: usize, scale: f64) -> Vec<f64> {
        (0..n).map(|_| scale * (self.rng.random::<f64>() * 2.0 - 1.0)).collect()
    }
}

/// The best action values for some rewards, and the policy that is certain of the best actions.
pub(super) fn best(process: &Process<'_>, rewards: &[f64], discount: f64) -> (Vec<f64>, Vec<f64>) {
    let Process { transitions, terminal, .. } = *process;
    let model = Model { transitions, rewards, terminal };
    let v = fixed_point(|v| optimality(&model, discount, v), terminal.len(), 1e-14, 10_000);
    let q = bellman::backup(&model, discount, &v.expect("they settle"));
    let actions: Vec<usize> = q.chunks(process.n_actions()).map(greedy).collect();
    let policy = certain_policy(&actions, process.n_actions());
    (q, policy)
}

/// Of a policy, for rewards instead of cumulants.
pub(super) fn values(
    process: &Process<'_>,
    rewards: &[f64],
    policy: &[f64],
    discount: f64,
) -> Vec<f64> {
    let process = Process { cumulants: rewards, ..*process };
    successor_features(&process, policy, discount).expect("a contraction has a solution")
}

pub(super) fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A room of three by three cells, in the corners of which are a green, a red and a yellow coin; what enters one ends
/// the episode. Actions go up, down, left and right, and into walls nowhere.
///
/// ```text
/// 0 1 G
/// 3 4 5
/// R 7 Y
/// ```
pub(super) struct Coins {
    transitions: Vec<f64>,
    cumulants: Vec<f64>,
}

const TERMINAL: [bool; 9] = [false, false, true, false, false, false, true, false, true];
/// Preferences of the three tasks (Eqn. 4.7).
pub(super) const TASKS: [[f64; 3]; 3] = [[1.0, -1.0, 0.0], [0.0, 2.0, -1.0], [-3.0, 0.0, 1.0]];

impl Coins {
    pub(super) fn new() -> Self {
        let (mut transitions, mut cumulants) = (vec![0.0; 9 * 4 * 9], vec![0.0; 9 * 4 * 3]);
        for s in 0..9_usize {
            let (row, col) = (s / 3, s % 3);
            let to = [
                row.saturating_sub(1) * 3 + col,
                (row + 1).min(2) * 3 + col,
                row * 3 + col.saturating_sub(1),
                row * 3 + (col + 1).min(2),
            ];
            for (a, to) in to.into_iter().enumerate() {
                transitions[(s * 4 + a) * 9 + to] = 1.0;
                if let Some(colour) = [2, 6, 8].iter().position(|coin| *coin == to) {
                    cumulants[(s * 4 + a) * 3 + colour] = 1.0;
                }
            }
        }
        Self { transitions, cumulants }
    }

    pub(super) fn process(&self) -> Process<'_> {
        Process { transitions: &self.transitions, cumulants: &self.cumulants, terminal: &TERMINAL }
    }

    /// The successor features of the policies that are best for the three tasks.
    pub(super) fn features(&self, discount: f64) -> Vec<Vec<f64>> {
        let process = self.process();
        let of = |w: &[f64; 3]| {
            let (_, policy) = best(&process, &preferred(&self.cumulants, w), discount);
            successor_features(&process, &policy, discount).unwrap()
        };
        TASKS.iter().map(of).collect()
    }
}

#[test]
fn by_hand() {
    // From the first state either action leads to the second with probability ½, where the episode ends.
    let process = Process {
        transitions: &[0.5, 0.5, 0.5, 0.5, 0.0, 1.0, 0.0, 1.0],
        cumulants: &[1.0, 0.0, 0.0, 2.0, 9.0, 9.0, 9.0, 9.0],
        terminal: &[false, true],
    };
    // V = (¼, 3/2) + ½·½ V, so V = (⅓, 2), and Ψ = Φ + ¼ V.
    let features = successor_features(&process, &[0.25, 0.75, 0.5, 0.5], 0.5).unwrap();
    let expected = [1.0 + 1.0 / 12.0, 0.5, 1.0 / 12.0, 2.5, 0.0, 0.0, 0.0, 0.0];
    assert!(apart(&features, &expected) < 1e-15, "{features:?}");
    assert_eq!(preferred(&[1.0, 2.0, 3.0, -1.0], &[0.5, 2.0]), [4.5, -0.5]);
}

#[test]
fn what_never_ends_has_no_sum_without_a_discount() {
    let stays = Process { transitions: &[1.0], cumulants: &[1.0], terminal: &[false] };
    assert_eq!(successor_features(&stays, &[1.0], 1.0), None);
    assert_eq!(successor_features(&stays, &[1.0], 0.5), Some(vec![2.0]));
    // It ends after two steps on average.
    let ends = Process {
        transitions: &[0.5, 0.5, 0.0, 1.0],
        cumulants: &[1.0, 0.0],
        terminal: &[false, true],
    };
    assert_eq!(successor_features(&ends, &[1.0, 1.0], 1.0), Some(vec![2.0, 0.0]));
}

/// Example 4.1: Eqns. 4.6 and 4.7.
#[test]
fn three_tasks_pay_what_colours_are_worth_to_them() {
    let colours = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    assert_eq!(preferred(&colours, &TASKS[0]), [1.0, -1.0, 0.0]);
    assert_eq!(preferred(&colours, &TASKS[1]), [0.0, 2.0, -1.0]);
    assert_eq!(preferred(&colours, &TASKS[2]), [-3.0, 0.0, 1.0]);
    // In the room: from the cell above the red coin, going down.
    let coins = Coins::new();
    let pays = TASKS.map(|w| preferred(&coins.cumulants, &w)[3 * 4 + 1]);
    assert_eq!(pays, [-1.0, 2.0, 0.0]);
}

/// Example 4.2: Eqn. 4.12.
#[test]
fn evaluation_by_features_is_direct_evaluation() {
    let coins = Coins::new();
    let process = coins.process();
    // To the nearest green or yellow coin without stepping on the red: right, right, and down at the right wall.
    let actions = [3, 3, 0, 3, 3, 1, 0, 3, 0];
    let policy = certain_policy(&actions, 4);
    let features = successor_features(&process, &policy, 0.9).unwrap();
    // From the first cell, going right: green at the second step. Down first: yellow at the fourth. In the cell above
    // the red coin, down: red at once.
    let of = |s: usize, a: usize| &features[(s * 4 + a) * 3..][..3];
    assert!(apart(of(0, 3), &[0.9, 0.0, 0.0]) < 1e-15);
    assert!(apart(of(0, 1), &[0.0, 0.0, 0.9_f64.powi(3)]) < 1e-15);
    assert_eq!(of(3, 1), [0.0, 1.0, 0.0]);
    for w in TASKS {
        let direct = values(&process, &preferred(&coins.cumulants, &w), &policy, 0.9);
        assert!(apart(&preferred(&features, &w), &direct) < 1e-14);
    }
    for i in 0..100 {
        let mut random = Random::of(i);
        let (w, logits) = (random.numbers(3, 2.0), random.numbers(15, 2.0));
        let policy: Vec<f64> = logits.chunks(3).flat_map(|row| boltzmann(row, 1.0)).collect();
        let process = random.process();
        let features = successor_features(&process, &policy, 0.9).unwrap();
        let direct = values(&process, &preferred(&random.cumulants, &w), &policy, 0.9);
        assert!(apart(&preferred(&features, &w), &direct) < 1e-12);
        let explained = explained_cumulants(&process, &features, &policy, 0.9);
        assert!(apart(&explained, &random.cumulants) < 1e-12);
    }
}

/// Example 4.4: with one preference of 1 the features are action values, and what explains them is the reward.
#[test]
fn one_task_has_values_for_features_and_a_reward_for_cumulants() {
    let coins = Coins::new();
    let reward = preferred(&coins.cumulants, &TASKS[0]);
    let process = Process { cumulants: &reward, ..coins.process() };
    let (q, policy) = best(&process, &reward, 0.9);
    let features = successor_features(&process, &policy, 0.9).unwrap();
    assert!(apart(&preferred(&features, &[1.0]), &q) < 1e-13);
    let explained = explained_cumulants(&process, &features, &policy, 0.9);
    let ended = TERMINAL.iter().flat_map(|end| [*end; 4]);
    let paid: Vec<f64> =
        ended.zip(&reward).map(|(end, reward)| if end { 0.0 } else { *reward }).collect();
    assert!(apart(&explained, &paid) < 1e-13);
}

/// Theorem 4.2 by Eqns. B.2b to B.5d, with `1/ν` where the thesis has `1/γ`: values that explain a softmax are free up
/// to a shift in each state, and whatever it is, what is best for the reward that explains them is best for the
/// expert's.
#[test]
fn a_shift_of_values_changes_neither_the_softmax_nor_what_is_best() {
    for i in 0..200 {
        let mut random = Random::of(i);
        let (w, shift) = (random.numbers(3, 1.0), random.numbers(5, 5.0));
        let process = Process { ..random.process() };
        let reward = preferred(&random.cumulants, &w);
        let (q, policy) = best(&process, &reward, 0.9);
        let nu = 0.5;
        let seen = q.chunks(3).zip(&shift).flat_map(|(q, f)| q.iter().map(move |q| q / nu + f));
        let seen: Vec<f64> = seen.collect();
        let soft = |q: &[f64], nu| -> Vec<f64> {
            q.chunks(3).flat_map(|row| boltzmann(row, nu)).collect()
        };
        assert!(apart(&soft(&seen, 1.0), &soft(&q, nu)) < 1e-13);
        let single = Process { cumulants: &reward, ..process };
        let explained = explained_cumulants(&single, &seen, &policy, 0.9);
        // r/ν + F(s) - γ E F(s').
        let shaped = reward
            .iter()
            .enumerate()
            .map(|(pair, r)| r / nu + shift[pair / 3] - 0.9 * dot(next(&single, pair), &shift));
        assert!(apart(&explained, &shaped.collect::<Vec<_>>()) < 1e-12);
        assert_eq!(best(&process, &explained, 0.9).1, policy);
    }
}
