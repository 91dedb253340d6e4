//! Neural networks; the only place that names dfdx.

mod activation;
mod dense;
mod fit;
mod matmul;
mod net;
pub mod optim;
mod optimiser;
mod schedule;

pub use activation::{Activation, Elu, Relu, Tanh};
pub use fit::{fit, predict};
pub use net::{Mlp, Net, check};
pub use optimiser::{Adam, AdamW, Optimiser, RmsProp, Sgd, Step};
pub use schedule::{Constant, Linear, Schedule};

use ivx_op::Registry;

/// Adds what this folder declares.
pub(crate) fn register(registry: Registry) -> Registry {
    registry
        .parts(activation::activations())
        .parts(net::nets())
        .parts(optimiser::optimisers())
        .parts(schedule::schedules())
}
