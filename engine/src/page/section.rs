//! One experiment: what it is about, what it shows and what it was made of.

use ivx_grammar::ir::{Definition, Experiment, Output, Param, Spec};

use super::groups::groups;
use super::network::network;
use super::svg::is_plain;
use super::text::{code, escape, numbers, prose};
use crate::outcome::Outcome;
use crate::plan::Plan;
use crate::results::{ExperimentResults, FIGURES, Measure, Report, TABLES, path};

/// So many labels of an axis are listed.
const LABELS: usize = 12;

/// Drawings that are wider, in pixels, are not put side by side.
const BROAD: f64 = 660.0;

/// The section of the experiment in this place.
pub(super) fn section(
    spec: &Spec,
    place: usize,
    experiment: &Experiment,
    (plan, outcome): (&Plan, &Outcome),
    report: &Report,
) -> String {
    let found = &report.results.experiments[&experiment.name];
    let mut out = vec![
        format!("<section id=\"e{place}\"><h2>{}</h2>", escape(&experiment.name)),
        prose(&experiment.docs),
    ];
    out.extend(differs(&found.differs));
    let mut shows = Vec::new();
    for figure in &experiment.figures {
        let svg = report.files.get(&path(FIGURES, &figure.name, "svg"));
        let is_broad = svg.is_some_and(|svg| is_broad(svg));
        let svg = svg.map(|svg| drawing(&figure.name, svg));
        shows.push(shown("Figure", figure, svg, is_broad));
    }
    for table in &experiment.tables {
        let text = report.files.get(&path(TABLES, &table.name, "md"));
        shows.push(shown("Table", table, text.map(|text| prose(text)), false));
    }
    if !shows.is_empty() {
        out.push(format!("<div class=\"shown\">{}</div>", shows.concat()));
    }
    out.extend(measures(experiment, found));
    out.extend(settings(spec, experiment));
    out.extend(definitions(&experiment.definitions));
    let groups = groups(&experiment.name, plan, outcome);
    if !groups.is_empty() {
        out.push(format!("<h3>Who feeds whom</h3>{}", network(&groups)));
    }
    out.push("</section>".to_owned());
    out.join("\n")
}

/// A figure or table with its caption; a broad one has a row of its own.
fn shown(what: &str, output: &Output, content: Option<String>, is_broad: bool) -> String {
    let content = content.unwrap_or_else(|| {
        "<p class=\"failed\">Not there, because something that it needs has failed.</p>".to_owned()
    });
    let class = if is_broad { " class=\"broad\"" } else { "" };
    format!(
        "<figure{class}><div class=\"wide\">{content}</div><figcaption><b>{what} {}</b> {}</figcaption></figure>",
        escape(&output.name),
        prose(&output.docs)
    )
}

/// Whether a drawing would be hard to read at half the page's width.
fn is_broad(svg: &str) -> bool {
    let width = svg.split(" width=\"").nth(1).and_then(|rest| rest.split('"').next());
    width.and_then(|width| width.parse::<f64>().ok()).is_some_and(|width| width > BROAD)
}

/// A drawing as it is, if it is nothing but one.
fn drawing(name: &str, svg: &str) -> String {
    if is_plain(svg) {
        format!(
            "<div class=\"drawing\" role=\"img\" aria-label=\"Figure {}\">{svg}</div>",
            escape(name)
        )
    } else {
        let file = code(&path(FIGURES, name, "svg"));
        format!(
            "<p class=\"failed\">Not shown, because it holds more than shapes and text: {file}</p>"
        )
    }
}

fn measures(experiment: &Experiment, found: &ExperimentResults) -> Option<String> {
    let each = experiment.measures.iter().map(|output| {
        let (name, docs) = (code(&output.name), prose(&output.docs));
        let amount = amount(&found.measures[&output.name]);
        format!("<tr><th scope=\"row\">{name}</th><td>{amount}</td><td>{docs}</td></tr>\n")
    });
    let each: String = each.collect();
    (!each.is_empty()).then(|| {
        format!("<details><summary>Measures</summary><table class=\"facts\"><tbody>\n{each}</tbody></table></details>")
    })
}

