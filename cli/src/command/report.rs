//! `ivx report`

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::source::no_spec;
use crate::{OK, Trouble, WRONG, args, place, project};

/// What a run calls its page.
const PAGE: &str = "report.html";

pub(crate) fn report(
    args: &args::Report,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let all = match &args.path {
        None => below(&project::results(&project::here())),
        Some(path) if path.is_dir() => match path.join(PAGE) {
            page if page.is_file() => vec![page],
            _ => below(path),
        },
        Some(path) => of_spec(path)?,
    };
    let Some(page) = last(all) else {
        let (of, spec) = match &args.path {
            None => (String::new(), "SPEC".to_owned()),
            Some(path) if path.is_dir() => (format!(" in {}", path.display()), "SPEC".to_owned()),
            Some(path) => (format!(" of {}", path.display()), path.display().to_string()),
        };
        writeln!(err, "error: there is no report{of} yet: `ivx exec {spec}` makes it")?;
        return Ok(WRONG);
    };
    let page = project::real(&page);
    writeln!(out, "{}", project::shown(&page))?;
    if args.open {
        let failed = |error: io::Error| Trouble::Content {
            path: page.display().to_string(),
            why: format!("no browser shows it: {error}"),
        };
        open(&page).map_err(failed)?;
    }
    Ok(OK)
}

/// The pages of the runs of a spec: with every profile, and whatever was set.
fn of_spec(spec: &Path) -> Result<Vec<PathBuf>, Trouble> {
    let real = fs::canonicalize(spec).map_err(|error| Trouble::Spec {
        path: spec.display().to_string(),
        why: no_spec(spec, &error),
    })?;
    let root = project::root(&real);
    let name = place::name(real.strip_prefix(&root).unwrap_or(&real), "");
    let plain = project::results(&root).join(name);
    let around = plain.parent().unwrap_or(&root);
    let own = plain.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let variants = folders(around).into_iter().filter(|folder| {
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        name.strip_prefix(&own).is_some_and(|rest| rest.starts_with('@'))
    });
    Ok([plain.clone()].into_iter().chain(variants).map(|folder| folder.join(PAGE)).collect())
}

/// The pages in all folders of a folder. Those whose names begin with a dot are being written.
fn below(folder: &Path) -> Vec<PathBuf> {
    let own = [folder.join(PAGE)];
    own.into_iter().chain(folders(folder).iter().flat_map(|folder| below(folder))).collect()
}

fn folders(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let folders = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
    let seen = folders.filter(|folder| !folder.file_name().to_string_lossy().starts_with('.'));
    let mut seen: Vec<PathBuf> = seen.map(|folder| folder.path()).collect();
    seen.sort();
    seen
}

/// That of the pages which are there that was written last.
fn last(pages: Vec<PathBuf>) -> Option<PathBuf> {
    let written =
        |page: &PathBuf| -> Option<SystemTime> { fs::metadata(page).ok()?.modified().ok() };
    let there = pages.into_iter().filter_map(|page| Some((written(&page)?, page)));
    there.max().map(|(_, page)| page)
}

/// Shows a page in the browsers that `BROWSER` names, the first that there is, else as the system does.
fn open(page: &Path) -> io::Result<()> {
    let named = std::env::var_os("BROWSER").filter(|named| !named.is_empty());
    let Some(named) = named else { return open::that_detached(page) };
    let mut failed = None;
    for browser in std::env::split_paths(&named) {
        match open::with_detached(page, browser.to_string_lossy()) {
            Ok(()) => return Ok(()),
            Err(error) => {
                let why = format!("{}: {error}", browser.display());
                failed = Some(io::Error::new(error.kind(), why));
            }
        }
    }
    Err(failed.unwrap_or_else(|| io::ErrorKind::NotFound.into()))
}
