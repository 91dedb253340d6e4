//! Learners, planners, knowledge equivalents, worlds and metrics.
//!
//! To add one: write its file, and add one line to its folder's table or `register`.

pub mod agent;
pub mod ce;
pub mod command;
pub mod ke;
pub mod learner;
pub mod metric;
pub mod planner;

use ivx_op::Registry;

/// The page about agents, whose code is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../docs/agents.md")]
struct Page;

/// The digest of the library's source, for the provenance of results.
pub const SOURCE_DIGEST: &str = env!("IVX_SOURCE_DIGEST");

/// Every operation and part that a spec can use.
#[must_use]
pub fn registry() -> Registry {
    let registry = Registry::default();
    let registry = ce::register(registry);
    let registry = ke::register(registry);
    let registry = ivx_world::register(registry);
    let registry = ivx_foreign::register(registry);
    let registry = ivx_nn::register(registry);
    let registry = learner::register(registry);
    let registry = planner::register(registry);
    let registry = agent::register(registry);
    let registry = metric::register(registry);
    let registry = command::register(registry);
    let registry = ivx_table::register(registry);
    ivx_figure::register(registry)
}
