//! Certainty and knowledge equivalents.

use ivx_library::ce::{Bcu, CertaintyEquivalent, Eu, LowerMean, Mvu, UpperMean, Wcu};
use ivx_library::ke::{Bcm, Cvar, KnowledgeEquivalent, Ma, MeanStd, Mvm, Wcm};
use ivx_library::planner::{Decide, Utility, equivalents};
use ivx_math::moments::{sample_variance, uniform, weighted_variance};
use ivx_math::order::argmax;
use ivx_op::{Ctx, Op};
use ivx_world::{BeliefOver, Boxes, Discrete};
use serde_json::{Value, json};

use crate::harness::{Case, check, numbers, parameter, rows, text};

#[test]
fn golden_certainty_knowledge_equivalents() {
    check("certainty_knowledge_equivalents", |case, path| match case.kind.as_str() {
        "ce" => ce(case, path),
        "ce_table" => ce_table(case, path),
        "ke" => ke(case, path),
        "ke_over_ce" => ke_over_ce(case, path),
        "rip_select" => rip_select(case, path),
        _ => None,
    });
}

fn ce_named(key: &str) -> Option<Box<dyn CertaintyEquivalent>> {
    if let Some(beta) = parameter(key, "mvu") {
        return Some(Box::new(Mvu { beta }));
    }
    if let Some(alpha) = parameter(key, "cvar_lower") {
        return Some(Box::new(LowerMean { alpha }));
    }
    if let Some(alpha) = parameter(key, "cvar_upper") {
        return Some(Box::new(UpperMean { alpha }));
    }
    match key {
        "eu" => Some(Box::new(Eu {})),
        "wcu" => Some(Box::new(Wcu {})),
        "bcu" => Some(Box::new(Bcu {})),
        _ => None,
    }
}

pub(crate) fn ke_named(key: &str) -> Option<Box<dyn KnowledgeEquivalent>> {
    if let Some(xi) = parameter(key, "mvm") {
        return Some(Box::new(Mvm { xi }));
    }
    if let Some(beta) = parameter(key, "mean_plus_beta_std") {
        return Some(Box::new(MeanStd { beta }));
    }
    if let Some(alpha) = parameter(key, "cvar_lower") {
        return Some(Box::new(Cvar { alpha }));
    }
    match key {
        "ma" => Some(Box::new(Ma {})),
        "wcm" => Some(Box::new(Wcm {})),
        "bcm" => Some(Box::new(Bcm {})),
        _ => None,
    }
}

fn ce(case: &Case, path: &[&str]) -> Option<Value> {
    let (xs, ps) = (numbers(&case.inputs["values"]), numbers(&case.inputs["probs"]));
    match path {
        ["var"] => Some(json!(weighted_variance(&xs, &ps))),
        [key] => Some(json!(ce_named(key)?.value(&xs, &ps))),
        _ => None,
    }
}

fn ce_table(case: &Case, path: &[&str]) -> Option<Value> {
    let ["rows", i, key] = path else { return None };
    let label = text(&case.expected["rows"][i.parse::<usize>().ok()?]["ce"]);
    // Such as `risk_averse_MVU(-0.5)`: an attitude, then a name, then perhaps a parameter.
    let name = label.rsplit('_').next()?.to_lowercase().replace(['(', ')'], " ");
    let ce = ce_named(&name.split_whitespace().collect::<Vec<_>>().join("_"))?;

    let belief = |side: &str| {
        let side = &case.inputs[side];
        let (outcomes, probabilities) = (numbers(&side["x"]), numbers(&side["p"]));
        let models = vec![Box::new(Discrete { outcomes, probabilities }) as _];
        Box::new(BeliefOver { models, weights: vec![] })
    };
    let problem = Box::new(Boxes { left: belief("left"), right: belief("right") });
    let ke = Box::new(Ma {});
    let ctx = Ctx::new("", 0, None);
    let place = usize::from(key.ends_with("right"));
    match *key {
        "ce" => Some(json!(label)),
        "u_left" | "u_right" => {
            let utility = Utility { problem, ce, ke }.run(&ctx).ok()?;
            Some(json!(utility.values[place]))
        }
        "pi_left" | "pi_right" => {
            let policy = Decide { problem, ce, ke }.run(&ctx).ok()?;
            Some(json!(policy.values[place]))
        }
        _ => None,
    }
}

