//! What became of a claim, in few digits.

use ivx_op::escape::markdown as plain;
use ivx_op::{Finding, Outcome as Verdict, shown_to};

use crate::markdown::code;
use crate::results::Claim;
use crate::told::{notes, reason, verdict};

/// So many digits that count are enough to see how large a difference is; more tell it from what stands beside it.
const DIGITS: i32 = 3;

/// What became of a claim: its verdict, and below it the coordinates at which it does not hold.
pub(super) fn judged(claim: &Claim) -> Vec<String> {
    let notes = match &notes(claim)[..] {
        [] => String::new(),
        notes => format!(" ({})", plain(&notes.join("; "))),
    };
    let outcome = verdict(claim.outcome);
    match &claim.findings[..] {
        [] => vec![format!("**{outcome}**{notes}")],
        [one] => {
            let why = match reason(one) {
                why if why.is_empty() => why,
                why => format!(": {why}"),
            };
            vec![format!("**{outcome}**{}{notes}{why}", difference(one))]
        }
        all => {
            let mut lines = vec![format!("**{outcome}**{}{notes}", at_coordinates(all))];
            let others = all.iter().filter(|finding| finding.outcome != Verdict::Holds);
            lines.extend(others.map(|finding| {
                let at = finding.at.iter();
                let at = at.map(|(axis, label)| format!("{} = {}", code(axis), code(label)));
                let at: Vec<String> = at.collect();
                format!("{} at {}{}", finding.outcome, at.join(", "), difference(finding))
            }));
            lines
        }
    }
}

/// At how many coordinates a claim holds, and between which differences.
fn at_coordinates(all: &[Finding]) -> String {
    let held = all.iter().filter(|finding| finding.outcome == Verdict::Holds);
    let held: Vec<f64> = held.map(|finding| finding.estimate).collect();
    let said = format!(" at {} of {} coordinates", held.len(), all.len());
    let ends = held.iter().copied().map(|x| (x, x));
    let ends = ends.reduce(|(low, high), (x, _)| (low.min(x), high.max(x)));
    let n = all.iter().map(|finding| finding.n).min().unwrap_or(0);
    match ends.filter(|_| n > 0) {
        Some((low, high)) => {
            let ends = shown_to(DIGITS, &[low, high]);
            let between = if low == high { ends[0].clone() } else { ends.join(" to ") };
            format!("{said}, difference {between}, n = {n}")
        }
        None => said,
    }
}

/// The difference with its interval, and over how many seeds; nothing where a claim is true for certain.
fn difference(finding: &Finding) -> String {
    let Finding { n, outcome, estimate, interval, within, .. } = finding;
    if interval.is_none() && *n == 0 && *outcome == Verdict::Holds {
        return String::new();
    }
    let seeds = if *n > 0 { format!(", n = {n}") } else { String::new() };
    let Some((low, high)) = interval else {
        return format!(", difference {}{seeds}", shown_to(DIGITS, &[*estimate])[0]);
    };
    // What counts as equal decides, and so is to be told from the ends.
    let mut numbers = vec![*estimate, *low, *high];
    numbers.extend([-within, *within].into_iter().filter(|bound| *bound != 0.0));
    let shown = shown_to(DIGITS, &numbers);
    let [estimate, low, high] = [0, 1, 2].map(|i| shown[i].replace("inf", "∞"));
    format!(", difference {estimate} in [{low}, {high}]{seeds}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_that_do_not_hold_are_told() {
        let finding = |label: &str, outcome, estimate| Finding {
            at: vec![("ke".into(), label.into())],
            outcome,
            estimate,
            interval: Some((-1.0, 1.0)),
            n: 8,
            ..Finding::default()
        };
        let findings = vec![
            finding("WCM", Verdict::Holds, -0.512_345),
            finding("MA", Verdict::Holds, -0.25),
            finding("BCM", Verdict::Fails, 0.25),
        ];
        let claim = Claim { outcome: Some(Verdict::Fails), findings, ..Claim::default() };
        let told = [
            "**fails** at 2 of 3 coordinates, difference -0.512 to -0.25, n = 8",
            "fails at `ke` = `BCM`, difference 0.25 in [-1, 1], n = 8",
        ];
        assert_eq!(judged(&claim), told);
    }
}
