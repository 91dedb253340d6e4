use ivx_op::{Gathered, Labels, MISSING};
use rand_distr::{Distribution as _, StandardNormal};

use super::*;
use crate::metric::Resample;

const CTX: Ctx = Ctx::new("claim", 0, None);

fn scalar(x: f64) -> Everything<Array> {
    Everything(Gathered { dims: vec![], values: vec![Array::scalar(x)], name: String::new() })
}

/// One number a seed.
fn seeds(xs: &[f64]) -> Everything<Array> {
    let seed = Dim::new("seed", Labels::count(xs.len()));
    let values = xs.iter().copied().map(Array::scalar).collect();
    Everything(Gathered { dims: vec![seed], values, name: String::new() })
}

fn whole(array: Array) -> Everything<Array> {
    Everything(Gathered { dims: vec![], values: vec![array], name: String::new() })
}

/// A claim of the default method.
fn of(left: Everything<Array>, relation: &str, right: Everything<Array>) -> Claim {
    Claim {
        left,
        right,
        relation: relation.to_owned(),
        confidence: 0.95,
        within: 0.0,
        by: "tails".into(),
        seeds: 0,
        behind: Many(Vec::new()),
        describes: false,
    }
}

fn finding(claim: &Claim) -> Finding {
    claim.run(&CTX).expect("it can be judged").findings.remove(0)
}

fn within(within: f64, left: Everything<Array>, relation: &str, right: f64) -> Finding {
    finding(&Claim { within, ..of(left, relation, scalar(right)) })
}

fn outcome(left: Everything<Array>, relation: &str, right: Everything<Array>) -> Outcome {
    of(left, relation, right).run(&CTX).expect("it can be judged").outcome()
}

/// Numbers of mean 0 whose spread and skewness are those of a normal sample.
fn evenly(n: usize) -> Vec<f64> {
    (0..n).map(|i| ivx_math::moments::real(i) - ivx_math::moments::real(n - 1) / 2.0).collect()
}

#[test]
fn deterministic_numbers_compare_plainly() {
    use Outcome::{Fails, Holds, Undecided};
    let all = |l, r| ["<", "<=", ">", ">=", "==", "!="].map(|s| outcome(scalar(l), s, scalar(r)));
    assert_eq!(all(1.0, 2.0), [Holds, Holds, Fails, Fails, Fails, Holds]);
    assert_eq!(all(2.0, 2.0), [Fails, Holds, Fails, Holds, Holds, Fails]);
    assert_eq!(all(3.0, 2.0), [Fails, Fails, Holds, Holds, Fails, Holds]);
    assert_eq!(all(f64::NAN, 2.0), [Undecided; 6]);
    for x in [f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(all(x, x), [Fails, Holds, Fails, Holds, Holds, Fails]);
        assert_eq!(within(0.5, scalar(x), "==", x).outcome, Holds);
        assert_eq!(within(0.5, scalar(x), "==", -x).outcome, Fails);
    }
    let found = finding(&of(scalar(1.0), "<", scalar(3.0)));
    assert_eq!((found.estimate, found.interval, found.n, found.p), (-2.0, None, 0, None));
}

#[test]
fn seeds_are_paired() {
    // The sides overlap by far, but every pair differs by about 1.
    let left = [0.0, 10.0, 20.0, 30.0, 40.0];
    let right = [0.9, 10.9, 21.0, 31.1, 41.1];
    let claim = of(seeds(&left), "<", seeds(&right));
    let found = finding(&claim);
    assert_eq!((found.outcome, found.n), (Outcome::Holds, 5));
    assert!((found.estimate + 1.0).abs() < 1e-12 && found.at.is_empty());
    let (low, high) = found.interval.expect("there are seeds");
    assert!(low < -1.0 && -1.0 < high && high < 0.0, "{low} {high}");
    let (holds, fails) = found.p.expect("there are seeds");
    assert!(holds < 1e-3 && fails > 0.999, "{holds} {fails}");
    assert_eq!(outcome(seeds(&left), ">", seeds(&right)), Outcome::Fails);
    assert_eq!(outcome(seeds(&left[..4]), "<", seeds(&right[..4])), Outcome::Undecided);
    assert_eq!(outcome(seeds(&left), "<", scalar(20.5)), Outcome::Undecided);
}

