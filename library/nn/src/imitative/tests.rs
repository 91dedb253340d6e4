use std::sync::Arc;

use ivx_data::{Dataset, Form};
use ivx_op::{Artifact as _, Ctx, Lit, Part};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::curve::Curve;
use crate::descend::Rule;
use crate::model::Model;
use crate::net::nets;
use crate::optim::Pull;
use crate::optimiser::optimisers;
use crate::real::Real as _;
use crate::{Fitted, Function as _};

fn drawn(rng: &mut ChaCha8Rng, n: usize) -> Vec<f64> {
    (0..n).map(|_| rng.random::<f64>() * 2.0 - 1.0).collect()
}

/// Three models of four steps of two numbers, with six units.
fn models(rng: &mut ChaCha8Rng) -> Scorer<f64> {
    let one = |rng: &mut ChaCha8Rng| PlanWeights {
        dims: 2,
        units: 6,
        cell: [drawn(rng, 36), drawn(rng, 18), drawn(rng, 108), drawn(rng, 18)],
        head: vec![
            (drawn(rng, 30), drawn(rng, 5), Curve::Tanh),
            (drawn(rng, 20), drawn(rng, 4), Curve::Identity),
        ],
    };
    let models: Vec<_> = (0..3).map(|_| one(rng)).collect();
    let mut scorer = Scorer::new(&models, 4);
    scorer.see(&drawn(rng, 3 * 2 * 6));
    scorer
}

/// With weights of 0 every step is normal about the one before, with the deviation `ln 2 + 10⁻³`.
#[test]
fn a_model_without_weights_is_a_walk() {
    let zeros = |n: usize| vec![0.0; n];
    let model = PlanWeights {
        dims: 1,
        units: 2,
        cell: [zeros(6), zeros(6), zeros(12), zeros(6)],
        head: vec![(zeros(4), zeros(2), Curve::Identity)],
    };
    let mut scorer = Scorer::new(&[model], 2);
    scorer.see(&[0.3, -0.3]);
    let mut score = [0.0];
    scorer.scores(&[0.5, -1.0], 1, &mut score);
    let spread: f64 = std::f64::consts::LN_2 + 1e-3;
    let log_n = |d: f64| -0.5 * (d / spread).powi(2) - spread.ln() - 0.918_938_533_204_672_7;
    assert!((score[0] - log_n(0.5) - log_n(-1.5)).abs() < 1e-12, "{}", score[0]);
    // A formula that forgets the place before is told from it.
    assert!((score[0] - log_n(0.5) - log_n(-1.0)).abs() > 0.1);
    let mut plan = [1.0, -2.0];
    scorer.plans(0, &mut plan, 1);
    assert!((plan[0] - spread).abs() < 1e-12 && (plan[1] + spread).abs() < 1e-12, "{plan:?}");
}

#[test]
fn slopes_are_finite_differences() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut scorer = models(&mut rng);
    let (plans, noise) = (drawn(&mut rng, 16), drawn(&mut rng, 16));
    // One model counts in one row, two in the other, and the third nowhere.
    let weights = [0.5, 0.0, 0.0, -0.25, 0.75, 0.0];
    let worth = |scorer: &mut Scorer<f64>, plans: &[f64]| -> f64 {
        let mut scores = [0.0; 6];
        scorer.scores(plans, 1, &mut scores);
        scores.iter().zip(weights).map(|(score, weight)| score * weight).sum()
    };
    let of_noise = |scorer: &mut Scorer<f64>, noise: &[f64]| {
        let mut plans = noise.to_vec();
        scorer.plans(1, &mut plans, 1);
        plans
    };
    let mut slope = vec![f64::NAN; 16];
    worth(&mut scorer, &plans);
    scorer.slope(&weights, &mut slope);
    let made = of_noise(&mut scorer, &noise);
    let mut by_noise = vec![f64::NAN; 16];
    worth(&mut scorer, &made);
    scorer.slope(&weights, &mut by_noise);
    scorer.plans_back(1, &noise, &mut by_noise);
    for i in 0..16 {
        let moved = |of: &[f64], by: f64| {
            let mut of = of.to_vec();
            of[i] += by;
            of
        };
        let (up, down) = (moved(&plans, 1e-5), moved(&plans, -1e-5));
        let found = (worth(&mut scorer, &up) - worth(&mut scorer, &down)) / 2e-5;
        assert!((found - slope[i]).abs() < 1e-6 * (1.0 + found.abs()), "{i}: {found} {}", slope[i]);
        let (up, down) = (moved(&noise, 1e-5), moved(&noise, -1e-5));
        let (up, down) = (of_noise(&mut scorer, &up), of_noise(&mut scorer, &down));
        let found = (worth(&mut scorer, &up) - worth(&mut scorer, &down)) / 2e-5;
        let own = by_noise[i];
        assert!((found - own).abs() < 1e-6 * (1.0 + found.abs()), "{i}: {found} {own} by noise");
    }
}

