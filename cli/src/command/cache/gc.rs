//! `ivx cache gc`

use std::cell::RefCell;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};
use std::path::Path;

use ivx_cache::{CacheError, Run, Sweep, Swept, Wanted, sweep};

use super::{count, root};
use crate::command::consent::consent;
use crate::command::lock;
use crate::history::Summary;
use crate::render::visible;
use crate::size::spell_bytes;
use crate::time::now_millis;
use crate::{OK, Trouble, WRONG, args, project};

/// How many runs of a spec, and how many experiments, are named.
const MOST: usize = 10;

pub(super) fn gc(args: &args::Gc, out: &mut dyn Write, err: &mut dyn Write) -> Result<u8, Trouble> {
    let root = root()?;
    let age = args.older_than.map(|age| u64::try_from(age.as_millis()).unwrap_or(u64::MAX));
    let locked = lock::locked(&project::here())?;
    let specs = RefCell::new(BTreeMap::new());
    let wanted = |history: &[Run]| {
        let of = |run: &Run| (run.name.clone(), Summary::read(run).spec);
        *specs.borrow_mut() = history.iter().map(of).collect();
        Wanted {
            runs: args.keep_runs.map(|n| last_runs(history, n)),
            since: age.map(|age| now_millis().saturating_sub(age)),
            max_bytes: args.max_size,
            locked: locked.clone(),
        }
    };
    if args.dry_run || !args.yes {
        let swept = swept(&root, Sweep::Dry, wanted, err)?;
        let deletes = swept.records + swept.objects + swept.checkpoints + swept.runs.len() > 0;
        if args.dry_run || deletes {
            tell(&swept, Sweep::Dry, &specs.borrow(), out)?;
            note(&swept, args.max_size, err)?;
        }
        if args.dry_run {
            return Ok(OK);
        }
        if deletes && !consent(err)? {
            return Ok(WRONG);
        }
    }
    let swept = swept(&root, Sweep::Wet, wanted, err)?;
    tell(&swept, Sweep::Wet, &specs.borrow(), out)?;
    note(&swept, args.max_size, err)?;
    Ok(OK)
}

fn swept(
    root: &Path,
    how: Sweep,
    wanted: impl FnOnce(&[Run]) -> Wanted,
    err: &mut dyn Write,
) -> Result<Swept, Trouble> {
    let swept = sweep(root, how, wanted);
    if let Err(CacheError::NoKeys { .. }) = &swept {
        let help = "`ivx cache verify` puts what is damaged aside, `ivx runs drop` drops a run";
        writeln!(err, "help: {help}")?;
    }
    Ok(swept?)
}

/// Says what goes and whose it is, and what stays.
///
/// - `specs`: of each run.
fn tell(
    swept: &Swept,
    how: Sweep,
    specs: &BTreeMap<String, String>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let Swept { records, objects, checkpoints, runs, experiments, freed, kept, left, .. } = swept;
    let what = [(*records, "record"), (*objects, "object"), (*checkpoints, "checkpoint")];
    let what: Vec<String> = what.iter().map(|(n, what)| count(*n, what)).collect();
    let would = if how == Sweep::Dry { "would remove" } else { "removed" };
    writeln!(out, "{would} {} and {}", what.join(", "), count(runs.len(), "run"))?;
    let mut of_spec = BTreeMap::<&str, Vec<&str>>::new();
    for run in runs {
        of_spec.entry(specs.get(run).map_or("", |spec| spec)).or_default().push(run);
    }
    for (spec, runs) in of_spec {
        let more = runs.len().saturating_sub(MOST);
        let shown = runs[..runs.len() - more].join(", ");
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        writeln!(out, "  {} of {}: {shown}{more}", count(runs.len(), "run"), visible(spec))?;
    }
    let mut experiments: Vec<_> = experiments.iter().collect();
    experiments.sort_by_key(|(name, n)| (Reverse(*n), *name));
    for (experiment, n) in experiments.iter().take(MOST) {
        writeln!(out, "  {} of {}", count(**n, "record"), visible(experiment))?;
    }
    if experiments.len() > MOST {
        writeln!(out, "  and those of {}", count(experiments.len() - MOST, "experiment"))?;
    }
    let would = if how == Sweep::Dry { "would free" } else { "freed" };
    let (freed, stay) = (spell_bytes(*freed), spell_bytes(*left));
    writeln!(out, "{would} {freed}: {} in {stay} stay", count(*kept, "record"))
}

/// Says what was damaged, and whether a limit is not met.
fn note(swept: &Swept, max_size: Option<u64>, err: &mut dyn Write) -> io::Result<()> {
    for trouble in &swept.troubles {
        writeln!(err, "note: {trouble}")?;
    }
    if let Some(max) = max_size.filter(|max| swept.left > *max) {
        let max = spell_bytes(max);
        writeln!(err, "note: kept runs, chosen runs and locks hold more than {max}")?;
    }
    Ok(())
}

/// The names of the last `n` runs of each spec.
fn last_runs(history: &[Run], n: usize) -> BTreeSet<String> {
    let mut of_spec = BTreeMap::<String, usize>::new();
    let mut last = BTreeSet::new();
    for run in history.iter().rev() {
        let before = of_spec.entry(Summary::read(run).spec).or_default();
        if *before < n {
            last.insert(run.name.clone());
        }
        *before += 1;
    }
    last
}
