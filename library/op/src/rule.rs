//! Rules and shapes: what a declaration asks of the arguments of one call together, and what it
//! knows of the result before anything runs.

use std::collections::BTreeMap;

use crate::{Args, Literal};

/// What a declaration asks of the arguments of one call together, beyond the type and range of each.
///
/// It is asked before anything runs, and says what the operation or part would fail with.
pub type Rule = fn(&Facts<'_>) -> Result<(), Wrong>;

/// The shape of each array inside an artifact, or inside one observation of it, by name; a scalar is
/// the empty list.
///
/// The names are the library's: images of ten classes are `"x": [1, 10, 10]` and `"y": [10]`, however
/// many there are.
pub type Shapes = BTreeMap<String, Vec<usize>>;

/// What is known of the shapes of an operation's result before anything runs; none if nothing is.
///
/// It is asked once for each set of arguments that a [`Rule`] is asked for, and only if that
/// finds nothing wrong.
pub type ShapeRule = fn(&Facts<'_>) -> Option<Shapes>;

/// What is known of one call before anything runs.
#[derive(Clone, Copy, Debug)]
pub struct Facts<'a> {
    /// Its descriptions, complete, with the names that axis arguments stand for.
    pub args: &'a Args,
    /// The names of the arguments that the call itself gives; the others have their defaults.
    pub given: &'a [&'a str],
    /// The names of the axes and dimensions of each value that a port takes, by port.
    pub over: &'a BTreeMap<String, Vec<Vec<String>>>,
    /// The names of those axes of them that one run sees, outermost first, by port.
    pub seen: &'a BTreeMap<String, Vec<Vec<String>>>,
    /// The shapes of each value that a port takes, by port: those that all have that one run
    /// sees, and none where they differ or are not known.
    pub shapes: &'a BTreeMap<&'a str, Vec<Option<&'a Shapes>>>,
}

impl<'a> Facts<'a> {
    /// Whether the call itself gives an argument.
    #[must_use]
    pub fn is_given(&self, name: &str) -> bool {
        self.given.contains(&name)
    }

    /// The argument; none where it holds what is still to be computed.
    #[must_use]
    pub fn arg<T: Literal>(&self, name: &str) -> Option<T> {
        T::from_lit(self.args.get(name)?).ok()
    }

    /// The names of the axes that one run sees of what a port takes, as `collect` put them together; none where it is
    /// left out.
    #[must_use]
    pub fn seen(&self, port: &str) -> &'a [String] {
        self.seen.get(port).and_then(|all| all.first()).map_or(&[], Vec::as_slice)
    }

    /// The shapes of what a port takes; none where they are not known.
    #[must_use]
    pub fn shapes(&self, port: &str) -> Option<&'a Shapes> {
        self.shapes_at(port, 0)
    }

    /// The shapes of one value of the list that a port takes; none where they are not known.
    #[must_use]
    pub fn shapes_at(&self, port: &str, i: usize) -> Option<&'a Shapes> {
        self.shapes.get(port)?.get(i).copied().flatten()
    }
}

/// Why the arguments of a call do not go together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wrong {
    /// The argument to look at.
    pub arg: &'static str,
    /// What is wrong, in one sentence without a full stop.
    pub message: String,
    /// How to mend it.
    pub help: String,
}
