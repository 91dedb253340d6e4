//! Who acts in worlds of any kind.

mod autopilot;
mod follows;
mod gpi;
mod imitated;
mod mpc;
mod noisy;
mod random;
mod rip;
mod softened;
mod tabular;
mod trained;
mod wheels;

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::Misfit;
use ivx_op::{Parts, family};
use ivx_world::Spec;

pub use autopilot::Autopilot;
pub use follows::Follows;
pub use gpi::Gpi;
pub use imitated::Imitated;
pub(crate) use imitated::known;
pub use mpc::Mpc;
pub use noisy::Noisy;
pub use random::Random;
pub(crate) use rip::Driver;
pub use rip::Rip;
pub use softened::Softened;
pub use tabular::Tabular;
pub use trained::Trained;

use super::agent::Acting;

/// Somebody who acts in worlds that show and take certain things.
pub trait Actor: Debug + Send + Sync {
    /// Whether there can be somebody who acts in such a world.
    ///
    /// # Errors
    /// Why not.
    fn fits(&self, spec: &Spec) -> Result<(), Misfit>;

    /// Somebody who does.
    ///
    /// # Errors
    /// Why there can be nobody.
    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting + '_>, Misfit>;

    /// Itself, if it drives by the plans of imitative models.
    fn rip(&self) -> Option<&Rip> {
        None
    }

    /// What is told of each of its choices, besides what the world tells of what comes of it.
    fn tells(&self) -> &'static [&'static str] {
        &[]
    }
}

family!(dyn Actor, "Actor", actors);

pub(super) fn actors() -> &'static Parts<dyn Actor> {
    static TABLE: LazyLock<Parts<dyn Actor>> = LazyLock::new(|| {
        Parts::<dyn Actor>::new()
            .with(|x: Trained| Box::new(x))
            .with(|x: Random| Box::new(x))
            .with(|x: Tabular| Box::new(x))
            .with(|x: Softened| Box::new(x))
            .with(|x: Imitated| Box::new(x))
            .with(|x: Gpi| Box::new(x))
            .with(|x: Mpc| Box::new(x))
            .with(|x: Noisy| Box::new(x))
            .with(|x: Autopilot| Box::new(x))
            .with(|x: Rip| Box::new(x))
            .with(|x: Follows| Box::new(x))
    });
    &TABLE
}
