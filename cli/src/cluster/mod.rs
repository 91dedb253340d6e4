//! Nodes on other machines: who hands them out, what runs them there, and how those find each other.
//!
//! `ivx exec --on` starts a driver and speaks with it in lines of JSON ([`words`]). A driver has keys run somewhere by
//! `ivx node exec`, which finds what to run, and puts what came out, in the store that all machines share. One driver is
//! ivx itself: `ivx node serve` lays batches into the store, and every `ivx worker` takes some from there ([`queue`]).

mod driver;
mod node;
mod queue;
mod serve;
mod words;
mod worker;

pub(crate) use driver::Driver;
pub(crate) use node::{exec, log};
pub(crate) use serve::serve;
pub(crate) use worker::worker;

use std::path::Path;

use ivx_cache::{Mode, Place, Store};

/// The store that a text names, to be read and written.
fn store(place: &Path) -> Result<Box<dyn Store>, String> {
    Place::parse(place.as_os_str())?.open(Mode::Write).map_err(|error| error.to_string())
}

/// Ends this process with that which started it.
fn end_with_parent() {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Signal, set_parent_process_death_signal};
        // Where it cannot be asked for, an orphan finishes what it runs.
        let _ = set_parent_process_death_signal(Some(Signal::KILL));
    }
}
