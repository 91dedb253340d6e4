//! What a run found out: determined by the spec alone, and so comparable byte for byte.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ivx_cache::Digest;
use ivx_grammar::ir::{Judged, Mark, Output, Param, Spec};
use ivx_op::{
    Array, Artifact, Dim, Figure, Finding, Gathered, Lit, MISSING, Outcome as Verdict, Table,
    labels_at,
};
use petgraph::graph::NodeIndex;
use serde::{Deserialize, Serialize};

use crate::family::correct;
use crate::markdown::markdown;
use crate::outcome::{Fate, Outcome};
use crate::plan::{Family, Plan, Source};
use crate::told::differs;

/// What a spec's run found out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// The format of this file.
    pub format: u32,
    /// The spec's name.
    pub spec: String,
    /// The profile in force; none when every parameter has its default.
    pub profile: Option<String>,
    /// Parameters of files.
    pub params: BTreeMap<String, Setting>,
    /// How these differ from their source, in their author's words, and in which sizes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub differs: Vec<String>,
    /// By name.
    pub experiments: BTreeMap<String, ExperimentResults>,
    /// Nodes that failed, and why.
    pub failures: BTreeMap<String, String>,
}

/// What one experiment found out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ExperimentResults {
    /// Its parameters.
    pub params: BTreeMap<String, Setting>,
    /// How it differs from its source, in its author's words, and in which sizes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub differs: Vec<String>,
    /// Its claims, by their words.
    pub claims: BTreeMap<String, Claim>,
    /// Its measures.
    pub measures: BTreeMap<String, Measure>,
    /// Its figures: the digest of each file.
    pub figures: BTreeMap<String, BTreeMap<String, String>>,
    /// Its tables: the digest of each file.
    pub tables: BTreeMap<String, BTreeMap<String, String>>,
}

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Setting {
    /// Yes or no.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A real number.
    Real(f64),
    /// A string; lists and parts as the language writes them.
    Text(String),
}

/// A measure over everything that it varies over, last dimension fastest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measure {
    /// Axes first, by name, then the dimensions inside.
    pub dims: Vec<Dim>,
    /// The numbers, NaN where a node that they need has failed; none if they differ in their
    /// dimensions from coordinate to coordinate.
    pub values: Vec<f64>,
    /// The coordinates that are missing, and the node that failed for each.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub missing: BTreeMap<String, String>,
}

impl Measure {
    /// The lowest and the highest of its numbers, but what is none; nothing if all are none.
    #[must_use]
    pub fn ends(&self) -> Option<(f64, f64)> {
        let known = self.values.iter().copied().filter(|x| !x.is_nan());
        known.map(|x| (x, x)).reduce(|(low, high), (x, _)| (low.min(x), high.max(x)))
    }

    /// The node that failed, if the number at a place in `values` is missing because of it.
    #[must_use]
    pub fn missing_at(&self, place: usize) -> Option<&str> {
        if self.missing.is_empty() {
            return None;
        }
        let at = coordinates(&self.dims, place);
        // Axes come first, and dimensions inside an array have nothing missing of their own.
        let known = (0..=at.len()).find_map(|n| self.missing.get(&at[..n].join(",")));
        known.map(String::as_str)
    }
}

/// `n=5`: the coordinates of a place as addresses have them.
fn coordinates(dims: &[Dim], place: usize) -> Vec<String> {
    let labels = labels_at(dims, place);
    dims.iter().zip(labels).map(|(dim, label)| format!("{}={label}", dim.name)).collect()
}

/// What became of a claim.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// The comparison, as written.
    pub claim: String,
    /// What it amounts to; none if something that it needs has failed.
    pub outcome: Option<Verdict>,
    /// What it amounts to among the claims of its family; none where it is in none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub corrected: Option<Corrected>,
    /// What a reader is to know of it, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub marks: Vec<String>,
    /// Coordinate by coordinate.
    pub findings: Vec<Finding>,
}

