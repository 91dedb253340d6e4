//! How agents learn in worlds of any kind.

mod a2c;
mod bc;
mod beside;
mod dqn;
mod gail;
mod inferred;
mod itd;
mod means;
mod on_policy;
mod ppo;
mod preferences;
mod psi_phi;
mod sqil;
mod target;

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::{Columns, Misfit};
use ivx_op::{Ctx, OpError, Parts, Registry, State, family};
use ivx_world::{Acts, Spec, Step};

pub use a2c::A2c;
pub use bc::Bc;
pub use beside::{Beside, Cloning, Shares};
pub use dqn::{Dqn, q_loss, q_target};
pub use gail::Gail;
pub use inferred::Inferred;
pub use itd::Itd;
pub use means::Means;
pub use ppo::Ppo;
pub use preferences::NewTask;
pub use psi_phi::PsiPhi;
pub use sqil::Sqil;

use super::agent::Agent;
use super::learn::{Counted, Span};

/// In which circumstances an agent learns.
#[derive(Clone, Copy, Debug)]
pub struct Setting<'a> {
    /// What the world shows and takes.
    pub spec: &'a Spec,
    /// How many worlds there are side by side.
    pub lanes: usize,
    /// How many steps there are in all, where that is known.
    pub steps: Option<u64>,
    /// Or how many updates.
    pub updates: Option<u64>,
}

impl<'a> Setting<'a> {
    /// That of so many lanes of a world, for as long as a span says, if it is known.
    #[must_use]
    pub fn of(spec: &'a Spec, lanes: usize, span: Option<&dyn Span>) -> Self {
        let (counted, n) = span.map_or((Counted::Episodes, 1), Span::count);
        let of = |what| (counted == what).then_some(n);
        Self { spec, lanes, steps: of(Counted::Steps), updates: of(Counted::Updates) }
    }
}

/// A way to learn by acting, or from what others did.
pub trait Method: Debug + Send + Sync {
    /// Whether it learns in such circumstances.
    ///
    /// # Errors
    /// Why not.
    fn fits(&self, setting: &Setting<'_>) -> Result<(), Misfit>;

    /// How many bytes of memory it takes, about.
    fn memory(&self, setting: &Setting<'_>) -> u64;

    /// Whether it learns by acting. Who does not makes an update for each step that it could take.
    fn acts(&self) -> bool {
        true
    }

    /// Whether it learns from what is paid.
    fn is_paid(&self) -> bool {
        self.acts()
    }

    /// Itself, if it is deep Q-learning, by whose settings others learn too.
    fn replayed(&self) -> Option<&Dqn> {
        None
    }

    /// Itself, if it is behaviour cloning.
    fn cloned(&self) -> Option<&Bc> {
        None
    }

    /// Itself, if others can learn beside it by layers that they share.
    fn shares(&self) -> Option<&dyn Shares> {
        None
    }

    /// An agent that has learned nothing yet.
    ///
    /// # Errors
    /// If there can be none.
    fn begin<'a>(
        &'a self,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError>;
}

/// An agent that learns.
pub trait Learning {
    /// Chooses an action for each lane, after `t` steps of all together.
    fn act(&mut self, t: u64, seen: &Columns, acts: &mut Acts);

    /// Sees what came of it.
    fn see(&mut self, step: &Step);

    /// Learns from what it saw, now that `t` steps are done.
    fn learn(&mut self, t: u64);

    /// How many updates it has made.
    fn updates(&self) -> u64;

    /// The agent of this moment.
    fn agent(&self) -> Agent;

    /// The parts of its loss.
    fn losses(&mut self) -> &mut Means;

    /// Walks over all that changes.
    fn state(&mut self, state: &mut State);
}

family!(dyn Method, "Method", methods);

fn methods() -> &'static Parts<dyn Method> {
    static TABLE: LazyLock<Parts<dyn Method>> = LazyLock::new(|| {
        Parts::<dyn Method>::new()
            .with(|x: Dqn| Box::new(x))
            .with(|x: Ppo| Box::new(x))
            .with(|x: A2c| Box::new(x))
            .with(|x: Bc| Box::new(x))
            .with(|x: Itd| Box::new(x))
            .with(|x: PsiPhi| Box::new(x))
            .with(|x: NewTask| Box::new(x))
            .with(|x: Inferred| Box::new(x))
            .with(|x: Sqil| Box::new(x))
            .with(|x: Beside| Box::new(x))
            .with(|x: Gail| Box::new(x))
    });
    &TABLE
}

/// Adds what this folder declares.
pub(super) fn register(registry: Registry) -> Registry {
    registry.parts(methods()).parts(target::targets())
}

#[cfg(test)]
mod tests;
