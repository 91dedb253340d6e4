//! Worlds that agents act in, step by step.

use std::fmt::Debug;

use ivx_data::{Act, Actions, Columns, End, Field, Misfit, Picture, RoadMap, Values, same_world};
use ivx_op::OpError;
use serde::{Deserialize, Serialize};

use crate::finite::Finite;
use crate::foresight::Foresight;
use crate::luck::Luck;
use crate::worlds::Worlds;

/// What a world shows and takes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spec {
    /// What is seen of it at each step.
    pub sees: Vec<Field>,
    /// What can be done in it.
    pub does: Actions,
    /// What it tells of each step besides, which nobody acts on: such as coins or infractions.
    pub tells: Vec<String>,
    /// After how many steps an episode is cut off, if it is.
    pub limit: Option<u64>,
}

impl Spec {
    /// Whether who acts in this world can act in another: it shows and takes the same.
    ///
    /// # Errors
    /// If not.
    pub fn same(&self, other: &Self) -> Result<(), Misfit> {
        let (own, other) = ((&self.sees[..], &self.does), (&other.sees[..], &other.does));
        same_world("the agent knows", own, other)
    }
}

/// Where a world writes what is seen: one row of columns. It must write all that it shows.
#[derive(Debug)]
pub struct Row<'a> {
    seen: &'a mut Columns,
    told: &'a mut [f32],
    at: usize,
}

impl<'a> Row<'a> {
    /// Row `at` of `seen`, and as many numbers as the world tells.
    #[must_use]
    pub fn of(seen: &'a mut Columns, at: usize, told: &'a mut [f32]) -> Self {
        Self { seen, told, at }
    }

    /// The numbers of a field that has them in single precision.
    ///
    /// # Panics
    /// If it has not.
    pub fn numbers(&mut self, field: usize) -> &mut [f32] {
        let at = self.at;
        let (Values::F32(values), width) = self.seen.values_mut(field) else {
            panic!("a field of numbers")
        };
        &mut values[at * width..][..width]
    }

    /// The bytes of a field that has such.
    ///
    /// # Panics
    /// If it has not.
    pub fn bytes(&mut self, field: usize) -> &mut [u8] {
        let at = self.at;
        let (Values::U8(values), width) = self.seen.values_mut(field) else {
            panic!("a field of bytes")
        };
        &mut values[at * width..][..width]
    }

    /// Writes a field that is one of so many.
    ///
    /// # Panics
    /// If it is not.
    pub fn index(&mut self, field: usize, place: usize) {
        let (Values::Index(values), 1) = self.seen.values_mut(field) else {
            panic!("a field that is one of so many")
        };
        values[self.at] = u32::try_from(place).expect("far fewer");
    }

    /// What the world tells besides: one number for each name in [`Spec::tells`].
    pub fn told(&mut self) -> &mut [f32] {
        self.told
    }
}

/// A world that goes on step by step.
///
/// After [`World::reset`] it depends on nothing that was before: so an episode is known by its luck and its actions.
pub trait World: Send {
    /// Starts an episode.
    fn reset(&mut self, luck: &mut Luck, row: &mut Row<'_>);

    /// Takes an action: what it pays, and whether the episode is over. What is written is what is seen after it, of
    /// an episode that is over too.
    ///
    /// The limit of [`Spec`] is counted by whoever steps it.
    fn step(&mut self, act: Act<'_>, luck: &mut Luck, row: &mut Row<'_>) -> (f64, End);

    /// What it tells now, and would tell of each of the next steps if its expert acted from now on, by luck that is not the
    /// world's: rows as [`Spec::tells`] names them, fewer where the episode would end. None but where [`Env::has_expert`] says
    /// so.
    fn shown(&self, _steps: usize, _luck: &mut Luck) -> Option<Vec<f32>> {
        None
    }

    /// A picture of it as it stands: of every state after [`World::reset`], where [`Env::is_drawn`] says so.
    fn draw(&self) -> Option<Picture> {
        None
    }

    /// The ways into each cell of its grid, as the world stands; `None` of one that has no such.
    fn entries(&self) -> Option<Entries> {
        None
    }
}

/// What would be seen right before each cell of a grid is entered, and what enters it: a row for each way into each.
#[derive(Clone, Debug, PartialEq)]
pub struct Entries {
    /// How many rows and columns of cells there are.
    pub sides: [usize; 2],
    /// The cell of each way, row after row from the top.
    pub cells: Vec<usize>,
    /// What is seen before.
    pub seen: Columns,
    /// What is done.
    pub acts: Vec<usize>,
}

/// Why there is no map of a world.
pub(crate) const NO_MAP: &str = "this world has no map of roads";

/// An environment, as a spec names it.
pub trait Env: Debug + Send + Sync {
    /// What its worlds show and take, before there is one.
    ///
    /// # Errors
    /// Why there can be none.
    fn spec(&self) -> Result<Spec, Misfit>;

    /// A world of its own.
    ///
    /// # Errors
    /// If there can be none.
    fn open(&self) -> Result<Box<dyn World>, OpError>;

    /// `n` worlds that are stepped together: by default each on its own.
    ///
    /// # Errors
    /// If there can be none.
    fn open_all(&self, n: usize) -> Result<Box<dyn Worlds>, OpError> {
        let worlds: Result<Vec<_>, _> = (0..n).map(|_| self.open()).collect();
        Ok(Box::new(worlds?))
    }

    /// Itself, where it is a table of states.
    fn finite(&self) -> Option<&dyn Finite> {
        None
    }

    /// What follows in its worlds, where that is known from what is seen alone.
    ///
    /// # Errors
    /// Why it is not.
    fn foresight(&self) -> Result<Box<dyn Foresight>, Misfit> {
        let message = "what follows in this world is not known from what is seen of it";
        let help =
            "use a world of classic control or one that is finite, or a model that was `learned`";
        Err(Misfit::new(message.to_owned(), help))
    }

    /// Whether its worlds know what an expert would do ([`World::shown`]).
    fn has_expert(&self) -> bool {
        false
    }

    /// Whether its worlds give pictures of themselves.
    fn is_drawn(&self) -> bool {
        false
    }

    /// Whether it has roads, and a map of them.
    fn is_mapped(&self) -> bool {
        false
    }

    /// The map of its roads, where [`Env::is_mapped`] says that it has some.
    ///
    /// # Errors
    /// If there can be none.
    fn map(&self) -> Result<RoadMap, OpError> {
        Err(OpError::Failed(NO_MAP.to_owned()))
    }

    /// Whether it ever pays anything: without, there is nothing to be learned from its rewards.
    fn pays(&self) -> bool {
        true
    }
}