/// A plan has the same score whatever is scored beside it.
#[test]
fn many_plans_are_scored_as_one() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut scorer = models(&mut rng);
    let n = 75;
    let plans = drawn(&mut rng, 2 * n * 8);
    let mut all = vec![0.0; 2 * n * 3];
    scorer.scores(&plans, n, &mut all);
    for at in [0, 63, 64, 74] {
        let two: Vec<f64> =
            [at, n + at].iter().flat_map(|i| plans[i * 8..][..8].to_vec()).collect();
        let mut scores = [0.0; 6];
        scorer.scores(&two, 1, &mut scores);
        assert_eq!(scores[..3], all[at * 3..][..3]);
        assert_eq!(scores[3..], all[(n + at) * 3..][..3]);
    }
    let mut made = plans.clone();
    scorer.plans(1, &mut made, n);
    for at in [0, 63, 64, 74] {
        let of = |plans: &[f64], i: usize| plans[i * 8..][..8].to_vec();
        let mut two = [of(&plans, at), of(&plans, n + at)].concat();
        scorer.plans(1, &mut two, 1);
        assert_eq!(two, [of(&made, at), of(&made, n + at)].concat());
    }
}

/// A fork: who is imitated goes left or right, and tells by what is beside the picture how far.
fn fork(n: usize) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let form = Form { input: vec![1, 2, 2], beside: 1, target: vec![3, 2], ..Form::default() };
    let (mut x, mut y) = (Vec::new(), Vec::new());
    for _ in 0..n {
        let (speed, side) = (rng.random::<f64>() + 0.5, if rng.random() { 1.0 } else { -1.0 });
        x.extend([0.0, 1.0, 0.0, 1.0, speed]);
        for t in 1..4 {
            let far = f64::from(t) * speed;
            y.extend([far, side * far * far / 4.0]);
        }
    }
    Dataset { form, x, y }
}

fn trained(data: &Dataset, steps: u64) -> Imitative {
    let registry = crate::registry();
    let dense = Part::new("dense").with("units", 8_i64).with("activation", Part::new("relu"));
    let layers = vec![Part::new("flatten").into(), dense.into()];
    let net = Part::new("sequence").with("layers", Lit::List(layers));
    let net = nets().build(&registry.complete(&net)).unwrap();
    let nets = PlanNets { net: &*net, features: 4, merge: &[16], units: 16, head: &[16] };
    let ctx = Ctx::new("train", 0, Some(1));
    let model = Imitative::drawn(&nets, &data.form, &mut ctx.rng("init", &[])).unwrap();
    let rate = Part::new("constant").with("value", 5e-3);
    let adam = registry.complete(&Part::new("adam").with("lr", rate));
    let optimiser = optimisers().build(&adam).unwrap();
    let rule = Rule { optimiser: &*optimiser, pull: Pull::NONE, steps };
    fit_plans(model, data, &PlanTraining { rule, batch: 64, noise: 0.01 }, &ctx).unwrap()
}

/// Who goes left goes on to the left: of plans that were seen the end is known by their beginning, and a plan whose
/// last place is on the other side is a thousand times less probable, as is one at twice the speed that is told.
#[test]
fn a_fork_is_learned() {
    let (data, model) = (fork(400), trained(&fork(400), 600));
    let mut opened = Imitators::of(&[&model], &data.form);
    let single = |values: &[f64]| values.iter().map(|x| f32::of(*x)).collect::<Vec<f32>>();
    opened.see(&single(&data.x[..20 * 5]));
    let mut score = |change: &dyn Fn(usize, f64) -> f64| {
        let plans = data.y[..20 * 6].iter().enumerate().map(|(i, y)| change(i % 6, *y));
        let mut scores = vec![0.0; 20];
        opened.scorer.scores(&single(&plans.collect::<Vec<_>>()), 1, &mut scores);
        f64::from(scores.iter().sum::<f32>()) / 20.0
    };
    let own = score(&|_, y| y);
    let turned = score(&|at, y| if at == 5 { -y } else { y });
    let hasty = score(&|_, y| 2.0 * y);
    assert!(own > turned + 7.0 && own > hasty + 7.0, "{own} {turned} {hasty}");
    let both = score(&|at, y| if at % 2 == 1 { -y } else { y });
    assert!((own - both).abs() < 1.0, "{own} {both}");
}

#[test]
fn a_model_is_stored_whole_and_says_a_plan() {
    let (data, model) = (fork(8), trained(&fork(8), 2));
    let function = Arc::new(model.clone());
    let stored = Model::Fitted(Fitted { form: data.form.clone(), function });
    let back = Model::decode(&stored.encode()).unwrap();
    assert_eq!(back, stored);
    assert_eq!(Imitative::within(&back), Some((&model, &data.form)));
    // A plan alone is what it is among others.
    let all = back.predict(&data.x);
    assert_eq!(all.len(), 8 * 6);
    let one = back.predict(&data.x[5..10]);
    assert!(one.iter().zip(&all[6..12]).all(|(one, all)| (one - all).abs() < 1e-5));
    for name in ["layers", "cell.state_bias", "head.1.bias"] {
        let mut less = model.tensors();
        less.arrays.remove(name).expect(name);
        assert!(read(&data.form, &mut less).is_none(), "without {name}");
    }
    let longer = Form { target: vec![3, 3], ..data.form };
    assert!(read(&longer, &mut model.tensors()).is_none());
}