#[test]
fn what_is_equal_in_few_seeds_may_differ_in_others() {
    use Outcome::{Fails, Holds, Undecided};
    // 0.95^72 is the first power below 0.025.
    for (n, same) in
        [(5, [Undecided; 5]), (71, [Undecided; 5]), (72, [Holds, Fails, Holds, Fails, Holds])]
    {
        let xs = evenly(n);
        let found = ["==", "!=", "<=", "<", ">="].map(|sign| outcome(seeds(&xs), sign, seeds(&xs)));
        assert_eq!(found, same, "{n}");
        let less = outcome(seeds(&vec![1.0; n]), "<", scalar(2.0));
        assert_eq!(less, if n < 72 { Undecided } else { Holds }, "{n}");
    }
    // One that is not equal is enough to see that not all are.
    let (xs, mut ys) = (evenly(5), evenly(5));
    ys[3] += 0.5;
    assert_eq!(outcome(seeds(&xs), "==", seeds(&ys)), Fails);
    assert_eq!(outcome(seeds(&xs), "!=", seeds(&ys)), Holds);
    let found = finding(&of(seeds(&[1.0; 20]), "<", scalar(2.0)));
    assert!(found.too_few && found.interval == Some((-1.0, -1.0)), "{found:?}");
    assert_eq!((found.smallest, found.enough), (None, Some(72)));
}

#[test]
fn what_was_reduced_over_few_seeds_decides_nothing() {
    let told = |seeds, left: Everything<Array>| {
        let found = finding(&Claim { seeds, ..of(left, "<", scalar(9.0)) });
        (found.outcome, found.n, found.lacks_seeds())
    };
    assert_eq!(told(0, scalar(1.0)), (Outcome::Holds, 0, false));
    assert_eq!(told(1, scalar(1.0)), (Outcome::Undecided, 1, true));
    assert_eq!(told(4, scalar(1.0)), (Outcome::Undecided, 4, true));
    // Paired with what was picked from one seed.
    assert_eq!(told(1, seeds(&evenly(6))), (Outcome::Undecided, 1, true));
    assert_eq!(told(6, seeds(&evenly(6))), (Outcome::Holds, 6, false));
    let only_these = Claim { describes: true, seeds: 8, ..of(scalar(1.0), "<", scalar(9.0)) };
    assert_eq!(finding(&only_these).outcome, Outcome::Describes);
    let not_even = Claim { describes: true, seeds: 8, ..of(scalar(1.0), ">", scalar(9.0)) };
    assert_eq!(finding(&not_even).outcome, Outcome::Fails);
}

#[test]
fn a_mean_over_seeds_is_judged_as_its_seeds_are() {
    let resampled = |xs: &[f64]| {
        let (reduction, along) = ("mean".to_owned(), vec![SEED.to_owned()]);
        let resample = Resample { x: seeds(xs), reduction, along, q: 0.5, skip_missing: false };
        whole(resample.run(&Ctx::new("resample", 0, None)).expect("it has seeds"))
    };
    let mut rng = Ctx { op: "test", ..CTX }.rng("sample", &[]);
    for n in [5, 12, 40] {
        let xs: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut rng)).collect();
        let claim = Claim {
            seeds: 99,
            behind: Many(vec![seeds(&xs)]),
            ..of(resampled(&xs), "<", scalar(0.1))
        };
        let (whole, each) = (finding(&claim), finding(&of(seeds(&xs), "<", scalar(0.1))));
        assert_eq!((whole.n, whole.outcome), (n, each.outcome));
        assert!((whole.estimate - each.estimate).abs() < 1e-12);
        let ends = |found: &Finding| found.interval.expect("there are seeds");
        let ((a, b), (c, d)) = (ends(&whole), ends(&each));
        for (x, y) in [(a, c), (b, d)] {
            assert!(x == y || (x - y).abs() < 0.05 * (x - each.estimate).abs(), "{n}: {x} {y}");
        }
    }
    // Both sides made of the same seeds move together.
    let xs = evenly(9);
    let above: Vec<f64> = xs.iter().map(|x| x + 0.5 + x * x * 1e-3).collect();
    let behind = Many(vec![seeds(&xs), seeds(&above)]);
    let claim = Claim { behind, ..of(resampled(&xs), "<", resampled(&above)) };
    assert_eq!(finding(&claim).outcome, Outcome::Holds);
}

