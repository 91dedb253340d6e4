//! Claims that are judged together: the more of them, the less each can be believed by itself.

use std::collections::BTreeMap;

use ivx_grammar::ir::{Mark, Spec};
use ivx_op::{Outcome as Verdict, holm};

use crate::results::{Claim, Corrected, Results};

/// Corrects the verdicts of each family by Holm: the claims of an experiment, or those of all experiments that name it.
///
/// What no chance is in is in no family: what is deterministic, is told of these seeds alone, or cannot fail.
pub(crate) fn correct(spec: &Spec, results: &mut Results) {
    let mut families: BTreeMap<(&str, &str), Vec<Member<'_>>> = BTreeMap::new();
    for experiment in &spec.experiments {
        for claim in &experiment.claims {
            let (judged, words) = (&claim.judged, claim.output.name.as_str());
            let found = &results.experiments[&experiment.name].claims[words];
            let apart = [Mark::Deterministic, Mark::OfTheseSeeds, Mark::CannotFail];
            if apart.iter().any(|mark| judged.marks.contains(mark)) || found.outcome.is_none() {
                continue;
            }
            let family = match &judged.family {
                Some(family) => ("", family.as_str()),
                None => (experiment.name.as_str(), ""),
            };
            let (experiment, confidence) = (experiment.name.as_str(), judged.confidence);
            families.entry(family).or_default().push(Member { experiment, words, confidence });
        }
    }
    for members in families.values() {
        let levels: Vec<f64> = members.iter().map(|member| level(member.claim(results))).collect();
        for (member, (p, adjusted)) in members.iter().zip(levels.iter().zip(holm(&levels))) {
            let claim = member.claim(results);
            let kept = claim.outcome.filter(|_| adjusted <= 1.0 - member.confidence);
            let outcome = kept.unwrap_or(Verdict::Undecided);
            claim.corrected = Some(Corrected { of: members.len(), p: *p, adjusted, outcome });
        }
    }
}

/// A claim of a family.
struct Member<'a> {
    experiment: &'a str,
    words: &'a str,
    confidence: f64,
}

impl Member<'_> {
    fn claim<'r>(&self, results: &'r mut Results) -> &'r mut Claim {
        let found = results.experiments.get_mut(self.experiment);
        let claim = found.and_then(|found| found.claims.get_mut(self.words));
        claim.expect("claims are found before they are corrected")
    }
}

/// The level of the two-sided test at which a claim would be decided as it is, or as it nearly is: it holds where it
/// does at each coordinate, and fails where it does at one of so many.
fn level(claim: &Claim) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "coordinates number far below 2^53")]
    let n = claim.findings.len() as f64;
    let each = claim.findings.iter().map(|finding| match (finding.p, finding.outcome) {
        (Some(p), _) => p,
        (None, Verdict::Holds) => (0.0, 1.0),
        (None, Verdict::Fails) => (1.0, 0.0),
        (None, _) => (1.0, 1.0),
    });
    let (holds, fails) = each.fold((0.0_f64, 1.0_f64), |(holds, fails), (hold, fail)| {
        (holds.max(hold), fails.min(fail))
    });
    let fails = (fails * n).min(1.0);
    match claim.outcome {
        Some(Verdict::Holds) => holds,
        Some(Verdict::Fails) => fails,
        _ => holds.min(fails),
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::Finding;

    use super::*;

    fn claim(outcome: Verdict, ps: &[(f64, f64)]) -> Claim {
        let finding = |p: &(f64, f64)| Finding { p: Some(*p), outcome, ..Finding::default() };
        let findings = ps.iter().map(finding).collect();
        Claim { outcome: Some(outcome), findings, ..Claim::default() }
    }

    #[test]
    fn all_must_hold_and_one_of_so_many_fails() {
        assert_eq!(level(&claim(Verdict::Holds, &[(0.01, 1.0), (0.03, 1.0)])), 0.03);
        assert_eq!(level(&claim(Verdict::Fails, &[(1.0, 0.01), (0.01, 1.0), (1.0, 0.4)])), 0.03);
        assert_eq!(level(&claim(Verdict::Undecided, &[(0.2, 1.0)])), 0.2);
    }
}
