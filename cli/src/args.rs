//! The command line.

mod cache;
mod cluster;
mod help;
mod runs;

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Parser, Subcommand, ValueEnum, ValueHint};

pub(crate) use cache::*;
pub(crate) use cluster::*;
pub(crate) use help::*;
pub(crate) use runs::*;

use crate::size::parse_bytes;
use crate::time::parse_span;
use crate::version::version;

/// Reproducible machine-learning experiments as dataflow over named axes.
#[derive(Debug, Parser)]
#[command(
    name = "ivx",
    version = version(),
    after_help = "\
Exit codes: 0 all went well, 1 a node failed (or a claim, under --strict; or results or layouts \
differ), 2 the spec or the command line is wrong, 3 the disk or the cache failed, \
130 stopped by Ctrl-C (a second one does not wait for what runs)."
)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run what is not known of a spec, and write its results.
    #[command(after_help = "\
Examples: ivx exec experiments/thesis.ivx
          ivx exec experiments/thesis.ivx --set members=16 --jobs 2
          ivx exec experiments/thesis.ivx --out /tmp/thesis
          ivx exec experiments/thesis.ivx --watch

Results of experiments/thesis.ivx are written to results/experiments/thesis/. With another profile, or with a
parameter set to another value than it has, they are written beside it, to a folder called for what is other:
results/experiments/thesis@paper,members=16/. The set of files appears at once. `ivx show RUN --to DIR` gives that
of an earlier run.")]
    Exec(Exec),
    /// Say what is wrong with a spec, without running it.
    #[command(after_help = "Example: ivx check experiments/thesis.ivx")]
    Check(Check),
    /// Say what a run would do: what is known, what would run.
    #[command(after_help = "Example: ivx plan experiments/thesis.ivx --dot | dot -Tsvg > dag.svg")]
    Plan(Plan),
    /// Say what a spec claims and how it is judged, or which claims changed since they were registered.
    #[command(after_help = "\
Examples: ivx claims experiments/thesis.ivx
          ivx claims experiments/thesis.ivx --since experiments/ivx.lock
          ivx claims experiments/thesis.ivx --since HEAD~3")]
    Claims(Claims),
    /// Say why a node is known, or what differs from the nearest earlier record of it.
    #[command(after_help = "\
Examples: ivx why experiments/thesis.ivx 'overoptimisation/model[seed=0]/member[3]'
          ivx why experiments/thesis.ivx overoptimisation/model --set members=64")]
    Why(Why),
    /// Run again what is known of a spec, and say whether it comes out the same.
    #[command(after_help = "Example: ivx verify experiments/thesis.ivx --sample 5%")]
    Verify(Verify),
    /// Give specs their one layout, in place.
    #[command(after_help = "Example: ivx fmt --check experiments/ch2/*.ivx")]
    Fmt(Fmt),
    /// Say what moved between two results, and why.
    #[command(after_help = "\
Examples: ivx diff
          ivx diff results/experiments/thesis old/results.ron
          ivx diff 3f2a91bc 77aa
          ivx diff HEAD~1 --format markdown

A and B are each a path, a run or a git revision; of several the first counts. A path is a results file, its
folder, or a folder of such; alone, a spec means its last two runs. A run is what `ivx runs` lists; the first digits are enough. At a revision, results
are those tracked below results/: `git add --force results/NAME/results.ron results/NAME/run.ron`. Of one run
or file against many, that of its spec is compared.

Exit codes: 0 nothing differs, 1 something does, 2 A or B is not there.")]
    Diff(Diff),
    /// Write measures, or one model or data set, as other programs read them.
    #[command(after_help = "\
Examples: ivx export results/experiments/thesis --to measures.csv
          ivx export results/experiments/thesis overoptimisation/optimality_gap --to gap.json
          ivx export experiments/thesis.ivx 'reward_ensemble/model[seed=0]/member[3]' --to model.npz

Measures are told one number a line, with a column for each axis and dimension. JSON is an object: `measures` has a
row a number, and `claims`, unless a measure is named, each claim with its verdict, difference, interval and number of
seeds, and what it amounts to in its family. A node of a spec is taken from the cache, and nothing is run.")]
    Export(Exported),
    /// Write how each element of a paper stands: where it is, what came out, and what is not there yet.
    #[command(after_help = "\
