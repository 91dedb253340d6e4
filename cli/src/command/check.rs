//! `ivx check`

use std::io::Write;

use super::ready;
use crate::args::Check;
use crate::{OK, Trouble, WRONG};

pub(crate) fn check(args: &Check, out: &mut dyn Write, err: &mut dyn Write) -> Result<u8, Trouble> {
    let Some(ready) = ready(&args.spec, err)? else { return Ok(WRONG) };
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let experiments = count(ready.spec.experiments.len(), "experiment");
    let found = if ready.n_warnings == 0 {
        "nothing wrong".to_owned()
    } else {
        count(ready.n_warnings, "warning")
    };
    writeln!(out, "{experiments}: {found}")?;
    // The process ends here: taking a large program apart first would be wasted work.
    std::mem::forget(ready);
    Ok(OK)
}
