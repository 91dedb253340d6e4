//! One file a subcommand.

mod cache;
mod check;
mod claims;
mod completions;
mod consent;
mod diff;
mod exec;
mod explain;
mod export;
mod fmt;
mod lock;
mod man;
mod measured;

mod new;
mod ops;
mod origin;
mod plan;
mod power;
mod report;
mod run_file;
mod runs;
mod show;
mod standing;
mod summary;
mod verify;
mod watch;
mod why;

use std::io::{self, IsTerminal as _, Write};

use ivx_grammar::check::{Settings, runs as can_run};
use ivx_grammar::ir;
use ivx_grammar::{Diagnostic, Severity};
use ivx_library::registry;
use ivx_op::Registry;

use crate::args;
use crate::load::{Loaded, load};
use crate::render::{render, visible};
use crate::set::sets;
use crate::{Trouble, colours, place};

pub(crate) use cache::cache;
pub(crate) use check::check;
pub(crate) use claims::claims;
pub(crate) use completions::completions;
pub(crate) use diff::diff;
pub(crate) use exec::exec;
pub(crate) use explain::explain;
pub(crate) use export::export;
pub(crate) use fmt::fmt;
pub(crate) use man::man;
pub(crate) use new::new;
pub(crate) use ops::ops;
pub(crate) use plan::plan;
pub(crate) use report::report;
pub(crate) use runs::runs;
pub(crate) use show::show;
pub(crate) use standing::standing;
pub(crate) use summary::{bracketed, difference};
pub(crate) use verify::verify;
pub(crate) use why::why;

/// A spec that can run.
struct Ready {
    spec: ir::Spec,
    loaded: Loaded,
    registry: Registry,
    settings: Settings,
    n_warnings: usize,
}

impl Ready {
    /// What its run is called: the spec's path, and what is asked beside the default.
    fn name(&self) -> String {
        let Self { spec, loaded, registry, settings, .. } = self;
        let variant = place::variant(&loaded.project, registry, settings, spec);
        let path = loaded.spec.strip_prefix(&loaded.root).unwrap_or(&loaded.spec);
        place::name(path, &variant)
    }
}

/// How many nodes run at once: as many as asked for, else one a core. Programs may wait for others,
/// so that more than one a core help, but not any number of them.
fn jobs(asked: Option<usize>, err: &mut dyn Write) -> io::Result<usize> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let (asked, most) = (asked.unwrap_or(cores), (16 * cores).max(64));
    if asked > most {
        let cores = count(cores, "core");
        writeln!(err, "note: {most} jobs instead of {asked}: more do not help on {cores}")?;
    }
    Ok(asked.min(most))
}

/// `1 record`, `2 records`.
fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// Loads and checks a spec. What is wrong with it goes to `err`; with an error among that,
/// `None`.
fn ready(args: &args::Spec, err: &mut dyn Write) -> Result<Option<Ready>, Trouble> {
    let registry = registry();
    let loaded = load(&args.path, &registry)?;
    ready_of(loaded, registry, args, err)
}

/// Checks a spec that was loaded, likewise.
fn ready_of(
    loaded: Loaded,
    registry: Registry,
    args: &args::Spec,
    err: &mut dyn Write,
) -> Result<Option<Ready>, Trouble> {
    let sets = match sets(&args.sets, &loaded.project) {
        Ok(sets) => sets,
        Err((message, help)) => {
            writeln!(err, "error: {}\nhelp: {}", visible(&message), visible(&help))?;
            return Ok(None);
        }
    };
    let settings = Settings { profile: args.profile.clone(), sets, max_nodes: args.max_nodes };
    let checked = checked(&loaded, &registry, &settings, err)?;
    Ok(checked.map(|(spec, n_warnings)| Ready { spec, loaded, registry, settings, n_warnings }))
}

/// The spec that was loaded, and how many warnings there are. What is wrong with it goes to `err`; with an error among
/// that, `None`.
fn checked(
    loaded: &Loaded,
    registry: &Registry,
    settings: &Settings,
    err: &mut dyn Write,
) -> Result<Option<(ir::Spec, usize)>, Trouble> {
    let (spec, faults) = ivx_grammar::check::check(&loaded.project, registry, settings);
    // Of text that does not read, warnings would be noise.
    let whole = can_run(&loaded.diagnostics);
    let faults = faults.into_iter().filter(|d| whole || d.code.severity() == Severity::Error);
    let mut diagnostics: Vec<Diagnostic> =
        loaded.diagnostics.iter().cloned().chain(faults).collect();
    diagnostics.sort_by_key(|d| d.labels.first().map(|label| label.span));
    let files = loaded.project.files.iter();
    let sources: Vec<_> = files.map(|file| (file.path.clone(), file.text.clone())).collect();
    tell(&diagnostics, &sources, err)?;
    let n_warnings = diagnostics.len();
    Ok(can_run(&diagnostics).then_some((spec, n_warnings)))
}

/// Writes what is wrong to `err`.
///
/// - `sources`: path and text of each file, the spec first.
fn tell(
    diagnostics: &[Diagnostic],
    sources: &[(String, String)],
    err: &mut dyn Write,
) -> Result<(), Trouble> {
    if diagnostics.is_empty() {
        return Ok(());
    }
    write!(err, "{}", render(diagnostics, sources, colours() && std::io::stderr().is_terminal()))?;
    let errors = diagnostics.iter().filter(|d| d.code.severity() == Severity::Error).count();
    if errors > 0 {
        let errors = format!("{errors} {}", if errors == 1 { "error" } else { "errors" });
        writeln!(err, "{errors} in {}", sources[0].0)?;
    }
    Ok(())
}