Examples: ivx standing experiments/thesis.ron --out docs/thesis.md
          ivx standing experiments/thesis.ron --out docs/thesis.md --check

LIST says what the paper has, element by element, and in which experiment each is. Verdicts and tables are those
that `ivx exec --register` put into `ivx.lock`, and nothing is run. It is wrong to name what is not there, and to leave
out a claim.")]
    Standing(Standing),
    /// List the operations and parts that specs can use.
    #[command(after_help = "Example: ivx ops argmax")]
    Ops(Ops),
    /// Say what a fault such as IVX0302 means, or list them all.
    #[command(after_help = "Example: ivx explain IVX0302")]
    Explain(Explain),
    /// List the runs of the project, or keep or drop one.
    #[command(after_help = "Example: ivx runs keep 3f2a91bc")]
    Runs(Runs),
    /// Say what is remembered of a run, or write its results again.
    #[command(after_help = "\
Examples: ivx show 3f2a
          ivx show 3f2a --to /tmp/earlier")]
    Show(Show),
    /// Say where the last report of a spec is, or open it.
    #[command(after_help = "\
Examples: ivx report experiments/thesis.ivx
          ivx report --open
          ivx report results/experiments/thesis@paper --open

Of the runs of a spec, with whichever profile and parameters, the report of the last one to end is meant.")]
    Report(Report),
    /// Say what the cache holds, and mend or empty it.
    #[command(subcommand, after_help = "Example: ivx cache stats")]
    Cache(Cache),
    /// Serve an editor: faults, names and verdicts while a spec is written.
    #[command(after_help = "\
Editors start it and speak with it over standard input and output, in the Language Server Protocol: `editors/README.md`
says how for VS Code, Neovim, Helix and others.")]
    Lsp,
    /// Run nodes for runs on other machines, which share a store: until Ctrl-C.
    #[command(after_help = "\
Examples: ivx worker /shared/store
          ivx worker /shared/store --cpus 8 --memory 32GiB --idle 10m

A run hands nodes to workers with `ivx exec SPEC --store /shared/store --on workers`.")]
    Worker(Worker),
    /// Run single nodes: what drivers of clusters call.
    #[command(subcommand)]
    Node(Node),
    /// Write a small spec to begin with.
    #[command(after_help = "Example: ivx new first && ivx exec first.ivx")]
    New(New),
    /// Write what completes command lines of ivx in a shell.
    #[command(after_help = "\
Examples: ivx completions bash > ~/.local/share/bash-completion/completions/ivx
          ivx completions zsh > ~/.zfunc/_ivx
          ivx completions fish > ~/.config/fish/completions/ivx.fish")]
    Completions(Completions),
    /// Write the manual, a page for each subcommand.
    #[command(after_help = "Example: ivx man ~/.local/share/man/man1 && man ivx-exec")]
    Man(Man),
}

/// How something is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// For people.
    #[default]
    Text,
    /// For programs.
    Json,
}

/// Which spec, and with which parameters.
#[derive(Debug, clap::Args)]
pub(crate) struct Spec {
    /// The spec.
    #[arg(value_name = "SPEC", value_hint = ValueHint::FilePath)]
    pub(crate) path: PathBuf,
    /// The profile; `paper` gives every parameter its default. Without one, `quick` where it
    /// is declared.
    #[arg(long, value_hint = ValueHint::Other)]
    pub(crate) profile: Option<String>,
    /// Set a parameter: `--set members=16` or `--set overoptimisation.members=16`.
    #[arg(long = "set", value_name = "NAME=VALUE", value_hint = ValueHint::Other)]
    pub(crate) sets: Vec<String>,
    /// The most nodes that the spec may expand to, and the most coordinates of one axis
    /// [default: 1000000].
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    pub(crate) max_nodes: Option<usize>,
}

/// Where results may be known beside the cache.
#[derive(Debug, clap::Args)]
pub(crate) struct Store {
    /// Take results that the cache lacks from the store at this place: a folder, `s3://BUCKET/PREFIX`, `gs://` or
    /// `az://` [default: `IVX_STORE`].
    #[arg(long, value_name = "PLACE", value_hint = ValueHint::DirPath)]
    pub(crate) store: Option<OsString>,
}

/// Whether results are put into a store.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum StoreMode {
    /// They are only taken from there.
    Read,
    /// New ones are put there, too.
    Write,
}

