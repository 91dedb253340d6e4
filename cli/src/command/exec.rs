//! `ivx exec`

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use ivx_cache::Cache;
use ivx_engine::{
    Fate, Options, Outcome, Plan, Report, expand, platform, report, schedule, wanted,
};
use ivx_op::Outcome as Verdict;
use serde::Serialize;

use super::ready;
use super::summary;
use crate::progress::Progress;
use crate::{At as _, FAILED, OK, Trouble, WRONG, args, project};

pub(crate) fn exec(
    args: &args::Exec,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let started = Instant::now();
    let Some(ready) = ready(&args.spec, err)? else { return Ok(WRONG) };
    let plan = expand(&ready.spec, &ready.registry)?;
    let jobs =
        args.jobs.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let mut cache = Cache::open(&project::cache(&ready.loaded.root), &platform())?;
    for trouble in cache.troubles() {
        writeln!(err, "note: {trouble}")?;
    }
    let options =
        Options { jobs, fail_fast: args.fail_fast, library: ivx_library::SOURCE_DIGEST.to_owned() };
    let mut progress = Progress::new(err, jobs);
    let outcome =
        schedule(&plan, &ready.registry, &mut cache, &options, &wanted(&plan), &mut progress);
    progress.finish();
    for trouble in cache.close()? {
        writeln!(err, "note: {trouble}")?;
    }
    let outcome = outcome?;
    let name = project::name(&args.spec.path);
    let report = report(&name, &ready.spec, &plan, &outcome);
    let folder = ready.loaded.root.join("results").join(&name);
    write_results(&folder, &report)?;
    write_file(&folder.join("run.ron"), &run_ron(&plan, &outcome, jobs, started))?;
    summary::write(&ready.spec, &report.results, &plan, &outcome, started.elapsed(), out)?;
    let shown = folder.strip_prefix(&ready.loaded.root).unwrap_or(&folder);
    writeln!(out, "results: {}", shown.join("results.ron").display())?;
    let claims =
        report.results.experiments.values().flat_map(|experiment| experiment.claims.values());
    let broken = claims.into_iter().any(|claim| claim.outcome == Some(Verdict::Fails));
    let failed = !report.results.failures.is_empty();
    Ok(if failed || (args.strict && broken) { FAILED } else { OK })
}

/// Writes what changed; files that are no longer part of the results go.
fn write_results(folder: &Path, report: &Report) -> Result<(), Trouble> {
    for kind in ["figures", "tables"] {
        let kind_folder = folder.join(kind);
        let Ok(entries) = fs::read_dir(&kind_folder) else { continue };
        for entry in entries.flatten() {
            let path = format!("{kind}/{}", entry.file_name().to_string_lossy());
            if !report.files.contains_key(&path) {
                fs::remove_file(entry.path()).at(&entry.path())?;
            }
        }
    }
    for (path, text) in &report.files {
        write_file(&folder.join(path), text)?;
    }
    write_file(&folder.join("results.ron"), &report.results.to_ron())
}

/// Writes a file whole or not at all, and leaves one alone that says the same.
fn write_file(path: &Path, text: &str) -> Result<(), Trouble> {
    if fs::read(path).is_ok_and(|bytes| bytes == text.as_bytes()) {
        return Ok(());
    }
    let folder = path.parent().expect("results lie in a folder");
    fs::create_dir_all(folder).at(folder)?;
    let temporary = path.with_added_extension(format!("{}.tmp", std::process::id()));
    fs::write(&temporary, text).at(&temporary)?;
    fs::rename(&temporary, path).at(path)
}

/// What varies from run to run.
#[derive(Serialize)]
struct Run<'a> {
    version: &'static str,
    platform: String,
    jobs: usize,
    /// Seconds since 1970.
    started: u64,
    seconds: f64,
    nodes: BTreeMap<&'a str, NodeRun>,
}

#[derive(Serialize)]
struct NodeRun {
    key: Option<String>,
    output: Option<String>,
    fate: &'static str,
    millis: u64,
}

fn run_ron(plan: &Plan, outcome: &Outcome, jobs: usize, started: Instant) -> String {
    let nodes = plan.graph.node_weights().zip(&outcome.nodes).map(|(step, node)| {
        let (fate, millis) = match &node.fate {
            Fate::Waiting => ("waiting", 0),
            Fate::Hit => ("hit", 0),
            Fate::Ran { millis } => ("ran", *millis),
            Fate::Failed { .. } => ("failed", 0),
            Fate::Skipped { .. } => ("skipped", 0),
        };
        let key = node.key.map(|key| key.to_string());
        let output = node.output.as_ref().map(|output| output.digest.to_string());
        (step.address.as_str(), NodeRun { key, output, fate, millis })
    });
    let seconds = started.elapsed();
    let began = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |now| now.saturating_sub(seconds).as_secs());
    let run = Run {
        version: env!("CARGO_PKG_VERSION"),
        platform: platform(),
        jobs,
        started: began,
        seconds: seconds.as_secs_f64(),
        nodes: nodes.collect(),
    };
    ron::ser::to_string_pretty(&run, ron::ser::PrettyConfig::new().indentor(" "))
        .expect("a run is plain data")
        + "\n"
}
