//! `ivx cache ..`

use std::path::PathBuf;
use std::time::Duration;

use clap::{Subcommand, ValueHint};

use super::Format;
use crate::size::parse_bytes;
use crate::time::parse_age;

/// What to do with the cache of the project that the command is called in.
#[derive(Debug, Subcommand)]
pub(crate) enum Cache {
    /// Say how much there is of what.
    #[command(after_help = "Example: ivx cache stats --format json")]
    Stats(Stats),
    /// Remove results that nobody wants any more, and what killed runs left.
    ///
    /// What kept runs used stays (`ivx runs keep`), and what an `ivx.lock` of this project names.
    /// Without a limit, no result is removed. What would go is told first, and asked for on a terminal.
    #[command(after_help = "\
Examples:
  ivx cache gc --keep-runs 5                       only what the last 5 runs of each spec used
  ivx cache gc --older-than 30d --max-size 10GiB   what was not used for 30 days, then what was
                                                   used longest ago until the rest fits
  ivx cache gc --keep-runs 1 --max-size 10GiB      the same, but never of each spec's last run")]
    Gc(Gc),
    /// Read all of the cache, and put aside what is damaged; exit with 1 if anything is.
    #[command(after_help = "Example: ivx cache verify")]
    Verify,
    /// Make anew what can be lost: merge the journals, learn durations from the records.
    #[command(after_help = "Example: ivx cache rebuild")]
    Rebuild,
    /// Put results into an archive, all or those of one spec.
    #[command(after_help = "Example: ivx cache export thesis.ivxa --spec experiments/thesis.ivx")]
    Export(Export),
    /// Take the results of an archive in. It is checked first, and refused whole.
    ///
    /// Bytes are checked against their digests, which does not say that they were computed as
    /// their records have it: take archives from people you trust, or `ivx verify` a sample.
    #[command(after_help = "Example: ivx cache import thesis.ivxa")]
    Import(Import),
}

#[derive(Debug, clap::Args)]
pub(crate) struct Stats {
    /// How to say it.
    #[arg(long, value_enum, default_value_t)]
    pub(crate) format: Format,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Gc {
    /// Keep what the last N runs of each spec used. Without another limit, the rest goes; but
    /// what was written this week and no run mentions stays, as it may be of a run that was
    /// killed.
    #[arg(long, value_name = "N")]
    pub(crate) keep_runs: Option<usize>,
    /// Remove what was last used so long ago: `90m`, `12h`, `30d`, `8w`.
    #[arg(long, value_name = "AGE", value_parser = parse_age)]
    pub(crate) older_than: Option<Duration>,
    /// Remove what was used longest ago until the cache fits: `500MiB`, `10GiB`.
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes)]
    pub(crate) max_size: Option<u64>,
    /// Only say what would be removed.
    #[arg(long, conflicts_with = "yes")]
    pub(crate) dry_run: bool,
    /// Do not ask. Where nobody can be asked, nothing is removed without it.
    #[arg(long)]
    pub(crate) yes: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Export {
    /// The archive; one that is there is replaced.
    #[arg(value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) path: PathBuf,
    /// Only what a run of this spec would find, from the cache of its project.
    #[arg(long, value_name = "SPEC", value_hint = ValueHint::FilePath)]
    pub(crate) spec: Option<PathBuf>,
    /// The profile of that run.
    #[arg(long, requires = "spec", value_hint = ValueHint::Other)]
    pub(crate) profile: Option<String>,
    /// A parameter of that run.
    #[arg(long = "set", value_name = "NAME=VALUE", value_hint = ValueHint::Other, requires = "spec")]
    pub(crate) sets: Vec<String>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Import {
    /// The archive.
    #[arg(value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) path: PathBuf,
}
