//! What the check knows of each name: for editors.

use std::collections::BTreeMap;

use ivx_op::Registry;

use super::value::Val;
use super::{Checker, Project, Settings};
use crate::ir::{AxisId, Desc, Spec};
use crate::{Diagnostic, Span};

/// A checked spec, and what its names stand for.
#[derive(Clone, Debug, Default)]
pub struct Look {
    /// The program, as [`check`](super::check) gives it.
    pub spec: Spec,
    /// What is wrong with it.
    pub diagnostics: Vec<Diagnostic>,
    /// What each name stands for that was evaluated without a fault, by where it is declared.
    pub values: BTreeMap<Span, Value>,
}

/// What a name stands for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Value {
    /// Its type, as messages have it; of plain data that is the same everywhere, what it is, too.
    pub ty: String,
    /// The names of the axes that it varies over.
    pub axes: Vec<String>,
    /// What its nodes are called, in each experiment that uses it; none where there are none.
    pub addresses: Vec<String>,
    /// The labels of an axis, in order.
    pub labels: Vec<String>,
}

/// Checks as [`check`](super::check) does, and says what names stand for.
#[must_use]
pub fn look(project: &Project, registry: &Registry, settings: &Settings) -> Look {
    super::checked(project, registry, settings)
}

/// A value as it was found, and what its nodes are called.
pub(super) struct Seen {
    pub(super) value: Val,
    pub(super) axis: Option<AxisId>,
    pub(super) addresses: Vec<String>,
}

/// Longer values, in bytes, are not told.
const LONGEST: usize = 80;

impl Checker<'_> {
    /// Says what was seen, of expressions that are still there.
    pub(super) fn told_values(&self) -> BTreeMap<Span, Value> {
        let seen = self.names.seen().iter();
        seen.filter_map(|(declared, seen)| Some((*declared, self.told_value(seen)?))).collect()
    }

    fn told_value(&self, seen: &Seen) -> Option<Value> {
        let addresses = match seen.value {
            Val::Artifact(_) => seen.addresses.clone(),
            _ => Vec::new(),
        };
        let labels = seen.axis.map_or_else(Vec::new, |axis| {
            self.program.axis(axis).coords.iter().map(|coord| coord.label.clone()).collect()
        });
        let (ty, axes) = match &seen.value {
            Val::Poison => return None,
            Val::Desc(desc, ty) => {
                let own = match desc {
                    Desc::Lit(lit) => format!("{ty} = {lit}"),
                    _ => ty.to_string(),
                };
                let own = if own.len() > LONGEST { ty.to_string() } else { own };
                (own, desc.axes())
            }
            Val::Artifact(id) => {
                if id.0 as usize >= self.program.exprs().len() {
                    return None;
                }
                (self.program.describe(&seen.value), self.program.expr(*id).axes.clone())
            }
        };
        Some(Value { ty, axes: self.program.names(&axes), addresses, labels })
    }
}
