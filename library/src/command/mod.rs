//! Other programs as nodes: what they are given, how they run, and what is read from what they
//! leave behind.
//!
//! A program sees an empty folder with the files it was given, and an environment with the variables
//! it was given. Nothing keeps it from the network, from other files or from the clock.

mod folder;
mod input;
mod outside;
mod process;
mod read;
mod run;
mod setting;

use ivx_op::Registry;

pub use input::{AsFile, Input};
pub use ivx_foreign::look_up as world;
pub use ivx_foreign::procgen::look_up as procgen;
pub use ivx_table::npz::npz;
pub use outside::{file, find, program, variable};
pub use read::{ReadArray, ReadDataset, ReadFile, ReadModel, ReadScalar};
pub use run::RunProgram;
pub use setting::{Inherited, SetVariable, Setting};

/// Asks every program that runs to end, kills it if it has not a second later, and starts no other.
/// The nodes that they are fail.
pub fn stop_all() {
    ivx_foreign::stop_all();
}

/// Lets programs run again, once all that were asked to end have.
pub fn go_on() {
    ivx_foreign::go_on();
}

/// Kills every program that runs and removes its folder: for a process that is about to end.
pub fn abandon_all() {
    ivx_foreign::kill_all();
    folder::remove_all();
}

/// Adds what this folder declares.
pub(crate) fn register(registry: Registry) -> Registry {
    registry
        .parts(input::inputs())
        .parts(setting::settings())
        .op::<RunProgram>()
        .op::<ReadScalar>()
        .op::<ReadDataset>()
        .op::<ReadArray>()
        .op::<ReadModel>()
        .op::<ReadFile>()
}