/// What a measure amounts to.
fn amount(measure: &Measure) -> String {
    if let [one] = measure.values[..] {
        return numbers(&[one]).concat();
    }
    let ends = measure.ends().map_or_else(String::new, |(low, high)| {
        format!(" from {}", numbers(&[low, high]).join(" to "))
    });
    let over: Vec<String> = measure.dims.iter().map(|dim| code(&dim.name)).collect();
    format!("{} numbers{ends} over {}", measure.values.len(), over.join(", "))
}

/// The parameters that several experiments may read, and what files give names to.
pub(super) fn shared(spec: &Spec) -> Option<String> {
    let rows: String = spec.params.iter().map(param).collect();
    let params = (!rows.is_empty()).then(|| table("Parameters of several experiments", &rows));
    let shared: String = params.into_iter().chain(definitions(&spec.definitions)).collect();
    (!shared.is_empty()).then(|| format!("<section id=\"shared\">{shared}</section>"))
}

/// What is said of names.
fn definitions(all: &[Definition]) -> Option<String> {
    let row = |Definition { name, docs }: &Definition| {
        format!("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", code(name), prose(docs))
    };
    let rows: String = all.iter().map(row).collect();
    (!rows.is_empty()).then(|| {
        format!("<details><summary>Definitions</summary><table class=\"facts\"><tbody>\n{rows}</tbody></table></details>")
    })
}

fn param(Param { name, docs, value, by, .. }: &Param) -> String {
    format!(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        code(name),
        code(&value.to_string()),
        escape(by),
        prose(docs)
    )
}

/// How something differs from its source.
pub(super) fn differs(differs: &[String]) -> Option<String> {
    let each: Vec<String> =
        differs.iter().map(|words| format!("<li>{}</li>", escape(words))).collect();
    let list = each.concat();
    (!each.is_empty()).then(|| {
        format!("<div class=\"differs\"><b>Differs from its source</b><ul>{list}</ul></div>")
    })
}

fn table(summary: &str, rows: &str) -> String {
    format!(
        "<details><summary>{summary}</summary><table class=\"facts\"><thead><tr><th scope=\"col\">name</th>\
         <th scope=\"col\">value</th><th scope=\"col\">set by</th><th></th></tr></thead>\
         <tbody>\n{rows}</tbody></table></details>"
    )
}

/// Parameters and axes.
fn settings(spec: &Spec, experiment: &Experiment) -> Option<String> {
    let params: String = experiment.params.iter().map(param).collect();
    let axes = experiment.axes.iter().map(|declared| {
        let axis = spec.axis(declared.axis);
        let labels: Vec<String> = axis.coords.iter().map(|coord| code(&coord.label)).collect();
        let labels = match &labels[..] {
            [first, .., last] if labels.len() > LABELS => {
                format!("{} from {first} to {last}", labels.len())
            }
            all => all.join(", "),
        };
        let docs = prose(&declared.docs);
        format!(
            "<tr><th scope=\"row\">axis {}</th><td colspan=\"2\">{labels}</td><td>{docs}</td></tr>\n",
            code(&axis.name)
        )
    });
    let rows = params + &axes.collect::<String>();
    (!rows.is_empty()).then(|| table("Parameters and axes", &rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_at_half_the_width_stands_beside_another() {
        let of = |wide: u32| format!("<svg xmlns=\"x\" width=\"{wide}\" height=\"9\"></svg>");
        assert!(!is_broad(&of(600)) && is_broad(&of(900)) && !is_broad("<svg></svg>"));
    }

    #[test]
    fn only_drawings_stand_in_the_page() {
        assert!(drawing("a", "<svg></svg>").contains("<svg></svg>"));
        let hostile = drawing("<b>", "<svg><script>alert(1)</script></svg>");
        assert!(
            !hostile.contains("<script") && hostile.contains("figures/&lt;b&gt;.svg"),
            "{hostile}"
        );
    }
}
