//! Rules: what a declaration asks of the arguments of one call together.

use std::collections::BTreeMap;

use crate::{Args, Literal};

/// What a declaration asks of the arguments of one call together, beyond the type and range of each.
///
/// It is asked before anything runs, and says what the operation or part would fail with.
pub type Rule = fn(&Facts<'_>) -> Result<(), Wrong>;

/// What is known of one call before anything runs.
#[derive(Clone, Copy, Debug)]
pub struct Facts<'a> {
    /// Its descriptions, complete, with the names that axis arguments stand for.
    pub args: &'a Args,
    /// The names of the axes and dimensions of each value that a port takes, by port.
    pub over: &'a BTreeMap<String, Vec<Vec<String>>>,
}

impl Facts<'_> {
    /// The argument; none where it holds what is still to be computed.
    #[must_use]
    pub fn arg<T: Literal>(&self, name: &str) -> Option<T> {
        T::from_lit(self.args.get(name)?).ok()
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