/// A verdict corrected for how many claims are judged together (Holm, 1979).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Corrected {
    /// How many claims there are.
    pub of: usize,
    /// The level at which the claim by itself is decided, or nearly is.
    pub p: f64,
    /// The level corrected.
    pub adjusted: f64,
    /// What it amounts to at that level.
    pub outcome: Verdict,
}

/// Results, and the files that show them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// What was found out.
    pub results: Results,
    /// Figures, tables and the report to read: path below the results' folder, and text.
    pub files: BTreeMap<String, String>,
}

/// The nodes whose bytes a report needs.
#[must_use]
pub fn wanted(plan: &Plan) -> BTreeSet<NodeIndex> {
    let sources = plan.outputs.values().flat_map(|family| &family.sources);
    sources.filter_map(Source::node).collect()
}

/// The report of a run.
#[must_use]
pub fn report(name: &str, spec: &Spec, plan: &Plan, outcome: &Outcome) -> Report {
    let mut report = Report::default();
    let results = &mut report.results;
    results.format = 1;
    name.clone_into(&mut results.spec);
    results.profile.clone_from(&spec.profile);
    results.params = settings(&spec.params);
    results.differs = differs(&[], &spec.params);
    for experiment in &spec.experiments {
        let mut found = ExperimentResults {
            params: settings(&experiment.params),
            differs: differs(&experiment.deviations, &experiment.params),
            ..ExperimentResults::default()
        };
        for measure in &experiment.measures {
            let family = &plan.outputs[&measure.expr];
            found.measures.insert(measure.name.clone(), self::measure(plan, family, outcome));
        }
        for figure in &experiment.figures {
            let files = rendered(plan, outcome, figure, Figure::decode).map(|figure| figure.files);
            found
                .figures
                .insert(figure.name.clone(), keep(FIGURES, &figure.name, files, &mut report.files));
        }
        for table in &experiment.tables {
            let files = rendered(plan, outcome, table, Table::decode).map(|table| table.files);
            found
                .tables
                .insert(table.name.clone(), keep(TABLES, &table.name, files, &mut report.files));
        }
        for claim in &experiment.claims {
            let verdict = rendered(plan, outcome, &claim.output, ivx_op::Verdict::decode);
            let claimed = Claim {
                claim: claim.output.source.clone(),
                outcome: verdict.as_ref().map(ivx_op::Verdict::outcome),
                corrected: None,
                marks: marks(&claim.judged),
                findings: verdict.map(findings).unwrap_or_default(),
            };
            found.claims.insert(claim.output.name.clone(), claimed);
        }
        results.experiments.insert(experiment.name.clone(), found);
    }
    correct(spec, results);
    for (step, node) in plan.graph.node_weights().zip(&outcome.nodes) {
        if let Fate::Failed { why } = &node.fate {
            results.failures.insert(step.address.clone(), why.clone());
        }
    }
    let page = markdown(spec, &report);
    report.files.insert(PAGE.to_owned(), page);
    report
}

/// The confidence of which nothing is told, and what stands before another.
const USUAL: f64 = 0.95;
const AT: &str = "at ";
/// The mark of a claim that no chance is in.
const DETERMINISTIC: &str = "deterministic";

/// What a reader is to know of a claim.
#[must_use]
pub fn marks(judged: &Judged) -> Vec<String> {
    let words = |mark: &Mark| match mark {
        Mark::Deterministic => DETERMINISTIC,
        Mark::CannotFail => "cannot fail",
        Mark::OfTheseSeeds => "describes these seeds only",
        Mark::ChosenSeeds => "rests on chosen seeds",
        Mark::MarginUnsaid => "a margin without a reason",
    };
    let mut marks: Vec<String> = judged.marks.iter().map(words).map(str::to_owned).collect();
    if !judged.by.is_empty() {
        marks.push(format!("by {}", judged.by));
    }
    if judged.confidence != USUAL && !judged.marks.contains(&Mark::Deterministic) {
        marks.push(format!("{AT}{}", judged.confidence));
    }
    marks
}

