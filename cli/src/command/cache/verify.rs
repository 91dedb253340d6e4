//! `ivx cache verify`

use std::io::Write;

use ivx_cache::{Checked, check};

use super::{count, root};
use crate::size::spell_bytes;
use crate::{FAILED, OK, Trouble};

pub(super) fn verify(out: &mut dyn Write) -> Result<u8, Trouble> {
    let Checked { records, objects, object_bytes, gone, checkpoints, runs, damaged, mended } =
        check(&root()?)?;
    for trouble in &damaged {
        writeln!(out, "damaged  {trouble}")?;
    }
    let whole = [(records, "record"), (objects, "object"), (checkpoints, "checkpoint")];
    let whole: Vec<String> = whole.iter().map(|(n, what)| count(*n, what)).collect();
    let (whole, runs) = (whole.join(", "), count(runs, "run"));
    writeln!(out, "whole: {whole} and {runs}; {} in objects", spell_bytes(object_bytes))?;
    if gone > 0 {
        writeln!(out, "{} without an object: made anew when needed", count(gone, "record"))?;
    }
    if damaged.is_empty() {
        writeln!(out, "nothing is damaged")?;
        return Ok(OK);
    }
    writeln!(out, "{} damaged", damaged.len())?;
    if mended {
        writeln!(out, "damaged journals are put aside, and their whole records saved")?;
    }
    Ok(FAILED)
}
