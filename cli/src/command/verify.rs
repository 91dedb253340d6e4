//! `ivx verify`

use std::io::Write;
use std::time::Instant;

use ivx_cache::Cache;
use ivx_engine::{Verified, consult, expand, platform};

use super::{jobs, ready};
use crate::args::StoreMode;
use crate::progress::{Progress, spell};
use crate::render::visible;
use crate::{FAILED, OK, Trouble, WRONG, args, project, store};

pub(crate) fn verify(
    args: &args::Verify,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let started = Instant::now();
    let Some(ready) = ready(&args.spec, err)? else { return Ok(WRONG) };
    let plan = expand(&ready.spec, &ready.registry);
    let mut cache = Cache::open(&project::cache(&ready.loaded.root), &platform())?;
    store::attach(&args.store, StoreMode::Read, &mut cache, err)?;
    consult(&plan, &ready.registry, &mut cache);
    let jobs = jobs(args.jobs, err)?;
    let mut progress = Progress::new(err, jobs);
    let verified =
        ivx_engine::verify(&plan, &ready.registry, &cache, args.sample, jobs, &mut progress);
    progress.finish();
    let verified = verified?;
    store::notes(&mut cache, err)?;
    let (mut same, mut close, mut gone, mut wrong) = (0, 0, 0, 0);
    for (node, verified) in &verified {
        let address = visible(&plan.graph[*node].address);
        match verified {
            Verified::Same => same += 1,
            Verified::Gone => gone += 1,
            Verified::Close { by } => {
                close += 1;
                writeln!(out, "close    {address}: within {by:.1e} of another platform")?;
            }
            Verified::Differs { known, found, platform } => {
                wrong += 1;
                let (known, found) = (known.short(), found.short());
                writeln!(out, "differs  {address}: {known} on {platform}, now {found}")?;
            }
            Verified::Failed { why } => {
                wrong += 1;
                writeln!(out, "failed   {address}: {why}")?;
            }
        }
    }
    write!(
        out,
        "{} of {} nodes run again: {same} the same",
        verified.len(),
        plan.graph.node_count()
    )?;
    let others = [(close, "close"), (wrong, "not"), (gone, "without the bytes they need")];
    for (n, what) in others.iter().filter(|(n, _)| *n > 0) {
        write!(out, ", {n} {what}")?;
    }
    writeln!(out, " ({})", spell(started.elapsed()))?;
    Ok(if wrong > 0 { FAILED } else { OK })
}
