//! How agents act in environments step by step, and how they learn to.

mod act;
mod actor;
#[expect(clippy::module_inception, reason = "an agent is what this folder is of")]
mod agent;
mod cloned;
mod control;
mod dynamic;
mod estimate;
mod evaluate;
mod explore;
mod implicit;
mod learn;
mod method;
mod policy;
mod policy_gradient;
mod q_ensemble;
mod reach;
mod replay;
mod tabular;
pub mod tabular_loss;
mod without;
mod world;

use ivx_op::Registry;

pub use act::{Act, Demonstrations, Returns, Visits};
pub use actor::{Actor, Random, Trained};
pub use agent::{Acting, Agent, Choice, best, look, sight};
pub use cloned::ClonedPolicy;
pub use control::{Bootstrap, Control, ExpectedSarsa, QLearning, Sarsa};
pub use dynamic::{PolicyValues, ValueIteration};
pub use estimate::{EstimateValues, Estimator, MonteCarlo, Td, TdLambda};
pub use evaluate::{Evaluate, Evaluation};
pub use implicit::{ImplicitActionValues, ImplicitOptimalValues, ImplicitValues, SampledValues};
pub use learn::{Episodes, Learn, Learned, Span, Steps, Updates};
pub use method::{A2c, Dqn, Learning, Means, Method, Ppo, Setting, q_loss, q_target};
pub use policy::{BoltzmannPolicy, GreedyPolicy, UniformPolicy};
pub use policy_gradient::{ActorCritic, Critic, PolicyGradient, Reinforce};
pub use q_ensemble::{EnsemblePolicy, QEnsemble, worth};
pub use reach::Reach;
pub use tabular::{TabularModel, TabularRewards, TabularValues};
pub use without::WithoutStates;
pub use world::{
    LatentStates, ModelErrors, PartialModel, ProcessModel, ProcessValues, ReconstructionModel,
    UnrolledErrors,
};

/// Adds what this folder declares.
pub(crate) fn register(registry: Registry) -> Registry {
    method::register(world::register(registry))
        .parts(actor::actors())
        .parts(learn::spans())
        .op::<Learn>()
        .op::<Evaluate>()
        .parts(estimate::estimators())
        .parts(control::bootstraps())
        .parts(policy_gradient::critics())
        .op::<ValueIteration>()
        .op::<PolicyValues>()
        .op::<UniformPolicy>()
        .op::<GreedyPolicy>()
        .op::<BoltzmannPolicy>()
        .op::<ClonedPolicy>()
        .op::<Act>()
        .op::<Demonstrations>()
        .op::<Returns>()
        .op::<Visits>()
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
}
