//! Programs that ivx starts, worlds at the other end of a pipe, and games of a library that is loaded.
#![cfg_attr(not(feature = "procgen"), forbid(unsafe_code))]

mod bridge;
mod group;
mod gymnasium;
mod hello;
mod pipe;
pub mod procgen;
mod watch;
mod words;

use ivx_op::{Parts, Registry};
use ivx_world::Env;

pub use group::{For, GRACE, Group, LOOK, go_on, kill_all, ready, stop_all, stopping};
pub use gymnasium::{Gymnasium, look_up};
pub use procgen::Procgen;
pub use words::{TAIL, how, tail};

/// Adds what this crate declares.
#[must_use]
pub fn register(registry: Registry) -> Registry {
    let envs = || {
        Parts::<dyn Env>::new()
            .with(|env: Gymnasium| Box::new(env))
            .with(|env: Procgen| Box::new(env))
    };
    registry.parts(ivx_world::envs().further(envs))
}
