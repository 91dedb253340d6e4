//! The second store that a command is given.

use std::env::var_os;
use std::ffi::OsString;
use std::io::{self, Write};
use std::path::PathBuf;

use clap::ValueEnum as _;
use ivx_cache::{Cache, Folder, Mode, Second, StoreError, Traffic, Trouble};

use crate::args::{self, StoreMode};

/// Puts the store that is asked for behind the cache, and says what is there; one that can't be
/// used is a note.
pub(crate) fn attach(
    args: &args::Store,
    mode: StoreMode,
    cache: &mut Cache,
    err: &mut dyn Write,
) -> io::Result<()> {
    let Some(folder) = folder(args) else { return Ok(()) };
    let name = folder.display().to_string();
    let open = || -> Result<Second, StoreError> {
        let (store, mode) = match mode {
            StoreMode::Read => (Folder::open(&folder)?, Mode::Read),
            StoreMode::Write => (Folder::create(&folder)?, Mode::Write),
        };
        Second::new(Box::new(store), name.clone(), mode)
    };
    match open() {
        Ok(second) => {
            let n_keys = second.n_keys();
            let results = if n_keys == 1 { "result" } else { "results" };
            let then = match mode {
                StoreMode::Read => "nothing is put there",
                StoreMode::Write => "new ones are put there",
            };
            writeln!(err, "store {name}: {n_keys} {results}, {then}")?;
            cache.attach(second);
        }
        Err(error) => writeln!(err, "note: the store {name} is not used: {error}")?,
    }
    Ok(())
}

/// The store that the command line names, else the environment.
pub(crate) fn folder(args: &args::Store) -> Option<PathBuf> {
    args.store.clone().or_else(|| variable("IVX_STORE").map(PathBuf::from))
}

/// Says what went between the cache and its store, if anything did.
pub(crate) fn tell(cache: &Cache, err: &mut dyn Write) -> io::Result<()> {
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
    for trouble in troubles.filter(|trouble| matches!(trouble, Trouble::Store { .. })) {
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
