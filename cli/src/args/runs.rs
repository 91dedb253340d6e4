//! `ivx runs`, `ivx show` and `ivx report`

use std::path::PathBuf;

use clap::{Subcommand, ValueHint};

use super::Format;

#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Runs {
    #[command(subcommand)]
    pub(crate) command: Option<RunsCommand>,
    /// How to list them.
    #[arg(long, value_enum, default_value_t)]
    pub(crate) format: Format,
}

/// What to do with runs.
#[derive(Debug, Subcommand)]
pub(crate) enum RunsCommand {
    /// Keep runs, and in the cache all that they used, whatever `ivx cache gc` is told.
    Keep(Named),
    /// Take runs out of the history; what they used goes with the next `ivx cache gc` that
    /// finds no other use of it.
    Drop(Dropped),
}

#[derive(Debug, clap::Args)]
pub(crate) struct Named {
    /// Their names, as `ivx runs` lists them; the first digits are enough.
    #[arg(required = true, value_name = "RUN")]
    pub(crate) names: Vec<String>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Dropped {
    #[command(flatten)]
    pub(crate) named: Named,
    /// Do not ask. Where nobody can be asked, nothing is dropped without it.
    #[arg(long)]
    pub(crate) yes: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Show {
    /// Its name, as `ivx runs` lists it; the first digits are enough [default: the last run].
    #[arg(value_name = "RUN")]
    pub(crate) name: Option<String>,
    /// Write its results to this folder, with figures and tables. It is new or empty, or holds other results, which
    /// are replaced.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) to: Option<PathBuf>,
    /// How to say it.
    #[arg(long, value_enum, default_value_t)]
    pub(crate) format: Format,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Report {
    /// The spec, or the folder of its results [default: whichever of the project ran last].
    #[arg(value_name = "SPEC|RESULTS", value_hint = ValueHint::FilePath)]
    pub(crate) path: Option<PathBuf>,
    /// Open it in the browser: that of the variable `BROWSER`, or the one that the system has for pages.
    #[arg(long)]
    pub(crate) open: bool,
}
