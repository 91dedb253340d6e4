//! What is told of a claim beside its verdict, in words.

use ivx_grammar::ir::Param;
use ivx_op::{Finding, Outcome as Verdict, shown};

use crate::results::Claim;

/// So many labels of an axis are listed at most.
const MAX_LABELS: usize = 12;

/// Labels of an axis, or how many there are, from which to which.
pub(crate) fn listed(labels: &[String]) -> String {
    match labels {
        [first, .., last] if labels.len() > MAX_LABELS => {
            format!("{} from {first} to {last}", labels.len())
        }
        all => all.join(", "),
    }
}

/// A verdict in a word or two.
#[must_use]
pub fn verdict(outcome: Option<Verdict>) -> String {
    outcome.map_or_else(|| "not run".to_owned(), |outcome| outcome.to_string())
}

/// What a reader is to know of a claim, its verdict aside: one note each.
#[must_use]
pub fn notes(claim: &Claim) -> Vec<String> {
    let mut notes = claim.marks.clone();
    if let Some(corrected) = claim.corrected.filter(|corrected| corrected.of > 1) {
        let (adjusted, n) = (level(corrected.adjusted), corrected.of);
        notes.push(match claim.outcome {
            Some(outcome) if outcome != corrected.outcome => {
                format!("{} among {n} claims, p {adjusted}", corrected.outcome)
            }
            _ => format!("among {n}: p {adjusted}"),
        });
    }
    notes
}

/// How something differs from its source: what its author says of it and of its parameters, and the sizes that were set
/// otherwise.
pub(crate) fn differs(said: &[String], params: &[Param]) -> Vec<String> {
    let mut differs = deviations(said, params);
    differs.extend(other_sizes(params));
    differs
}

/// What an author says of how something and its parameters differ from their source.
pub(crate) fn deviations(said: &[String], params: &[Param]) -> Vec<String> {
    let mut all = said.to_vec();
    for param in params {
        all.extend(param.deviations.iter().map(|words| format!("{}: {words}", param.name)));
    }
    all
}

/// The sizes that were set otherwise than by default; none if all are as there.
pub(crate) fn other_sizes(params: &[Param]) -> Option<String> {
    let sizes = params.iter().filter(|param| param.value != param.default);
    let sizes =
        sizes.map(|param| format!("{} = {} for {}", param.name, param.value, param.default));
    let sizes: Vec<String> = sizes.collect();
    if sizes.is_empty() { None } else { Some(format!("other sizes: {}", sizes.join(", "))) }
}

/// Why a finding is undecided, and how many seeds would decide it; empty where it is not.
#[must_use]
pub fn reason(finding: &Finding) -> String {
    if finding.outcome != Verdict::Undecided {
        return String::new();
    }
    match &finding.missing[..] {
        [] => {}
        [seed] if seed.is_empty() => return "something that it compares is missing".to_owned(),
        [seed] => return format!("seed {seed} is missing"),
        seeds => return format!("seeds {} are missing", listed(seeds)),
    }
    if finding.lacks_seeds() {
        return format!("fewer than {} seeds decide nothing", Finding::MIN_SEEDS);
    }
    let mut reasons = Vec::new();
    if finding.too_few {
        reasons.push("too few seeds for such differences".to_owned());
    }
    reasons.extend(
        finding.smallest.map(|least| format!("{} could have been told", shown(round(least)))),
    );
    reasons.extend(finding.enough.map(|n| format!("about {} seeds would tell this", roughly(n))));
    reasons.join(", ")
}

/// A level of significance: what is nearly none is below.
fn level(p: f64) -> String {
    if p < 1e-4 { "< 0.0001".to_owned() } else { format!("= {}", shown(round(p))) }
}

/// Upwards to two digits.
fn roughly(n: usize) -> usize {
    let unit = (2..19).take_while(|power| n >= 10_usize.saturating_pow(*power)).last();
    let unit = unit.map_or(1, |power| 10_usize.pow(power - 1));
    n.div_ceil(unit) * unit
}

/// To two digits.
fn round(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use ivx_op::Lit;

    use super::*;
    use crate::results::Corrected;

    #[test]
    fn numbers_are_rounded_so_that_nothing_is_promised() {
        assert_eq!([1, 9, 62, 99, 101, 627, 12_345].map(roughly), [1, 9, 62, 99, 110, 630, 13_000]);
        assert_eq!([0.5, 0.0123, 1e-9].map(level), ["= 0.5", "= 0.012", "< 0.0001"]);
    }

    #[test]
    fn what_is_undecided_says_why() {
        let finding = Finding {
            n: 8,
            too_few: true,
            smallest: Some(0.123),
            enough: Some(127),
            ..Finding::default()
        };
        let told = "too few seeds for such differences, 0.12 could have been told, \
                    about 130 seeds would tell this";
        assert_eq!(reason(&finding), told);
        assert_eq!(reason(&Finding { outcome: Verdict::Fails, ..finding }), "");
        let missing = |seeds: &[&str]| {
            let missing = seeds.iter().map(ToString::to_string).collect();
            reason(&Finding { n: 3, missing, ..Finding::default() })
        };
        assert_eq!(missing(&["4"]), "seed 4 is missing");
        assert_eq!(missing(&["2", "4"]), "seeds 2, 4 are missing");
        assert_eq!(missing(&[""]), "something that it compares is missing");
        let few = Finding { n: 3, ..Finding::default() };
        assert_eq!(reason(&few), "fewer than 5 seeds decide nothing");
    }

    #[test]
    fn a_verdict_that_changes_among_others_is_told() {
        let corrected = |outcome| Corrected { of: 3, p: 0.02, adjusted: 0.06, outcome };
        let claim = |among| Claim {
            outcome: Some(Verdict::Holds),
            corrected: Some(corrected(among)),
            marks: vec!["by t".to_owned()],
            ..Claim::default()
        };
        assert_eq!(
            notes(&claim(Verdict::Undecided)),
            ["by t", "undecided among 3 claims, p = 0.06"]
        );
        assert_eq!(notes(&claim(Verdict::Holds)), ["by t", "among 3: p = 0.06"]);
    }

    #[test]
    fn deviations_and_other_sizes_are_told() {
        let param = |name: &str, value: i64, words: &[&str]| Param {
            name: name.to_owned(),
            docs: String::new(),
            value: Lit::Int(value),
            by: String::new(),
            default: Lit::Int(64),
            deviations: words.iter().map(ToString::to_string).collect(),
        };
        let params = [param("members", 16, &["fewer, since it is slow"]), param("n", 64, &[])];
        let told = differs(&["a finer grid".to_owned()], &params);
        let expected = [
            "a finer grid",
            "members: fewer, since it is slow",
            "other sizes: members = 16 for 64",
        ];
        assert_eq!(told, expected);
    }
}
