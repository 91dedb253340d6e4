//! What became of the claims, all on one table.

use ivx_grammar::ir::Spec;
use ivx_op::{Finding, Outcome as Verdict};

use super::text::{code, escape, prose, typeset};
use super::{Kind, badge, kind, kind_of};
use crate::results::{Claim, Report};
use crate::told::{notes, reason};

/// So many coordinates of a claim are shown at once; more on demand.
const SHOWN: usize = 8;

/// The size of a picture of an interval, in pixels.
const SIZE: (f64, f64) = (140.0, 18.0);

/// All claims: verdict, words, and what was measured, in a picture and in numbers.
pub(super) fn table(spec: &Spec, report: &Report) -> String {
    let mut rows = String::new();
    for (i, experiment) in spec.experiments.iter().enumerate() {
        let claims = &report.results.experiments[&experiment.name].claims;
        if experiment.claims.is_empty() {
            continue;
        }
        if spec.experiments.len() > 1 {
            rows.extend([
                format!("<tr class=\"of\"><th colspan=\"3\" scope=\"rowgroup\"><a href=\"#e{i}\">"),
                escape(&experiment.name),
                "</a></th></tr>\n".to_owned(),
            ]);
        }
        for claim in &experiment.claims {
            let output = &claim.output;
            rows += &row(&output.name, &output.docs, &claims[&output.name]);
        }
    }
    if rows.is_empty() {
        return String::new();
    }
    format!(
        "<section id=\"claims\"><h2>Claims</h2>\n<p>A claim over seeds holds, or fails, when the interval of its paired \
         difference lies on one side; else it is undecided. The line through each picture is no difference. \
         Of several claims judged together (Holm), the verdict among them stands below that by itself.</p>\n\
         <div class=\"wide\"><table class=\"claims\"><thead><tr><th scope=\"col\">Verdict</th><th scope=\"col\">Claim</th>\
         <th scope=\"col\">Difference and interval</th></tr></thead><tbody>\n{rows}</tbody></table></div></section>"
    )
}

fn row(words: &str, docs: &str, claim: &Claim) -> String {
    let noted: Vec<String> = notes(claim)
        .iter()
        .map(|note| format!("<div class=\"note\">{}</div>", escape(note)))
        .collect();
    let docs = if docs.trim().is_empty() { String::new() } else { prose(docs) };
    format!(
        "<tr><td>{}{}</td><td><div>{}</div><div class=\"source\">{}</div>{docs}</td><td>{}</td></tr>\n",
        badge(kind(claim), true),
        noted.concat(),
        escape(words),
        code(&claim.claim),
        findings(claim)
    )
}

fn findings(claim: &Claim) -> String {
    let scale = scale(&claim.findings);
    match &claim.findings[..] {
        [] => String::new(),
        [one] => finding(one, scale),
        all => {
            let held = all.iter().filter(|one| one.outcome == Verdict::Holds).count();
            let each = all.iter().map(|one| {
                let at = one.at.iter().map(|(axis, label)| format!("{axis} = {label}"));
                let at: Vec<String> = at.collect();
                let badge = badge(kind_of(one.outcome), false);
                let (at, found) = (code(&at.join(", ")), finding(one, scale));
                // A picture wants a line of its own.
                let tag = if found.starts_with("<svg") { "div" } else { "span" };
                format!("<li>{badge} {at} <{tag} class=\"measured\">{found}</{tag}></li>")
            });
            let list = format!("<ul class=\"plain\">{}</ul>", each.collect::<String>());
            let short = format!("at {held} of {} coordinates", all.len());
            if all.len() > SHOWN {
                format!("<details><summary>{short}</summary>{list}</details>")
            } else {
                format!("<div>{short}</div>{list}")
            }
        }
    }
}

/// From the lowest to the highest number among the findings and 0.
fn scale(findings: &[Finding]) -> (f64, f64) {
    let ends = findings.iter().flat_map(|one| {
        let (low, high) = one.interval.unwrap_or((one.estimate, one.estimate));
        [low, high, one.estimate]
    });
    ends.filter(|x| x.is_finite()).fold((0.0, 0.0), |(low, high), x| (low.min(x), high.max(x)))
}