#[test]
fn a_share_of_seeds_is_judged_by_the_binomial_distribution() {
    let share = |k: usize, n: usize, relation: &str, bound: f64| {
        let xs: Vec<f64> = (0..n).map(|i| if i < k { 1.0 } else { 0.0 }).collect();
        finding(&Claim { by: "binomial".into(), ..of(seeds(&xs), relation, scalar(bound)) })
    };
    // Of n successes in n the exact bound is 0.025^(1/n): 0.9 from 36 on.
    assert_eq!(share(35, 35, ">=", 0.9).outcome, Outcome::Undecided);
    let found = share(36, 36, ">=", 0.9);
    let (low, high) = found.interval.expect("there are seeds");
    assert_eq!((found.outcome, found.n), (Outcome::Holds, 36));
    assert!((low + 0.9 - 0.025_f64.powf(1.0 / 36.0)).abs() < 1e-9 && (high - 0.1).abs() < 1e-12);
    // 2 · 0.8^10 = 0.2147: nothing is decided; at 0.6, 2 · 0.6^10 = 0.0121.
    let (p, _) = share(10, 10, ">", 0.8).p.expect("there are seeds");
    assert!((p - 2.0 * 0.8_f64.powi(10)).abs() < 1e-12, "{p}");
    assert_eq!(share(10, 10, ">", 0.6).outcome, Outcome::Holds);
    assert_eq!(share(0, 10, ">", 0.4).outcome, Outcome::Fails);
    assert_eq!(share(9, 10, "==", 1.0).outcome, Outcome::Fails);
    assert_eq!(share(10, 10, "==", 1.0).outcome, Outcome::Undecided);
}

#[test]
fn what_is_infinite_has_no_interval() {
    for n in [5, 20] {
        let mut differences = vec![1.0; n];
        differences[0] = f64::INFINITY;
        let found = finding(&of(seeds(&differences), "<", scalar(0.0)));
        assert_eq!((found.estimate, found.n), (f64::INFINITY, n));
        assert!(found.interval.is_none_or(|(low, high)| low <= high), "{found:?}");
        differences[1] = f64::NEG_INFINITY;
        let found = finding(&of(seeds(&differences), "<", scalar(0.0)));
        assert_eq!((found.outcome, found.interval), (Outcome::Undecided, None));
    }
}

#[test]
fn margins_are_of_the_interval() {
    use Outcome::{Fails, Holds, Undecided};
    // Mean 3, s² = 2.5, no tail: 3 ± 2.7764 · 0.7071 = 3 ± 1.963 at 5 seeds.
    let xs = [1.0, 2.0, 3.0, 4.0, 5.0];
    let by = |margin, sign, n| within(margin, seeds(&xs[..n]), sign, 0.0).outcome;
    assert_eq!([by(5.0, "==", 5), by(3.0, "==", 5), by(1.0, "==", 5)], [Holds, Undecided, Fails]);
    assert_eq!([by(5.0, "<=", 5), by(3.0, "<=", 5), by(1.0, "<=", 5)], [Holds, Undecided, Fails]);
    assert_eq!(by(5.0, "==", 4), Undecided);
    let found = within(4.97, seeds(&xs), "<=", 0.0);
    let (low, high) = found.interval.expect("there are seeds");
    assert!((low - 1.037).abs() < 1e-3 && (high - 4.963).abs() < 1e-3, "{low} {high}");
    assert_eq!((found.outcome, found.estimate, found.n), (Holds, 3.0, 5));
    // Not worse by more than 1 than what is 3.5 below.
    let worse = |margin| within(margin, seeds(&xs), ">=", 6.5).outcome;
    assert_eq!([worse(6.0), worse(3.0), worse(1.0)], [Holds, Undecided, Fails]);

    let plainly = |margin, l| within(margin, scalar(l), "==", 2.0).outcome;
    assert_eq!([plainly(0.5, 2.5), plainly(0.5, 1.5), plainly(0.5, 2.6)], [Holds, Holds, Fails]);
    assert_eq!(plainly(0.5, f64::NAN), Undecided);
    assert_eq!(within(0.5, scalar(1.5), ">=", 2.0).outcome, Holds);
    assert_eq!(within(0.5, scalar(1.4), ">=", 2.0).outcome, Fails);
}

