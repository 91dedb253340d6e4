//! `ivx exec`

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use ivx_cache::{Cache, CacheError, Trouble as CacheTrouble};
use ivx_engine::{
    Lock, Locks, Options, Outcome, Plan, Registration, Results, expand, page, platform, report,
    schedule, wanted,
};
use ivx_grammar::ast::Ast;
use ivx_op::Outcome as Verdict;

use super::diff::interval;
use super::origin::origin;
use super::run_file::run_file;
use super::summary;
use super::{Ready, jobs, lock, ready};
use crate::date::today;
use crate::ending::{STOP, heeding};
use crate::found;
use crate::history::{self, Files, Summary};
use crate::machine::memory;
use crate::progress::Progress;
use crate::publish::{RESULTS, in_the_way, publish, refusal};
use crate::time::now_millis;
use crate::{FAILED, OK, STOPPED, Trouble, WRONG, args, project, store};

pub(crate) fn exec(
    args: &args::Exec,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let started = Instant::now();
    let Some(mut ready) = ready(&args.spec, err)? else { return Ok(WRONG) };
    let root = ready.loaded.root.clone();
    let spec = ready.loaded.spec.clone();
    let Some(Target { name, folder, results }) = target(args, &ready, err)? else {
        return Ok(WRONG);
    };
    let locks =
        if args.lock || args.locked || args.register { Some(lock::read(&spec)?) } else { None };
    if args.locked && locks.as_ref().is_none_or(|locks| !locks.specs.contains_key(&name)) {
        writeln!(
            err,
            "error: `{name}` is not in {}: write it with `--lock` or `--register`",
            lock::FILE
        )?;
        return Ok(WRONG);
    }
    let Some(mode) = mode(args, err)? else { return Ok(WRONG) };
    // Of a large spec these are most of what is in memory: first the trees, of which it is made,
    // and then its expressions, of which the plan is.
    for file in &mut ready.loaded.project.files {
        file.ast = Ast::default();
    }
    let plan = expand(&ready.spec, &ready.registry);
    ready.spec.exprs = Vec::new();
    ready.spec.held = Vec::new();
    if !project::is_marked(&root) && !results.exists() {
        let root = root.display();
        writeln!(err, "note: there is no `.ivx` or `.git` around the spec: {root} is its project")?;
    }
    let jobs = jobs(args.jobs, err)?;
    let mut cache = Cache::open(&project::cache(&root), &platform())?;
    store::attach(&args.store, mode, &mut cache, err)?;
    for trouble in cache.troubles() {
        // What a killed writer left undone is no damage: its nodes run again.
        if !matches!(trouble, CacheTrouble::TornJournal { .. }) {
            writeln!(err, "note: {trouble}")?;
        }
    }
    let options = Options {
        jobs,
        memory: args.memory.unwrap_or_else(memory),
        fail_fast: args.fail_fast,
        library: ivx_library::SOURCE_DIGEST.to_owned(),
        checkpoint: args.checkpoint,
        stop: STOP.clone(),
    };
    let files = Files::of(&ready.loaded.project);
    let mut progress = Progress::new(err, jobs);
    let outcome = heeding(|| {
        schedule(&plan, &ready.registry, &mut cache, &options, &wanted(&plan), &mut progress)
    });
    progress.finish();
    let (outcome, report) = match outcome {
        Ok(outcome) => {
            let report = (!STOP.asked()).then(|| report(&name, &ready.spec, &plan, &outcome));
            let results = report.as_ref().map(|report| &report.results);
            let spec = &ready.spec;
            let mut summary = Summary::of(spec, &files, &plan, &outcome, results, jobs, started);
            let text = results.map(Results::to_ron);
            let kept = text.as_deref().zip(report.as_ref().map(|report| &report.files));
            if let Err(error) = note(&cache, &plan, &outcome, kept, &mut summary) {
                writeln!(err, "note: the history lacks this run: {error}")?;
            }
            (Ok(outcome), report.zip(text))
        }
        Err(error) => (Err(error), None),
    };
    store::tell(&cache, err)?;
    for trouble in cache.close()? {
        writeln!(err, "note: {trouble}")?;
    }
    let outcome = outcome?;
    let Some((report, text)) = report else {
        summary::executed(&plan, &outcome, started.elapsed(), out)?;
        writeln!(out, "stopped: what was executed is kept, and the next run goes on from there")?;
        return Ok(STOPPED);
    };
    let origin = origin(&args.spec, &files, &text, jobs, started);
    let page = page(&ready.spec, &plan, &outcome, &report, &origin);
    // Who stands in the folder stands in the old one afterwards, and would be told wrong paths.
    let shown = [RESULTS, "report.html"].map(|file| project::shown(&folder.join(file)));
    let mut set = report.files;
    set.insert(RESULTS.to_owned(), text);
    set.insert("run.ron".to_owned(), run_file(&plan, &outcome, jobs, started));
    set.insert("report.html".to_owned(), page);
    for moved in publish(&folder, &results, &set)? {
        writeln!(err, "note: a file that no run wrote is now {}", project::shown(&moved))?;
    }
    summary::write(&ready.spec, &report.results, &plan, &outcome, started.elapsed(), out)?;
    writeln!(out, "results: {}", shown[0])?;
    writeln!(out, "report:  {}", shown[1])?;
    let claims =
        report.results.experiments.values().flat_map(|experiment| experiment.claims.values());
    let broken = claims.into_iter().any(|claim| claim.outcome == Some(Verdict::Fails));
    let failed = !report.results.failures.is_empty();
    let run = (&plan, &outcome, &report.results);
    let moved = locks.map_or(Ok(false), |locks| lock_up(args, &ready, (locks, name), run, out))?;
    // The process is about to end: to give all this back piece by piece would be a large part of
    // a run that has nothing to do.
    std::mem::forget((ready, plan, outcome, report.results, set));
    Ok(if failed || moved || (args.strict && broken) { FAILED } else { OK })
}

