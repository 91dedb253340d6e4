//! `ivx exec`

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use ivx_cache::{Cache, CacheError, Trouble as CacheTrouble};
use ivx_engine::{
    Crew, Listen, Lock, Locks, Options, Outcome, Plan, Registration, Report, Results, expand, page,
    platform, report, schedule_on, wanted,
};
use ivx_library::registry;
use ivx_op::Outcome as Verdict;
use serde_json::json;

use super::diff::interval;
use super::measured;
use super::origin::origin;
use super::run_file::run_file;
use super::summary;
use super::watch::watch;
use super::{Ready, jobs, lock, ready_of};
use crate::account::Account;
use crate::args::Format;
use crate::changes::Read;
use crate::cluster::Driver;
use crate::date::today;
use crate::ending::{STOP, heeding};
use crate::events::Events;
use crate::found;
use crate::history::{self, Files, Summary};
use crate::load::load;
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
    if args.watch {
        return watch(args, out, err);
    }
    let ended = once(args, &mut |_, _| Ok(()), out, err)?;
    // The process is about to end: to give this back would take a while.
    std::mem::forget(ended.found);
    Ok(ended.code)
}

/// How a run ended.
pub(super) struct Ended {
    /// The exit code.
    pub(super) code: u8,
    /// What came out; none if it was stopped or did not begin.
    pub(super) found: Option<Results>,
}

impl Ended {
    fn early(code: u8) -> Self {
        Self { code, found: None }
    }
}

