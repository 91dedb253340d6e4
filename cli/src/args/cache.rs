//! `ivx cache ..`

use std::path::PathBuf;

use clap::Subcommand;

/// What to do with the cache of the project that the command is called in.
#[derive(Debug, Subcommand)]
pub(crate) enum Cache {
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
pub(crate) struct Export {
    /// The archive; one that is there is replaced.
    #[arg(value_name = "FILE")]
    pub(crate) path: PathBuf,
    /// Only what a run of this spec would find, from the cache of its project.
    #[arg(long, value_name = "SPEC")]
    pub(crate) spec: Option<PathBuf>,
    /// The profile of that run.
    #[arg(long, requires = "spec")]
    pub(crate) profile: Option<String>,
    /// A parameter of that run.
    #[arg(long = "set", value_name = "NAME=VALUE", requires = "spec")]
    pub(crate) sets: Vec<String>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Import {
    /// The archive.
    #[arg(value_name = "FILE")]
    pub(crate) path: PathBuf,
}
