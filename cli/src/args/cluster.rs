//! The command line of what runs nodes for other machines.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Subcommand, ValueHint};
use ivx_cache::Digest;

use super::at_least_one;
use crate::size::parse_bytes;
use crate::time::parse_span;

#[derive(Debug, Subcommand)]
pub(crate) enum Node {
    /// Run keys whose tickets lie in a store, and say a line of JSON of each.
    Exec(NodeExec),
    /// Keep what stands on standard input as a log in a store.
    Log(NodeLog),
    /// Lay batches into a store for workers: a driver, which is told what to run on standard input.
    Serve(NodeServe),
}

#[derive(Debug, clap::Args)]
pub(crate) struct NodeExec {
    /// The keys.
    #[arg(required = true, value_name = "KEY")]
    pub(crate) keys: Vec<Digest>,
    /// The store that all machines share.
    #[arg(long, value_name = "STORE", value_hint = ValueHint::DirPath)]
    pub(crate) store: PathBuf,
    /// The digest of the library that the run has: another is refused.
    #[arg(long, value_name = "DIGEST")]
    pub(crate) library: Option<String>,
    /// Where this machine keeps what it fetches and makes [default: below the user's cache folder].
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) cache: Option<PathBuf>,
    /// How many threads a node keeps busy.
    #[arg(long, default_value_t = 1)]
    pub(crate) threads: usize,
    /// How much work a kill may cost a long node.
    #[arg(long, value_name = "TIME", default_value = "10s", value_parser = parse_span)]
    pub(crate) checkpoint: Duration,
    /// How long a node may compute.
    #[arg(long, value_name = "TIME", value_parser = parse_span)]
    pub(crate) node_limit: Option<Duration>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct NodeLog {
    /// What it is called.
    pub(crate) name: String,
    /// The store.
    #[arg(long, value_name = "STORE", value_hint = ValueHint::DirPath)]
    pub(crate) store: PathBuf,
}

#[derive(Debug, clap::Args)]
pub(crate) struct NodeServe {
    /// The store that all machines share.
    #[arg(long, value_name = "STORE", value_hint = ValueHint::DirPath)]
    pub(crate) store: PathBuf,
    /// The digest of the library that the run has.
    #[arg(long, value_name = "DIGEST")]
    pub(crate) library: String,
    /// What the run is called, for workers that end with it [default: a new name].
    #[arg(long, value_name = "NAME")]
    pub(crate) run: Option<String>,
    /// How long nothing is heard of a worker before what it runs is given to another.
    #[arg(long, value_name = "TIME", default_value = "15s", value_parser = parse_span)]
    pub(crate) dead: Duration,
    /// The command on other machines; workers have their own.
    #[arg(long, hide = true)]
    pub(crate) ivx: Option<PathBuf>,
    /// The version of the run's command; workers are held against its library.
    #[arg(long, hide = true)]
    pub(crate) ivx_version: Option<String>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Worker {
    /// The store that all machines share.
    #[arg(value_name = "STORE", value_hint = ValueHint::DirPath)]
    pub(crate) store: PathBuf,
    /// How many threads nodes keep busy at once [default: one a core].
    #[arg(long, value_parser = at_least_one)]
    pub(crate) cpus: Option<usize>,
    /// How much memory nodes take at once [default: all there is].
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes)]
    pub(crate) memory: Option<u64>,
    /// End after so long without work [default: never].
    #[arg(long, value_name = "TIME", value_parser = parse_span)]
    pub(crate) idle: Option<Duration>,
    /// Where this machine keeps what it fetches and makes [default: below the user's cache folder].
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) cache: Option<PathBuf>,
    /// End with the run of this name.
    #[arg(long, value_name = "NAME", hide = true)]
    pub(crate) until: Option<String>,
    /// End with the process that started it.
    #[arg(long, hide = true)]
    pub(crate) with_parent: bool,
}
