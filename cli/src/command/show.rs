//! `ivx show`

use std::io::{self, Write};
use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use ivx_cache::{History, Run};
use ivx_engine::Setting;

use super::runs::{as_json, find, found, history, status};
use crate::account::Nodes;
use crate::args::Format;
use crate::date::spell_moment;
use crate::history::Summary;
use crate::progress::spell;
use crate::publish::{RESULTS, publish, refusal};
use crate::{OK, Trouble, WRONG, args, project};

pub(crate) fn show(
    args: &args::Show,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let Some(history) = history(err)? else { return Ok(WRONG) };
    // Every name begins like nothing.
    let last = history.runs.last().filter(|_| args.name.is_none());
    let run = match last {
        Some(run) => Some(run),
        None => find(&history.runs, args.name.as_deref().unwrap_or_default(), err)?,
    };
    let Some(run) = run else { return Ok(WRONG) };
    if let Some(to) = &args.to {
        return give_back(run, &history, to, out, err);
    }
    match args.format {
        Format::Json => writeln!(out, "{:#}", as_json(run))?,
        Format::Text => tell(run, out)?,
    }
    Ok(OK)
}

/// Writes what the cache keeps of a run's results to a folder.
fn give_back(
    run: &Run,
    history: &History,
    to: &Path,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let Some(found) = found(run, history, err)? else { return Ok(WRONG) };
    let results = project::real(&project::results(&project::here()));
    let folder = project::real(to);
    if let Some(why) = refusal(&folder, &results) {
        writeln!(err, "error: {} {why}", to.display())?;
        return Ok(WRONG);
    }
    let name = &run.name;
    if found.files.is_empty() {
        writeln!(
            err,
            "note: an earlier ivx did not keep report.md, figures and tables of run {name}: they are gone"
        )?;
    }
    writeln!(
        err,
        "note: run.ron and report.html of run {name} are not kept: another run of its spec writes such"
    )?;
    let shown = project::shown(&folder.join(RESULTS));
    let mut set = found.files;
    set.insert(RESULTS.to_owned(), found.results.to_ron());
    for moved in publish(&folder, &results, &set)? {
        writeln!(err, "note: a file that no run wrote is now {}", project::shown(&moved))?;
    }
    writeln!(out, "results: {shown}")?;
    Ok(OK)
}

fn tell(run: &Run, out: &mut dyn Write) -> io::Result<()> {
    let summary = Summary::read(run);
    let kept = if run.kept { ", kept" } else { "" };
    writeln!(out, "run {} of {}: {}{kept}", run.name, summary.spec, status(&summary))?;
    let took = spell(Duration::from_millis(summary.millis));
    writeln!(
        out,
        "  began     {}, took {took}",
        spell_moment(UNIX_EPOCH + Duration::from_millis(summary.started))
    )?;
    let profile = summary.profile.as_deref().unwrap_or("none");
    writeln!(out, "  profile   {profile}")?;
    writeln!(out, "  files     {}", summary.files)?;
    writeln!(out, "  platform  {}, {} jobs", summary.platform, summary.jobs)?;
    writeln!(out, "  ivx       {}, library {}", summary.version, summary.library)?;
    let Nodes { all, executed, hit, failed, skipped } = summary.nodes;
    write!(out, "  nodes     {all}: {executed} executed, {hit} known")?;
    if failed > 0 {
        write!(out, ", {failed} failed, {skipped} skipped because of them")?;
    }
    writeln!(out)?;
    let params = summary.params.iter().map(|(name, value)| {
        let by = summary.set_by.get(name).map_or_else(String::new, |by| format!(", by {by}"));
        format!("{name} = {}{by}", text(value))
    });
    part("parameters", params, out)?;
    let claims = summary.claims.iter().flat_map(|(experiment, claims)| {
        claims.iter().map(move |(words, verdict)| format!("{verdict:<9} {experiment}: {words}"))
    });
    part("claims", claims, out)?;
    let longest = summary.longest.iter();
    let longest =
        longest.map(|(node, ms)| format!("{:>10}  {node}", spell(Duration::from_millis(*ms))));
    part("longest", longest, out)?;
    let failures = summary.failures.iter().map(|(node, why)| format!("{node}: {why}"));
    part("failures", failures, out)
}

/// A heading and its lines, if there are any.
fn part(heading: &str, lines: impl Iterator<Item = String>, out: &mut dyn Write) -> io::Result<()> {
    let mut lines = lines.peekable();
    if lines.peek().is_some() {
        writeln!(out, "  {heading}")?;
    }
    lines.try_for_each(|line| writeln!(out, "    {line}"))
}

fn text(setting: &Setting) -> String {
    match setting {
        Setting::Bool(b) => b.to_string(),
        Setting::Int(n) => n.to_string(),
        Setting::Real(x) => format!("{x:?}"),
        Setting::Text(text) => text.clone(),
    }
}
