//! `ivx diff`

use std::fs;
use std::io::Write;
use std::path::Path;

use ivx_engine::Results;

use crate::args::Diff;
use crate::{At as _, FAILED, OK, Trouble};

pub(crate) fn diff(args: &Diff, out: &mut dyn Write, _: &mut dyn Write) -> Result<u8, Trouble> {
    let (before, after) = (read(&args.before)?, read(&args.after)?);
    let changes = ivx_engine::diff(&before, &after, args.tolerance);
    for change in &changes {
        writeln!(out, "{change}")?;
    }
    if changes.is_empty() {
        writeln!(out, "no differences")?;
        return Ok(OK);
    }
    Ok(FAILED)
}

pub(super) fn read(path: &Path) -> Result<Results, Trouble> {
    let path = if path.is_dir() { path.join("results.ron") } else { path.to_owned() };
    let text = fs::read_to_string(&path).at(&path)?;
    Results::from_ron(&text)
        .map_err(|why| Trouble::Content { path: path.display().to_string(), why: why.to_string() })
}