#[derive(Debug, clap::Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of its own")]
pub(crate) struct Exec {
    #[command(flatten)]
    pub(crate) spec: Spec,
    #[command(flatten)]
    pub(crate) store: Store,
    /// Whether to put new results into the store, too [default: `IVX_STORE_MODE`, else read].
    #[arg(long, value_name = "MODE", value_enum)]
    pub(crate) store_mode: Option<StoreMode>,
    /// Run nodes on other machines, which share the store: `ray`, `slurm` or `workers`, with words for that driver
    /// behind it, such as `slurm --workers 8`. Results are put into the store.
    #[arg(long, value_name = "WHERE")]
    pub(crate) on: Option<String>,
    /// How many threads nodes keep busy at once [default: one a core]. More than help are not
    /// started.
    #[arg(long, short, value_parser = at_least_one)]
    pub(crate) jobs: Option<usize>,
    /// How much memory nodes take at once, by their own estimates: `4GiB` [default: all there
    /// is]. One that takes more runs alone.
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes)]
    pub(crate) memory: Option<u64>,
    /// How much work a kill may cost a long node: so often its progress is kept, or less often where keeping it takes
    /// more than a fiftieth of the time.
    #[arg(long, value_name = "TIME", default_value = "10s", value_parser = parse_span)]
    pub(crate) checkpoint: Duration,
    /// How long a node may compute: a long one that takes longer keeps what it did and fails, and the next run goes
    /// on from there.
    #[arg(long, value_name = "TIME", value_parser = parse_span)]
    pub(crate) node_limit: Option<Duration>,
    /// For people, a bar or lines; for programs, an object a line of what happens, and then of what came out.
    #[arg(long, value_enum, default_value_t)]
    pub(crate) format: Format,
    /// Write results to this folder instead. It is new or empty, or holds other results, which are replaced.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    /// Fail when a claim fails.
    #[arg(long)]
    pub(crate) strict: bool,
    /// Keep what this run finds in `ivx.lock`, beside the spec.
    #[arg(long, conflicts_with = "locked")]
    pub(crate) lock: bool,
    /// Register the claims and what came out in `ivx.lock`, beside the spec: as `--lock`, without the bytes that this
    /// machine made, so that it can be committed.
    #[arg(long, conflicts_with_all = ["lock", "locked"])]
    pub(crate) register: bool,
    /// Fail when this run finds something else than `ivx.lock` has: other bytes on the same
    /// platform, measures beyond a millionth on another; of registered claims another text or verdict, a measure outside
    /// of its interval, another parameter.
    #[arg(long)]
    pub(crate) locked: bool,
    /// End the run with the first failure.
    #[arg(long, conflicts_with = "keep_going")]
    pub(crate) fail_fast: bool,
    /// Go on with what does not depend on a failure; this is the default.
    #[arg(long)]
    pub(crate) keep_going: bool,
    /// Run again whenever a file changes that the spec read: itself, those that it uses, includes or names, and programs.
    /// A run that such a change meets is stopped as by Ctrl-C, and what it did is kept. Ends with Ctrl-C.
    #[arg(long)]
    pub(crate) watch: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Check {
    #[command(flatten)]
    pub(crate) spec: Spec,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Claims {
    #[command(flatten)]
    pub(crate) spec: Spec,
    /// What to compare with: a lock, or a revision of git whose lock beside the spec is meant.
    #[arg(long, value_name = "LOCK|REV")]
    pub(crate) since: Option<String>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Plan {
    #[command(flatten)]
    pub(crate) spec: Spec,
    #[command(flatten)]
    pub(crate) store: Store,
    /// List every node.
    #[arg(long)]
    pub(crate) nodes: bool,
    /// Print the graph in Graphviz' language.
    #[arg(long, conflicts_with = "nodes")]
    pub(crate) dot: bool,
    /// Say what the claims that were judged could tell: the smallest difference, and about how many seeds would tell
    /// that seen, in four of five cases.
    #[arg(long, conflicts_with_all = ["nodes", "dot"])]
    pub(crate) power: bool,
    /// How to say it.
    #[arg(long, value_enum, default_value_t, conflicts_with_all = ["nodes", "dot", "power"])]
    pub(crate) format: Format,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Why {
    #[command(flatten)]
    pub(crate) spec: Spec,
    #[command(flatten)]
    pub(crate) store: Store,
    /// A node as `ivx plan --nodes` lists it, or how its name begins.
    #[arg(value_name = "NODE")]
    pub(crate) node: String,
    /// How to say it.
    #[arg(long, value_enum, default_value_t)]
    pub(crate) format: Format,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Verify {
    #[command(flatten)]
    pub(crate) spec: Spec,
    #[command(flatten)]
    pub(crate) store: Store,
    /// How much of what is known: `5%`. The same nodes are chosen each time.
    #[arg(long, value_name = "SHARE", default_value = "100%", value_parser = share)]
    pub(crate) sample: f64,
    /// How many nodes run at once [default: one a core].
    #[arg(long, short, value_parser = at_least_one)]
    pub(crate) jobs: Option<usize>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Standing {
    /// The list, as RON.
    #[arg(value_name = "LIST", value_hint = ValueHint::FilePath)]
    pub(crate) list: PathBuf,
    /// Write the page to this file, in whose folder its links begin [default: standard output].
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) out: Option<PathBuf>,
    /// Write nothing, and exit with 1 if the file is not as it would be written.
    #[arg(long, requires = "out")]
    pub(crate) check: bool,
}

/// A number of things of which there is at least one.
fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("nothing would run: write at least 1".to_owned()),
        Ok(n) => Ok(n),
        Err(_) => Err("write a whole number of at least 1".to_owned()),
    }
}

/// A relative difference, such as `1e-9`.
fn tolerance(text: &str) -> Result<f64, String> {
    let tolerance = text.parse().ok().filter(|x: &f64| x.is_finite() && *x >= 0.0);
    tolerance.ok_or("write a number of at least 0, such as `1e-6`".to_owned())
}

/// A share from 0 to 1, written in percent.
fn share(text: &str) -> Result<f64, String> {
    let percent = text.strip_suffix('%').and_then(|percent| percent.trim().parse::<f64>().ok());
    let percent = percent.filter(|percent| (0.0..=100.0).contains(percent));
    percent.map(|percent| percent / 100.0).ok_or_else(|| match text.parse::<f64>() {
        Ok(_) => format!("it has no unit: write `{text}%`"),
        Err(_) => "write a share from `0%` to `100%`, such as `5%`".to_owned(),
    })
}

#[derive(Debug, clap::Args)]
pub(crate) struct Fmt {
    /// The specs; those that change are listed.
    #[arg(required = true, value_name = "FILES", value_hint = ValueHint::FilePath)]
    pub(crate) paths: Vec<PathBuf>,
    /// Only list what would change; exit with 1 if anything would.
    #[arg(long)]
    pub(crate) check: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Diff {
    /// What was: a path, a run or a git revision [default: the run before the last, of the same spec].
    #[arg(value_name = "A", value_hint = ValueHint::FilePath)]
    pub(crate) before: Option<PathBuf>,
    /// What is, likewise [default: the project's results; without A, the last run].
    #[arg(value_name = "B", value_hint = ValueHint::FilePath)]
    pub(crate) after: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) store: Store,
    /// By how much a number may move, relative to its size.
    #[arg(long, default_value_t = 1e-9, value_parser = tolerance)]
    pub(crate) tolerance: f64,
    /// Name every node that is new, gone or another.
    #[arg(long)]
    pub(crate) nodes: bool,
    /// How to say it.
    #[arg(long, value_enum, default_value_t)]
    pub(crate) format: DiffFormat,
}

/// How differences are told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum DiffFormat {
    /// For people.
    #[default]
    Text,
    /// For programs.
    Json,
    /// For a comment on a pull request.
    Markdown,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Exported {
    #[command(flatten)]
    pub(crate) spec: Spec,
    #[command(flatten)]
    pub(crate) store: Store,
    /// Of results: only the measures whose names begin so. Of a spec: a node, as `ivx plan --nodes` lists
    /// it.
    #[arg(value_name = "NAME")]
    pub(crate) name: Option<String>,
    /// The file; its name ends in `.csv`, `.json` or `.parquet` for measures, in `.npz` or `.safetensors` for a node.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) to: PathBuf,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Ops {
    /// Only this one, in full.
    pub(crate) name: Option<String>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Explain {
    /// Only this one, with an example.
    pub(crate) code: Option<String>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct New {
    /// The name of the spec; the file is NAME.ivx, and must not be there.
    pub(crate) name: PathBuf,
}
