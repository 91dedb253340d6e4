//! `ivx check`

use std::io::Write;

use ivx_engine::expand;

use super::ready;
use crate::args::Check;
use crate::{OK, Trouble, WRONG};

pub(crate) fn check(args: &Check, out: &mut dyn Write, err: &mut dyn Write) -> Result<u8, Trouble> {
    let Some(ready) = ready(&args.spec, err)? else { return Ok(WRONG) };
    let plan = expand(&ready.spec, &ready.registry)?;
    let experiments = ready.spec.experiments.len();
    writeln!(out, "{experiments} experiments, {} nodes: nothing wrong", plan.graph.node_count())?;
    Ok(OK)
}
