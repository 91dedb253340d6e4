//! The second store that a command is given.

use std::env::var_os;
use std::ffi::OsString;
use std::io::{self, Write};
use std::time::Duration;

use clap::ValueEnum as _;
use ivx_cache::{Cache, Mode, Place, Second, Traffic, Trouble as CacheTrouble};

use crate::Trouble;
use crate::args::{self, StoreMode};
use crate::ending::{STOP, is_ending};

/// How long it takes until it is said that results are still being put there.
const QUIET: Duration = Duration::from_secs(2);
/// How often that is said again.
const AGAIN: Duration = Duration::from_secs(10);
/// How long results are still put there when the command is to end.
const ENDING: Duration = Duration::from_millis(500);

/// Puts the store that is asked for behind the cache, and says what is there; one that can't be
/// used is a note.
pub(crate) fn attach(
    args: &args::Store,
    mode: StoreMode,
    cache: &mut Cache,
    err: &mut dyn Write,
) -> Result<(), Trouble> {
    let Some(text) = asked(args) else { return Ok(()) };
    let place = Place::parse(&text).map_err(Trouble::Store)?;
    let name = place.to_string();
    let mode = match mode {
        StoreMode::Read => Mode::Read,
        StoreMode::Write => Mode::Write,
    };
    match place.open(mode).and_then(|store| Second::new(store, name.clone(), mode)) {
        Ok(second) => {
            let n_keys = second.n_keys();
            let results = if n_keys == 1 { "result" } else { "results" };
            let then = match mode {
                Mode::Read => "nothing is put there",
                Mode::Write => "new ones are put there",
            };
            writeln!(err, "store {name}: {n_keys} {results}, {then}")?;
            cache.attach(second);
        }
        Err(error) => writeln!(err, "note: the store {name} is not used: {error}")?,
    }
    Ok(())
}

/// The store that the command line names, else the environment.
pub(crate) fn asked(args: &args::Store) -> Option<OsString> {
    args.store.clone().or_else(|| variable("IVX_STORE"))
}

/// Waits for what is still to be put into the store, and says what went between it and the cache, if anything did.
pub(crate) fn tell(cache: &mut Cache, err: &mut dyn Write) -> io::Result<()> {
    if is_ending() || STOP.asked() {
        cache.wait_for_second(ENDING);
    } else {
        let mut patience = QUIET;
        while let left @ 1.. = cache.wait_for_second(patience) {
            writeln!(err, "store: {left} results are still to be put there")?;
            patience = AGAIN;
        }
    }
    let left = cache.wait_for_second(Duration::ZERO);
    if left > 0 {
        writeln!(err, "note: {left} results are not in the store; the next run puts them there")?;
        cache.leave_second();
    }
    match cache.second().map(Second::traffic) {
        Some(Traffic { taken, copied, put }) if taken + copied + put > 0 => {
            writeln!(
                err,
                "store: {taken} results taken, {copied} objects copied, {put} results put"
            )
        }
        _ => Ok(()),
    }
}

/// Says what was wrong with the store, where nothing else is said of the cache.
pub(crate) fn notes(cache: &mut Cache, err: &mut dyn Write) -> io::Result<()> {
    let troubles = cache.troubles().into_iter();
    for trouble in troubles.filter(|trouble| matches!(trouble, CacheTrouble::Store { .. })) {
        writeln!(err, "note: {trouble}")?;
    }
    Ok(())
}

/// What the command line says, else the environment; what that says wrongly is returned.
pub(crate) fn mode(asked: Option<StoreMode>) -> Result<StoreMode, OsString> {
    let said = || variable("IVX_STORE_MODE");
    let parse =
        |text: OsString| text.to_str().and_then(|t| StoreMode::from_str(t, false).ok()).ok_or(text);
    asked.map_or_else(|| said().map_or(Ok(StoreMode::Read), parse), Ok)
}

fn variable(name: &str) -> Option<OsString> {
    var_os(name).filter(|value| !value.is_empty())
}
