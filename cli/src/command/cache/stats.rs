//! `ivx cache stats`

use std::io::Write;
use std::time::Duration;

use ivx_cache::{Cache, OpStats, Stats};
use ivx_engine::platform;
use serde_json::{Map, Value, json};

use super::{count, root};
use crate::args::Format;
use crate::progress::spell;
use crate::size::spell_bytes;
use crate::{OK, Trouble, args};

pub(super) fn stats(args: &args::Stats, out: &mut dyn Write) -> Result<u8, Trouble> {
    let stats = Cache::look(&root()?, &platform())?.stats()?;
    match args.format {
        Format::Json => writeln!(out, "{:#}", as_json(&stats))?,
        Format::Text => tell(&stats, out)?,
    }
    Ok(OK)
}

fn tell(stats: &Stats, out: &mut dyn Write) -> std::io::Result<()> {
    let Stats { records, journals, objects, checkpoints, corrupt, .. } = stats;
    let bytes = spell_bytes;
    let (records, journals) = (count(*records, "record"), count(*journals, "journal"));
    writeln!(out, "{records} in {journals}, {}", bytes(stats.journal_bytes))?;
    writeln!(out, "{}, {}", count(*objects, "object"), bytes(stats.object_bytes))?;
    let checkpoints = count(*checkpoints, "checkpoint");
    writeln!(out, "{checkpoints}, {}", bytes(stats.checkpoint_bytes))?;
    let (runs, kept) = (count(stats.runs, "run"), stats.kept_runs);
    writeln!(out, "{runs}, {kept} of them kept, {}", bytes(stats.run_bytes))?;
    writeln!(out, "{} put aside", count(*corrupt, "damaged file"))?;
    let mut ops: Vec<_> = stats.ops.iter().collect();
    ops.sort_by_key(|(op, of)| (std::cmp::Reverse(of.bytes), *op));
    for (op, OpStats { records, bytes, millis }) in ops {
        let (bytes, took) = (spell_bytes(*bytes), spell(Duration::from_millis(*millis)));
        writeln!(out, "  {op:<24} {records:>8} records {bytes:>10}  made in {took}")?;
    }
    Ok(())
}

fn as_json(stats: &Stats) -> Value {
    let Stats { records, journals, journal_bytes, objects, object_bytes, .. } = stats;
    let Stats { checkpoints, checkpoint_bytes, corrupt, .. } = stats;
    let op =
        |of: &OpStats| json!({ "records": of.records, "bytes": of.bytes, "millis": of.millis });
    let ops: Map<String, Value> =
        stats.ops.iter().map(|(name, of)| (name.clone(), op(of))).collect();
    json!({
        "records": records,
        "journals": journals,
        "journal_bytes": journal_bytes,
        "objects": objects,
        "object_bytes": object_bytes,
        "checkpoints": checkpoints,
        "checkpoint_bytes": checkpoint_bytes,
        "runs": stats.runs,
        "kept_runs": stats.kept_runs,
        "run_bytes": stats.run_bytes,
        "corrupt": corrupt,
        "ops": ops,
    })
}
