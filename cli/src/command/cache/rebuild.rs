//! `ivx cache rebuild`

use std::io::Write;

use ivx_cache::{Rebuilt, rebuild as rebuild_cache};

use super::{count, root};
use crate::{OK, Trouble};

pub(super) fn rebuild(out: &mut dyn Write, err: &mut dyn Write) -> Result<u8, Trouble> {
    let Rebuilt { records, journals: (before, after), ops, troubles } = rebuild_cache(&root()?)?;
    for trouble in troubles {
        writeln!(err, "note: {trouble}")?;
    }
    let (records, journals) = (count(records, "record"), count(before, "journal"));
    writeln!(out, "{records} of {journals} are in {after} now")?;
    writeln!(out, "durations of {} are learned from them", count(ops, "operation"))?;
    Ok(OK)
}
