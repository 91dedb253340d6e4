//! What can be done in a world, and how episodes end.

use serde::{Deserialize, Serialize};

use crate::{Columns, Field, Kind, Misfit, Values};

/// The actions of a world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Actions {
    /// One of these.
    Discrete(Vec<String>),
    /// A vector between bounds.
    Continuous {
        /// The least of each number.
        low: Vec<f32>,
        /// The most of each.
        high: Vec<f32>,
    },
}

impl Actions {
    /// Actions by their names.
    #[must_use]
    pub fn named(names: &[&str]) -> Self {
        Self::Discrete(names.iter().map(|name| (*name).to_owned()).collect())
    }

    /// How many there are.
    ///
    /// # Errors
    /// If they are vectors; then who asks does not fit.
    pub fn n_discrete(&self) -> Result<usize, Misfit> {
        match self {
            Self::Discrete(names) => Ok(names.len()),
            Self::Continuous { .. } => {
                let message = "it takes one of some actions, and those of this world are vectors";
                Err(Misfit::new(message.to_owned(), "use a world with discrete actions"))
            }
        }
    }

    /// `6 actions` or `actions of 2 numbers`.
    #[must_use]
    pub fn told(&self) -> String {
        match self {
            Self::Discrete(names) => format!("{} actions", names.len()),
            Self::Continuous { low, .. } => format!("actions of {} numbers", low.len()),
        }
    }

    /// One of them as a column.
    #[must_use]
    pub fn field(&self) -> Field {
        match self {
            Self::Discrete(names) => Field::new("act", &[], Kind::Index(names.len())),
            Self::Continuous { low, .. } => Field::new("act", &[low.len()], Kind::F32),
        }
    }
}

/// One action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Act<'a> {
    /// The place of one among those that there are.
    Index(usize),
    /// A vector.
    Vector(&'a [f32]),
}

impl<'a> Act<'a> {
    /// The place of a discrete action.
    ///
    /// # Panics
    /// If it is a vector.
    #[must_use]
    pub fn index(self) -> usize {
        let Self::Index(place) = self else { panic!("the action of a discrete world is a place") };
        place
    }

    /// A continuous action.
    ///
    /// # Panics
    /// If it is a place.
    #[must_use]
    pub fn vector(self) -> &'a [f32] {
        let Self::Vector(vector) = self else { panic!("that of a continuous world is a vector") };
        vector
    }

    /// Appends it to a column of such.
    ///
    /// # Panics
    /// If they are others.
    pub fn append(self, to: &mut Columns) {
        to.resize(to.len() + 1);
        let at = to.len() - 1;
        match (to.values_mut(0), self) {
            ((Values::Index(places), _), Act::Index(place)) => {
                places[at] = u32::try_from(place).expect("far fewer");
            }
            ((Values::F32(numbers), width), Act::Vector(vector)) => {
                numbers[at * width..][..width].copy_from_slice(vector);
            }
            _ => panic!("a column of such actions"),
        }
    }
}

/// Whether an episode is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum End {
    /// It goes on.
    No,
    /// Nothing follows: no reward is to be had from here on.
    Terminal,
    /// It was cut off: what would follow is unknown, and worth what it would be.
    Limit,
}