fn ke(case: &Case, path: &[&str]) -> Option<Value> {
    let scores = rows(&case.inputs["scores_KxA"]);
    let weights = match &case.inputs["weights"] {
        Value::Null => uniform(scores.len()),
        weights => numbers(weights),
    };
    let column = |a: usize| scores.iter().map(|row| row[a]).collect::<Vec<f64>>();
    let each = |f: &dyn Fn(&[f64]) -> f64| {
        (0..scores[0].len()).map(|a| f(&column(a))).collect::<Vec<f64>>()
    };
    let reduced = |ke: &dyn KnowledgeEquivalent| each(&|scores| ke.reduce(scores, &weights));
    match path {
        ["var_pop"] => Some(json!(each(&|scores| weighted_variance(scores, &weights)))),
        ["std_pop"] => Some(json!(each(&|scores| weighted_variance(scores, &weights).sqrt()))),
        ["var_sample"] => Some(json!(each(&sample_variance))),
        ["argmax", key] => Some(json!(argmax(&reduced(ke_named(key)?.as_ref())))),
        ["grad_wrt_scores_of_action0", key] => {
            Some(json!(ke_named(key)?.gradient(&column(0), &weights)))
        }
        [key] => Some(json!(reduced(ke_named(key)?.as_ref()))),
        _ => None,
    }
}

fn ke_over_ce(case: &Case, path: &[&str]) -> Option<Value> {
    let [ce, key] = path else { return None };
    let ce = ce_named(ce)?;
    let (values, probs) = (rows(&case.inputs["values_KxN"]), rows(&case.inputs["probs_KxN"]));
    let weights = numbers(&case.inputs["posterior_weights"]);
    if *key == "per_model" {
        let per_model = values.iter().zip(&probs).map(|(xs, ps)| ce.value(xs, ps));
        return Some(json!(per_model.collect::<Vec<_>>()));
    }
    let lottery = |(xs, ps): (&Vec<f64>, &Vec<f64>)| {
        Box::new(Discrete { outcomes: xs.clone(), probabilities: ps.clone() }) as _
    };
    let models = || values.iter().zip(&probs).map(lottery).collect();
    let belief = || Box::new(BeliefOver { models: models(), weights: weights.clone() });
    let problem = Box::new(Boxes { left: belief(), right: belief() });
    let ke = ke_named(key)?;
    let ctx = Ctx::new("utility", 0, None);
    Some(json!(Utility { problem, ce, ke }.run(&ctx).ok()?.values[0]))
}

/// Plans scored by models; `ma_log` averages the logarithms.
fn rip_select(case: &Case, path: &[&str]) -> Option<Value> {
    let [key] = path else { return None };
    let scores = rows(&case.inputs["scores_models_x_plans"]);
    let logs: Vec<Vec<f64>> =
        scores.iter().map(|row| row.iter().map(|x| x.ln()).collect()).collect();
    let under = |scores: &[Vec<f64>], ke: &dyn KnowledgeEquivalent| {
        equivalents(&scores.iter().map(Vec::as_slice).collect::<Vec<_>>(), ke)
    };
    match *key {
        "per_model_argmax" => Some(json!(scores.iter().map(|row| argmax(row)).collect::<Vec<_>>())),
        "wcm_scores" => Some(json!(under(&scores, &Wcm {}))),
        "rip_wcm" => Some(json!(argmax(&under(&scores, &Wcm {})))),
        "rip_bcm" => Some(json!(argmax(&under(&scores, &Bcm {})))),
        "rip_ma_log" => Some(json!(argmax(&under(&logs, &Ma {})))),
        "var_of_log_at_selected" => {
            let selected = argmax(&under(&scores, &Wcm {}))?;
            let logs: Vec<f64> = logs.iter().map(|row| row[selected]).collect();
            Some(json!(weighted_variance(&logs, &uniform(logs.len()))))
        }
        _ => None,
    }
}
