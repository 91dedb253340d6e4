//! Worlds: what agents choose from, what rewards them, and where data come from.

mod belief;
mod boxes;
mod classic;
mod coin_grid;
mod copy;
mod env;
mod examples;
mod finite;
mod foresight;
mod fruit_grid;
mod glyphs;
mod grid;
mod grids;
mod highway;
mod interval;
mod intervals;
mod lanes;
mod lottery;
mod luck;
mod mapped;
mod minatar;
mod observe;
mod paint;
mod reward;
mod reward_at;
mod road_map;
mod sample;
mod scene;
mod sinusoids;
mod support_distance;
mod town;
mod twister;
mod worlds;

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::Form;
use ivx_op::{Array, Dim, Facts, Labels, OpError, Parts, Registry, Wrong, family};
use rand_chacha::ChaCha8Rng;

pub use belief::BeliefOver;
pub use boxes::Boxes;
pub use classic::{Acrobot, CartPole, Control, MountainCar, MountainCarContinuous, Pendulum};
pub use coin_grid::{CoinGrid, Coins};
pub use copy::Copying;
pub use env::{Entries, Env, Row, Spec, World};
pub use examples::Examples;
pub use finite::{
    Chain, ComputedMdp, Finite, GoalWorld, GridMap, Gridworld, Mdp, Numbers, Paid, Rewarded, Taken,
    Transitions, WrittenMdp, mdp, of_is_finite, policy, world_is_finite,
};
pub use foresight::Foresight;
pub use fruit_grid::FruitGrid;
pub use glyphs::Glyphs;
pub use grid::Grid;
pub use grids::Grids;
pub use highway::{DrivingActions, Highway, Roundabout};
pub use interval::Interval;
pub use intervals::Intervals;
pub use ivx_data::{Act, Actions, End};
pub use lanes::{Acts, Finished, Lanes, Step};
pub use lottery::Discrete;
pub use luck::Luck;
pub use mapped::Mapped;
pub use minatar::{Minatar, Play};
pub use observe::Observe;
pub use reward::Own;
pub use reward_at::RewardAt;
pub use road_map::MapRoads;
pub use sample::Sample;
pub use scene::Scene;
pub use sinusoids::Sinusoids;
pub use support_distance::SupportDistance;
pub use town::{Carnovel, Town};
pub use worlds::Worlds;

/// A reward that is uncertain by chance.
pub trait Lottery: Debug + Send + Sync {
    /// Outcomes, and as many probabilities, which sum to one.
    ///
    /// # Errors
    /// If the description is no distribution.
    fn atoms(&self) -> Result<(&[f64], &[f64]), OpError>;
}

/// Lotteries, and as many weights, which sum to one.
pub type Weighted<'a> = (&'a [Box<dyn Lottery>], Vec<f64>);

/// What an agent thinks the lottery behind an action may be.
pub trait Belief: Debug + Send + Sync {
    /// The lotteries it holds possible, with their probabilities.
    ///
    /// # Errors
    /// If the description is no distribution.
    fn models(&self) -> Result<Weighted<'_>, OpError>;
}

/// A choice between actions.
pub trait Problem: Debug + Send + Sync {
    /// Each action with the agent's belief about its reward.
    fn actions(&self) -> Vec<(&'static str, &dyn Belief)>;
}

/// The reward of a scalar action.
pub trait Reward: Debug + Send + Sync {
    /// The mean reward of action `a`.
    fn mean(&self, a: f64) -> f64;
}

/// A part of the real line.
pub trait Region: Debug + Send + Sync {
    /// The intervals `[low, high]` whose union it is.
    ///
    /// # Errors
    /// If an interval ends before it starts.
    fn intervals(&self) -> Result<Vec<(f64, f64)>, OpError>;
}

/// A list of places.
pub trait Points: Debug + Send + Sync {
    /// The places, in order; two may be the same.
    ///
    /// # Errors
    /// If the description names no places.
    fn places(&self) -> Result<Vec<f64>, OpError>;

