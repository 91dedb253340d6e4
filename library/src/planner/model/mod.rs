//! What plans are foretold to return.

mod latent;
mod learned;
mod transitions;
mod true_model;

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::{Columns, Misfit};
use ivx_op::{Parts, family};
use ivx_world::Spec;

pub use latent::LatentModel;
pub use learned::LearnedModel;
pub use transitions::LabelledTransitions;
pub use true_model::TrueModel;

/// A model of worlds in which plans are tried.
pub trait Simulator: Debug + Send + Sync {
    /// Whether it is a model of such worlds.
    ///
    /// # Errors
    /// Why not.
    fn fits(&self, spec: &Spec) -> Result<(), Misfit>;

    /// It itself, ready to try plans in such worlds.
    ///
    /// # Errors
    /// Why it cannot.
    fn open(&self, spec: &Spec) -> Result<Box<dyn Simulating + '_>, Misfit>;
}

/// A model as plans are tried in it.
pub trait Simulating {
    /// How many say what a plan returns.
    fn n_members(&self) -> usize;

    /// Lets plans begin where a row is seen.
    fn begin(&mut self, seen: &Columns, row: usize);

    /// What each member says that `n` plans return from there (Eqn. 2.66), discounted to their start.
    ///
    /// - `plans`: `[n, len]`, the numbers of actions one after the other; the places of discrete ones.
    /// - `returns`: `[n, members]`, to be written.
    fn returns(&mut self, plans: &[f64], n: usize, discount: f64, returns: &mut [f64]);
}

family!(dyn Simulator, "Simulator", simulators);

pub(super) fn simulators() -> &'static Parts<dyn Simulator> {
    static TABLE: LazyLock<Parts<dyn Simulator>> = LazyLock::new(|| {
        Parts::<dyn Simulator>::new()
            .with(|x: TrueModel| Box::new(x))
            .with(|x: LearnedModel| Box::new(x))
            .with(|x: LatentModel| Box::new(x))
    });
    &TABLE
}
