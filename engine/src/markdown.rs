//! The report to read: what an experiment is about, in its author's words, and what came out.
//!
//! Determined by the spec alone, as the results are. Doc comments are Markdown and stay as they
//! are written.

use ivx_grammar::ir::{Axis, AxisId, Definition, Experiment, Output, Param, Spec};
use ivx_op::escape::markdown as plain;
use ivx_op::{Finding, Outcome as Verdict, shown as shown_alone, shown_together};

use crate::results::{Claim, ExperimentResults, FIGURES, Measure, Report, TABLES, path};
use crate::told::{listed, notes, reason, verdict};

/// The report, as Markdown.
pub(crate) fn markdown(spec: &Spec, report: &Report) -> String {
    let results = &report.results;
    let mut page = vec![format!("# {}", plain(&results.spec))];
    page.extend(results.profile.as_ref().map(|profile| format!("Profile {}.", code(profile))));
    page.extend(list(
        "## Differs from its source",
        results.differs.iter().map(|words| plain(words)),
    ));
    page.extend(list("## Parameters", spec.params.iter().map(parameter)));
    page.extend(list("## Definitions", spec.definitions.iter().map(definition)));
    for experiment in &spec.experiments {
        let found = &results.experiments[&experiment.name];
        page.push(format!("## {}", plain(&experiment.name)));
        self::experiment(spec, experiment, found, report, &mut page);
    }
    page.extend(list("## Failures", results.failed().into_iter().map(failure)));
    page.retain(|paragraph| !paragraph.is_empty());
    page.join("\n\n") + "\n"
}

/// Adds the paragraphs of one experiment.
fn experiment(
    spec: &Spec,
    experiment: &Experiment,
    found: &ExperimentResults,
    report: &Report,
    page: &mut Vec<String>,
) {
    page.push(closed(&experiment.docs));
    page.extend(list(
        "### Differs from its source",
        found.differs.iter().map(|words| plain(words)),
    ));
    page.extend(list("### Parameters", experiment.params.iter().map(parameter)));
    let axes = experiment.axes.iter().map(|declared| axis(spec, declared.axis, &declared.docs));
    page.extend(list("### Axes", axes));
    page.extend(list("### Definitions", experiment.definitions.iter().map(definition)));
    let measures = experiment.measures.iter().map(|output| {
        documented(
            &format!("{} {}", code(&output.name), numbers(&found.measures[&output.name])),
            &output.docs,
        )
    });
    page.extend(list("### Measures", measures));
    for figure in &experiment.figures {
        let drawn = found.figures[&figure.name].keys().map(|extension| {
            format!("![{}](<{}>)", plain(&figure.name), path(FIGURES, &figure.name, extension))
        });
        shown("Figure", figure, drawn.collect(), page);
    }
    for table in &experiment.tables {
        let text = report.files.get(&path(TABLES, &table.name, "md"));
        shown(
            "Table",
            table,
            text.map(|text| text.trim_end().to_owned()).into_iter().collect(),
            page,
        );
    }
    let claims =
        experiment.claims.iter().map(|own| claim(&own.output, &found.claims[&own.output.name]));
    page.extend(list("### Claims", claims));
}

/// What failed for one reason. What programs said stands as they said it.
fn failure((why, nodes): (&str, Vec<&str>)) -> String {
    let more = match nodes.len() - 1 {
        0 => String::new(),
        n => format!(" and {n} more like it"),
    };
    let (first, rest) = why.split_once('\n').unwrap_or((why, ""));
    let item = format!("{}{more}: {}", code(nodes[0]), plain(first));
    if rest.is_empty() {
        return item;
    }
    let fence = "`".repeat(backticks(rest).max(2) + 1);
    format!("{item}\n\n{fence}text\n{rest}\n{fence}")
}

/// Adds a figure or table under its own heading.
fn shown(what: &str, output: &Output, content: Vec<String>, page: &mut Vec<String>) {
    page.push(format!("### {what} {}", plain(&output.name)));
    page.push(closed(&output.docs));
    if content.is_empty() {
        page.push("Not there, because something that it needs has failed.".to_owned());
    }
    page.extend(content);
}

/// A heading and its list; nothing without items.
fn list(heading: &str, items: impl Iterator<Item = String>) -> Vec<String> {
    let items: Vec<String> = items.map(|item| format!("- {}", set_in(&item))).collect();
    // Items of several paragraphs stand apart.
    let apart = if items.iter().any(|item| item.contains("\n\n")) { "\n\n" } else { "\n" };
    if items.is_empty() { Vec::new() } else { vec![heading.to_owned(), items.join(apart)] }
}

/// Text whose lines but the first are set in, to belong to the item of a list.
fn set_in(text: &str) -> String {
    text.replace('\n', "\n  ").replace("\n  \n", "\n\n")
}