#[test]
fn a_margin_does_not_depend_on_the_number_of_seeds() {
    for x in [0.1, 0.7, 1.0 / 3.0, 1e-300, 123.456, 1e300] {
        for n in [72, 73, 100] {
            let found = within(x, seeds(&vec![x; n]), "==", 0.0);
            assert_eq!((found.outcome, found.estimate), (Outcome::Holds, x), "{n} of {x}");
            assert_eq!(found.interval, Some((x, x)));
            let above = f64::from_bits(x.to_bits() + 1);
            let found = within(x, seeds(&vec![above; n]), "==", 0.0);
            assert_eq!(found.outcome, Outcome::Fails);
            assert_ne!(found.shown()[0].parse(), Ok(x), "what fails is not shown as what holds");
            assert_eq!(outcome(seeds(&vec![x; n]), "<=", scalar(x)), Outcome::Holds, "{n} of {x}");
        }
    }
}

#[test]
fn other_axes_mean_for_all() {
    let ke = Dim::new("ke", Labels::Names(vec!["WCM".into(), "BCM".into()]));
    let n = Dim::new("n", Labels::Numbers(vec![5.0, 10.0]));
    let row = |values| Array::series(n.clone(), values);
    let values = vec![row(vec![0.0, 1.0]), row(vec![2.0, 3.0])];
    let left = Everything(Gathered { dims: vec![ke], values, name: String::new() });
    let verdict = of(left, "<", scalar(2.5)).run(&CTX).expect("it can be judged");
    let at: Vec<String> = verdict.findings.iter().map(|f| format!("{:?}", f.at)).collect();
    assert_eq!(at[1], r#"[("ke", "WCM"), ("n", "10")]"#);
    assert_eq!(at[2], r#"[("ke", "BCM"), ("n", "5")]"#);
    let outcomes: Vec<Outcome> = verdict.findings.iter().map(|f| f.outcome).collect();
    assert_eq!(outcomes, [Outcome::Holds, Outcome::Holds, Outcome::Holds, Outcome::Fails]);
    assert_eq!(verdict.outcome(), Outcome::Fails);
}

#[test]
fn methods_differ_as_they_should() {
    let xs = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 40.0];
    let by = |by: &str| {
        let found = finding(&Claim { by: by.into(), ..of(seeds(&xs), "<", scalar(0.0)) });
        found.interval.expect("there are seeds")
    };
    // Mean 8.5, s = 12.88, so 8.5 ± 2.3646 · 4.553.
    let (low, high) = by("t");
    assert!((low + 2.267).abs() < 1e-2 && (high - 19.267).abs() < 1e-2, "{low} {high}");
    // A tail above: the end there is far away, and that below is nearer.
    let (near, open) = by("tails");
    assert!(near > low && open == f64::INFINITY, "{near} {open}");
    // The fourth lowest and highest of 36 means of pairs: P(W ≤ 3) = 5 / 256 < 0.025 < P(W ≤ 4).
    assert_eq!(by("wilcoxon"), (2.0, 22.5));
    let (low, high) = by("bootstrap");
    assert!(2.5 < low && low < 4.0 && 16.0 < high && high < 19.0, "{low} {high}");
}

#[test]
fn unknown_relations_are_refused() {
    assert!(of(scalar(0.0), "~", scalar(1.0)).run(&CTX).is_err());
}

#[test]
fn what_is_undecided_says_how_many_seeds_would_tell() {
    // s = 3.0277 and n = 10: (2.2622 + 0.8834) · 0.9574 = 3.012 could have been told.
    let xs: Vec<f64> = evenly(10).iter().map(|x| x + 1.0).collect();
    let found = finding(&of(seeds(&xs), ">", scalar(0.0)));
    assert_eq!(found.outcome, Outcome::Undecided);
    assert!((found.smallest.expect("it is undecided") - 3.012).abs() < 1e-3, "{found:?}");
    // (1.9921 + 0.8465) · 3.0277 / √n ≤ 1 for n of 74.
    assert_eq!(found.enough, Some(74));
    assert!(!found.too_few);
    let decided = finding(&of(seeds(&xs), ">", scalar(-9.0)));
    // (2.7764 + 0.9410) · 3.0277 / √5 = 5.034 is less than 10: five would have told.
    assert_eq!((decided.smallest.is_some(), decided.enough), (true, Some(5)));
}

#[test]
fn what_is_missing_decides_nothing() {
    let mut xs = evenly(80);
    xs[3] = f64::NAN;
    for by in ["tails", "t", "bootstrap", "wilcoxon"] {
        for relation in ["<", "<=", ">", ">=", "==", "!="] {
            let found =
                finding(&Claim { by: by.into(), ..of(seeds(&xs), relation, scalar(900.0)) });
            assert_eq!(found.outcome, Outcome::Undecided, "{by} {relation}");
            let levels = found.p.unwrap_or((1.0, 1.0));
            assert!(levels == (1.0, 1.0) && found.interval.is_none(), "{by} {relation}: {found:?}");
        }
    }
    let resample = |xs: &[f64]| {
        let (reduction, along) = ("median".to_owned(), vec![SEED.to_owned()]);
        let resample = Resample { x: seeds(xs), reduction, along, q: 0.5, skip_missing: false };
        whole(resample.run(&Ctx::new("resample", 0, None)).expect("it has seeds"))
    };
    let claim = Claim {
        by: "quantiles".into(),
        behind: Many(vec![seeds(&xs)]),
        ..of(resample(&xs), "<", scalar(900.0))
    };
    assert_eq!(finding(&claim).outcome, Outcome::Undecided);
    // Spreads that no number holds.
    let tiny = [5e-324, 0.0, -5e-324, 1e-323, -5e-324];
    assert_ne!(finding(&of(seeds(&tiny), "<", scalar(0.0))).outcome, Outcome::Holds);
}

#[test]
fn a_share_on_the_right_is_told_as_it_stands() {
    let xs = [1.0, 0.0, 1.0, 1.0, 1.0, 1.0];
    let left = finding(&Claim { by: "binomial".into(), ..of(seeds(&xs), ">", scalar(0.9)) });
    let right = Claim { by: SHARE_ON_THE_RIGHT.into(), ..of(scalar(0.9), "<", seeds(&xs)) };
    let right = finding(&right);
    assert_eq!((left.outcome, left.p), (right.outcome, right.p));
    assert_eq!(left.estimate, -right.estimate);
    let ends = |finding: &Finding| finding.interval.expect("there are seeds");
    assert_eq!(ends(&left), (-ends(&right).1, -ends(&right).0));
}

#[test]
fn what_lacks_seeds_is_undecided_and_says_which() {
    let low = seeds(&[1.0, 2.0, MISSING, 4.0, 5.0, MISSING, 7.0]);
    let found = finding(&of(low.clone(), "<", scalar(100.0)));
    assert_eq!((found.outcome, found.n), (Outcome::Undecided, 5));
    assert!(found.estimate.is_nan());
    assert_eq!(found.missing, ["2", "5"]);
    // A failed node without seeds.
    let found = finding(&of(scalar(MISSING), "<", scalar(1.0)));
    assert_eq!((found.outcome, &found.missing[..]), (Outcome::Undecided, &[String::new()][..]));
    // What was computed and is not a number is not missing, and decides nothing either.
    let odd = finding(&of(seeds(&[1.0, 2.0, f64::NAN, 4.0, 5.0]), "<", scalar(100.0)));
    assert_eq!((odd.outcome, odd.missing.len()), (Outcome::Undecided, 0));

    let mean = |skip_missing| {
        let (reduction, along) = ("mean".to_owned(), vec!["seed".to_owned()]);
        let resample = Resample { x: low.clone(), reduction, along, q: 0.5, skip_missing };
        let left = whole(resample.run(&CTX).expect("it has seeds"));
        let behind = Many(vec![low.clone()]);
        finding(&Claim { behind, ..of(left, "<", scalar(100.0)) })
    };
    let lost = mean(false);
    assert_eq!(
        (lost.outcome, &lost.missing[..]),
        (Outcome::Undecided, &["2", "5"].map(str::to_owned)[..])
    );
    let kept = mean(true);
    assert_eq!((kept.outcome, kept.n, kept.missing.len()), (Outcome::Holds, 5, 0));
    assert!((kept.estimate + 96.2).abs() < 1e-9, "{}", kept.estimate);
}
