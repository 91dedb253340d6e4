//! Which axes and dimensions can meet in one value.

use std::collections::{BTreeMap, BTreeSet};

use super::Checker;
use crate::ir::AxisId;
use crate::{Code, Diagnostic, Span};

impl Checker<'_> {
    /// Whether no two of the axes bear one name; reports it if they do.
    pub(super) fn distinct(&mut self, axes: &BTreeSet<AxisId>, span: Span) -> bool {
        let mut names: BTreeMap<String, usize> = BTreeMap::new();
        for axis in axes {
            let axis = self.program.axis(*axis);
            let (name, n) = (axis.name.clone(), axis.coords.len());
            if let Some(other) = names.insert(name.clone(), n) {
                let message = format!(
                    "two different axes called `{name}` meet here, of {other} and {n} coordinates"
                );
                let fault = Diagnostic::new(Code::Dimensions, span, message, "they do not combine");
                self.fault(fault.help(format!("select or reduce `{name}` on one side")));
                return false;
            }
        }
        true
    }

    /// Whether no axis bears the name of a dimension inside the value; reports it if one does.
    pub(super) fn apart(&mut self, axes: &BTreeSet<AxisId>, dims: &[String], span: Span) -> bool {
        let Some(clash) = self.program.names(axes).into_iter().find(|name| dims.contains(name))
        else {
            return true;
        };
        let message = format!("`{clash}` is both an axis and a dimension of this value");
        let fault = Diagnostic::new(Code::Dimensions, span, message, "they cannot be told apart");
        self.fault(fault.help("give the axis another name"));
        false
    }
}
