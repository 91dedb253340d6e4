//! What `ivx exec` says at its end: claims, then what was run.

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::time::Duration;

use ivx_cache::Digest;
use ivx_engine::{Claim, Fate, Outcome, Plan, Results, notes, reason, verdict};
use ivx_grammar::ir::Spec;
use ivx_op::{Finding, Outcome as Verdict};

use crate::progress::spell;
use crate::render::visible;

/// Writes the claims in the order of the spec, and how many nodes were executed.
pub(super) fn write(
    spec: &Spec,
    results: &Results,
    plan: &Plan,
    outcome: &Outcome,
    took: Duration,
    out: &mut dyn Write,
) -> io::Result<()> {
    for words in &results.differs {
        writeln!(out, "differs     {}", visible(words))?;
    }
    for experiment in &spec.experiments {
        let found = &results.experiments[&experiment.name];
        if experiment.claims.is_empty() && found.differs.is_empty() {
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
    }
    executed(plan, outcome, took, out)
}

/// Writes how many nodes were executed.
pub(super) fn executed(
    plan: &Plan,
    outcome: &Outcome,
    took: Duration,
    out: &mut dyn Write,
) -> io::Result<()> {
    let count =
        |wanted: fn(&Fate) -> bool| outcome.nodes.iter().filter(|node| wanted(&node.fate)).count();
    let ran = count(|fate| matches!(fate, Fate::Ran { .. }));
    let failed = count(|fate| matches!(fate, Fate::Failed { .. }));
    let skipped = count(|fate| matches!(fate, Fate::Skipped { .. }));
    write!(out, "{ran} of {} nodes executed", plan.graph.node_count())?;
    let (known, equal) = known(outcome);
    if known > 0 {
        write!(out, ", {known} known from earlier runs")?;
    }
    if equal > 0 {
        write!(out, ", {equal} equal to one of these (same operation, same inputs)")?;
    }
    if failed > 0 {
        write!(out, ", {failed} failed, {skipped} skipped because of them")?;
    }
    writeln!(out, " ({})", spell(took))
}

/// How many results were known before, and how many are those of another node that was executed.
fn known(outcome: &Outcome) -> (usize, usize) {
    let ran = outcome.nodes.iter().filter(|node| matches!(node.fate, Fate::Ran { .. }));
    let ran: BTreeSet<Digest> = ran.filter_map(|node| node.key).collect();
    let hits = outcome.nodes.iter().filter(|node| node.fate == Fate::Hit);
    let (equal, known): (Vec<_>, Vec<_>) =
        hits.partition(|node| node.key.is_some_and(|key| ran.contains(&key)));
    (known.len(), equal.len())
}

/// Notes on a claim, behind what is said of it.
pub(super) fn bracketed(notes: &[String]) -> String {
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

fn difference(finding: &Finding) -> String {
    let n = finding.n;
    match &finding.shown()[..] {
        [estimate, low, high] => {
            format!("  difference {estimate} in [{low}, {high}], n = {n}{}", why(finding))
        }
        [estimate, ..] if n > 0 => format!("  difference {estimate}, n = {n}{}", why(finding)),
        _ if finding.outcome == Verdict::Holds => String::new(),
        estimate => format!("  difference {}", estimate.concat()),
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
    fn what_was_not_executed_was_known_or_equals_what_was() {
        let node = |key: u8, fate| ivx_engine::Node {
            key: Some(Digest([key; 32])),
            fate,
            ..ivx_engine::Node::default()
        };
        let ran = Fate::Ran { millis: 1 };
        let nodes = vec![
            node(1, Fate::Hit),
            node(2, Fate::Hit),
            node(2, ran.clone()),
            node(3, ran),
            node(4, Fate::Waiting),
            node(5, Fate::Hit),
            node(2, Fate::Hit),
        ];
        assert_eq!(known(&Outcome { nodes, ..Outcome::default() }), (2, 2));
    }

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
