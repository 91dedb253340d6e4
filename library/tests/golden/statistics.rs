//! Statistics beside those of scipy, rliable and scikit-learn.

use ivx_math::compare::{TTest, cohen_d, mann_whitney_p, mann_whitney_u, sign_flip_p, wilcoxon};
use ivx_math::detect::{auroc, average_precision, pearson, rate_above, spearman};
use ivx_math::interval::{percentile, wilson};
use ivx_math::moments::{mean, real, sample_variance, stderr};
use ivx_math::order::quantile;
use ivx_math::several::{Aggregate, benjamini_hochberg, holm, improvement};
use serde_json::{Value, json};

use crate::harness::{Case, check, number, numbers, rows};

#[test]
fn golden_statistics_agree() {
    check("statistics", |case, path| match case.kind.as_str() {
        "two_sample" => two_samples(case, path),
        "rliable" => aggregates(case, path),
        "multiple_testing" => several(case, path),
        "detection" => detection(case, path),
        "paired" => paired(case, path),
        "wilson" => successes(case, path),
        _ => None,
    });
}

fn two_samples(case: &Case, path: &[&str]) -> Option<Value> {
    let (xs, ys) = (numbers(&case.inputs["x"]), numbers(&case.inputs["y"]));
    let test = TTest::welch(&xs, &ys);
    let means = || -> Vec<f64> {
        let resampled = rows(&case.inputs["boot_index"]);
        let at = |i: &f64| xs[(0..xs.len()).find(|n| real(*n) == *i).expect("a place")];
        resampled.iter().map(|row| mean(&row.iter().map(at).collect::<Vec<_>>())).collect()
    };
    Some(match path {
        ["mean_x"] => json!(mean(&xs)),
        ["sem_x"] => json!(stderr(&xs)),
        ["t"] => json!(test.t),
        ["df"] => json!(test.df),
        ["p_two_sided"] => json!(test.p_two_sided()),
        ["p_greater"] => json!(test.p_greater()),
        ["ci95_diff"] => json!(test.interval(0.95)),
        ["mwu_u"] => json!(mann_whitney_u(&xs, &ys)),
        ["mwu_p_exact"] => json!(mann_whitney_p(&xs, &ys)),
        ["boot_se"] => json!(sample_variance(&means()).sqrt()),
        ["boot_ci95_percentile"] => json!(percentile(&means(), 0.95)),
        ["cohen_d"] => json!(cohen_d(&xs, &ys)),
        _ => return None,
    })
}

fn aggregates(case: &Case, path: &[&str]) -> Option<Value> {
    let scores = rows(&case.inputs["scores_runs_x_tasks"]);
    let of = Aggregate::of(&scores);
    Some(match path {
        ["mean"] => json!(of.mean),
        ["median"] => json!(of.median),
        ["iqm" | "iqm_scipy"] => json!(of.iqm),
        ["optimality_gap"] => json!(of.optimality_gap),
        ["prob_improvement"] => json!(improvement(&scores, &rows(&case.inputs["scores_other"]))),
        _ => return None,
    })
}

fn several(case: &Case, path: &[&str]) -> Option<Value> {
    let ps = numbers(&case.inputs["p"]);
    match path {
        ["holm_adjusted"] => Some(json!(holm(&ps))),
        ["bh_adjusted"] => Some(json!(benjamini_hochberg(&ps))),
        _ => None,
    }
}

fn detection(case: &Case, path: &[&str]) -> Option<Value> {
    let (scores, crash) = (numbers(&case.inputs["uncertainty"]), numbers(&case.inputs["crash"]));
    let crashed: Vec<bool> = crash.iter().map(|crash| *crash == 1.0).collect();
    Some(match path {
        ["auroc"] => json!(auroc(&scores, &crashed)),
        ["average_precision"] => json!(average_precision(&scores, &crashed)),
        ["pearson"] => json!(pearson(&scores, &crash)),
        ["spearman"] => json!(spearman(&scores, &crash)),
        ["percentile80"] => json!(quantile(&scores, 0.8)),
        ["crash_rate_above_p80"] => json!(rate_above(&scores, &crashed, 0.8)),
        _ => return None,
    })
}

fn paired(case: &Case, path: &[&str]) -> Option<Value> {
    let (a, b) = (numbers(&case.inputs["a"]), numbers(&case.inputs["b"]));
    let test = TTest::paired(&a, &b);
    Some(match path {
        ["t"] => json!(test.t),
        ["p"] => json!(test.p_two_sided()),
        ["wilcoxon_w"] => json!(wilcoxon(&a, &b).0),
        ["wilcoxon_p"] => json!(wilcoxon(&a, &b).1),
        ["sign_flip_exact_p"] => json!(sign_flip_p(&a, &b)),
        _ => return None,
    })
}

fn successes(case: &Case, path: &[&str]) -> Option<Value> {
    let whole = |name: &str| {
        let wanted = number(&case.inputs[name]);
        (0..1000).find(|n| real(*n) == wanted)
    };
    let (k, n) = (whole("k")?, whole("n")?);
    match path {
        ["p"] => Some(json!(real(k) / real(n))),
        ["ci95"] => Some(json!(wilson(k, n, 0.95))),
        _ => None,
    }
}
