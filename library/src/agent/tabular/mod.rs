//! Agents of finite worlds: values, models and policies as arrays over states and actions.

mod cloned;
mod control;
mod dynamic;
mod estimate;
mod implicit;
pub mod loss;
mod policy;
mod policy_gradient;
mod q_ensemble;
mod reach;
mod tables;
mod visits;
mod walk;
mod without;
mod world;

use ivx_data::{NOT_FINITE, finite, shown_by};
use ivx_op::{Facts, Registry, Wrong};

pub use cloned::ClonedPolicy;
pub use control::{Bootstrap, Control, ExpectedSarsa, QLearning, Sarsa};
pub use dynamic::{PolicyValues, ValueIteration};
pub use estimate::{EstimateValues, Estimator, MonteCarlo, Td, TdLambda};
pub use implicit::{ImplicitActionValues, ImplicitOptimalValues, ImplicitValues, SampledValues};
pub use policy::{BoltzmannPolicy, GreedyPolicy, UniformPolicy};
pub use policy_gradient::{ActorCritic, Critic, PolicyGradient, Reinforce};
pub use q_ensemble::{EnsemblePolicy, QEnsemble, worth};
pub use reach::Reach;
pub use tables::{TabularModel, TabularRewards, TabularValues};
pub use visits::Visits;
pub use without::WithoutStates;
pub use world::{
    LatentStates, ModelErrors, PartialModel, ProcessModel, ProcessValues, ReconstructionModel,
    UnrolledErrors,
};

/// The rule that the episodes `of` are of a finite world.
fn of_is_walked(facts: &Facts<'_>) -> Result<(), Wrong> {
    are_walked(facts, "of")
}

/// The same of `from`.
fn from_is_walked(facts: &Facts<'_>) -> Result<(), Wrong> {
    are_walked(facts, "from")
}

/// The same of `on`.
fn on_is_walked(facts: &Facts<'_>) -> Result<(), Wrong> {
    are_walked(facts, "on")
}

fn are_walked(facts: &Facts<'_>, arg: &'static str) -> Result<(), Wrong> {
    let Some((sees, does)) = facts.shapes(arg).and_then(shown_by) else { return Ok(()) };
    match finite(&sees, &does) {
        Some(_) => Ok(()),
        None => Err(Wrong {
            arg,
            message: NOT_FINITE.to_owned(),
            help: "act in one that is, such as `chain()`, `goal_world()` or `gridworld()`"
                .to_owned(),
        }),
    }
}

/// Adds what this folder declares.
pub(super) fn register(registry: Registry) -> Registry {
    world::register(registry)
        .parts(estimate::estimators())
        .parts(control::bootstraps())
        .parts(policy_gradient::critics())
        .op::<ValueIteration>()
        .op::<PolicyValues>()
        .op::<UniformPolicy>()
        .op::<GreedyPolicy>()
        .op::<BoltzmannPolicy>()
        .op::<ClonedPolicy>()
        .op::<EstimateValues>()
        .op::<Control>()
        .op::<PolicyGradient>()
        .op::<QEnsemble>()
        .op::<EnsemblePolicy>()
        .op::<WithoutStates>()
        .op::<TabularValues>()
        .op::<TabularModel>()
        .op::<TabularRewards>()
        .op::<ImplicitValues>()
        .op::<ImplicitOptimalValues>()
        .op::<ImplicitActionValues>()
        .op::<SampledValues>()
        .op::<Reach>()
        .op::<Visits>()
}

/// Episodes of a policy, for tests.
#[cfg(test)]
fn walked(
    policy: ivx_op::One<ivx_op::Array>,
    r#in: Box<dyn ivx_world::Env>,
    (episodes, stream): (usize, &str),
) -> ivx_data::Rollouts {
    let (actor, stream) = (Box::new(super::Tabular { policy }), stream.to_owned());
    let act = super::Act { actor, r#in, episodes, limit: 500, stream, keeps: Vec::new() };
    ivx_op::Op::run(&act, &ivx_op::Ctx::new("act", 3, None)).expect("the policy is of the world")
}
