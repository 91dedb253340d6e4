//! How agents act in environments step by step, and how they learn to.

mod act;
mod actor;
mod adapt;
#[expect(clippy::module_inception, reason = "an agent is what this folder is of")]
mod agent;
mod demonstrate;
mod drive;
mod evaluate;
mod explained;
mod explore;
mod features;
mod improve;
mod learn;
mod method;
mod replay;
mod resample;
mod scenes;
mod shown;
pub mod tabular;
mod watch;
mod windows;

use ivx_op::Registry;

pub use act::{Act, Returns, Told, ToldSums};
pub use actor::{
    Actor, Autopilot, Follows, Gpi, Imitated, Mpc, Noisy, Random, Rip, Softened, Tabular, Trained,
};
pub use adapt::{Adapt, Adapted};
pub use agent::{Acting, Agent, Choice, best, look, sight};
pub use demonstrate::{Demonstrate, LabelledActions};
pub use evaluate::{Evaluate, Evaluation};
pub use explained::{CumulantMap, Imitation, LearnedPreferences, MatchedCumulants};
pub use learn::{Episodes, Learn, Learned, Span, Steps, Updates};
pub use method::{
    A2c, Bc, Beside, Cloning, Dqn, Gail, Inferred, Itd, Learning, Means, Method, NewTask, Ppo,
    PsiPhi, Setting, Shares, Sqil, q_loss, q_target,
};
pub use scenes::{FindScenes, Scenes};
pub use watch::Watched;
pub use windows::Windows;

/// A walk of three steps through a world of three states, so many times, for tests.
#[cfg(test)]
fn strolls(n: usize) -> ivx_data::Walks {
    let stroll = ivx_data::Episode {
        states: vec![1, 0, 1, 2],
        actions: vec![0, 1, 1],
        rewards: vec![1.0, 0.0, 2.0],
        ended: true,
    };
    let actions = vec!["LEFT".to_owned(), "RIGHT".to_owned()];
    ivx_data::Walks { n_states: 3, actions, episodes: vec![stroll; n] }
}

/// Adds what this folder declares.
pub(crate) fn register(registry: Registry) -> Registry {
    method::register(tabular::register(registry))
        .parts(actor::actors())
        .parts(learn::spans())
        .op::<Learn>()
        .op::<Evaluate>()
        .op::<Act>()
        .op::<Adapt>()
        .op::<Demonstrate>()
        .op::<LabelledActions>()
        .op::<Watched>()
        .op::<Windows>()
        .op::<FindScenes>()
        .op::<Imitation>()
        .op::<LearnedPreferences>()
        .op::<MatchedCumulants>()
        .op::<CumulantMap>()
        .op::<Returns>()
        .op::<Told>()
        .op::<ToldSums>()
}
