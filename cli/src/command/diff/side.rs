//! What one name given to `ivx diff` means: a path, a run or a git revision.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::Path;

use ivx_cache::{History, Run};
use ivx_grammar::suggest;

use super::git::{self, Revision};
use crate::command::runs::{find, found};
use crate::found::Found;
use crate::history::Summary;
use crate::render::visible;
use crate::{At as _, Trouble, project};

/// One side of a comparison.
pub(super) struct Side {
    /// What it is called.
    pub(super) title: String,
    /// Its results by the name of their spec.
    pub(super) found: BTreeMap<String, Found>,
    /// Whether it is one run or results file, which is compared whatever its name.
    pub(super) is_single: bool,
}

/// The side that a name means; says so if it means none.
pub(super) fn side(
    name: &Path,
    root: &Path,
    history: Option<&History>,
    err: &mut dyn Write,
) -> Result<Option<Side>, Trouble> {
    if name.exists() {
        return of_path(name, err);
    }
    let Some(word) = name.to_str() else {
        writeln!(err, "error: {} is not there", visible(&name.to_string_lossy()))?;
        return Ok(None);
    };
    let runs = history.map(|history| history.runs.as_slice()).unwrap_or_default();
    if let Some(history) = history
        && !word.is_empty()
        && runs.iter().any(|run| run.name.starts_with(word))
    {
        return match find(runs, word, err)? {
            Some(run) => of_run(run, history, err),
            None => Ok(None),
        };
    }
    match git::at(root, word) {
        Revision::Known { commit, found } if found.is_empty() => {
            writeln!(
                err,
                "error: no results are tracked at {} ({}): commit them with \
                 `git add --force results/NAME/results.ron results/NAME/run.ron`",
                visible(word),
                &commit[..8]
            )?;
            Ok(None)
        }
        Revision::Known { commit, found } => {
            let title = format!("{word} ({})", &commit[..8]);
            Ok(Some(Side { title, found, is_single: false }))
        }
        Revision::Broken(why) => {
            writeln!(err, "error: {}", visible(&format!("{word}: {why}")))?;
            Ok(None)
        }
        Revision::Unknown => {
            unknown(word, root, runs, err)?;
            Ok(None)
        }
    }
}

/// The last two runs that found something out of one spec, the earlier first: of the spec that is
/// named, or of the one that ran last. Says which they are, or that there are none.
pub(super) fn last(
    spec: Option<&Path>,
    history: Option<&History>,
    err: &mut dyn Write,
) -> Result<Option<(Side, Side)>, Trouble> {
    let runs = history.map(|history| history.runs.as_slice()).unwrap_or_default();
    let summaries = runs.iter().map(|run| (run, Summary::read(run)));
    let told: Vec<(&Run, Summary)> = summaries.filter(|(_, s)| s.found.is_some()).collect();
    let spec = match spec {
        Some(path) => {
            let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
            let root = project::root(&path);
            Some(path.strip_prefix(&root).unwrap_or(&path).display().to_string())
        }
        None => told.last().map(|(_, summary)| summary.spec.clone()),
    };
    let (Some(history), Some(spec)) = (history, spec) else {
        writeln!(err, "error: there are no runs to compare: `ivx exec SPEC` makes one")?;
        return Ok(None);
    };
    let mut own = told.iter().rev().filter(|(_, summary)| summary.spec == spec);
    let (new, old) = (own.next(), own.next());
    let (Some((new, _)), Some((old, _))) = (new, old) else {
        let n = if new.is_some() { "one run" } else { "no run" };
        let said = format!("there is {n} of {spec}, and two are compared: `ivx runs` lists all");
        writeln!(err, "error: {}", visible(&said))?;
        return Ok(None);
    };
    let said = format!("of {spec}: the last run, {}, with the one before, {}", new.name, old.name);
    writeln!(err, "{}", visible(&said))?;
    let (before, after) = (of_run(old, history, err)?, of_run(new, history, err)?);
    Ok(before.zip(after))
}

/// The results in the project's own folder.
pub(super) fn current(root: &Path, err: &mut dyn Write) -> Result<Option<Side>, Trouble> {
    let folder = root.join("results");
    let found = folders(&folder)?;
    if found.is_empty() {
        let folder = folder.display();
        writeln!(err, "error: no results are in {folder}: `ivx exec` writes some")?;
        return Ok(None);
    }
    Ok(Some(Side { title: "results".to_owned(), found, is_single: false }))
}

fn of_path(path: &Path, err: &mut dyn Write) -> Result<Option<Side>, Trouble> {
    let title = path.display().to_string();
    if !path.is_dir() || path.join("results.ron").exists() {
        let found = super::read(path)?;
        let found = [(found.results.spec.clone(), found)].into();
        return Ok(Some(Side { title, found, is_single: true }));
    }
    let found = folders(path)?;
    if found.is_empty() {
        let path = visible(&title);
        writeln!(
            err,
            "error: no results are in {path}: there is no results.ron, nor in its folders"
        )?;
        return Ok(None);
    }
    Ok(Some(Side { title, found, is_single: false }))
}

/// The results in the folders of a folder, by the paths of these in it.
fn folders(folder: &Path) -> Result<BTreeMap<String, Found>, Trouble> {
    let read = |name: String| {
        let found = super::read(&folder.join(&name))?;
        Ok((name, found))
    };
    named(folder)?.into_iter().map(read).collect()
}

/// The paths in a folder of the folders with results, however deep. Those whose names begin with a dot are being
/// written.
fn named(folder: &Path) -> Result<Vec<String>, Trouble> {
    let mut names = Vec::new();
    let mut open = vec![String::new()];
    while let Some(above) = open.pop() {
        let own = folder.join(&above);
        let entries = match fs::read_dir(&own) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => return Err(error).at(&own),
        };
        for entry in entries {
            let entry = entry.at(&own)?;
            let (name, path) = (entry.file_name().to_string_lossy().into_owned(), entry.path());
            // A link may lead back.
            if name.starts_with('.') || !entry.file_type().at(&path)?.is_dir() {
                continue;
            }
            let name = if above.is_empty() { name } else { format!("{above}/{name}") };
            if path.join("results.ron").exists() {
                names.push(name.clone());
            }
            open.push(name);
        }
    }
    Ok(names)
}

fn of_run(run: &Run, history: &History, err: &mut dyn Write) -> Result<Option<Side>, Trouble> {
    let Some(found) = found(run, history, err)? else { return Ok(None) };
    let found = [(found.results.spec.clone(), found)].into();
    Ok(Some(Side { title: format!("run {}", run.name), found, is_single: true }))
}

/// Says that nothing is called like that, and what was perhaps meant.
fn unknown(word: &str, root: &Path, runs: &[Run], err: &mut dyn Write) -> io::Result<()> {
    let folders = named(&root.join("results")).unwrap_or_default();
    let folders = folders.into_iter().map(|name| format!("results/{name}"));
    let known: Vec<String> = folders.chain(runs.iter().map(|run| run.name.clone())).collect();
    let help = suggest(word, known.iter().map(String::as_str)).map(String::from);
    let help = help.unwrap_or_else(|| "`ivx runs` lists runs".to_owned());
    let said = format!("`{word}` is no path, no run and no git revision: {help}");
    writeln!(err, "error: {}", visible(&said))
}
