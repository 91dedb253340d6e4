//! What `ivx exec` says at its end: claims, then what was run.

use std::collections::BTreeMap;
use std::io::{self, Write};

use ivx_engine::{Claim, Results, notes, reason, verdict};
use ivx_op::{Finding, Outcome as Verdict};
use serde_json::{Value, json};

use super::measured;
use crate::account::Account;
use crate::progress::spell;
use crate::render::visible;

/// Writes the claims in the order of the spec, the measures that none of them mentions, and how many nodes were
/// executed.
///
/// - `unclaimed`: the names of such measures, by experiment.
pub(super) fn write(
    run: &Account<'_>,
    results: &Results,
    unclaimed: &BTreeMap<String, Vec<String>>,
    out: &mut dyn Write,
) -> io::Result<()> {
    for words in &results.differs {
        writeln!(out, "differs     {}", visible(words))?;
    }
    for experiment in &run.spec.experiments {
        let found = &results.experiments[&experiment.name];
        let unclaimed = unclaimed.get(&experiment.name).map_or(&[][..], Vec::as_slice);
        if experiment.claims.is_empty() && found.differs.is_empty() && unclaimed.is_empty() {
            continue;
        }
        writeln!(out, "{}", experiment.name)?;
        for words in &found.differs {
            writeln!(out, "  differs   {}", visible(words))?;
        }
        let claims = &found.claims;
        for own in &experiment.claims {
            claim(&own.output.name, &claims[&own.output.name], out)?;
        }
        for name in unclaimed {
            measured::write(name, &found.measures[name], out)?;
        }
    }
    executed(run, out)
}

/// What came out, for programs: the verdicts, how many nodes were executed, and where results and report lie.
pub(super) fn as_json(run: &Account<'_>, results: &Results, [file, report]: &[String; 2]) -> Value {
    let claims = run.spec.experiments.iter().flat_map(|experiment| {
        let found = &results.experiments[&experiment.name].claims;
        experiment.claims.iter().map(move |claim| (&experiment.name, &claim.output.name, found))
    });
    let claims = claims.map(|(experiment, words, found)| {
        let outcome = found[words]
            .outcome
            .map_or_else(|| "no result".to_owned(), |outcome| outcome.to_string());
        json!({ "experiment": experiment, "claim": words, "outcome": outcome })
    });
    let nodes = run.nodes();
    json!({
        "event": "ended",
        "claims": claims.collect::<Vec<_>>(),
        "nodes": nodes.all,
        "executed": nodes.executed,
        "failed": nodes.failed,
        "skipped": nodes.skipped,
        "results": file,
        "report": report,
    })
}

/// Writes how many nodes were executed.
pub(super) fn executed(run: &Account<'_>, out: &mut dyn Write) -> io::Result<()> {
    let (nodes, n_equal) = (run.nodes(), run.n_equal());
    write!(out, "{} of {} nodes executed", nodes.executed, nodes.all)?;
    if nodes.hit > n_equal {
        write!(out, ", {} known from earlier runs", nodes.hit - n_equal)?;
    }
    if n_equal > 0 {
        write!(out, ", {n_equal} equal to one of these (same operation, same inputs)")?;
    }
    if nodes.failed > 0 {
        write!(out, ", {} failed, {} skipped because of them", nodes.failed, nodes.skipped)?;
    }
    writeln!(out, " ({})", spell(run.took))
}

/// Notes on a claim, behind what is said of it.
pub(crate) fn bracketed(notes: &[String]) -> String {
    if notes.is_empty() { String::new() } else { format!("  [{}]", notes.join("; ")) }
}

/// Where a finding is, if it is one of several.
pub(super) fn at(finding: &Finding) -> String {
    let at = finding.at.iter().map(|(axis, label)| format!("{axis} = {}", visible(label)));
    let at: Vec<String> = at.collect();
    if at.is_empty() { String::new() } else { format!(" at {}", at.join(", ")) }
}

/// One line a claim, and one for each coordinate at which it does not hold.
fn claim(words: &str, claim: &Claim, out: &mut dyn Write) -> io::Result<()> {
    let notes = bracketed(&notes(claim));
    let words = visible(words);
    let outcome = verdict(claim.outcome);
    let held = claim.findings.iter().filter(|finding| finding.outcome == Verdict::Holds);
    match &claim.findings[..] {
        [] => writeln!(out, "  {outcome:<9} {words}{notes}"),
        [one] => writeln!(out, "  {outcome:<9} {words}{}{notes}", difference(one)),
        all => {
            writeln!(
                out,
                "  {outcome:<9} {words}  at {} of {} coordinates{notes}",
                held.count(),
                all.len()
            )?;
            for finding in all.iter().filter(|finding| finding.outcome != Verdict::Holds) {
                let (at, difference) = (at(finding), difference(finding));
                writeln!(out, "            {}{at}{difference}", finding.outcome)?;
            }
            Ok(())
        }
    }
}

/// What was found, behind what is said of it.
pub(crate) fn difference(finding: &Finding) -> String {
    let n = finding.n;
    match &finding.shown()[..] {
        [estimate, low, high] => {
            format!("  difference {estimate} in [{low}, {high}], n = {n}{}", why(finding))
        }
        [estimate, ..] if n > 0 => format!("  difference {estimate}, n = {n}{}", why(finding)),
        _ if finding.outcome == Verdict::Holds => String::new(),
        estimate => format!("  difference {}{}", estimate.concat(), why(finding)),
    }
}

fn why(finding: &Finding) -> String {
    match reason(finding) {
        reason if reason.is_empty() => reason,
        reason => format!(": {reason}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_title_holds_stays_on_its_line() {
        let held = Claim { outcome: Some(Verdict::Holds), ..Claim::default() };
        let mut out = Vec::new();
        claim("a\n\u{1b}[2Jb \"é\"\t\u{202e}", &held, &mut out).expect("vectors take everything");
        let expected = "  holds     a\\n\\u{1b}[2Jb \"é\"\\t\\u{202e}\n";
        assert_eq!(String::from_utf8_lossy(&out), expected);
    }

    #[test]
    fn coordinates_that_do_not_hold_are_listed() {
        let finding = |label: &str, outcome, estimate| Finding {
            at: vec![("ke".into(), label.into())],
            outcome,
            estimate,
            interval: Some((-1.0, 1.0)),
            n: 8,
            ..Finding::default()
        };
        let found = Claim {
            claim: "a < b".into(),
            outcome: Some(Verdict::Fails),
            findings: vec![
                finding("WCM", Verdict::Holds, -0.5),
                finding("BCM", Verdict::Fails, 0.25),
            ],
            ..Claim::default()
        };
        let mut out = Vec::new();
        claim("less", &found, &mut out).expect("vectors take everything");
        let expected = "  fails     less  at 1 of 2 coordinates\n            fails at ke = BCM  difference 0.25 in [-1, 1], n = 8\n";
        assert_eq!(String::from_utf8_lossy(&out), expected);
    }
}
