//! How much distributions of values disagree, and policies that act on it.

use ivx_math::disagreement::{decreasing, increasing, jensen_shannon, mixture};
use ivx_math::moments::uniform;
use ivx_math::policy::{mix_logits, mix_probabilities, shares};
use serde_json::{Value, json};

use crate::harness::{Case, check, number, numbers, rows};

#[test]
fn golden_js_divergence_mixing() {
    check("js_divergence_mixing", |case, path| match case.kind.as_str() {
        "jsd" => divergence(case, path),
        "ive_policy_mixing" => mixed(case, path),
        _ => None,
    });
}

fn divergence(case: &Case, path: &[&str]) -> Option<Value> {
    let distributions = rows(&case.inputs["value_distributions_nxM"]);
    let n = distributions.len();
    let weights = match path[0] {
        "uni" => uniform(n),
        "dec" => decreasing(n),
        "inc" => increasing(n),
        "pairwise_01_half" => {
            return Some(json!(jensen_shannon(&distributions[..2], &[0.5, 0.5])));
        }
        _ => return None,
    };
    match path[1] {
        "weights" => Some(json!(weights)),
        "jsd" => Some(json!(jensen_shannon(&distributions, &weights))),
        "mean" => Some(json!(mixture(&distributions, &weights))),
        _ => None,
    }
}

fn mixed(case: &Case, path: &[&str]) -> Option<Value> {
    let inputs = &case.inputs;
    let (policy, logits) = (numbers(&inputs["pi"]), numbers(&inputs["logits"]));
    let signal = numbers(&inputs["sigma_ive_per_action"]);
    let in_probs =
        |signal: &[f64]| mix_probabilities(&policy, signal, number(&inputs["beta_prob"]));
    let in_logits =
        |sign: f64| json!(mix_logits(&logits, &signal, sign * number(&inputs["beta_logit"])));
    match path {
        ["prob_mix_unnormalised"] => Some(json!(in_probs(&signal))),
        ["prob_mix_normalised"] => Some(json!(shares(&in_probs(&signal)))),
        ["prob_mix_signal_normalised"] => Some(json!(in_probs(&shares(&signal)))),
        ["logit_mix"] => Some(in_logits(1.0)),
        ["logit_mix_pessimistic"] => Some(in_logits(-1.0)),
        _ => None,
    }
}
