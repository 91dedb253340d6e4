//! How often claims hold that are not true, by rule and family: the table of `docs/claims.md`.
//!
//! `cargo bench -p ivx-library --bench levels`, some minutes on one core.

#![expect(clippy::print_stdout, reason = "a bench tells what it found")]

use ivx_math::evidence::{Evidence, Spread};
use ivx_math::moments::real;
use ivx_op::Ctx;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Exp1, StandardNormal, StudentT};

const N_TRIALS: usize = 20_000;
const SIZES: [usize; 4] = [5, 10, 20, 50];

type Family = (&'static str, fn(&mut ChaCha8Rng) -> f64);

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

fn exponential(rng: &mut ChaCha8Rng) -> f64 {
    Exp1.sample(rng)
}

fn one_in(rng: &mut ChaCha8Rng, share: f64) -> f64 {
    f64::from(u8::from(rng.random::<f64>() < share))
}

/// All of mean 0.
const FAMILIES: [Family; 14] = [
    ("normal", normal),
    ("χ² with 1 degree", |rng| normal(rng).powi(2) - 1.0),
    ("z⁴", |rng| normal(rng).powi(4) - 3.0),
    ("t with 3 degrees", |rng| StudentT::new(3.0).expect("positive").sample(rng)),
    ("rounded normal", |rng| normal(rng).round()),
    ("−1, 0, 1", |rng| f64::from(rng.random_range(-1..=1_i8))),
    ("1 in one of five", |rng| one_in(rng, 0.2) - 0.2),
    ("1 in one of ten", |rng| one_in(rng, 0.1) - 0.1),
    ("half 0, else χ²", |rng| one_in(rng, 0.5) * normal(rng).powi(2) - 0.5),
    ("four fifths 0, else exponential", |rng| one_in(rng, 0.2) * exponential(rng) - 0.2),
    ("exponential", |rng| exponential(rng) - 1.0),
    ("log-normal", |rng| normal(rng).exp() - 0.5_f64.exp()),
    ("Pareto with 3", |rng| (exponential(rng) / 3.0).exp() - 1.5),
    ("normal, 5 higher in one of ten", |rng| normal(rng) + 5.0 * one_in(rng, 0.1) - 0.5),
];

/// The levels at which the mean of a sample is below 0, by each rule.
fn levels(xs: &[f64], rng: &mut ChaCha8Rng) -> [f64; 4] {
    let spread = Spread::of_mean(xs);
    let rules = [
        Evidence::Mean(spread),
        Evidence::Mean(spread.plain()),
        Evidence::bootstrap(xs, rng),
        Evidence::ranks(xs),
    ];
    rules.map(|rule| rule.p_below(0.0, false))
}

/// In how many of a hundred samples each rule decides at 2.5 %.
fn decided(family: fn(&mut ChaCha8Rng) -> f64, effect: f64, n: usize) -> [f64; 4] {
    let mut rng = Ctx::new("levels", 0, None).rng("samples", &[&n.to_string()]);
    let mut counts = [0; 4];
    for trial in 0..N_TRIALS {
        let xs: Vec<f64> = (0..n).map(|_| family(&mut rng) - effect).collect();
        // The bootstrap and the ranks are slow.
        let all = if trial % 10 == 0 {
            levels(&xs, &mut rng)
        } else {
            let spread = Spread::of_mean(&xs);
            let plain = Evidence::Mean(spread.plain());
            [Evidence::Mean(spread).p_below(0.0, false), plain.p_below(0.0, false), 1.0, 1.0]
        };
        for (count, p) in counts.iter_mut().zip(all) {
            *count += usize::from(p <= 0.025);
        }
    }
    let share = |count: usize, of: usize| 100.0 * real(count) / real(of);
    let [ours, plain, bootstrap, ranks] = counts;
    [
        share(ours, N_TRIALS),
        share(plain, N_TRIALS),
        share(bootstrap, N_TRIALS / 10),
        share(ranks, N_TRIALS / 10),
    ]
}

fn main() {
    let row = |name: &str, cells: Vec<[f64; 4]>| {
        let rule = |rule: usize| {
            cells.iter().map(|cell| format!("{:.1}", cell[rule])).collect::<Vec<_>>().join(" ")
        };
        println!("| {name} | {} | {} | {} | {} |", rule(0), rule(1), rule(2), rule(3));
    };
    println!(
        "| n = 5, 10, 20, 50 | default | `t` | `bootstrap` | `wilcoxon` |\n|---|---|---|---|---|"
    );
    for (name, family) in FAMILIES {
        row(name, SIZES.map(|n| decided(family, 0.0, n)).to_vec());
    }
    let effects = [1.684, 0.995, 0.66, 0.404];
    row(
        "power",
        SIZES.iter().zip(effects).map(|(n, effect)| decided(normal, effect, *n)).collect(),
    );
}
