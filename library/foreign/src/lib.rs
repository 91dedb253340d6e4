//! Programs that ivx starts, and worlds at the other end of a pipe.

mod bridge;
mod group;
mod gymnasium;
mod hello;
mod pipe;
mod watch;
mod words;

use ivx_op::{Parts, Registry};
use ivx_world::Env;

pub use group::{For, GRACE, Group, LOOK, kill_all, ready, stop_all, stopping};
pub use gymnasium::{Gymnasium, look_up};
pub use words::{TAIL, how, tail};

/// Adds what this crate declares.
#[must_use]
pub fn register(registry: Registry) -> Registry {
    let envs = || Parts::<dyn Env>::new().with(|env: Gymnasium| Box::new(env));
    registry.parts(ivx_world::envs().further(envs))
}
