//! What the history remembers of a run.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::time::{Duration, UNIX_EPOCH};

use ivx_cache::{Digest, Run};
use ivx_engine::{Fate, Outcome, Results, Setting, platform, settings, verdict};
use ivx_grammar::check::Project;
use ivx_grammar::ir::Spec;
use serde::{Deserialize, Serialize};

use crate::account::{Account, Nodes};

/// How many nodes are named of those that took longest, and of those that failed.
const MOST: usize = 10;
/// How much of a failure is remembered.
const WHY_MAX: usize = 500;

/// Which texts a run is of.
#[derive(Clone, Debug)]
pub(crate) struct Files {
    /// The path of the spec in its project.
    spec: String,
    /// The digest of its files, their names and the published numbers that they name.
    pub(crate) digest: Digest,
}

impl Files {
    pub(crate) fn of(project: &Project) -> Self {
        let mut texts = BTreeMap::new();
        for file in &project.files {
            texts.insert(file.path.as_str(), file.text.as_str());
            // These are called as the spec calls them, which is part of its text.
            texts.extend(file.texts.iter().map(|(name, text)| (name.as_str(), text.as_str())));
        }
        let line =
            |(name, text): (&&str, &&str)| format!("{} {name}\n", Digest::of(text.as_bytes()));
        let digest = Digest::of(texts.iter().map(line).collect::<String>().as_bytes());
        Self { spec: project.files[0].path.clone(), digest }
    }
}

/// What the history remembers of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Summary {
    /// The path of the spec in its project.
    pub(crate) spec: String,
    /// The digest of all its files.
    pub(crate) files: String,
    /// The profile in force.
    pub(crate) profile: Option<String>,
    /// Every parameter, by address.
    pub(crate) params: BTreeMap<String, Setting>,
    /// Who set those that have not their default: a profile or `--set`.
    pub(crate) set_by: BTreeMap<String, String>,
    pub(crate) platform: String,
    /// The version of ivx.
    pub(crate) version: String,
    /// The digest of the library's source.
    pub(crate) library: String,
    /// How many nodes ran at once.
    pub(crate) jobs: usize,
    /// Milliseconds since 1970.
    pub(crate) started: u64,
    pub(crate) millis: u64,
    pub(crate) status: Status,
    pub(crate) nodes: Nodes,
    /// The verdict of each claim, by experiment and words; none of a run that was stopped.
    pub(crate) claims: BTreeMap<String, BTreeMap<String, String>>,
    /// The digest of what it found out, which the cache keeps; none of a run that was stopped.
    pub(crate) found: Option<String>,
    /// The nodes that took longest, in milliseconds.
    pub(crate) longest: Vec<(String, u64)>,
    /// Some nodes that failed, and why.
    pub(crate) failures: Vec<(String, String)>,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Status {
    /// Every node has a result.
    #[default]
    Finished,
    /// By hand.
    Stopped,
    /// A node failed.
    Failed,
}

impl Summary {
    /// What is to be remembered of a run.
    pub(crate) fn of(run: &Account<'_>) -> Self {
        let &Account { spec, files, plan, outcome, results, jobs, .. } = run;
        let millis = |time: Duration| u64::try_from(time.as_millis()).unwrap_or(u64::MAX);
        let began = run.began.duration_since(UNIX_EPOCH).unwrap_or_default();
        let nodes = run.nodes();
        let status = match results {
            None => Status::Stopped,
            Some(_) if nodes.failed > 0 => Status::Failed,
            Some(_) => Status::Finished,
        };
        let mut longest = Vec::new();
        let mut failures = Vec::new();
        for (step, node) in plan.graph.node_weights().zip(&outcome.nodes) {
            match &node.fate {
                Fate::Ran { millis } if *millis > 0 => longest.push((&step.address, *millis)),
                Fate::Failed { why } if failures.len() < MOST => {
                    let why: String = why.chars().take(WHY_MAX).collect();
                    failures.push((step.address.clone(), why));
                }
                _ => {}
            }
        }
        longest.sort_by_key(|(_, millis)| Reverse(*millis));
        longest.truncate(MOST);
        Self {
            spec: files.spec.clone(),
            files: files.digest.to_string(),
            profile: spec.profile.clone(),
            params: params(spec),
            set_by: set_by(spec),
            platform: platform(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            library: ivx_library::SOURCE_DIGEST.to_owned(),
            jobs,
            started: millis(began),
            millis: millis(run.took),
            status,
            nodes,
            claims: results.map(claims).unwrap_or_default(),
            found: None,
            longest: longest.into_iter().map(|(address, ms)| (address.clone(), ms)).collect(),
            failures,
        }
    }

    /// The parameters that were set by hand.
    pub(crate) fn by_hand(&self) -> impl Iterator<Item = (&String, &Setting)> {
        let is_by_hand = |name: &String| self.set_by.get(name).is_some_and(|by| by == "`--set`");
        self.params.iter().filter(move |(name, _)| is_by_hand(name))
    }

    /// What is remembered of a run; nothing if another version of ivx wrote it otherwise.
    pub(crate) fn read(run: &Run) -> Self {
        ron::from_str(&run.summary).unwrap_or_default()
    }

    /// As the cache keeps it.
    pub(crate) fn write(&self) -> String {
        ron::to_string(self).expect("a summary is plain data")
    }
}

/// The keys whose results a run used.
pub(crate) fn keys(outcome: &Outcome) -> Vec<Digest> {
    let known = outcome.nodes.iter().filter(|node| node.output.is_some());
    known.filter_map(|node| node.key).collect()
}

/// Every parameter, by address.
pub(crate) fn params(spec: &Spec) -> BTreeMap<String, Setting> {
    let mut params = settings(&spec.params);
    for experiment in &spec.experiments {
        let own = settings(&experiment.params).into_iter();
        params.extend(own.map(|(name, value)| (format!("{}.{name}", experiment.name), value)));
    }
    params
}

fn set_by(spec: &Spec) -> BTreeMap<String, String> {
    let own = spec.params.iter().map(|param| (param.name.clone(), param));
    let of_experiments = spec.experiments.iter().flat_map(|experiment| {
        experiment.params.iter().map(|p| (format!("{}.{}", experiment.name, p.name), p))
    });
    let changed = own.chain(of_experiments).filter(|(_, param)| param.by != "default");
    changed.map(|(name, param)| (name, param.by.clone())).collect()
}

fn claims(results: &Results) -> BTreeMap<String, BTreeMap<String, String>> {
    let experiments = results.experiments.iter().filter(|(_, found)| !found.claims.is_empty());
    let verdicts = experiments.map(|(name, found)| {
        let verdicts =
            found.claims.iter().map(|(words, claim)| (words.clone(), verdict(claim.outcome)));
        (name.clone(), verdicts.collect())
    });
    verdicts.collect()
}
