//! Descriptions: the plain data that a spec writes down.

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::{ByName, External, Formula, Gathered, Shapes};

/// A description, complete: defaults filled, names resolved, parameters substituted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Lit {
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A finite real number.
    Real(f64),
    /// A string.
    Text(String),
    /// A list, in the order written.
    List(Vec<Lit>),
    /// A named part with its arguments, such as `cvar(alpha: 0.1)`; without a name, a record.
    Part(Part),
    /// An artifact that a part holds.
    Held(Held),
    /// Something outside the spec.
    External(Arc<External>),
    /// A function of numbers.
    Function(Arc<Formula>),
}

/// An artifact inside a part; written down before anything is known of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Held {
    /// Its place among those that the computation holds, before it runs.
    Slot(usize),
    /// What is known of its shapes, where rules and estimates ask before anything runs.
    #[serde(skip)]
    Later(Arc<Shapes>),
    /// Its encoded values, when it runs.
    #[serde(skip)]
    Value(Gathered<Arc<[u8]>>),
}

/// A named part with its arguments, such as `cvar(alpha: 0.1)`.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Part {
    /// The declared name; empty for a record, whose fields are the arguments.
    pub name: String,
    /// Its arguments.
    pub args: Args,
}

/// Arguments in name order; the order of writing never reaches a key.
pub type Args = ByName<Lit>;

impl Part {
    /// A part with no arguments given.
    #[must_use]
    pub fn new(name: &str) -> Self {
        Self { name: name.to_owned(), args: Args::new() }
    }

    /// The same part with one more argument.
    #[must_use]
    pub fn with(mut self, arg: &str, value: impl Into<Lit>) -> Self {
        self.args.insert(arg.to_owned(), value.into());
        self
    }
}

impl Lit {
    /// Puts what is known of what parts hold in their places: nothing, where nothing is.
    pub fn foresee(&mut self, shapes_of: &impl Fn(usize) -> Option<Arc<Shapes>>) {
        match self {
            Self::Held(held) => {
                if let Held::Slot(slot) = held {
                    *held = Held::Later(shapes_of(*slot).unwrap_or_default());
                }
            }
            Self::List(items) => items.iter_mut().for_each(|item| item.foresee(shapes_of)),
            Self::Part(part) => part.args.values_mut().for_each(|arg| arg.foresee(shapes_of)),
            _ => {}
        }
    }

    /// The field of a record; `None` for what has no such field.
    #[must_use]
    pub fn field(&self, name: &str) -> Option<&Self> {
        match self {
            Self::Part(part) if part.name.is_empty() => part.args.get(name),
            _ => None,
        }
    }

    /// A number as `f64`; `None` for what is not a number.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "specs count far below 2^53")]
    pub fn as_f64(&self) -> Option<f64> {
        match self {
            Self::Int(n) => Some(*n as f64),
            Self::Real(x) => Some(*x),
            _ => None,
        }
    }
}

/// As the language writes it; reals shortest round-trip, −0 as 0.
impl fmt::Display for Lit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(b) => write!(f, "{b}"),
            Self::Int(n) => write!(f, "{n}"),
            Self::Real(x) => write!(f, "{:?}", x + 0.0),
            Self::Text(s) => write!(f, "{s:?}"),
            Self::List(items) => {
                f.write_str("[")?;
                for (i, item) in items.iter().enumerate() {
                    write!(f, "{}{item}", if i == 0 { "" } else { ", " })?;
                }
                f.write_str("]")
            }
            Self::Part(part) => write!(f, "{part}"),
            Self::Held(_) => f.write_str("something computed"),
            Self::External(found) => write!(f, "{found}"),
            Self::Function(formula) => write!(f, "{formula}"),
        }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}(", self.name)?;
        for (i, (name, value)) in self.args.iter().enumerate() {
            write!(f, "{}{name}: {value}", if i == 0 { "" } else { ", " })?;
        }
        f.write_str(")")
    }
}

impl From<bool> for Lit {
    fn from(value: bool) -> Self {
        Self::Bool(value)
    }
}

impl From<i64> for Lit {
    fn from(value: i64) -> Self {
        Self::Int(value)
    }
}

impl From<f64> for Lit {
    fn from(value: f64) -> Self {
        Self::Real(value)
    }
}

impl From<&str> for Lit {
    fn from(value: &str) -> Self {
        Self::Text(value.to_owned())
    }
}

impl From<Part> for Lit {
    fn from(value: Part) -> Self {
        Self::Part(value)
    }
}

impl<T: Into<Lit>> From<Vec<T>> for Lit {
    fn from(values: Vec<T>) -> Self {
        Self::List(values.into_iter().map(Into::into).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_description_reads_as_the_language_writes_it() {
        let part = Part::new("f").with("b", vec![1.0, -0.0]).with("a", "x\"y");
        assert_eq!(Lit::from(part).to_string(), r#"f(a: "x\"y", b: [1.0, 0.0])"#);
    }
}
