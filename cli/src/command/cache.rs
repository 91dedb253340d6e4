//! `ivx cache ..`: one file a subcommand.

mod export;
mod gc;
mod import;
mod rebuild;
mod stats;
mod verify;

use std::io::Write;
use std::path::PathBuf;

use super::count;
use crate::{Trouble, args, project};

pub(crate) fn cache(
    command: &args::Cache,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    match command {
        args::Cache::Stats(args) => stats::stats(args, out),
        args::Cache::Gc(args) => gc::gc(args, out, err),
        args::Cache::Verify => verify::verify(out),
        args::Cache::Rebuild => rebuild::rebuild(out, err),
        args::Cache::Export(args) => export::export(args, out, err),
        args::Cache::Import(args) => import::import(args, out),
    }
}

/// Where the cache of the project lies that the command is called in.
fn root() -> Result<PathBuf, Trouble> {
    let root = project::cache(&project::here());
    if root.join("version").exists() {
        return Ok(root);
    }
    Err(Trouble::Content { path: root.display().to_string(), why: "there is no cache".to_owned() })
}
