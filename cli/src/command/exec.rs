//! `ivx exec`

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use ivx_cache::{Cache, Trouble as CacheTrouble};
use ivx_engine::{
    Fate, Lock, Options, Outcome, Plan, Report, Results, expand, platform, report, schedule, wanted,
};
use ivx_op::Outcome as Verdict;
use serde::Serialize;

use super::summary;
use super::{jobs, lock, ready};
use crate::progress::Progress;
use crate::replace::replace;
use crate::{At as _, FAILED, OK, STOP, STOPPED, Trouble, WRONG, args, project};

/// How much work a kill can cost one node.
const CHECKPOINT: Duration = Duration::from_secs(10);

pub(crate) fn exec(
    args: &args::Exec,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let started = Instant::now();
    let Some(ready) = ready(&args.spec, err)? else { return Ok(WRONG) };
    let name = project::name(&args.spec.path);
    let locks = if args.lock || args.locked { Some(lock::read(&args.spec.path)?) } else { None };
    if args.locked && locks.as_ref().is_none_or(|locks| !locks.specs.contains_key(&name)) {
        writeln!(err, "error: `{name}` is not in {}: write it with `--lock`", lock::FILE)?;
        return Ok(WRONG);
    }
    let plan = expand(&ready.spec, &ready.registry);
    let jobs = jobs(args.jobs);
    let mut cache = Cache::open(&project::cache(&ready.loaded.root), &platform())?;
    for trouble in cache.troubles() {
        // What a killed writer left undone is no damage: its nodes run again.
        if !matches!(trouble, CacheTrouble::TornJournal { .. }) {
            writeln!(err, "note: {trouble}")?;
        }
    }
    let options = Options {
        jobs,
        fail_fast: args.fail_fast,
        library: ivx_library::SOURCE_DIGEST.to_owned(),
        checkpoint: CHECKPOINT,
        stop: STOP.clone(),
    };
    let mut progress = Progress::new(err, jobs);
    let outcome =
        schedule(&plan, &ready.registry, &mut cache, &options, &wanted(&plan), &mut progress);
    progress.finish();
    for trouble in cache.close()? {
        writeln!(err, "note: {trouble}")?;
    }
    let outcome = outcome?;
    if STOP.asked() && outcome.nodes.iter().any(|node| node.fate == Fate::Waiting) {
        summary::executed(&plan, &outcome, started.elapsed(), out)?;
        writeln!(out, "stopped: what was executed is kept, and the next run goes on from there")?;
        return Ok(STOPPED);
    }
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
    let mut moved = false;
    if let Some(locks) = locks {
        let found = Lock::of(&plan, &outcome, &report.results);
        if args.locked {
            moved = lock::moved(&locks.specs[&name], &found, out)?;
        } else if !failed {
            lock::write(&args.spec.path, locks, name, found)?;
        }
    }
    Ok(if failed || moved || (args.strict && broken) { FAILED } else { OK })
}

/// Writes what changed; what the results before had written and these do not goes.
fn write_results(folder: &Path, report: &Report) -> Result<(), Trouble> {
    let results = folder.join("results.ron");
    let before = fs::read_to_string(&results).ok().and_then(|text| Results::from_ron(&text).ok());
    let before = before.map(|results| results.files()).unwrap_or_default();
    for gone in before.iter().filter(|path| !report.files.contains_key(*path)) {
        let gone = folder.join(gone);
        match fs::remove_file(&gone) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error).at(&gone),
            _ => {}
        }
    }
    for (path, text) in &report.files {
        write_file(&folder.join(path), text)?;
    }
    write_file(&results, &report.results.to_ron())
}

/// Writes a file that does not say the same already.
fn write_file(path: &Path, text: &str) -> Result<(), Trouble> {
    if fs::read(path).is_ok_and(|bytes| bytes == text.as_bytes()) {
        return Ok(());
    }
    let folder = path.parent().expect("results lie in a folder");
    fs::create_dir_all(folder).at(folder)?;
    replace(path, text)
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