/// The confidence of a claim's intervals, as [`marks`] told it; none where nothing is stochastic.
pub(crate) fn confidence(claim: &Claim) -> Option<f64> {
    if claim.marks.iter().any(|mark| mark == DETERMINISTIC) {
        return None;
    }
    let told = claim.marks.iter().find_map(|mark| mark.strip_prefix(AT)?.parse().ok());
    Some(told.unwrap_or(USUAL))
}

/// The values of parameters, by name.
#[must_use]
pub fn settings(params: &[Param]) -> BTreeMap<String, Setting> {
    params.iter().map(|param| (param.name.clone(), setting(&param.value))).collect()
}

fn setting(lit: &Lit) -> Setting {
    match lit {
        Lit::Bool(b) => Setting::Bool(*b),
        Lit::Int(n) => Setting::Int(*n),
        Lit::Real(x) => Setting::Real(*x),
        Lit::Text(text) => Setting::Text(text.clone()),
        other => Setting::Text(other.to_string()),
    }
}

fn bytes(source: &Source, outcome: &Outcome) -> Option<Arc<[u8]>> {
    match source {
        Source::Node(node) => outcome.values.get(node).cloned(),
        Source::Number(x) => Some(Array::scalar(*x).encode().into()),
    }
}

/// The numbers of a measure; NaN where a node that they need has failed.
fn measure(plan: &Plan, family: &Family, outcome: &Outcome) -> Measure {
    let decode = |source| {
        let array = bytes(source, outcome).and_then(|bytes| Array::decode(&bytes));
        array.unwrap_or(Array::scalar(MISSING))
    };
    let values = Array::widened(family.sources.iter().map(decode).collect());
    let gathered = Gathered { dims: family.dims.clone(), values, name: String::new() };
    let missing = missing(plan, family, outcome);
    match Array::stack(&gathered) {
        Ok(array) => Measure {
            dims: array.dims,
            values: array.values.into_iter().map(unsigned_nan).collect(),
            missing,
        },
        Err(_) => Measure { dims: family.dims.clone(), values: Vec::new(), missing },
    }
}

/// The coordinates at which there is nothing because a node failed, and that node.
fn missing(plan: &Plan, family: &Family, outcome: &Outcome) -> BTreeMap<String, String> {
    let mut missing = BTreeMap::new();
    for (i, source) in family.sources.iter().enumerate() {
        let Some(node) = source.node() else { continue };
        let cause = match outcome.nodes[node.index()].fate {
            Fate::Failed { .. } => node,
            Fate::Skipped { cause } => cause,
            _ => continue,
        };
        missing.insert(coordinates(&family.dims, i).join(","), plan.graph[cause].address.clone());
    }
    missing
}

fn findings(verdict: ivx_op::Verdict) -> Vec<Finding> {
    let plain = |mut finding: Finding| {
        finding.estimate = unsigned_nan(finding.estimate);
        finding.interval =
            finding.interval.map(|(low, high)| (unsigned_nan(low), unsigned_nan(high)));
        finding
    };
    verdict.findings.into_iter().map(plain).collect()
}

/// The number; NaN without its sign, which says nothing and differs from platform to platform.
/// Zero keeps its own: it is part of the value.
fn unsigned_nan(x: f64) -> f64 {
    if x.is_nan() { f64::NAN } else { x }
}

fn rendered<T>(
    plan: &Plan,
    outcome: &Outcome,
    output: &Output,
    decode: fn(&[u8]) -> Option<T>,
) -> Option<T> {
    let source = plan.outputs[&output.expr].sources.first()?;
    bytes(source, outcome).and_then(|bytes| decode(&bytes))
}

