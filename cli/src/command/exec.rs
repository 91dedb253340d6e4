//! `ivx exec`

use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::time::Instant;

use ivx_cache::{Cache, CacheError, Trouble as CacheTrouble};
use ivx_engine::{
    Lock, Options, Outcome, Plan, Report, Results, expand, page, platform, report, schedule, wanted,
};
use ivx_grammar::ast::Ast;
use ivx_op::Outcome as Verdict;

use super::origin::origin;
use super::run_file::run_file;
use super::summary;
use super::{jobs, lock, ready};
use crate::ending::{STOP, heeding};
use crate::found;
use crate::history::{self, Files, Summary};
use crate::machine::memory;
use crate::progress::Progress;
use crate::replace::replace;
use crate::time::now_millis;
use crate::{At as _, FAILED, OK, STOPPED, Trouble, WRONG, args, project, store};

pub(crate) fn exec(
    args: &args::Exec,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let started = Instant::now();
    let Some(mut ready) = ready(&args.spec, err)? else { return Ok(WRONG) };
    let name = project::name(&args.spec.path);
    let locks = if args.lock || args.locked { Some(lock::read(&args.spec.path)?) } else { None };
    if args.locked && locks.as_ref().is_none_or(|locks| !locks.specs.contains_key(&name)) {
        writeln!(err, "error: `{name}` is not in {}: write it with `--lock`", lock::FILE)?;
        return Ok(WRONG);
    }
    let mode = match store::mode(args.store_mode) {
        Ok(mode) => mode,
        Err(said) => {
            let said = said.display();
            writeln!(err, "error: `IVX_STORE_MODE` is `{said}`: write `read` or `write`")?;
            return Ok(WRONG);
        }
    };
    if args.store_mode.is_some() && store::folder(&args.store).is_none() {
        writeln!(
            err,
            "error: `--store-mode` is of no store: add `--store DIR`, or set `IVX_STORE`"
        )?;
        return Ok(WRONG);
    }
    // Of a large spec these are most of what is in memory: first the trees, of which it is made,
    // and then its expressions, of which the plan is.
    for file in &mut ready.loaded.project.files {
        file.ast = Ast::default();
    }
    let plan = expand(&ready.spec, &ready.registry);
    ready.spec.exprs = Vec::new();
    ready.spec.held = Vec::new();
    let jobs = jobs(args.jobs, err)?;
    let mut cache = Cache::open(&project::cache(&ready.loaded.root), &platform())?;
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
            if let Err(error) = note(&cache, &plan, &outcome, text.as_deref(), &mut summary) {
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
    let folder = ready.loaded.root.join("results").join(&name);
    write_results(&folder, &report, &text)?;
    write_file(&folder.join("run.ron"), &run_file(&plan, &outcome, jobs, started))?;
    let origin = origin(&args.spec, &files, &text, jobs, started);
    let page = page(&ready.spec, &plan, &outcome, &report, &origin);
    write_file(&folder.join("report.html"), &page)?;
    summary::write(&ready.spec, &report.results, &plan, &outcome, started.elapsed(), out)?;
    let shown = folder.strip_prefix(&ready.loaded.root).unwrap_or(&folder);
    writeln!(out, "results: {}", shown.join("results.ron").display())?;
    writeln!(out, "report:  {}", shown.join("report.html").display())?;
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
    // The process is about to end: to give all this back piece by piece would be a large part of
    // a run that has nothing to do.
    std::mem::forget((ready, plan, outcome, report));
    Ok(if failed || moved || (args.strict && broken) { FAILED } else { OK })
}

/// Adds a run to the history, with what it found out.
///
/// - `results`: their text; none if it was stopped.
fn note(
    cache: &Cache,
    plan: &Plan,
    outcome: &Outcome,
    results: Option<&str>,
    summary: &mut Summary,
) -> Result<(), CacheError> {
    if let Some(results) = results {
        let found = cache.keep_found(&found::pack(results, plan, outcome))?;
        summary.found = Some(found.to_string());
    }
    cache.note_run(now_millis(), history::keys(outcome), &summary.write()).map(drop)
}

/// Writes what changed; what the results before had written and these do not goes.
///
/// - `text`: of the results.
fn write_results(folder: &Path, report: &Report, text: &str) -> Result<(), Trouble> {
    let results = folder.join("results.ron");
    // The same results have the same files, and need not be understood.
    let before = fs::read_to_string(&results).ok().filter(|before| *before != text);
    let before = before.and_then(|text| Results::from_ron(&text).ok());
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
    write_file(&results, text)
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