fn parameter(param: &Param) -> String {
    let value = code(&param.value.to_string());
    documented(&format!("{} = {value}", code(&param.name)), &param.docs)
}

fn definition(Definition { name, docs }: &Definition) -> String {
    documented(&code(name), docs)
}

fn axis(spec: &Spec, id: AxisId, docs: &str) -> String {
    let Axis { name, coords, .. } = spec.axis(id);
    let labels: Vec<String> = coords.iter().map(|coord| code(&coord.label)).collect();
    documented(&format!("{} ({})", code(name), listed(&labels)), docs)
}

/// A doc comment that ends what it begins, so that what follows it is not taken for code or a comment.
fn closed(docs: &str) -> String {
    let mut fence: Option<&str> = None;
    for line in docs.lines() {
        let line = line.trim_start();
        let sign = ['`', '~']
            .into_iter()
            .find(|sign| line.starts_with(&[*sign; 3].iter().collect::<String>()));
        let run = sign.map(|sign| &line[..line.len() - line.trim_start_matches(sign).len()]);
        fence = match (fence, run) {
            (None, run) => run,
            (Some(open), Some(run)) if run.starts_with(open) && line.trim_end() == run => None,
            (open, _) => open,
        };
    }
    let is_hidden = fence.is_none() && docs.rfind("<!--") > docs.rfind("-->");
    match fence {
        Some(fence) => format!("{docs}\n{fence}"),
        None if is_hidden => format!("{docs}\n-->"),
        None => docs.to_owned(),
    }
}

/// An item with its doc comment: one line behind it, more below.
fn documented(item: &str, docs: &str) -> String {
    match docs.trim() {
        "" => item.to_owned(),
        docs if docs.contains('\n') => format!("{item}\n\n{}", closed(docs)),
        docs => format!("{item}: {docs}"),
    }
}

/// What a measure amounts to.
fn numbers(measure: &Measure) -> String {
    if let [one] = measure.values[..] {
        return format!("= {}", shown_alone(one));
    }
    if measure.values.is_empty() {
        return "(its dimensions differ from coordinate to coordinate)".to_owned();
    }
    let over: Vec<String> = measure.dims.iter().map(|dim| code(&dim.name)).collect();
    let missing = measure.values.iter().filter(|x| x.is_nan()).count();
    let range = measure.ends().map_or_else(String::new, |(low, high)| {
        let ends = shown_together(&[low, high]);
        format!(" from {}", ends.join(" to "))
    });
    let missing = if missing > 0 { format!(", {missing} of them missing") } else { String::new() };
    let n = measure.values.len();
    format!("({n} numbers{range} over {}{missing})", over.join(", "))
}

fn claim(output: &Output, claim: &Claim) -> String {
    let outcome = verdict(claim.outcome);
    let words: Vec<&str> = output.name.split_whitespace().collect();
    let findings: Vec<String> = match &claim.findings[..] {
        [one] if one.at.is_empty() => vec![difference(one)],
        all => all.iter().map(at_coordinate).collect(),
    };
    let (words, source) = (plain(&words.join(" ")), code(&claim.claim));
    let notes = match &notes(claim)[..] {
        [] => String::new(),
        notes => format!(" ({})", plain(&notes.join("; "))),
    };
    let text = format!("**{outcome}**: {words}: {source}{notes}{}", findings.concat());
    match output.docs.trim() {
        "" => text,
        docs => format!("{text}\n\n{}", closed(docs)),
    }
}

/// What came out at one of several coordinates, as an item.
fn at_coordinate(finding: &Finding) -> String {
    let at = finding.at.iter().map(|(axis, label)| format!("{} = {}", code(axis), code(label)));
    let at: Vec<String> = at.collect();
    format!("\n- {} at {}{}", finding.outcome, at.join(", "), difference(finding))
}

fn difference(finding: &Finding) -> String {
    let Finding { n, outcome, .. } = finding;
    let numbers = finding.shown();
    let ends = &numbers[1..];
    let interval =
        if ends.is_empty() { String::new() } else { format!(" in [{}]", ends.join(", ")) };
    let seeds = if *n > 0 { format!(", n = {n}") } else { String::new() };
    if interval.is_empty() && *n == 0 && *outcome == Verdict::Holds {
        return String::new();
    }
    let why = match reason(finding) {
        why if why.is_empty() => why,
        why => format!(": {why}"),
    };
    format!(", difference {}{interval}{seeds}{why}", numbers[0])
}

/// How long the longest run of backticks is: a fence around the text is longer.
fn backticks(text: &str) -> usize {
    text.split(|c| c != '`').map(str::len).max().unwrap_or(0)
}