/// What was measured: a picture where there is an interval, and the numbers.
fn finding(finding: &Finding, scale: (f64, f64)) -> String {
    let Finding { estimate, interval, n, outcome, .. } = finding;
    if interval.is_none() && *n == 0 && *outcome == Verdict::Holds && *estimate == 0.0 {
        return String::new();
    }
    let seeds = if *n > 0 { format!(", n = {n}") } else { String::new() };
    let why = match reason(finding) {
        why if why.is_empty() => why,
        why => format!(": {}", escape(&why)),
    };
    let measured = match &finding.shown().iter().map(|number| typeset(number)).collect::<Vec<_>>()[..]
    {
        [estimate, low, high] => format!("{estimate} in [{low}, {high}]"),
        estimate => estimate.concat(),
    };
    let picture =
        interval.map_or_else(String::new, |ends| picture(*estimate, ends, scale, *outcome));
    format!("{picture}<span class=\"numbers\">{measured}{seeds}{why}</span>")
}

/// The interval as a line, the estimate as a dot, and no difference as a line through all.
fn picture(estimate: f64, (low, high): (f64, f64), scale: (f64, f64), outcome: Verdict) -> String {
    if !estimate.is_finite() || low.is_nan() || high.is_nan() || scale.1 <= scale.0 {
        return String::new();
    }
    let (wide, tall) = SIZE;
    let at = |x: f64| {
        // An open end reaches to the edge.
        if x.is_infinite() {
            return if x > 0.0 { wide } else { 0.0 };
        }
        let share = (x / 2.0 - scale.0 / 2.0) / (scale.1 / 2.0 - scale.0 / 2.0);
        share * (wide - 16.0) + 8.0
    };
    let [left, right, dot, zero] = [low, high, estimate, 0.0].map(at);
    let middle = tall / 2.0;
    let cap = |x: f64, at: f64| {
        if x.is_finite() { format!("M{at:.1} 4V14") } else { String::new() }
    };
    let (below, above) = (cap(low, left), cap(high, right));
    let class = match kind_of(outcome) {
        Kind::Holds => "holds",
        Kind::Fails => "fails",
        _ => "undecided",
    };
    format!(
        "<svg class=\"interval {class}\" width=\"{wide}\" height=\"{tall}\" aria-hidden=\"true\">\
         <path class=\"zero\" d=\"M{zero:.1} 0V{tall}\"/>\
         <path d=\"M{left:.1} {middle}H{right:.1}{below}{above}\"/>\
         <circle cx=\"{dot:.1}\" cy=\"{middle}\" r=\"3.5\"/></svg>"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(n: usize) -> Claim {
        let finding = |i: usize| Finding {
            at: vec![("ke".to_owned(), format!("<{i}>"))],
            outcome: if i == 0 { Verdict::Fails } else { Verdict::Holds },
            estimate: 0.5,
            interval: Some((0.25, 0.75)),
            n: 8,
            ..Finding::default()
        };
        let findings = (0..n).map(finding).collect();
        Claim { claim: "a < b".into(), outcome: Some(Verdict::Fails), findings, ..Claim::default() }
    }

    #[test]
    fn a_claim_shows_what_was_measured() {
        let found = row("less <than>", "", &claim(1));
        for text in ["fails", "less &lt;than&gt;", "a &lt; b", "0.5 in [0.25, 0.75], n = 8", "<svg"]
        {
            assert!(found.contains(text), "{text} in {found}");
        }
        // The scale reaches from 0 to 0.75 over 124 pixels from 8 on.
        assert!(found.contains("cx=\"90.7\"") && found.contains("M8.0 0V18"), "{found}");
    }

    #[test]
    fn each_coordinate_is_listed_and_many_on_demand() {
        let found = row("words", "", &claim(3));
        assert!(found.contains("at 2 of 3 coordinates") && !found.contains("<details"), "{found}");
        assert_eq!(found.matches("<li>").count(), 3);
        assert!(found.contains("ke = &lt;2&gt;"), "{found}");
        assert!(row("words", "", &claim(9)).contains("<details><summary>at 8 of 9 coordinates"));
    }
}