/// Holds a run against the locks beside its spec, or writes it there; whether it found something else.
fn lock_up(
    args: &args::Exec,
    ready: &Ready,
    (locks, name): (Locks, String),
    (plan, outcome, results): (&Plan, &Outcome, &Results),
    out: &mut dyn Write,
) -> Result<bool, Trouble> {
    let registered = Registration::of(&ready.spec, &today()).with(results, interval);
    let found = if args.register {
        Lock::registering(results, registered)
    } else {
        Lock { registered: Some(registered), ..Lock::of(plan, outcome, results) }
    };
    if args.locked {
        return Ok(lock::moved(&locks.specs[&name], &found, out)?);
    }
    if results.failures.is_empty() {
        lock::write(&ready.loaded.spec, locks, name, found)?;
    }
    Ok(false)
}

/// What a run is called, and where its results lie.
struct Target {
    name: String,
    folder: PathBuf,
    /// Where those of the project lie.
    results: PathBuf,
}

/// Where the results are to lie; says so if they cannot.
fn target(
    args: &args::Exec,
    ready: &Ready,
    err: &mut dyn Write,
) -> Result<Option<Target>, Trouble> {
    let name = ready.name();
    let results = project::real(&project::results(&ready.loaded.root));
    let folder = args.out.as_deref().map_or_else(|| results.join(&name), project::real);
    let why = match &args.out {
        Some(_) => refusal(&folder, &results),
        None => in_the_way(&folder),
    };
    if let Some(why) = why {
        let shown = args
            .out
            .as_ref()
            .map_or_else(|| project::shown(&folder), |out| out.display().to_string());
        writeln!(err, "error: {shown} {why}")?;
        return Ok(None);
    }
    Ok(Some(Target { name, folder, results }))
}

/// What may be done with the store; says so if that makes no sense.
fn mode(args: &args::Exec, err: &mut dyn Write) -> Result<Option<args::StoreMode>, Trouble> {
    let mode = match store::mode(args.store_mode) {
        Ok(mode) => mode,
        Err(said) => {
            let said = said.display();
            writeln!(err, "error: `IVX_STORE_MODE` is `{said}`: write `read` or `write`")?;
            return Ok(None);
        }
    };
    if args.store_mode.is_some() && store::folder(&args.store).is_none() {
        writeln!(
            err,
            "error: `--store-mode` is of no store: add `--store DIR`, or set `IVX_STORE`"
        )?;
        return Ok(None);
    }
    Ok(Some(mode))
}

/// Adds a run to the history, with what it found out.
///
/// - `found`: the text of its results, and the files that show them; none if it was stopped.
fn note(
    cache: &Cache,
    plan: &Plan,
    outcome: &Outcome,
    found: Option<(&str, &BTreeMap<String, String>)>,
    summary: &mut Summary,
) -> Result<(), CacheError> {
    if let Some((results, files)) = found {
        let found = cache.keep_found(&found::pack(results, files, plan, outcome))?;
        summary.found = Some(found.to_string());
    }
    cache.note_run(now_millis(), history::keys(outcome), &summary.write()).map(drop)
}
