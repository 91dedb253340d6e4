//! `ivx cache gc`

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;

use ivx_cache::{CacheError, Run, Sweep, Swept, Wanted, sweep};

use super::{count, root};
use crate::command::lock;
use crate::history::Summary;
use crate::size::spell_bytes;
use crate::time::now_millis;
use crate::{OK, Trouble, args, project};

pub(super) fn gc(args: &args::Gc, out: &mut dyn Write, err: &mut dyn Write) -> Result<u8, Trouble> {
    let root = root()?;
    let age = args.older_than.map(|age| u64::try_from(age.as_millis()).unwrap_or(u64::MAX));
    let locked = lock::locked(&project::here())?;
    let wanted = |history: &[Run]| Wanted {
        runs: args.keep_runs.map(|n| last_runs(history, n)),
        since: age.map(|age| now_millis().saturating_sub(age)),
        max_bytes: args.max_size,
        locked,
    };
    let how = if args.dry_run { Sweep::Dry } else { Sweep::Wet };
    let swept = sweep(&root, how, wanted);
    if let Err(CacheError::NoKeys { .. }) = &swept {
        let help = "`ivx cache verify` puts what is damaged aside, `ivx runs drop` drops a run";
        writeln!(err, "help: {help}")?;
    }
    let swept = swept?;
    for trouble in &swept.troubles {
        writeln!(err, "note: {trouble}")?;
    }
    let Swept { records, objects, checkpoints, runs, freed, kept, left, .. } = swept;
    let what = [(records, "record"), (objects, "object"), (checkpoints, "checkpoint")];
    let what: Vec<String> = what.iter().map(|(n, what)| count(*n, what)).collect();
    let verb = if args.dry_run { "would remove" } else { "removed" };
    writeln!(out, "{verb} {} and {}", what.join(", "), count(runs, "run"))?;
    let verb = if args.dry_run { "would free" } else { "freed" };
    let (freed, stay) = (spell_bytes(freed), spell_bytes(left));
    writeln!(out, "{verb} {freed}: {} in {stay} stay", count(kept, "record"))?;
    if let Some(max) = args.max_size.filter(|max| left > *max) {
        let max = spell_bytes(max);
        writeln!(err, "note: kept runs, chosen runs and locks hold more than {max}")?;
    }
    Ok(OK)
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