/// The report to read.
const PAGE: &str = "report.md";
/// The folder of figures.
pub(crate) const FIGURES: &str = "figures";
/// The folder of tables.
pub(crate) const TABLES: &str = "tables";

/// Where a figure or table lies.
pub(crate) fn path(folder: &str, name: &str, extension: &str) -> String {
    format!("{folder}/{name}.{extension}")
}

/// Puts files where the report shows them, and returns the digest of each.
fn keep(
    folder: &str,
    name: &str,
    files: Option<BTreeMap<String, String>>,
    into: &mut BTreeMap<String, String>,
) -> BTreeMap<String, String> {
    let mut digests = BTreeMap::new();
    for (extension, text) in files.unwrap_or_default() {
        digests.insert(extension.clone(), Digest::of(text.as_bytes()).to_string());
        into.insert(path(folder, name, &extension), text);
    }
    digests
}

impl Results {
    /// The nodes that failed for each reason, both in order of the first such node.
    pub(crate) fn failed(&self) -> Vec<(&str, Vec<&str>)> {
        let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
        let mut places = BTreeMap::new();
        for (node, why) in &self.failures {
            let place = *places.entry(why).or_insert(reasons.len());
            if place == reasons.len() {
                reasons.push((why, Vec::new()));
            }
            reasons[place].1.push(node);
        }
        reasons
    }

    /// The files that show figures and tables: path below the results' folder, and digest.
    #[must_use]
    pub fn files(&self) -> BTreeMap<String, String> {
        let mut files = BTreeMap::new();
        for experiment in self.experiments.values() {
            for (folder, shown) in [(FIGURES, &experiment.figures), (TABLES, &experiment.tables)] {
                for (name, digests) in shown {
                    let own = digests.iter();
                    files.extend(
                        own.map(|(kind, digest)| (path(folder, name, kind), digest.clone())),
                    );
                }
            }
        }
        files
    }

    /// As text: sorted, with shortest round-trip numbers.
    #[must_use]
    pub fn to_ron(&self) -> String {
        to_ron(self)
    }

    /// Back from text.
    ///
    /// # Errors
    /// If the text is no results file; the error has line and column.
    pub fn from_ron(text: &str) -> Result<Self, ron::error::SpannedError> {
        ron::from_str(text)
    }
}

/// As text that reads well and differs only where the value does.
pub(crate) fn to_ron(value: &impl Serialize) -> String {
    let config = ron::ser::PrettyConfig::new()
        .indentor("  ")
        .extensions(ron::extensions::Extensions::IMPLICIT_SOME);
    let mut text = ron::ser::to_string_pretty(value, config).expect("results are plain data");
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sign_of_nan_is_not_written_and_that_of_zero_is() {
        let numbers = [-f64::NAN, f64::NAN, -0.0, 0.0, -f64::INFINITY].map(unsigned_nan);
        let measure = Measure { values: numbers.to_vec(), ..Measure::default() };
        let text = to_ron(&measure);
        let written: Vec<&str> =
            text.lines().map(str::trim).filter(|line| line.ends_with(',')).collect();
        assert_eq!(written[1..6], ["NaN,", "NaN,", "-0.0,", "0.0,", "-inf,"]);
        let back: Measure = ron::from_str(&text).expect("what is written reads");
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&back.values), bits(&numbers));
    }

    #[test]
    fn findings_have_no_signed_nan() {
        let finding = Finding {
            at: Vec::new(),
            outcome: Verdict::Undecided,
            estimate: -f64::NAN,
            interval: Some((-f64::NAN, 1.0)),
            ..Finding::default()
        };
        let found = findings(ivx_op::Verdict { findings: vec![finding] });
        let (low, high) = found[0].interval.expect("there was one");
        assert!(found[0].estimate.is_nan() && low.is_nan());
        assert!(found[0].estimate.is_sign_positive() && low.is_sign_positive());
        assert_eq!(high, 1.0);
    }
}
