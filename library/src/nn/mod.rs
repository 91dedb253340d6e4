//! Neural networks; the only place that names dfdx.

#![expect(
    clippy::inline_always,
    reason = "loops are compiled for the registers of whoever runs them"
)]

mod activation;
mod curve;
mod fit;
mod graph;
mod matmul;
mod net;
mod ops;
pub mod optim;
mod optimiser;
mod params;
mod real;
mod schedule;
mod thin;

pub use activation::{Activation, Elu, Relu, Sigmoid, Silu, Softplus, Tanh};
pub use curve::Curve;
pub use fit::{fit, predict};
pub use graph::{Graph, Shape, Var};
pub use net::{Mlp, Net, check};
pub use ops::{BatchNorm, Cell, Proximal, Proximity, Steps, Window};
pub use optimiser::{Adam, AdamW, Optimiser, RmsProp, Sgd, Step};
pub use params::{Param, ParamId, Params};
pub use real::Real;
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
