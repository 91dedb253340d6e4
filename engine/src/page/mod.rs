//! The report to look at: one file that needs nothing beside it.
//!
//! What a run found out, and how it went: claims first, then each experiment. Whatever comes from a spec, an
//! artifact or a record is escaped, and the page forbids scripts and anything from elsewhere.

mod claims;
mod groups;
mod network;
mod section;
mod svg;
mod text;

use ivx_grammar::ir::Spec;
use ivx_op::Outcome as Verdict;

use crate::outcome::{Fate, Outcome};
use crate::plan::Plan;
use crate::results::{Claim, Report};
use text::{code, escape, seconds};

/// How a run was made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Origin {
    /// The command that makes it again.
    pub command: String,
    /// What else to say of it, such as versions and digests: what it is, and its value.
    pub facts: Vec<(String, String)>,
    /// How long it took.
    pub seconds: f64,
}

/// The page of a run.
#[must_use]
pub fn page(
    spec: &Spec,
    plan: &Plan,
    outcome: &Outcome,
    report: &Report,
    origin: &Origin,
) -> String {
    let name = escape(&report.results.spec);
    let mut body = vec![header(spec, outcome, report, origin)];
    body.push(r#"<main id="main">"#.to_owned());
    body.push(claims::table(spec, report));
    body.extend(failures(report));
    body.extend(section::differs(&report.results.differs));
    body.extend(section::shared(spec));
    for (i, experiment) in spec.experiments.iter().enumerate() {
        body.push(section::section(spec, i, experiment, (plan, outcome), report));
    }
    body.push(again(origin, report));
    body.push("</main>".to_owned());
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n\
         <title>{name}</title>\n<style>\n{}</style>\n</head>\n<body>\n{}\n</body>\n</html>\n",
        include_str!("style.css"),
        body.join("\n")
    )
}

/// The name, what came out in short, and the ways to the parts of the page.
fn header(spec: &Spec, outcome: &Outcome, report: &Report, origin: &Origin) -> String {
    let results = &report.results;
    let profile =
        results.profile.as_ref().map_or_else(String::new, |p| format!(" · profile {}", code(p)));
    let links = spec.experiments.iter().enumerate().map(|(i, experiment)| {
        let verdicts = results.experiments[&experiment.name].claims.values().map(kind);
        let worst = verdicts.max().unwrap_or(Kind::Holds);
        let mark = if experiment.claims.is_empty() { String::new() } else { badge(worst, false) };
        format!("<li><a href=\"#e{i}\">{}</a> {mark}</li>", escape(&experiment.name))
    });
    // One alone needs no way to it.
    let links: String = links.filter(|_| spec.experiments.len() > 1).collect();
    format!(
        "<a class=\"skip\" href=\"#main\">Skip to the claims</a>\n<header>\n<h1>{}</h1>\n\
         <p>{}{profile} · {}</p>\n<nav aria-label=\"Parts\"><ul>{links}\
         <li><a href=\"#again\">How to do it again</a></li></ul></nav>\n</header>",
        escape(&results.spec),
        tally(report),
        nodes(outcome, origin)
    )
}

/// How many claims came out how.
fn tally(report: &Report) -> String {
    let all = report.results.experiments.values().flat_map(|e| e.claims.values());
    let kinds: Vec<Kind> = all.map(kind).collect();
    let each = [Kind::Holds, Kind::Fails, Kind::Undecided, Kind::Describes, Kind::NotRun]
        .into_iter()
        .filter_map(|of| {
            let n = kinds.iter().filter(|kind| **kind == of).count();
            (n > 0).then(|| format!("<b>{n}</b> {}", badge(of, true)))
        });
    match kinds.len() {
        0 => "no claims".to_owned(),
        1 => format!("1 claim: {}", each.collect::<String>()),
        n => format!("{n} claims: {}", each.collect::<Vec<_>>().join(", ")),
    }
}

fn nodes(outcome: &Outcome, origin: &Origin) -> String {
    let count = |is: fn(&Fate) -> bool| outcome.nodes.iter().filter(|n| is(&n.fate)).count();
    let (ran, failed) =
        (count(|f| matches!(f, Fate::Ran { .. })), count(|f| matches!(f, Fate::Failed { .. })));
    let failed = if failed > 0 { format!(", {failed} failed") } else { String::new() };
    format!("{ran} of {} nodes executed{failed}, {}", outcome.nodes.len(), seconds(origin.seconds))
}

fn failures(report: &Report) -> Option<String> {
    let each = report.results.failed().into_iter().map(|(why, nodes)| {
        let more = if let n @ 1.. = nodes.len() - 1 {
            format!(" and {n} more like it")
        } else {
            String::new()
        };
        format!("<li>{}{more}: {}</li>", code(nodes[0]), escape(why))
    });
    let each: String = each.collect();
    let any = !each.is_empty();
    any.then(|| {
        format!(
            "<section id=\"failures\"><h2>Failures</h2><ul class=\"failed\">{each}</ul></section>"
        )
    })
}

/// How to make exactly this again.
fn again(origin: &Origin, report: &Report) -> String {
    let facts = origin.facts.iter().map(|(what, value)| {
        format!("<tr><th scope=\"row\">{}</th><td>{}</td></tr>", escape(what), code(value))
    });
    let settings = report.results.params.len()
        + report.results.experiments.values().map(|e| e.params.len()).sum::<usize>();
    format!(
        "<section id=\"again\"><h2>How to do it again</h2>\n<pre><code>{}</code></pre>\n\
         <p>The results are a matter of the spec, its parameters ({settings}), the versions of the operations and \
         the platform: run on the same, <code>results.ron</code> is the same to the byte. <code>ivx verify</code> \
         executes nodes again and compares.</p>\n<table class=\"facts\"><tbody>{}</tbody></table></section>",
        escape(&origin.command),
        facts.collect::<String>()
    )
}

/// What became of a claim, from best to worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Holds,
    Describes,
    Undecided,
    NotRun,
    Fails,
}

fn kind(claim: &Claim) -> Kind {
    claim.outcome.map_or(Kind::NotRun, kind_of)
}

fn kind_of(verdict: Verdict) -> Kind {
    match verdict {
        Verdict::Holds => Kind::Holds,
        Verdict::Describes => Kind::Describes,
        Verdict::Fails => Kind::Fails,
        Verdict::Undecided => Kind::Undecided,
    }
}

/// A mark, and the word where the mark alone would have to be known.
fn badge(kind: Kind, worded: bool) -> String {
    let (class, mark, word) = match kind {
        Kind::Holds => ("holds", "✓", "holds"),
        Kind::Describes => ("describes", "=", "describes these seeds only"),
        Kind::Fails => ("fails", "✗", "fails"),
        Kind::Undecided => ("undecided", "?", "undecided"),
        Kind::NotRun => ("notrun", "–", "not run"),
    };
    if worded {
        format!(
            "<span class=\"badge {class}\"><span aria-hidden=\"true\">{mark}</span> {word}</span>"
        )
    } else {
        format!(
            "<span class=\"badge {class}\" title=\"{word}\" role=\"img\" aria-label=\"{word}\">{mark}</span>"
        )
    }
}
