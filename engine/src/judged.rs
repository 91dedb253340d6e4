//! Claims as objects, one each, as other programs read them.

use ivx_op::{Finding, Outcome as Verdict};
use serde_json::{Value, json};

use crate::results::{Claim, Results, confidence};
use crate::tidy::number;
use crate::told::{reason, verdict};

/// The claims of all experiments as a list of objects, in order of experiments and words.
///
/// What is not there is `null`, and what is no number of JSON is `"NaN"`, `"Infinity"` or `"-Infinity"`. The
/// difference, its interval and the number of seeds are those of a claim that is judged at one coordinate; `findings`
/// has those of every coordinate. `family` is what the claim amounts to among those that it is corrected with.
#[must_use]
pub fn judged(results: &Results) -> String {
    let claims = results.experiments.iter().flat_map(|(experiment, found)| {
        found.claims.iter().map(move |(words, claim)| object(experiment, words, claim).to_string())
    });
    format!("[\n{}\n]\n", claims.collect::<Vec<_>>().join(",\n"))
}

fn object(experiment: &str, words: &str, claim: &Claim) -> Value {
    let one = match &claim.findings[..] {
        [one] => Some(one),
        _ => None,
    };
    let family = claim.corrected.map(|corrected| {
        json!({
            "of": corrected.of,
            "p": number(corrected.p),
            "adjusted": number(corrected.adjusted),
            "verdict": verdict(Some(corrected.outcome)),
        })
    });
    json!({
        "experiment": experiment,
        "claim": words,
        "comparison": claim.claim,
        "verdict": verdict(claim.outcome),
        "difference": one.map(|one| number(one.estimate)),
        "low": one.and_then(|one| one.interval).map(|(low, _)| number(low)),
        "high": one.and_then(|one| one.interval).map(|(_, high)| number(high)),
        "n": one.map(|one| one.n),
        "confidence": confidence(claim),
        "family": family,
        "marks": claim.marks,
        "findings": claim.findings.iter().map(finding).collect::<Vec<_>>(),
    })
}

fn finding(finding: &Finding) -> Value {
    let at = finding.at.iter().map(|(axis, label)| (axis.clone(), label.as_str().into())).collect();
    let undecided = finding.outcome == Verdict::Undecided;
    let (low, high) = (finding.interval.map(|ends| ends.0), finding.interval.map(|ends| ends.1));
    json!({
        "at": Value::Object(at),
        "verdict": verdict(Some(finding.outcome)),
        "difference": number(finding.estimate),
        "low": low.map(number),
        "high": high.map(number),
        "n": finding.n,
        "within": number(finding.within),
        "p_holds": finding.p.map(|(holds, _)| number(holds)),
        "p_fails": finding.p.map(|(_, fails)| number(fails)),
        "missing": finding.missing,
        "why": undecided.then(|| reason(finding)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::{Corrected, ExperimentResults};

    fn told(claims: &[(&str, Claim)]) -> Vec<Value> {
        let claims = claims.iter().map(|(words, claim)| ((*words).to_owned(), claim.clone()));
        let found = ExperimentResults { claims: claims.collect(), ..ExperimentResults::default() };
        let results = Results { experiments: [("e".into(), found)].into(), ..Results::default() };
        serde_json::from_str(&judged(&results)).expect("it is JSON")
    }

    #[test]
    fn one_coordinate_is_told_of_the_claim_itself() {
        let finding = Finding {
            outcome: Verdict::Holds,
            estimate: -0.5,
            interval: Some((f64::NEG_INFINITY, -0.25)),
            n: 8,
            p: Some((0.01, 1.0)),
            ..Finding::default()
        };
        let among = Corrected { of: 3, p: 0.01, adjusted: 0.03, outcome: Verdict::Undecided };
        let claim = Claim {
            claim: "a < b".into(),
            outcome: Some(Verdict::Holds),
            corrected: Some(among),
            marks: vec!["by t".into(), "at 0.99".into()],
            findings: vec![finding],
        };
        let expected = json!({
            "experiment": "e", "claim": "less", "comparison": "a < b", "verdict": "holds",
            "difference": -0.5, "low": "-Infinity", "high": -0.25, "n": 8, "confidence": 0.99,
            "family": { "of": 3, "p": 0.01, "adjusted": 0.03, "verdict": "undecided" },
            "marks": ["by t", "at 0.99"],
            "findings": [{
                "at": {}, "verdict": "holds", "difference": -0.5, "low": "-Infinity", "high": -0.25,
                "n": 8, "within": 0.0, "p_holds": 0.01, "p_fails": 1.0, "missing": [], "why": null,
            }],
        });
        assert_eq!(told(&[("less", claim)]), [expected]);
    }

    #[test]
    fn several_coordinates_and_none_have_no_difference_of_their_own() {
        let finding = |label: &str, estimate| Finding {
            at: vec![("ke".into(), label.into())],
            estimate,
            n: 3,
            ..Finding::default()
        };
        let claim = Claim {
            outcome: Some(Verdict::Undecided),
            findings: vec![finding("WCM", f64::NAN), finding("MA", 1.0)],
            marks: vec!["deterministic".into()],
            ..Claim::default()
        };
        let all = told(&[("not run", Claim::default()), ("several", claim)]);
        assert_eq!([&all[0]["verdict"], &all[1]["verdict"]], ["not run", "undecided"]);
        for claim in &all {
            assert!(
                ["difference", "low", "high", "n", "family"].iter().all(|f| claim[f].is_null())
            );
        }
        assert_eq!((&all[0]["confidence"], &all[1]["confidence"]), (&json!(0.95), &json!(null)));
        assert_eq!(all[0]["findings"], json!([]));
        let [wcm, ma] = [&all[1]["findings"][0], &all[1]["findings"][1]];
        assert_eq!((&wcm["at"]["ke"], &wcm["difference"]), (&json!("WCM"), &json!("NaN")));
        assert_eq!((&ma["difference"], &ma["n"]), (&json!(1.0), &json!(3)));
        assert_eq!(ma["why"], "fewer than 5 seeds decide nothing");
    }
}
