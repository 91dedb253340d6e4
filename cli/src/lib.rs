//! The only crate that prints, reads files and knows the user.

mod account;
mod advice;
mod args;
mod changes;
mod cluster;
mod command;
mod date;
mod ending;
mod events;
mod found;
mod history;
mod load;
mod lsp;
mod machine;
mod place;
mod progress;
mod project;
mod publish;
mod reference;
mod render;
mod replace;
mod set;
mod setter;
mod size;
mod source;
mod store;
mod time;
mod version;

use std::ffi::OsString;
use std::io::Write;

use args::{Args, Command};
use clap::Parser as _;

pub use ending::interrupt;
pub use reference::reference;

/// Everything went well.
pub const OK: u8 = 0;
/// Something failed: a node, a claim under `--strict`, or two results or layouts differ.
pub const FAILED: u8 = 1;
/// The spec or the command line is wrong.
pub const WRONG: u8 = 2;
/// The disk or the cache failed.
pub const BROKEN: u8 = 3;

/// The command was stopped by hand.
pub const STOPPED: u8 = 130;

/// Runs the command with these arguments, the first being its name. Returns the exit code.
pub fn run(
    args: impl IntoIterator<Item = OsString>,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> u8 {
    let line: Vec<OsString> = args.into_iter().collect();
    let args = match Args::try_parse_from(&line) {
        Ok(args) => args,
        Err(usage) => {
            let (to, code): (&mut dyn Write, u8) =
                if usage.use_stderr() { (err, WRONG) } else { (out, OK) };
            let text = if colours() {
                usage.render().ansi().to_string()
            } else {
                usage.render().to_string()
            };
            let help = advice::advice(&usage, &line).map(|help| format!("help: {help}\n"));
            let help = help.unwrap_or_default();
            return write!(to, "{text}{help}").map_or(BROKEN, |()| code);
        }
    };
    let done = match &args.command {
        Command::Exec(args) => command::exec(args, out, err),
        Command::Check(args) => command::check(args, out, err),
        Command::Plan(args) => command::plan(args, out, err),
        Command::Claims(args) => command::claims(args, out, err),
        Command::Why(args) => command::why(args, out, err),
        Command::Verify(args) => command::verify(args, out, err),
        Command::Fmt(args) => command::fmt(args, out, err),
        Command::Diff(args) => command::diff(args, out, err),
        Command::Export(args) => command::export(args, out, err),
        Command::Ops(args) => command::ops(args, out, err),
        Command::Explain(args) => command::explain(args, out, err),
        Command::Runs(args) => command::runs(args, out, err),
        Command::Show(args) => command::show(args, out, err),
        Command::Standing(args) => command::standing(args, out, err),
        Command::Cache(args) => command::cache(args, out, err),
        Command::New(args) => command::new(args, out, err),
        Command::Lsp => lsp::lsp(),
        Command::Worker(args) => cluster::worker(args, out, err),
        Command::Node(args::Node::Exec(args)) => cluster::exec(args, out, err),
        Command::Node(args::Node::Log(args)) => cluster::log(args, err),
        Command::Node(args::Node::Serve(args)) => cluster::serve(args, out, err),
        Command::Report(args) => command::report(args, out, err),
        Command::Completions(args) => command::completions(args, out),
        Command::Man(args) => command::man(args, out),
    };
    match done {
        Ok(code) => code,
        // Whoever reads our output has seen enough, as in `ivx ops | head`.
        Err(Trouble::Output(error)) if error.kind() == std::io::ErrorKind::BrokenPipe => OK,
        Err(trouble) => {
            // Where this cannot be written either, the code is all that is left.
            let _ = writeln!(err, "error: {trouble}");
            if matches!(trouble, Trouble::Spec { .. } | Trouble::Store(_)) { WRONG } else { BROKEN }
        }
    }
}

/// Whether output to a person may have colours.
fn colours() -> bool {
    use std::io::IsTerminal as _;
    std::env::var_os("NO_COLOR").is_none_or(|no| no.is_empty()) && std::io::stderr().is_terminal()
}

/// A failure of the world around the command.
#[derive(Debug, thiserror::Error)]
enum Trouble {
    /// A file cannot be read or written.
    #[error("{path}: {source}")]
    File {
        /// Which.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// The spec cannot be read.
    #[error("{path}: {why}")]
    Spec {
        /// Its path.
        path: String,
        /// Why, and what was perhaps meant.
        why: String,
    },
    /// A file does not hold what it should.
    #[error("{path}: {why}")]
    Content {
        /// Which.
        path: String,
        /// What is wrong.
        why: String,
    },
    /// Output cannot be written.
    #[error("output: {0}")]
    Output(#[from] std::io::Error),
    /// The cache fails.
    #[error(transparent)]
    Cache(#[from] ivx_cache::CacheError),
    /// What is said to be a store can't be one.
    #[error("the store: {0}")]
    Store(String),
}

/// Errors of files get the path.
trait At<T> {
    fn at(self, path: &std::path::Path) -> Result<T, Trouble>;
}

impl<T> At<T> for std::io::Result<T> {
    fn at(self, path: &std::path::Path) -> Result<T, Trouble> {
        self.map_err(|source| Trouble::File { path: path.display().to_string(), source })
    }
}
