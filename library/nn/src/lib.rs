//! Neural networks, and the other functions that are learned; the only place that names dfdx.

#![expect(
    clippy::inline_always,
    reason = "loops are compiled for the registers of whoever runs them"
)]

mod activation;
mod clip;
mod curve;
mod descend;
mod fit;
mod function;
mod graph;
mod imitative;
mod live;
mod loss;
mod matmul;
mod model;
mod modes;
mod module;
mod net;
mod network;
mod networks;
mod ops;
pub mod optim;
mod optimiser;
mod params;
mod real;
mod schedule;
mod seen;
mod target;
mod thin;
mod world;
mod world_model;

pub use activation::{Activation, Elu, Relu, Sigmoid, Silu, Softplus, Tanh, curve};
pub use clip::{ClipNorm, ClipValue};
pub use curve::Curve;
pub use descend::{Descent, Rule, Turns, descend};
pub use fit::{Training, fit};
pub use function::{Fitted, Forest, Function, Mixture, Neighbours, Scaled};
pub use graph::{Graph, Shape, Var};
pub use imitative::{
    Imitative, Imitators, PlanLearner, PlanNets, PlanTraining, PlanWeights, Scorer, fit_plans,
    plan_log_density,
};
pub use live::Live;
pub use loss::{Loss, Squared};
pub use model::{Head, Model, NetModel, PRIOR};
pub use modes::{Anchored, ModeNets, ModeTraining, Modes, Multimodal, fit_modes};
pub use module::{ArrayOf, Mode, Module, Start};
pub use net::{Mlp, Net, headed};
pub use network::{check, init, predict, singles, stds};
pub use networks::{Named, Networks, joined};
pub use ops::{
    BatchNorm, Cell, Layer, Norm, Payment, Proximal, Proximity, PsiPhiLosses, SoftSteps, Steps,
    SuccessorSteps, Weighting, Window,
};
pub use optimiser::{Adam, AdamW, Optimiser, RmsProp, Sgd, Step};
pub use params::{Param, ParamId, Params};
pub use real::Real;
pub use schedule::{Constant, Cosine, Linear, Schedule, WarmUp};
pub use seen::plan_sizes;
pub use target::Follow;
pub use world::{
    Body, Heads, Latent, Paths, Transitions, Unrolled, partial_losses, predicted_values,
    reconstruction_losses,
};
pub use world_model::{Layout, WorldModel};

use ivx_op::Registry;

/// Adds what this folder declares.
#[must_use]
pub fn register(registry: Registry) -> Registry {
    registry
        .parts(activation::activations())
        .parts(loss::losses())
        .parts(net::nets())
        .parts(optimiser::optimisers())
        .parts(schedule::schedules())
}

#[cfg(test)]
fn registry() -> Registry {
    register(Registry::default())
}