/// Text that is no prose, as code on one line.
#[must_use]
pub fn code(text: &str) -> String {
    let text = text.replace('\n', "\\n").replace('\r', "\\r");
    if text.trim().is_empty() {
        return format!("`{text:?}`");
    }
    let fence = "`".repeat(backticks(&text) + 1);
    let blank = if text.starts_with(['`', ' ']) || text.ends_with(['`', ' ']) { " " } else { "" };
    format!("{fence}{blank}{text}{blank}{fence}")
}

#[cfg(test)]
mod tests {
    use ivx_op::escape::markdown_cell;
    use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

    use super::*;

    /// Labels of every sign alone, doubled, around and inside a word, and some that are known to bite.
    fn labels() -> Vec<String> {
        let signs = "\\`*_{}[]()<>#+-.!|~&$:@=\"'/,;%^?";
        let of_sign = |c: char| {
            [
                format!("{c}"),
                format!("{c}{c}"),
                format!("{c}a b{c}"),
                format!("a{c}b"),
                format!("{c} a"),
            ]
        };
        let known = [
            "<b>x</b>",
            "<64,64>",
            "*star*",
            "a_b_c",
            "&lt;",
            "&#65;",
            "`c`",
            "[l](u)",
            "![l](u)",
            "a\\|b",
            "a\\",
            "|",
            "\\|",
            "~~a~~",
            "__a__",
            "[^1]",
            "[ ] a",
            "<!-- a -->",
            "<http://a.b>",
            "# a",
            "1. a",
            "1) a",
            "- a",
            "---",
            "===",
            "> a",
            " a ",
            "  ",
            "σ² ≤ 1",
            "a  b",
            "``` a",
            "$x$",
            "&amp;amp;",
        ];
        signs.chars().flat_map(of_sign).chain(known.map(str::to_owned)).collect()
    }

    /// The texts of the cells or the paragraph, with the names of the tags that are no part of a table.
    fn read(text: &str) -> (Vec<String>, Vec<String>) {
        let (mut cells, mut odd) = (Vec::new(), Vec::new());
        // What GitHub reads beyond CommonMark.
        let options = Options::ENABLE_TABLES
            | Options::ENABLE_STRIKETHROUGH
            | Options::ENABLE_TASKLISTS
            | Options::ENABLE_FOOTNOTES
            | Options::ENABLE_MATH
            | Options::ENABLE_GFM;
        for event in Parser::new_ext(text, options) {
            match event {
                Event::Start(Tag::TableCell | Tag::Paragraph) => cells.push(String::new()),
                Event::Text(text) => match cells.last_mut() {
                    Some(cell) => cell.push_str(&text),
                    None => odd.push(text.into_string()),
                },
                Event::Start(Tag::Table(_) | Tag::TableHead | Tag::TableRow)
                | Event::End(
                    TagEnd::TableCell
                    | TagEnd::Paragraph
                    | TagEnd::Table
                    | TagEnd::TableHead
                    | TagEnd::TableRow,
                ) => {}
                other => odd.push(format!("{other:?}")),
            }
        }
        (cells, odd)
    }

    #[test]
    fn a_label_in_a_table_reads_back() {
        assert!(labels().len() > 100);
        for label in labels() {
            let cell = markdown_cell(&label);
            let page = format!("| {cell} | b |\n| --- | --- |\n| {cell} | 1 |\n");
            let expected = [&label, "b", &label, "1"].map(str::to_owned).to_vec();
            assert_eq!(read(&page), (expected, Vec::new()), "{label:?} as {cell}");
        }
    }

    #[test]
    fn a_label_in_a_paragraph_reads_back() {
        for label in labels() {
            let text = plain(&label);
            assert_eq!(read(&text), (vec![label.clone()], Vec::new()), "{label:?} as {text}");
        }
    }

    #[test]
    fn docs_end_what_they_begin() {
        let check = |docs: &str, expected: &str| assert_eq!(closed(docs), expected);
        for whole in ["", "plain", "```\na\n```", "a <!-- b --> c", "````\n```\n````"] {
            check(whole, whole);
        }
        check("a\n```py\nb", "a\n```py\nb\n```");
        check("~~~\n```", "~~~\n```\n~~~");
        check("a <!-- b", "a <!-- b\n-->");
    }

    #[test]
    fn code_is_code_whatever_it_is() {
        let check = |text: &str, expected: &str| assert_eq!(code(text), expected, "{text:?}");
        check("MA", "`MA`");
        check("", "`\"\"`");
        check(" ", "`\" \"`");
        check(" a", "`  a `");
        check("a`b", "``a`b``");
        check("``", "``` `` ```");
        check("a\n\nb", "`a\\n\\nb`");
    }
}
