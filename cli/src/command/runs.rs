//! `ivx runs`

use std::io::{self, Write};
use std::path::PathBuf;
use std::time::{Duration, UNIX_EPOCH};

use ivx_cache::{History, Run};
use serde_json::{Value, json};

use super::consent::consent;
use crate::account::Nodes;
use crate::args::{Format, RunsCommand};
use crate::date::spell_moment;
use crate::found::Found;
use crate::history::{Status, Summary};
use crate::progress::spell;
use crate::render::visible;
use crate::{OK, Trouble, WRONG, args, project};

pub(crate) fn runs(
    args: &args::Runs,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let Some(history) = history(err)? else {
        return Ok(match (&args.command, args.format) {
            (Some(_), _) => WRONG,
            (None, Format::Json) => writeln!(out, "[]").map(|()| OK)?,
            (None, Format::Text) => OK,
        });
    };
    let (names, keeps) = match &args.command {
        None => {
            list(history.runs.iter(), args.format, out)?;
            return Ok(OK);
        }
        Some(RunsCommand::Keep(named)) => (&named.names, true),
        Some(RunsCommand::Drop(dropped)) => (&dropped.named.names, false),
    };
    let mut named = Vec::new();
    for name in names {
        let Some(run) = find(&history.runs, name, err)? else { return Ok(WRONG) };
        named.push(run);
    }
    if let Some(RunsCommand::Drop(dropped)) = &args.command
        && !dropped.yes
    {
        writeln!(out, "would drop, with what they found out:")?;
        list(named.iter().copied(), Format::Text, out)?;
        if !consent(err)? {
            return Ok(WRONG);
        }
    }
    for run in named {
        if keeps {
            history.keep(run)?;
        } else {
            history.forget(run)?;
        }
        writeln!(out, "{} run {}", if keeps { "kept" } else { "dropped" }, run.name)?;
    }
    Ok(OK)
}

/// The history of the project that the command is called in; says so if there is none.
pub(super) fn history(err: &mut dyn Write) -> Result<Option<History>, Trouble> {
    let root: PathBuf = project::cache(&project::here());
    if !root.join("version").exists() {
        writeln!(err, "no runs: there is no cache at {}", root.display())?;
        return Ok(None);
    }
    let history = History::open(&root)?;
    for trouble in &history.troubles {
        writeln!(err, "note: {trouble}")?;
    }
    Ok(Some(history))
}

/// What a run found out; says so if that is not known.
pub(super) fn found(
    run: &Run,
    history: &History,
    err: &mut dyn Write,
) -> Result<Option<Found>, Trouble> {
    let summary = Summary::read(run);
    let named = summary.found.as_ref().and_then(|digest| digest.parse().ok());
    let Some(digest) = named else {
        let why = match summary.status {
            Status::Stopped => "was stopped, and has no results",
            _ => "is of an ivx that did not keep results in the history: run it again",
        };
        writeln!(err, "error: run {} {why}", run.name)?;
        return Ok(None);
    };
    let Some(Ok(found)) = history.found(&digest)?.map(Found::unpack) else {
        let run = &run.name;
        writeln!(err, "error: what run {run} found out is damaged or gone from the cache")?;
        return Ok(None);
    };
    Ok(Some(found))
}

/// The one run whose name begins like that; says so if there is none, or several.
pub(super) fn find<'a>(
    runs: &'a [Run],
    name: &str,
    err: &mut dyn Write,
) -> io::Result<Option<&'a Run>> {
    let alike: Vec<&Run> = runs.iter().filter(|run| run.name.starts_with(name)).collect();
    match alike[..] {
        [run] => return Ok(Some(run)),
        [] => writeln!(err, "error: no run is called `{name}`: `ivx runs` lists them")?,
        _ => {
            let names: Vec<&str> = alike.iter().map(|run| run.name.as_str()).collect();
            writeln!(err, "error: `{name}` could be {}", names.join(" or "))?;
        }
    }
    Ok(None)
}

fn list<'a>(
    runs: impl Iterator<Item = &'a Run>,
    format: Format,
    out: &mut dyn Write,
) -> io::Result<()> {
    if format == Format::Json {
        let runs: Vec<Value> = runs.map(as_json).collect();
        return writeln!(out, "{:#}", Value::from(runs));
    }
    for run in runs {
        let summary = Summary::read(run);
        let started = spell_moment(UNIX_EPOCH + Duration::from_millis(summary.started));
        let took = spell(Duration::from_millis(summary.millis));
        let Nodes { all, executed, .. } = summary.nodes;
        let nodes = format!("{executed} of {all} executed");
        let status = status(&summary);
        write!(out, "{}  {started}  {took:>10}  {status:<8}  {nodes:<20}  ", run.name)?;
        write!(out, "{}", summary.spec)?;
        if let Some(profile) = &summary.profile {
            write!(out, " {profile}")?;
        }
        // As the command line took them.
        for (name, value) in summary.by_hand() {
            write!(out, " --set {}", visible(&format!("{name}={value}")))?;
        }
        for (n, verdict) in verdicts(&summary) {
            write!(out, ", {n} {verdict}")?;
        }
        writeln!(out, "{}", if run.kept { ", kept" } else { "" })?;
    }
    Ok(())
}

/// How a run ended, in a word.
pub(super) fn status(summary: &Summary) -> &'static str {
    match summary.status {
        Status::Finished => "finished",
        Status::Stopped => "stopped",
        Status::Failed => "failed",
    }
}

/// How many claims have each verdict.
fn verdicts(summary: &Summary) -> Vec<(usize, &str)> {
    let all: Vec<&str> = summary.claims.values().flat_map(|c| c.values()).map(|v| &**v).collect();
    let count = |verdict: &&str| all.iter().filter(|own| *own == verdict).count();
    let kinds = ["holds", "describes", "undecided", "fails", "not run"];
    kinds.iter().map(|v| (count(v), *v)).filter(|(n, _)| *n > 0).collect()
}

/// A run as programs read it.
pub(super) fn as_json(run: &Run) -> Value {
    let summary = Summary::read(run);
    let mut value = serde_json::to_value(&summary).expect("a summary is plain data");
    let by_hand = summary.by_hand().map(|(name, value)| (name.clone(), json!(value))).collect();
    value["set"] = Value::Object(by_hand);
    value["run"] = json!(run.name);
    value["kept"] = json!(run.kept);
    value["ended"] = json!(run.ended);
    value
}