/// Runs a spec.
///
/// - `see`: is told which files were read, before anything else is made of them.
pub(super) fn once(
    args: &args::Exec,
    see: &mut dyn FnMut(&Read, &mut dyn Write) -> Result<(), Trouble>,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<Ended, Trouble> {
    let started = Instant::now();
    let registry = registry();
    let loaded = load(&args.spec.path, &registry)?;
    see(&loaded.read, out)?;
    let Some(mut ready) = ready_of(loaded, registry, &args.spec, err)? else {
        return Ok(Ended::early(WRONG));
    };
    let root = ready.loaded.root.clone();
    let spec = ready.loaded.spec.clone();
    let Some(Target { name, folder, results }) = target(args, &ready, err)? else {
        return Ok(Ended::early(WRONG));
    };
    let Some(locks) = locks(args, &spec, &name, err)? else { return Ok(Ended::early(WRONG)) };
    let Some((mode, driver)) = shared(args, err)? else { return Ok(Ended::early(WRONG)) };
    // Of a large spec these are most of what is in memory: first the trees, of which it is made,
    // and then its expressions, of which the plan is.
    for file in &mut ready.loaded.project.files {
        file.ast = Arc::default();
    }
    let plan = expand(&ready.spec, &ready.registry);
    let unclaimed = measured::unclaimed(&ready.spec);
    ready.spec.exprs = Vec::new();
    ready.spec.held = Vec::new();
    if !project::is_marked(&root) && !results.exists() {
        let root = root.display();
        writeln!(err, "note: there is no `.ivx` or `.git` around the spec: {root} is its project")?;
    }
    let jobs = jobs(args.jobs, err)?;
    let mut cache = opened(args, mode, &root, err)?;
    let options = options(args, jobs);
    let files = Files::of(&ready.loaded.project);
    let is_json = args.format == Format::Json;
    let crew = driver.as_ref().map(|driver| driver as &dyn Crew);
    let of = (&plan, &ready.registry);
    let mut run = |listen: &mut dyn Listen| {
        heeding(|| schedule_on(crew, of, &mut cache, &options, &wanted(&plan), listen))
    };
    let outcome = if is_json {
        run(&mut Events::new(out))
    } else {
        let mut progress = Progress::new(err, jobs);
        let outcome = run(&mut progress);
        progress.finish();
        outcome
    };
    let ended = match outcome {
        Ok(outcome) => {
            let run = Account::of((&ready.spec, &files), (&plan, &outcome), jobs, started);
            let report = (!STOP.asked()).then(|| report(&name, &ready.spec, &plan, &outcome));
            let report = report.map(|report| (report.results.to_ron(), report));
            if let Err(error) = note(&cache, &run, report.as_ref()) {
                writeln!(err, "note: the history lacks this run: {error}")?;
            }
            Ok((outcome, report))
        }
        Err(error) => Err(error),
    };
    store::tell(&mut cache, err)?;
    for trouble in cache.close()? {
        writeln!(err, "note: {trouble}")?;
    }
    let (outcome, report) = ended?;
    let run = Account::of((&ready.spec, &files), (&plan, &outcome), jobs, started);
    let Some((text, report)) = report else {
        if is_json {
            writeln!(out, "{}", json!({ "event": "stopped" }))?;
        } else {
            summary::executed(&run, out)?;
            let kept = "what was executed is kept, and the next run goes on from there";
            writeln!(out, "stopped: {kept}")?;
        }
        return Ok(Ended::early(STOPPED));
    };
    let page = page(&ready.spec, &plan, &outcome, &report, &origin(&args.spec, &text, &run));
    // Who stands in the folder stands in the old one afterwards, and would be told wrong paths.
    let shown = [RESULTS, "report.html"].map(|file| project::shown(&folder.join(file)));
    let found = report.results;
    let mut set = report.files;
    set.insert(RESULTS.to_owned(), text);
    set.insert("run.ron".to_owned(), run_file(&run));
    set.insert("report.html".to_owned(), page);
    for moved in publish(&folder, &results, &set)? {
        writeln!(err, "note: a file that no run wrote is now {}", project::shown(&moved))?;
    }
    let run = Account { took: started.elapsed(), ..run };
    if is_json {
        writeln!(out, "{}", summary::as_json(&run, &found, &shown))?;
    } else {
        summary::write(&run, &found, &unclaimed, out)?;
        writeln!(out, "results: {}\nreport:  {}", shown[0], shown[1])?;
    }
    let mut claims = found.experiments.values().flat_map(|found| found.claims.values());
    let broken = claims.any(|claim| claim.outcome == Some(Verdict::Fails));
    let failed = !found.failures.is_empty();
    let told: &mut dyn Write = if is_json { err } else { out };
    let run = (&plan, &outcome, &found, &set);
    let moved = locks.map_or(Ok(false), |locks| lock_up(args, &ready, (locks, name), run, told))?;
    if !args.watch {
        // The process is about to end: to give all this back piece by piece would be a large part of
        // a run that has nothing to do.
        std::mem::forget((ready, plan, outcome, set));
    }
    let code = if failed || moved || (args.strict && broken) { FAILED } else { OK };
    Ok(Ended { code, found: Some(found) })
}

fn options(args: &args::Exec, jobs: usize) -> Options {
    Options {
        jobs,
        memory: args.memory.unwrap_or_else(memory),
        fail_fast: args.fail_fast,
        library: ivx_library::SOURCE_DIGEST.to_owned(),
        checkpoint: args.checkpoint,
        limit: args.node_limit,
        stop: STOP.clone(),
    }
}

/// The cache of a project, with the store that is asked for.
fn opened(
    args: &args::Exec,
    mode: args::StoreMode,
    root: &Path,
    err: &mut dyn Write,
) -> Result<Cache, Trouble> {
    let mut cache = Cache::open(&project::cache(root), &platform())?;
    store::attach(&args.store, mode, &mut cache, err)?;
    for trouble in cache.troubles() {
        // What a killed writer left undone is no damage: its nodes run again.
        if !matches!(trouble, CacheTrouble::TornJournal { .. }) {
            writeln!(err, "note: {trouble}")?;
        }
    }
    Ok(cache)
}

/// The locks beside a spec, where they are asked for; says so if there is none of it that a run could be held against.
#[expect(clippy::option_option, reason = "none asked for is not none there")]
fn locks(
    args: &args::Exec,
    spec: &Path,
    name: &str,
    err: &mut dyn Write,
) -> Result<Option<Option<Locks>>, Trouble> {
    let locks =
        if args.lock || args.locked || args.register { Some(lock::read(spec)?) } else { None };
    if args.locked && locks.as_ref().is_none_or(|locks| !locks.specs.contains_key(name)) {
        let help = "write it with `--lock` or `--register`";
        writeln!(err, "error: `{name}` is not in {}: {help}", lock::FILE)?;
        return Ok(None);
    }
    Ok(Some(locks))
}

/// Holds a run against the locks beside its spec, or writes it there; whether it found something else.
fn lock_up(
    args: &args::Exec,
    ready: &Ready,
    (locks, name): (Locks, String),
    (plan, outcome, results, files): (&Plan, &Outcome, &Results, &BTreeMap<String, String>),
    out: &mut dyn Write,
) -> Result<bool, Trouble> {
    let registered = Registration::of(&ready.spec, &today()).with(results, files, interval);
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
    if args.store_mode.is_some() && store::asked(&args.store).is_none() {
        writeln!(
            err,
            "error: `--store-mode` is of no store: add `--store PLACE`, or set `IVX_STORE`"
        )?;
        return Ok(None);
    }
    Ok(Some(mode))
}

/// What may be done with the store, and who runs nodes elsewhere; says so if that makes no sense.
fn shared(
    args: &args::Exec,
    err: &mut dyn Write,
) -> Result<Option<(args::StoreMode, Option<Driver>)>, Trouble> {
    let Some(mode) = mode(args, err)? else { return Ok(None) };
    let Some(driver) = driver(args, err)? else { return Ok(None) };
    let mode = if driver.is_some() { args::StoreMode::Write } else { mode };
    Ok(Some((mode, driver)))
}

/// Who runs nodes elsewhere, where that is asked for; says so if nobody can.
#[expect(clippy::option_option, reason = "nobody asked for is not nobody there")]
fn driver(args: &args::Exec, err: &mut dyn Write) -> Result<Option<Option<Driver>>, Trouble> {
    let Some(on) = &args.on else { return Ok(Some(None)) };
    let found = match store::asked(&args.store) {
        Some(store) => Driver::find(on, &store),
        None => {
            Err("`--on` needs a store that all machines share: add `--store`, or set `IVX_STORE`"
                .to_owned())
        }
    };
    match found {
        Ok(driver) => Ok(Some(Some(driver))),
        Err(why) => {
            writeln!(err, "error: {why}")?;
            Ok(None)
        }
    }
}

/// Adds a run to the history, with what it found out.
///
/// - `found`: the text of its results, and what shows them; none if it was stopped.
fn note(
    cache: &Cache,
    run: &Account<'_>,
    found: Option<&(String, Report)>,
) -> Result<(), CacheError> {
    let run = Account { results: found.map(|(_, report)| &report.results), ..*run };
    let mut summary = Summary::of(&run);
    if let Some((text, report)) = found {
        let found = cache.keep_found(&found::pack(text, &report.files, run.plan, run.outcome))?;
        summary.found = Some(found.to_string());
    }
    cache.note_run(now_millis(), history::keys(run.outcome), &summary.write()).map(drop)
}