    /// The places as what lies along a dimension, where each is a label of its own.
    ///
    /// # Errors
    /// If the description names no places, or one twice.
    fn points(&self) -> Result<Vec<f64>, OpError> {
        let points = self.places()?;
        match twice(&points) {
            None => Ok(points),
            Some(again) => {
                let again = ivx_op::label(again);
                Err(OpError::Failed(format!(
                    "two of the places are `{again}`, and each is a label of its own"
                )))
            }
        }
    }
}

/// A place that another one is.
fn twice(places: &[f64]) -> Option<f64> {
    if places.is_sorted_by(|a, b| a < b) {
        return None;
    }
    let mut sorted = places.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[1])
}

/// A problem of supervised learning without end.
pub trait Task: Debug + Send + Sync {
    /// What one observation is.
    fn form(&self) -> Form;

    /// One observation: its input and its target.
    fn draw(&self, rng: &mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>);
}

/// The rule that the world `in` is a table of states and pays something, for what learns or reckons values by its
/// rewards.
///
/// # Errors
/// If it is or does not.
pub fn world_pays(facts: &Facts<'_>) -> Result<(), Wrong> {
    world_is_finite(facts)?;
    facts.arg::<Box<dyn Env>>("in").map_or(Ok(()), |world| pays_something(&*world))
}

/// Whether the world `in` ever pays anything.
///
/// # Errors
/// If not.
pub fn pays_something(world: &dyn Env) -> Result<(), Wrong> {
    if world.pays() {
        return Ok(());
    }
    Err(Wrong {
        arg: "in",
        message: "this world never pays, so that every value in it is 0 and there is nothing \
                  to learn"
            .to_owned(),
        help: "use one that pays, such as `goal_world()`, `chain()` or a `grid_map([..])` with a `G`; \
               with a function of your own, `rewarded(.., by: f)` pays"
            .to_owned(),
    })
}

macro_rules! tables {
    ($($vis:vis $table:ident: $family:ident = $name:literal { $($part:ty),+ })+) => {$(
        family!(dyn $family, $name, $table);

        #[doc = concat!("The parts of `", $name, "`, by name.")]
        $vis fn $table() -> &'static Parts<dyn $family> {
            static TABLE: LazyLock<Parts<dyn $family>> = LazyLock::new(|| {
                Parts::<dyn $family>::new()$(.with(|part: $part| Box::new(part)))+
            });
            &TABLE
        }
    )+};
}

tables! {
    lotteries: Lottery = "Lottery" { Discrete }
    beliefs: Belief = "Belief" { BeliefOver }
    problems: Problem = "Problem" { Boxes }
    rewards: Reward = "Reward" { Own, Sinusoids }
    regions: Region = "Region" { Interval, Intervals }
    places: Points = "Points" { Grid, Grids, Mapped }
    tasks: Task = "Task" { Copying, Glyphs }
    pub envs: Env = "Env" {
        Acrobot, Carnovel, CartPole, Chain, CoinGrid, ComputedMdp, FruitGrid, GoalWorld, GridMap, Gridworld, Highway, Minatar, MountainCar,
        MountainCarContinuous, Pendulum, Rewarded, Roundabout, Town, WrittenMdp
    }
}

/// Values at places, over the dimension `x`.
#[must_use]
pub fn curve(points: Vec<f64>, values: Vec<f64>) -> Array {
    Array::series(Dim::new("x", Labels::Numbers(points)), values)
}

/// Fails unless the weights sum to one, up to rounding.
fn distribution(what: &str, weights: &[f64]) -> Result<(), OpError> {
    let total: f64 = weights.iter().sum();
    if (total - 1.0).abs() > 1e-9 {
        return Err(OpError::Failed(format!("the {what} sum to {total}, not to 1")));
    }
    Ok(())
}

/// Adds what this folder declares.
#[must_use]
pub fn register(registry: Registry) -> Registry {
    registry
        .parts(lotteries())
        .parts(beliefs())
        .parts(problems())
        .parts(rewards())
        .parts(regions())
        .parts(places())
        .parts(tasks())
        .parts(envs())
        .op::<Examples>()
        .op::<Sample>()
        .op::<RewardAt>()
        .op::<Observe>()
        .op::<SupportDistance>()
        .op::<Transitions>()
        .op::<DrivingActions>()
        .op::<MapRoads>()
        .op::<Scene>()
}
