//! `ivx claims`

use std::io::Write;
use std::path::Path;

use ivx_engine::{Registration, marks};

use super::diff::git;
use super::summary::bracketed;
use super::{lock, ready};
use crate::date::today;
use crate::render::visible;
use crate::{FAILED, OK, Trouble, WRONG, args};

/// Lists the claims of a spec, or what changed of them.
pub(crate) fn claims(
    args: &args::Claims,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let Some(ready) = ready(&args.spec, err)? else { return Ok(WRONG) };
    let Some(since) = &args.since else {
        for experiment in ready.spec.experiments.iter().filter(|own| !own.claims.is_empty()) {
            writeln!(out, "{}", experiment.name)?;
            for claim in &experiment.claims {
                let marks = bracketed(&marks(&claim.judged));
                let (words, source) = (visible(&claim.output.name), visible(&claim.output.source));
                writeln!(out, "  {words}{marks}\n      {source}")?;
            }
        }
        return Ok(OK);
    };
    let (spec, root) = (&ready.loaded.spec, &ready.loaded.root);
    let locks = if Path::new(since).is_file() {
        lock::read_file(Path::new(since))?
    } else {
        let Some(text) = git::file(root, since, &spec.with_file_name(lock::FILE)) else {
            let said =
                format!("`{since}` is no lock, and no revision of git with one beside the spec");
            writeln!(err, "error: {}", visible(&said))?;
            return Ok(WRONG);
        };
        lock::parse(&text, since)?
    };
    let name = ready.name();
    let lock = locks.specs.get(&name).and_then(|lock| lock.registered.as_ref());
    let Some(registered) = lock else {
        writeln!(err, "error: `{name}` is not registered there: `ivx exec --register` does that")?;
        return Ok(WRONG);
    };
    let changes = registered.changes(&Registration::of(&ready.spec, &today()));
    for line in &changes {
        writeln!(out, "{}", visible(line))?;
    }
    if changes.is_empty() {
        writeln!(out, "no claim, threshold or parameter changed")?;
    }
    Ok(if changes.is_empty() { OK } else { FAILED })
}
